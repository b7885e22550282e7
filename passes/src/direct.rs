//! Emission and direct light at the G-buffer's points.

use crate::scene::{SceneHandles, SceneInfo};
use crate::scene_shader::SceneShader;
use crate::{CameraUniform, GBuffer, LightInfo, radiance_desc};
use lightloom_graph::{Graph, Handle, ShaderError, Texture, WgslSources, shader_struct};

shader_struct! {
    struct DirectParams {
        camera: CameraUniform,
        lights: LightInfo,
        seed: u32,
        frame: u32,
        emissive_samples: u32,
        pad0: u32,
    }
}

/// How direct light is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DirectSettings {
    /// Seed of the random numbers.
    pub seed: u32,
    /// Frame, so that frames differ.
    pub frame: u32,
    /// Shadow rays to emissive triangles per pixel and frame. More: less noise in soft shadows.
    pub emissive_samples: u32,
}

/// One shadow ray to each lamp (one drawn lamp where there are more than 16) and some to emissive triangles. Unbiased.
/// Reads: scene, G-buffer. Writes: radiance. A thread per pixel.
#[derive(Clone, Debug)]
pub struct DirectLight {
    shader: SceneShader,
}

impl DirectLight {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: SceneShader::new(sources, "passes/direct.wgsl")? })
    }

    /// Declares the pass. Returns emitted and directly lit radiance (W·m⁻²·sr⁻¹); specular surfaces only emit.
    pub fn add(
        &self,
        graph: &mut Graph<'_>,
        scene: &SceneHandles,
        info: &SceneInfo,
        camera: &CameraUniform,
        gbuffer: &GBuffer,
        settings: DirectSettings,
    ) -> Handle<Texture> {
        let mut radiance = graph.texture("direct", radiance_desc(camera.size));
        let params = DirectParams {
            camera: *camera,
            lights: info.into(),
            seed: settings.seed,
            frame: settings.frame,
            emissive_samples: settings.emissive_samples,
            pad0: 0,
        };
        scene
            .bind(graph.compute(&self.shader.variant(scene)).params(&params))
            .read("position", &gbuffer.position)
            .read("surface", &gbuffer.surface)
            .read("emission", &gbuffer.emission)
            .write("direct_radiance", &mut radiance)
            .heavy()
            .dispatch_threads([camera.size[0], camera.size[1], 1]);
        radiance
    }
}
