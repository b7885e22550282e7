//! Brute force: every photon at every pixel. The oracle the other strategies are tested against.
//!
//! ```text
//! for each chunk of photons:                       # one dispatch each
//!     for each pixel (x, y) with visible point X:  # one thread for four
//!         for each photon P of the chunk:
//!             sum[x, y] += contribution of P at X  # 0 beyond the radius of P
//! image = sum
//! ```
//!
//! [MML13] Eq. 1 with no search at all. Biased for any radius above 0; consistent as radii shrink and photons grow. Pixels × photons
//! operations: seconds to minutes. A chunk is at most about 2²⁸ of them, which no driver's watchdog minds.
//!
//! Each chunk's sum is finished before it joins the total, so rounding grows with the photons of one chunk plus the
//! number of chunks, not with all photons. The order of summation is fixed: the strategy is always deterministic.
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"

use crate::parameter::Assignment;
use crate::{Estimate, FrameInputs, KNearest, KernelRadius, Parameter, Strategy, StrategyError};
use lightloom_graph::wgpu::Limits;
use lightloom_graph::{BufferDesc, ComputeShader, Graph, WgslSources, shader_struct};
use lightloom_passes::scene::SceneInfo;
use lightloom_passes::{SceneShader, radiance_desc};

/// Pairs of pixel and photon in one dispatch.
const PAIRS_PER_DISPATCH: u64 = 1 << 28;
/// Photons in one dispatch at the least: a workgroup reads blocks of 256.
const MIN_CHUNK: u64 = 256;
/// And at the most: llvmpipe ends every loop of an invocation once they have turned 65,535 times together. A photon takes
/// one turn where it is near and a fraction of one to test.
const MAX_CHUNK: u64 = 1 << 14;
/// Pixels below one another that a thread sums.
const PIXELS_PER_THREAD: u32 = 4;

shader_struct! {
    /// Parameters of `exact_gather`.
    struct GatherParams {
        camera_position_world: [f32; 3],
        first: u32,
        end: u32,
        r_min: f32,
        r_max: f32,
        pad0: u32,
        size: [u32; 2],
        pad1: u32,
        pad2: u32,
    }
}

shader_struct! {
    /// Parameters of `exact_resolve`.
    struct ResolveParams {
        size: [u32; 2],
        pad0: u32,
        pad1: u32,
    }
}

/// What a user can choose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExactConfig {
    /// Kernel radii (m).
    pub radius: KernelRadius,
}

/// The strategy `exact`.
#[derive(Debug)]
pub struct Exact {
    /// Parameters; may change between frames.
    pub config: ExactConfig,
    nearest: KNearest,
    gather: SceneShader,
    resolve: ComputeShader,
}

impl Exact {
    /// Its name in the registry.
    pub const NAME: &'static str = "exact";

    /// The strategy with default parameters; `sources` holds its shaders, see [`lightloom_passes::shaders`].
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            config: ExactConfig::default(),
            nearest: KNearest::new(sources),
            gather: SceneShader::new(sources, "strategies/exact_gather.wgsl")?,
            resolve: ComputeShader::new(sources, "strategies/exact_resolve.wgsl")?,
        })
    }
}

impl Strategy for Exact {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        "every photon at every pixel: slow, the oracle of the others; biased by its radius, consistent"
    }

    fn reach_m(&self, info: &SceneInfo, emitted: u32) -> Option<f32> {
        self.config.radius.reach_m(info, emitted)
    }

    fn declare(&mut self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>) -> Result<Estimate, StrategyError> {
        let photons = frame.need_photons(Self::NAME)?;
        let by_neighbours = self.nearest.add(graph, frame.info, photons, &self.config.radius)?;
        let photons = by_neighbours.as_ref().unwrap_or(photons);
        let radii = self.config.radius.resolve(frame.info, photons.emitted)?;
        let pixels = u64::from(frame.size[0]) * u64::from(frame.size[1]);
        if 16 * pixels > Limits::defaults().max_storage_buffer_binding_size {
            let value = format!("{}×{}", frame.size[0], frame.size[1]);
            return Err(StrategyError::BadSetting {
                setting: "size",
                value,
                expected: "strategy `exact` sums at most 8388608 pixels",
            });
        }

        let mut indirect_sum = graph.buffer("exact_indirect_sum", BufferDesc::bytes(16 * pixels));
        let mut caustic_sum = graph.buffer("exact_caustic_sum", BufferDesc::bytes(16 * pixels));
        graph.clear_buffer(&mut indirect_sum);
        graph.clear_buffer(&mut caustic_sum);
        let gather = self.gather.variant(frame.scene);
        let chunk = chunk_photons(pixels);
        for first in (0..photons.capacity).step_by(chunk as usize) {
            let params = GatherParams {
                camera_position_world: frame.camera_position_world(),
                first,
                end: first.saturating_add(chunk),
                r_min: radii.r_min_m,
                r_max: radii.r_max_m,
                size: frame.size,
                ..GatherParams::default()
            };
            graph
                .compute(&gather)
                .params(&params)
                .read("position", &frame.gbuffer.position)
                .read("surface", &frame.gbuffer.surface)
                .read("photons", &photons.records)
                .read("photon_state", &photons.state)
                .write("indirect_sum", &mut indirect_sum)
                .write("caustic_sum", &mut caustic_sum)
                .heavy()
                .dispatch_threads([frame.size[0], frame.size[1].div_ceil(PIXELS_PER_THREAD), 1]);
        }

        let mut indirect = graph.texture("exact_indirect", radiance_desc(frame.size));
        let mut caustic = graph.texture("exact_caustic", radiance_desc(frame.size));
        graph
            .compute(&self.resolve)
            .params(&ResolveParams { size: frame.size, ..ResolveParams::default() })
            .read("indirect_sum", &indirect_sum)
            .read("caustic_sum", &caustic_sum)
            .write("indirect", &mut indirect)
            .write("caustic", &mut caustic)
            .dispatch_threads([frame.size[0], frame.size[1], 1]);
        Ok(Estimate { caustic: Some(caustic), ..Estimate::new(indirect) })
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        let assignment = Assignment { strategy: Self::NAME, key, value };
        if self.config.radius.set(&assignment)? { Ok(()) } else { Err(assignment.unknown(&self.parameters())) }
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.config.radius.parameters()
    }
}

/// Photons per dispatch for an image of `pixels`: whole blocks, at least one.
fn chunk_photons(pixels: u64) -> u32 {
    let photons = PAIRS_PER_DISPATCH / pixels.max(1);
    // At most 2²⁸: fits.
    (photons / MIN_CHUNK * MIN_CHUNK).clamp(MIN_CHUNK, MAX_CHUNK) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_are_whole_blocks_within_the_budget() {
        assert_eq!(u64::from(chunk_photons(1)), MAX_CHUNK);
        assert_eq!(u64::from(chunk_photons(0)), MAX_CHUNK);
        let chunk = u64::from(chunk_photons(320 * 180));
        assert_eq!(chunk % MIN_CHUNK, 0);
        assert!(chunk * 320 * 180 <= PAIRS_PER_DISPATCH && (chunk + MIN_CHUNK) * 320 * 180 > PAIRS_PER_DISPATCH, "{chunk}");
        assert_eq!(chunk_photons(1 << 40), 256);
    }
}
