//! The mean over frames, along the motion of surfaces.

use super::FilterFrame;
use crate::radiance_desc;
use lightloom_graph::wgpu::TextureFormat;
use lightloom_graph::{ComputeShader, Graph, Handle, ShaderError, Texture, TextureDesc, WgslSources, shader_struct};

shader_struct! {
    struct TemporalParams {
        size: [u32; 2],
        jitter: [f32; 2],
        previous_jitter: [f32; 2],
        pixel_angle: f32,
        sigma_z: f32,
        sigma_n: f32,
        history: f32,
        continues: f32,
        pad0: u32,
    }
}

/// `Ẽ_i = (1 − α) E_i + α Ẽ_{i−1}`, `α = min(n / (n + 1), 0.95) w_z w_n` [SA19] Eq. 10 to 13, with n the frames in the history. Reads:
/// light, motion, guides. Its state is two history textures per image. A thread per pixel.
///
/// n is not counted but follows from the weights: 1/n′ = (1 − α)² + α²/n, the variance of the new mean in that of one frame. A plain mean
/// counts up by one, a rejected history begins at 1, and the longest, of weights 0.95ᵏ, is worth 39 frames.
///
/// Each of the four texels around the place is compared by itself, and weighs as much as it shows of the surface; where none does, as
/// along an edge that the samples of the two frames straddle, the nine around it are asked.
///
/// [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems chapter 24, 2019"
#[derive(Clone, Debug)]
pub(super) struct Temporal {
    shader: ComputeShader,
}

impl Temporal {
    /// Parses the shader.
    pub(super) fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: ComputeShader::new(sources, "passes/filter_temporal.wgsl")? })
    }

    /// Declares the pass. Returns the mean, and in the fourth channel the variance of it that is noise, the sum of the channels'. `name` names the history.
    pub(super) fn add(
        &self,
        graph: &mut Graph<'_>,
        frame: &FilterFrame<'_>,
        name: &str,
        light: &Handle<Texture>,
    ) -> Handle<Texture> {
        let size = frame.camera.size;
        let mut history = graph.history_texture(&format!("filter_{name}"), radiance_desc(size));
        let mut scatter =
            graph.history_texture(&format!("filter_{name}_scatter"), TextureDesc::new_2d(size, TextureFormat::Rg32Float));
        let previous = frame.previous.unwrap_or(frame.camera);
        let params = TemporalParams {
            size,
            jitter: frame.camera.jitter,
            previous_jitter: previous.jitter,
            pixel_angle: previous.pixel_angle(),
            sigma_z: frame.settings.sigma_z,
            sigma_n: frame.settings.sigma_n,
            history: frame.settings.history,
            continues: if frame.previous.is_some_and(|previous| previous.size == size) { 1.0 } else { 0.0 },
            pad0: 0,
        };
        graph
            .compute(&self.shader)
            .name(&format!("filter_temporal_{name}"))
            .params(&params)
            .read("value", light)
            .read("motion", frame.motion())
            .read("guide", &frame.guide.now)
            .read("previous_guide", &frame.guide.previous)
            .read("previous", &history.previous)
            .read("previous_scatter", &scatter.previous)
            .write("accumulated", &mut history.current)
            .write("scatter", &mut scatter.current)
            .dispatch_threads([size[0], size[1], 1]);
        history.current
    }
}
