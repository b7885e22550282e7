//! Instant radiosity: vertices of light paths as point lights, with shadow rays.
//!
//! ```text
//! photons = all vertices of the light paths, from the lights' first hits on       # Strategy::light_vertices
//! for j < M:  lights[j] = photons[⌊(j N + o) / M⌋]                                  # a systematic sample of all N, o drawn anew for each frame
//! progressive:
//!     for each pixel of visible point x:                                          # in chunks of lights, one dispatch each
//!         image = N/M Σ_j I_j(ω) f_x cos θ_x V / max(r², ε²)
//! realtime:
//!     sort the lights along a curve through space
//!     for each pixel:  choose one light y by what it brings unshadowed, among its tile's share and the one kept from before
//!     for each pixel:  image = what y brings · V · W
//! ```
//!
//! [Keller97], with rays for its shadow buffers as in Lin's "Using RTX to accelerate instant radiosity" (2019); `realtime` shares lights out in tiles as [Segovia06] interleaves them, and resamples in time
//! [Bitterli20]. Unbiased with `clamp` 0 in either mode for the light it holds, but for the rounding of albedos to 16 bits. With `clamp` ε it only ever darkens; what ε took
//! is in the statistics (`clamp_removed_ppm`) and, above 5 %, a warning.
//!
//! **Intensity.** Lin's `E = Φ cos θ cos θ′ / r²` lacks Lambert's 1/π, and the photons there take a cosine too many. A vertex of flux Φ
//! and albedo ρ is a light of intensity (ρ/π) Φ max(0, n·ω); here it reflects by the model that its surface has, glossy lobes and rough
//! dielectrics included (`shared/virtual_light.wgsl`). Narrow lobes make few bright dots, as they do in every method of points.
//!
//! **Which light.** `indirect` holds what a surface that is no mirror and no smooth glass sent straight to the visible one, after whatever way. A light cannot be
//! connected to through a mirror or glass, so that light whose *last* scattering before the visible surface is specular is missing. Where all were,
//! these are the caustics: the `caustic` layer is black, and a strategy of caustics beside it, as in `instant-radiosity+screen-space`, brings
//! them. What is left out then is light that was scattered diffusely first and by a mirror or glass last: of the indirect light of `builtin:caustics`, with
//! its sphere of glass and ring of metal, an eighth; of scenes without either, nothing. Pixels that show mirrors and glass are path-traced by the
//! pipeline.
//!
//! **No clamp.** Contributions grow as 1/r² where surfaces meet, and their variance has no bound there: corners show bright spots that the mean over
//! frames loses slowly. ε is a bias for that noise.
//!
//! **Lights.** A record of a photon does not say what surface it lies on, and a ray of a hair's length finds that again for the M that become lights. Surfaces that
//! blend by alpha are missed by that ray as by any other; such vertices are counted in `lights_lost`. A compact store counts scatterings to three, so that with it and
//! a limit above, caustic records of the last scattering count as lights.
//!
//! Bytes moved, for N photons of s = 32 or 20 bytes, M lights, X pixels, C chunks:
//!
//! | pass | reads | writes |
//! |---|---|---|
//! | `instant_radiosity_lights` | s M | 48 M |
//! | `instant_radiosity_gather` | C (48 X) + 48 M a workgroup | 16 C X |
//! | `instant_radiosity_sort` | 96 M | 48 M |
//! | `instant_radiosity_resample` | 112 X + 48 M a workgroup | 80 X |
//! | `instant_radiosity_shade` | 112 X | 16 X |
//! | `instant_radiosity_removed`, with a clamp | 16 X | |
//!
//! and one ray a pixel and light, or a pixel. A chunk is at most 64 lights and 2²⁶ rays, which no driver's watchdog minds. Sums are in a fixed order: the
//! strategy is always deterministic.
//!
//! [Bitterli20]: https://doi.org/10.1145/3386569.3392481 "Spatiotemporal reservoir resampling for real-time ray tracing with dynamic direct lighting, Bitterli et al., 2020"
//! [Keller97]: https://doi.org/10.1145/258734.258769 "Instant radiosity, Keller, 1997"
//! [Segovia06]: https://doi.org/10.2312/EGGH/EGGH06/053-060 "Non-interleaved deferred shading of interleaved sample patterns, Segovia et al., 2006"

mod config;
mod realtime;

pub use config::{InstantRadiosityConfig, InstantRadiosityMode};

use crate::parameter::Assignment;
use crate::{Estimate, FrameInputs, Parameter, Stats, Strategy, StrategyError};
use lightloom_graph::{Buffer, BufferDesc, ComputeShader, Graph, Handle, Load, Texture, WgslSources, shader_struct};
use lightloom_passes::{Photons, SceneShader, radiance_desc};
use realtime::Realtime;

/// Shadow rays of one dispatch at most.
const RAYS_PER_DISPATCH: u64 = 1 << 26;
/// Lights of one dispatch at most: llvmpipe ends every loop of an invocation once they have turned 65,535 times together, and a shadow ray turns them up
/// to some hundred times.
const MAX_CHUNK: u64 = 64;

shader_struct! {
    /// A light vertex and its surface; see `shared/virtual_light.wgsl`.
    struct VirtualLight {
        position: [f32; 3],
        flux: u32,
        direction: u32,
        normal: u32,
        normal_geometric: u32,
        flags: u32,
        base_red_green: u32,
        base_blue_transmission: u32,
        roughness_metallic: u32,
        ior: f32,
    }
}

shader_struct! {
    /// Parameters of `instant_radiosity_lights`.
    struct LightsParams {
        lights: u32,
        seed: u32,
        max_bounces: u32,
        pad0: u32,
    }
}

shader_struct! {
    /// Parameters of `instant_radiosity_gather`.
    struct GatherParams {
        camera_position_world: [f32; 3],
        least2: f32,
        size: [u32; 2],
        lights: u32,
        first: u32,
        end: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

shader_struct! {
    /// Parameters of `instant_radiosity_removed`.
    struct RemovedParams {
        size: [u32; 2],
        pad0: u32,
        pad1: u32,
    }
}

/// A frame's lights.
#[derive(Debug)]
struct Lights<'a> {
    /// [`VirtualLight`]s.
    made: Handle<Buffer>,
    /// How many are wanted; there are fewer where fewer vertices are stored.
    wanted: u32,
    /// Whose vertices they are.
    photons: &'a Photons,
}

/// The strategy `instant-radiosity`.
#[derive(Debug)]
pub struct InstantRadiosity {
    /// Parameters; may change between frames.
    pub config: InstantRadiosityConfig,
    lights: SceneShader,
    gather: SceneShader,
    removed: ComputeShader,
    realtime: Realtime,
}

impl InstantRadiosity {
    /// Its name in the registry.
    pub const NAME: &'static str = "instant-radiosity";

    /// The strategy with default parameters; `sources` holds its shaders, see [`lightloom_passes::shaders`].
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            config: InstantRadiosityConfig::default(),
            lights: SceneShader::new(sources, "strategies/instant_radiosity_lights.wgsl")?,
            gather: SceneShader::new(sources, "strategies/instant_radiosity_gather.wgsl")?,
            removed: ComputeShader::new(sources, "strategies/instant_radiosity_removed.wgsl")?,
            realtime: Realtime::new(sources)?,
        })
    }

    /// Makes the frame's lights.
    fn make_lights<'a>(
        &self,
        graph: &mut Graph<'_>,
        frame: &FrameInputs<'_>,
        photons: &'a Photons,
        stats: &mut Handle<Buffer>,
    ) -> Lights<'a> {
        let wanted = self.config.lights();
        let mut made = graph.buffer("virtual_lights", BufferDesc::array_of::<VirtualLight>(wanted.into()));
        let params = LightsParams { lights: wanted, seed: frame.seed, max_bounces: frame.max_bounces, pad0: 0 };
        frame
            .scene
            .bind(graph.compute(&self.lights.variant(frame.scene)).params(&params))
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .write("lights_made", &mut made)
            .write("stats", stats)
            .dispatch_1d(wanted);
        Lights { made, wanted, photons }
    }

    /// Sums all lights at all pixels.
    fn gather(
        &self,
        graph: &mut Graph<'_>,
        frame: &FrameInputs<'_>,
        lights: &Lights<'_>,
        stats: &mut Handle<Buffer>,
    ) -> Handle<Texture> {
        let shader = self.gather.variant(frame.scene);
        let chunk = chunk_lights(u64::from(frame.size[0]) * u64::from(frame.size[1]));
        let mut sum = graph.texture("instant_radiosity_none", radiance_desc(frame.size));
        graph.clear_texture(&mut sum, Load::Clear([0.0; 4]));
        for first in (0..lights.wanted).step_by(chunk as usize) {
            let mut after = graph.texture("instant_radiosity_indirect", radiance_desc(frame.size));
            let params = GatherParams {
                camera_position_world: frame.camera_position_world(),
                least2: self.config.clamp_m * self.config.clamp_m,
                size: frame.size,
                lights: lights.wanted,
                first,
                end: (first + chunk).min(lights.wanted),
                ..GatherParams::default()
            };
            frame
                .scene
                .bind(graph.compute(&shader).params(&params))
                .read("position", &frame.gbuffer.position)
                .read("surface", &frame.gbuffer.surface)
                .read("virtual_lights", &lights.made)
                .read("photon_state", &lights.photons.state)
                .read("before", &sum)
                .write("after", &mut after)
                .write("stats", stats)
                .heavy()
                .dispatch_threads([frame.size[0], frame.size[1], 1]);
            sum = after;
        }
        sum
    }
}

impl Strategy for InstantRadiosity {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        "vertices of light paths as point lights, with shadow rays [Keller97, Lin19]; unbiased without a clamp but for light scattered last by mirrors or glass, which is missing"
    }

    fn light_vertices(&self) -> bool {
        true
    }

    fn declare(&mut self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>) -> Result<Estimate, StrategyError> {
        let photons = frame.need_photons(Self::NAME)?;
        self.config.check()?;
        let mut stats = graph.buffer("instant_radiosity_stats", BufferDesc::words(4));
        graph.clear_buffer(&mut stats);
        let lights = self.make_lights(graph, frame, photons, &mut stats);
        let indirect = match self.config.mode {
            InstantRadiosityMode::Progressive => self.gather(graph, frame, &lights, &mut stats),
            InstantRadiosityMode::Realtime => self.realtime.add(graph, frame, &self.config, &lights)?,
        };
        // Without a clamp nothing is removed, and the word stays 0.
        if self.config.clamp_m > 0.0 {
            graph
                .compute(&self.removed)
                .params(&RemovedParams { size: frame.size, ..RemovedParams::default() })
                .read("sum", &indirect)
                .write("stats", &mut stats)
                .dispatch([1, 1, 1]);
        }
        let mut caustic = graph.texture("instant_radiosity_caustic", radiance_desc(frame.size));
        graph.clear_texture(&mut caustic, Load::Clear([0.0; 4]));
        let names = &["lights", "lights_lost", "pixels_cut", "clamp_removed_ppm"];
        Ok(Estimate { caustic: Some(caustic), stats: vec![Stats::new(stats, names)], ..Estimate::new(indirect) })
    }

    fn reset(&mut self) {
        self.realtime.forget();
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        let assignment = Assignment { strategy: Self::NAME, key, value };
        if self.config.set(&assignment)? { Ok(()) } else { Err(assignment.unknown(&self.parameters())) }
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.config.parameters()
    }
}

/// Lights per dispatch for an image of `pixels`, at least one.
fn chunk_lights(pixels: u64) -> u32 {
    // At most 64: fits.
    (RAYS_PER_DISPATCH / pixels.max(1)).clamp(1, MAX_CHUNK) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_keep_to_the_budget() {
        assert_eq!(u64::from(chunk_lights(320 * 180)), MAX_CHUNK);
        assert_eq!(u64::from(chunk_lights(0)), MAX_CHUNK);
        assert_eq!(chunk_lights(3840 * 2160), 8);
        assert_eq!(chunk_lights(1 << 40), 1);
    }
}
