//! The edge-avoiding à-trous transform, its details clipped by variance.

use super::{FilterFrame, Normals};
use crate::radiance_desc;
use lightloom_graph::{ComputeShader, Graph, Handle, ShaderError, Texture, WgslSources, shader_struct};

shader_struct! {
    struct AtrousParams {
        size: [u32; 2],
        spacing: i32,
        normal_word: u32,
        pixel_angle: f32,
        sigma_z: f32,
        sigma_n: f32,
        clip: f32,
        least: f32,
        first: u32,
        last: u32,
        pad0: u32,
    }
}

/// `E = s_n − Σ clamp(d_i, −b_i, b_i)`, `d_i = s_{i+1} − s_i` [SA19] Eq. 14 to 18: 5 × 5 taps per level, 2ⁱ pixels apart, weighted by
/// (⅛, ¼, ½, ¼, ⅛) along both axes and by `w_z w_n`. Reads: light, guide. A thread per pixel and level.
///
/// Details up to `b_i` are kept, what exceeds them is smoothed away. `b_i = c √(V_i (1 − N/ΣV_i)₊)`, per channel: `V_i` the variance of `s_i` among
/// the taps, ΣV its sum over the channels, N the part of that sum which is noise, averaged over the same taps, and c
/// [`FilterSettings::clip`](super::FilterSettings::clip).
///
/// That is what [SA19] §24.6.2 asks for, and answers its question whether scatter among neighbours is noise or light: between frames of
/// a still view only noise differs. N is the variance between the n frames of a pixel's history over n − 1, that of their mean; one frame
/// does not tell its noise, which is then taken to be as large as the light, so that `b = 0` and the picture is the smooth one where history
/// was rejected. With n the details come back. (The text calls such bounds less constricting; by its own Eq. 18 they are narrower.)
///
/// N is an average over the taps because it is skewed: at a pixel that a rare bright photon met it is large, beside it small, and bounds
/// by a pixel's own would keep the neighbours dark and not the bright pixel bright, which lost 1.7 % of the light of a room with caustics.
///
/// [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems chapter 24, 2019"
#[derive(Clone, Debug)]
pub(super) struct Atrous {
    shader: ComputeShader,
}

impl Atrous {
    /// Parses the shader.
    pub(super) fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: ComputeShader::new(sources, "passes/filter_atrous.wgsl")? })
    }

    /// Declares the levels. `least` bounds the result from below.
    pub(super) fn add(
        &self,
        graph: &mut Graph<'_>,
        frame: &FilterFrame<'_>,
        light: Handle<Texture>,
        normals: Normals,
        least: f32,
    ) -> Handle<Texture> {
        let (size, settings) = (frame.camera.size, frame.settings);
        let mut light = light;
        let mut details: Option<Handle<Texture>> = None;
        for level in 0..settings.iterations {
            let mut smoother = graph.texture("filter_light", radiance_desc(size));
            let mut more_details = graph.texture("filter_details", radiance_desc(size));
            let params = AtrousParams {
                size,
                spacing: 1 << level,
                normal_word: match normals {
                    Normals::Geometric => 2,
                    Normals::Shading => 3,
                },
                pixel_angle: frame.camera.pixel_angle(),
                sigma_z: settings.sigma_z,
                sigma_n: settings.sigma_n,
                clip: settings.clip,
                least,
                first: u32::from(level == 0),
                last: u32::from(level + 1 == settings.iterations),
                pad0: 0,
            };
            graph
                .compute(&self.shader)
                .params(&params)
                .read("guide", &frame.guide.now)
                .read("light", &light)
                .read_optional("details", details.as_ref())
                .write("smoother", &mut smoother)
                .write("more_details", &mut more_details)
                .dispatch_threads([size[0], size[1], 1]);
            (light, details) = (smoother, Some(more_details));
        }
        light
    }
}
