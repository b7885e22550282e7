//! Ambient occlusion: how closed in a visible point is.

use crate::scene::SceneHandles;
use crate::scene_shader::SceneShader;
use crate::{CameraUniform, GBuffer, radiance_desc};
use lightloom_graph::{Graph, Handle, ShaderError, Texture, WgslSources, shader_struct};

shader_struct! {
    struct AmbientOcclusionParams {
        camera: CameraUniform,
        seed: u32,
        frame: u32,
        rays: u32,
        radius: f32,
    }
}

/// How occlusion is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AmbientOcclusionSettings {
    /// Distance from which on nothing occludes (m), above 0. More: larger corners darken.
    pub radius_m: f32,
    /// Rays per pixel and frame. More: calmer.
    pub rays: u32,
}

impl AmbientOcclusionSettings {
    /// Eight rays of `radius_m` (m).
    pub fn new(radius_m: f32) -> Self {
        Self { radius_m, rays: 8 }
    }
}

/// Mean over the directions of the cosine law of t/r, t the distance of what a ray meets within r (m), 1 where it meets nothing: 0 closed
/// in, 1 open. Reads: scene, G-buffer. A thread per pixel.
///
/// Photons find their way into corners by themselves: light that they bring is occluded already, and this darkens it once more. It is
/// for the eye, to bring back contact that is smaller than the photons' kernels.
#[derive(Clone, Debug)]
pub struct AmbientOcclusion {
    shader: SceneShader,
}

impl AmbientOcclusion {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: SceneShader::new(sources, "passes/ambient_occlusion.wgsl")? })
    }

    /// Declares the pass. Returns the openness in each channel; 1 at the background and where the first surface is specular.
    #[expect(clippy::too_many_arguments, reason = "a frame's parts, each a different thing")]
    pub fn add(
        &self,
        graph: &mut Graph<'_>,
        scene: &SceneHandles,
        camera: &CameraUniform,
        gbuffer: &GBuffer,
        settings: AmbientOcclusionSettings,
        seed: u32,
        frame: u32,
    ) -> Handle<Texture> {
        let mut openness = graph.texture("ambient_occlusion", radiance_desc(camera.size));
        let AmbientOcclusionSettings { radius_m, rays } = settings;
        let params = AmbientOcclusionParams { camera: *camera, seed, frame, rays, radius: radius_m };
        scene
            .bind(graph.compute(&self.shader.variant(scene)).params(&params))
            .read("position", &gbuffer.position)
            .read("surface", &gbuffer.surface)
            .write("openness", &mut openness)
            .heavy()
            .dispatch_threads([camera.size[0], camera.size[1], 1]);
        openness
    }
}
