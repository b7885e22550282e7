//! Caustics in screen space: each photon into the one pixel that sees where it landed, and a denoiser over the map.
//!
//! ```text
//! for each photon P whose earlier scatterings were all specular:        # a thread each
//!     (x, y) = pixel to which P projects
//!     if the surface that (x, y) shows is that of P:
//!         L[x, y] += f(ω_P, ω_eye) Φ_P / a_p                            # atomically; a_p: area of its surface that the pixel shows
//! for each pixel: E = π L / R                                           # R: reflectance
//! E = denoised E                                                        # Σ E a_p stays
//! for each pixel: image = gain · E R / π
//! ```
//!
//! [Kim19]. Reflection caustics come beside refraction's, for photons are traced through both. **It estimates caustics and nothing else**: `indirect` is
//! the caustic layer, other indirect light is black, and only photons whose first scattering is specular are followed
//! ([`Strategy::caustics_only`]). Pixels that show mirrors and glass are path-traced by the pipeline as for every strategy, so that caustics
//! seen through them come from paths, and those of points and directions are not found there.
//!
//! Without a denoiser the estimate is unbiased but for two things: the box filter of the pixel, and photons at silhouettes, whose pixel shows
//! another surface at its sample; these are counted. A denoiser is biased by its kernel and conserves the light.
//!
//! **What is not stored.** The chapter's four conditions, and how each is met:
//!
//! 1. *The photon's intensity is negligibly small*: Russian roulette ends dim photons and raises those that survive, so that nothing is cut.
//! 2. *The location is out of the screen*: it is not stored (see [`DepositCull`](lightloom_passes::DepositCull)), and what is stored and does
//!    not project to a pixel is counted in `photons_off_screen`.
//! 3. *The photon travels beyond the depth buffer's values*: it must lie within a pixel's width of the plane that touches the visible surface,
//!    the normals of both must be less than 60° apart, and its light must come from before the surface. The rest, with photons on mirrors and on
//!    glass, is counted in `photons_hidden`. A plane does not mistake tilted surfaces for hidden ones, as bounds of depth do.
//! 4. *The photon is part of direct lighting*: tracing stores no light that comes straight from a light.
//!
//! **Area.** The printed `a_p = (2 d tan(θ_x/2)/w)(2 d tan(θ_y/2)/h)` leaves out that surfaces are tilted. Here it is what the pixel's four corners
//! cut from the tangent plane, in closed form, so that `Σ L a_p / f` is the flux of the photons that were seen, from wherever the camera looks.
//!
//! **Sums.** The chapter loses photons where two threads write one pixel. Sums here are atomic, those of [`SplatSums`]: fixed point by default, the same bits in
//! every run, with overflow counted in `pixels_overflowed`.
//!
//! Bytes moved, for N photons of s = 32 or 20 bytes, K of them seen, X pixels, and t taps of a denoiser's kernel:
//!
//! | pass | reads | writes |
//! |---|---|---|
//! | clearing | | 52 X, or 24 X floats |
//! | `screen_space_deposit` | s N + 32 K | 24 K by atomics, 8 more for `guided`; or 12 K floats |
//! | `screen_space_resolve` | 84 X, or 56 X | 32 X |
//! | `screen_space_guided_shares` | 16 X, 16 t a lit pixel | 16 X |
//! | `screen_space_guided` | 16 X + 16 t X, 16 t a lit pixel | 16 X |
//! | `screen_space_near`, `screen_space_bilateral_shares` | 32 X, 32 t a lit pixel, 512 t a lit texel | 17 X |
//! | `screen_space_bilateral` | 32 X + 32 t X, 32 t a lit pixel | 16 X |
//! | `screen_space_reflect` | 48 X | 32 X |
//!
//! [Kim19]: https://doi.org/10.1007/978-1-4842-4427-2_30 "Caustics using screen-space photon mapping, Kim, Ray Tracing Gems chapter 30, 2019"

mod config;
mod denoise;

pub use config::{Denoiser, ScreenSpaceConfig};

use crate::parameter::Assignment;
use crate::splat::{SplatShape, scale};
use crate::splat_compute::Sums;
use crate::{Estimate, FrameInputs, Parameter, Requirements, SplatSums, Stats, Strategy, StrategyError};
use denoise::{Denoisers, Map};
use lightloom_graph::wgpu::Features;
use lightloom_graph::{Buffer, BufferDesc, Graph, Handle, WgslSources, shader_struct};
use lightloom_passes::scene::SceneInfo;
use lightloom_passes::{CameraUniform, Photons, SceneShader, radiance_desc};

/// A photon is on a surface if it is within this part of the scene's radius of it, however small pixels or texels are there: some steps of a
/// compact store's positions.
pub(crate) const SURFACE_SLACK: f32 = 1.0e-5;

shader_struct! {
    /// Parameters of `screen_space_deposit`.
    struct DepositParams {
        camera: CameraUniform,
        scale: f32,
        distance_min: f32,
        distance_max: f32,
        per_distance: f32,
        slack: f32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

shader_struct! {
    /// Parameters of `screen_space_resolve`.
    struct ResolveParams {
        camera: CameraUniform,
        unit: f32,
        distance_max: f32,
        pad0: u32,
        pad1: u32,
    }
}

shader_struct! {
    /// Parameters of `screen_space_reflect`.
    struct ReflectParams {
        camera_position_world: [f32; 3],
        gain: f32,
        size: [u32; 2],
        pad0: u32,
        pad1: u32,
    }
}

/// The strategy `screen-space`.
#[derive(Debug)]
pub struct ScreenSpace {
    /// Parameters; may change between frames.
    pub config: ScreenSpaceConfig,
    fixed: SumShaders,
    float: SumShaders,
    denoisers: Denoisers,
    reflect: SceneShader,
}

/// The shaders that know what sums are.
#[derive(Debug)]
struct SumShaders {
    deposit: SceneShader,
    resolve: SceneShader,
}

impl SumShaders {
    fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            deposit: SceneShader::new(sources, "strategies/screen_space_deposit.wgsl")?,
            resolve: SceneShader::new(sources, "strategies/screen_space_resolve.wgsl")?,
        })
    }
}

impl ScreenSpace {
    /// Its name in the registry.
    pub const NAME: &'static str = "screen-space";

    /// The strategy with default parameters; `sources` holds its shaders, see [`lightloom_passes::shaders`].
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            config: ScreenSpaceConfig::default(),
            fixed: SumShaders::new(&SplatSums::Fixed.shaders(sources)?)?,
            float: SumShaders::new(&SplatSums::Float.shaders(sources)?)?,
            denoisers: Denoisers::new(sources)?,
            reflect: SceneShader::new(sources, "strategies/screen_space_reflect.wgsl")?,
        })
    }

    /// The photons' light as a map, before reflection. `stats` takes the counts.
    fn map(
        &self,
        graph: &mut Graph<'_>,
        frame: &FrameInputs<'_>,
        photons: &Photons,
        stats: &mut Handle<Buffer>,
    ) -> Result<Map, StrategyError> {
        let sums = self.config.sums(frame.deterministic);
        let shaders = match sums {
            SplatSums::Fixed => &self.fixed,
            SplatSums::Float => &self.float,
        };
        let [distance_min, distance_max] = self.config.distances(frame.info)?;
        // Only one denoiser asks for distances.
        let per_distance = if self.config.denoiser == Denoiser::Guided { 1.0 / distance_max } else { 0.0 };
        let scale = scale(frame.info, SplatShape::Sphere);
        let slack = SURFACE_SLACK * frame.info.bounds_radius;
        let camera = *frame.camera;
        let mut sums: Sums = sums.add(graph, u64::from(frame.size[0]) * u64::from(frame.size[1]));
        let params = DepositParams { camera, scale, distance_min, distance_max, per_distance, slack, ..DepositParams::default() };
        let mut pass = graph
            .compute(&shaders.deposit.variant(frame.scene))
            .params(&params)
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .read("position", &frame.gbuffer.position)
            .read("surface", &frame.gbuffer.surface)
            .write("stats", stats);
        for (name, words) in &mut sums.0 {
            pass = pass.write(name, words);
        }
        pass.heavy().dispatch_1d(photons.capacity);

        let mut light = graph.texture("screen_space_light", radiance_desc(frame.size));
        let mut points = graph.texture("screen_space_points", radiance_desc(frame.size));
        let mut pass = graph
            .compute(&shaders.resolve.variant(frame.scene))
            .params(&ResolveParams { camera, unit: 1.0 / scale, distance_max, ..ResolveParams::default() })
            .read("position", &frame.gbuffer.position)
            .read("surface", &frame.gbuffer.surface)
            .write("light", &mut light)
            .write("points", &mut points)
            .write("stats", stats);
        for (name, words) in &sums.0 {
            pass = pass.read(name, words);
        }
        pass.dispatch_threads([frame.size[0], frame.size[1], 1]);
        Ok(Map { light, points })
    }
}

impl Strategy for ScreenSpace {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        "caustics alone, each photon into the pixel that sees where it landed, denoised [Kim19]; biased by the denoiser, no other indirect light"
    }

    fn requirements(&self) -> Requirements {
        let features = match self.config.sums {
            Some(SplatSums::Float) => Features::SHADER_FLOAT32_ATOMIC,
            Some(SplatSums::Fixed) | None => Features::empty(),
        };
        Requirements { features, ..Requirements::default() }
    }

    fn caustics_only(&self) -> bool {
        true
    }

    fn reach_m(&self, _info: &SceneInfo, _emitted: u32) -> Option<f32> {
        Some(0.0)
    }

    fn declare(&mut self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>) -> Result<Estimate, StrategyError> {
        let photons = frame.need_photons(Self::NAME)?;
        self.config.check()?;
        let mut stats = graph.buffer("screen_space_stats", BufferDesc::words(4));
        graph.clear_buffer(&mut stats);
        let map = self.map(graph, frame, photons, &mut stats)?;
        let light = self.denoisers.add(graph, &self.config, frame, map);

        let mut indirect = graph.texture("screen_space_indirect", radiance_desc(frame.size));
        let mut caustic = graph.texture("screen_space_caustic", radiance_desc(frame.size));
        let params = ReflectParams {
            camera_position_world: frame.camera_position_world(),
            gain: self.config.gain,
            size: frame.size,
            ..ReflectParams::default()
        };
        graph
            .compute(&self.reflect.variant(frame.scene))
            .params(&params)
            .read("position", &frame.gbuffer.position)
            .read("surface", &frame.gbuffer.surface)
            .read("light", &light)
            .write("indirect", &mut indirect)
            .write("caustic", &mut caustic)
            .dispatch_threads([frame.size[0], frame.size[1], 1]);
        let names = &["photons_seen", "photons_off_screen", "photons_hidden", "pixels_overflowed"];
        Ok(Estimate { caustic: Some(caustic), stats: vec![Stats::new(stats, names)], ..Estimate::new(indirect) })
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        let assignment = Assignment { strategy: Self::NAME, key, value };
        if self.config.set(&assignment)? { Ok(()) } else { Err(assignment.unknown(&self.parameters())) }
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.config.parameters()
    }
}
