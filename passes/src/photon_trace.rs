//! Emission and tracing of a frame's photons, in batches short enough for any driver's watchdog.
//!
//! ```text
//! for each batch of ≤ 65,536:  photon_trace ─▶ staging, counts ─▶ prefix sum ─▶ photon_compact ─▶ records
//!                                   └─▶ ledger                                     photon_advance ─▶ state
//! ```
//!
//! Each photon writes to places of its own and a scan packs them, so that the same seed gives the same photons in the
//! same order whatever the threads' race; appending by an atomic counter would be one dispatch less and would not.

use crate::scene::{SceneHandles, SceneInfo};
use crate::scene_shader::SceneShader;
use crate::{LightInfo, Photon, PhotonState, PrefixSum};
use lightloom_graph::{Buffer, BufferDesc, ComputeShader, Graph, Handle, ShaderError, WgslSources, shader_struct};

/// Photons a batch follows at most.
const MAX_BATCH: u32 = 65_536;
/// Records the staging buffer holds at most (32 B each): 64 MiB, half of what WebGPU lets a shader bind.
const MAX_STAGING: u32 = 1 << 21;

shader_struct! {
    struct PhotonTraceParams {
        lights: LightInfo,
        emitted: u32,
        first: u32,
        count: u32,
        seed: u32,
        max_bounces: u32,
        caustics_only: u32,
        ledger_scale: f32,
        pad0: u32,
    }
}

shader_struct! {
    struct PhotonCompactParams {
        count: u32,
        max_bounces: u32,
        capacity: u32,
        pad0: u32,
    }
}

shader_struct! {
    struct PhotonAdvanceParams {
        count: u32,
        capacity: u32,
        pad0: u32,
        pad1: u32,
    }
}

/// How many photons, and how far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PhotonSettings {
    /// Photons to emit from all lights together. More: less noise, in proportion more time.
    pub emitted: u32,
    /// Records the store holds; what does not fit is dropped and counted.
    pub capacity: u32,
    /// Scatterings a photon may undergo before its last record.
    pub max_bounces: u32,
    /// Seed; the same seed gives the same photons in the same order.
    pub seed: u32,
    /// Follow only paths whose first scattering is specular.
    pub caustics_only: bool,
}

impl PhotonSettings {
    /// Records for which a store is laid out when nothing else is said: two for each photon that can leave one, at most
    /// what a default WebGPU binding of 128 MiB holds.
    pub fn default_capacity(emitted: u32, max_bounces: u32) -> u32 {
        let wanted = u64::from(emitted) * u64::from(max_bounces.clamp(1, 4));
        wanted.clamp(1, (128 << 20) / size_of::<Photon>() as u64) as u32
    }

    /// Fixed-point units per watt of the flux ledger: an average photon is 2²⁰ units.
    pub fn ledger_scale(&self, info: &SceneInfo) -> f32 {
        let power = info.total_power.max_element();
        if power > 0.0 { 1_048_576.0 * self.emitted as f32 / power } else { 1.0 }
    }
}

/// A frame's photons.
#[derive(Debug)]
pub struct Photons {
    /// Records of [`Photon`]; the first `state.stored` are valid.
    pub records: Handle<Buffer>,
    /// One [`PhotonState`].
    pub state: Handle<Buffer>,
    /// Records the store holds.
    pub capacity: u32,
    /// Photons that left the lights.
    pub emitted: u32,
}

/// The passes.
#[derive(Clone, Debug)]
pub struct PhotonTracing {
    trace: SceneShader,
    compact: ComputeShader,
    advance: ComputeShader,
    prefix_sum: PrefixSum,
}

impl PhotonTracing {
    /// Parses the shaders.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self {
            trace: SceneShader::new(sources, "passes/photon_trace.wgsl")?,
            compact: ComputeShader::new(sources, "passes/photon_compact.wgsl")?,
            advance: ComputeShader::new(sources, "passes/photon_advance.wgsl")?,
            prefix_sum: PrefixSum::new(sources)?,
        })
    }

    /// Declares the passes.
    pub fn add(&self, graph: &mut Graph<'_>, scene: &SceneHandles, info: &SceneInfo, settings: &PhotonSettings) -> Photons {
        let capacity = settings.capacity.max(1);
        let max_bounces = settings.max_bounces.max(1);
        let mut records = graph.buffer("photons", BufferDesc::array_of::<Photon>(u64::from(capacity)));
        let mut state = graph.buffer("photon_state", BufferDesc::array_of::<PhotonState>(1));
        let mut ledger = graph.buffer("photon_ledger", BufferDesc::words(24));
        graph.clear_buffer(&mut state);
        graph.clear_buffer(&mut ledger);
        let batch = MAX_BATCH.min(MAX_STAGING / max_bounces).max(1);
        let emitted = if settings.max_bounces == 0 { 0 } else { settings.emitted };
        if emitted == 0 {
            graph.clear_buffer(&mut records);
        }
        let trace_shader = self.trace.variant(scene.traits);
        let mut first = 0;
        while first < emitted {
            let count = batch.min(emitted - first);
            let mut staging =
                graph.buffer("photon_staging", BufferDesc::array_of::<Photon>(u64::from(batch) * u64::from(max_bounces)));
            let mut counts = graph.buffer("photon_counts", BufferDesc::words(u64::from(batch)));
            let mut offsets = graph.buffer("photon_offsets", BufferDesc::words(u64::from(batch) + 1));
            let trace = PhotonTraceParams {
                lights: info.into(),
                emitted: settings.emitted,
                first,
                count,
                seed: settings.seed,
                max_bounces,
                caustics_only: u32::from(settings.caustics_only),
                ledger_scale: settings.ledger_scale(info),
                pad0: 0,
            };
            scene
                .bind(graph.compute(&trace_shader).params(&trace))
                .write("staging", &mut staging)
                .write("counts", &mut counts)
                .write("ledger", &mut ledger)
                .heavy()
                .dispatch_1d(count);
            self.prefix_sum.add(graph, &counts, &mut offsets, count);
            graph
                .compute(&self.compact)
                .params(&PhotonCompactParams { count, max_bounces, capacity, pad0: 0 })
                .read("staging", &staging)
                .read("offsets", &offsets)
                .read("state", &state)
                .write("records", &mut records)
                .dispatch_1d(count);
            graph
                .compute(&self.advance)
                .params(&PhotonAdvanceParams { count, capacity, pad0: 0, pad1: 0 })
                .read("offsets", &offsets)
                .read("ledger", &ledger)
                .write("state", &mut state)
                .dispatch([1, 1, 1]);
            first += count;
        }
        Photons { records, state, capacity, emitted: settings.emitted }
    }
}
