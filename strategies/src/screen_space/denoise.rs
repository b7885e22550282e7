//! Denoisers of the map of photons, which conserve its light.
//!
//! Filters divide by the sum of the weights that a pixel takes with, and so lose and gain light wherever weights change: at edges, of which
//! caustics are full. Here a pixel's light is divided by the sum of the weights that others take it with:
//!
//! ```text
//! S_q = E_q a_q / Σ_p k(p, q) a_p        # what q gives
//! E_p = Σ_q S_q k(p, q)                  # what p takes
//! ```
//!
//! so that Σ E a stays, whatever the kernel k. It costs one more pass over the lit pixels.

use super::{Denoiser, ScreenSpaceConfig};
use crate::{FrameInputs, StrategyError};
use lightloom_graph::{ComputeShader, Graph, Handle, Texture, WgslSources, shader_struct};
use lightloom_passes::radiance_desc;

/// Pixels along a texel of the map for near surfaces; `NEAR_TEXEL` of `shared/screen_space_bilateral.wgsl`.
const NEAR_TEXEL: u32 = 4;

shader_struct! {
    struct GuidedParams {
        eye: [f32; 3],
        spread: f32,
        size: [u32; 2],
        reach: i32,
        pixel_angle: f32,
    }
}

shader_struct! {
    struct BilateralParams {
        eye: [f32; 3],
        width: i32,
        size: [u32; 2],
        near_m: f32,
        pixel_angle: f32,
        sigma_z: f32,
        sigma_n: f32,
        pad0: u32,
        pad1: u32,
    }
}

/// The light of photons in the pixels that see them.
pub(super) struct Map {
    /// E = π L / R (W·m⁻²), and the mean distance (m) from the last hit.
    pub(super) light: Handle<Texture>,
    /// Visible points (world, m), and the area (m²) that the pixel shows.
    pub(super) points: Handle<Texture>,
}

/// The passes of all denoisers.
#[derive(Debug)]
pub(super) struct Denoisers {
    guided_shares: ComputeShader,
    guided: ComputeShader,
    near: ComputeShader,
    bilateral_shares: ComputeShader,
    bilateral: ComputeShader,
}

impl Denoisers {
    pub(super) fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        let shader = |name| ComputeShader::new(sources, &format!("strategies/screen_space_{name}.wgsl"));
        Ok(Self {
            guided_shares: shader("guided_shares")?,
            guided: shader("guided")?,
            near: shader("near")?,
            bilateral_shares: shader("bilateral_shares")?,
            bilateral: shader("bilateral")?,
        })
    }

    /// Declares the passes of the denoiser that `config` asks for. Returns E (W·m⁻²).
    pub(super) fn add(
        &self,
        graph: &mut Graph<'_>,
        config: &ScreenSpaceConfig,
        frame: &FrameInputs<'_>,
        map: Map,
    ) -> Handle<Texture> {
        match config.denoiser {
            Denoiser::None => map.light,
            Denoiser::Guided => self.add_guided(graph, config, frame, &map),
            Denoiser::Bilateral => self.add_bilateral(graph, config, frame, &map),
        }
    }

    fn add_guided(
        &self,
        graph: &mut Graph<'_>,
        config: &ScreenSpaceConfig,
        frame: &FrameInputs<'_>,
        map: &Map,
    ) -> Handle<Texture> {
        let threads = [frame.size[0], frame.size[1], 1];
        let params = GuidedParams {
            eye: frame.camera_position_world(),
            spread: 2.0 * 3.0_f32.sqrt() * config.roughness * config.roughness,
            size: frame.size,
            reach: config.reach.cast_signed(),
            pixel_angle: frame.camera.pixel_angle(),
        };
        let mut shares = graph.texture("screen_space_shares", radiance_desc(frame.size));
        graph
            .compute(&self.guided_shares)
            .params(&params)
            .read("points", &map.points)
            .read("light", &map.light)
            .write("shares", &mut shares)
            .heavy()
            .dispatch_threads(threads);
        let mut denoised = graph.texture("screen_space_denoised", radiance_desc(frame.size));
        graph
            .compute(&self.guided)
            .params(&params)
            .read("points", &map.points)
            .read("shares", &shares)
            .write("denoised", &mut denoised)
            .heavy()
            .dispatch_threads(threads);
        denoised
    }

    fn add_bilateral(
        &self,
        graph: &mut Graph<'_>,
        config: &ScreenSpaceConfig,
        frame: &FrameInputs<'_>,
        map: &Map,
    ) -> Handle<Texture> {
        let threads = [frame.size[0], frame.size[1], 1];
        let pixel_angle = frame.camera.pixel_angle();
        let params = BilateralParams {
            eye: frame.camera_position_world(),
            width: config.width.cast_signed(),
            size: frame.size,
            near_m: config.near(frame.info, pixel_angle),
            pixel_angle,
            sigma_z: config.sigma_z,
            sigma_n: config.sigma_n,
            pad0: 0,
            pad1: 0,
        };
        let surface = &frame.gbuffer.surface;
        let texels = frame.size.map(|pixels| pixels.div_ceil(NEAR_TEXEL));
        let mut near_shares = graph.texture("screen_space_near_shares", radiance_desc(texels));
        graph
            .compute(&self.near)
            .params(&params)
            .read("points", &map.points)
            .read("surface", surface)
            .read("light", &map.light)
            .write("near_shares", &mut near_shares)
            .heavy()
            .dispatch_threads([texels[0], texels[1], 1]);
        let mut shares = graph.texture("screen_space_shares", radiance_desc(frame.size));
        graph
            .compute(&self.bilateral_shares)
            .params(&params)
            .read("points", &map.points)
            .read("surface", surface)
            .read("light", &map.light)
            .write("shares", &mut shares)
            .heavy()
            .dispatch_threads(threads);
        let mut denoised = graph.texture("screen_space_denoised", radiance_desc(frame.size));
        graph
            .compute(&self.bilateral)
            .params(&params)
            .read("points", &map.points)
            .read("surface", surface)
            .read("shares", &shares)
            .read("near_shares", &near_shares)
            .write("denoised", &mut denoised)
            .heavy()
            .dispatch_threads(threads);
        denoised
    }
}
