//! The G-buffer: what the eye sees through each pixel.

use crate::scene::SceneHandles;
use crate::scene_shader::SceneShader;
use crate::{CameraUniform, radiance_desc};
use lightloom_graph::wgpu::TextureFormat;
use lightloom_graph::{Graph, Handle, ShaderError, Texture, TextureDesc, WgslSources, shader_struct};

/// What strategies gather at. An engine may fill these textures itself; `shared/gbuffer.wgsl` has the encoding.
#[derive(Debug)]
pub struct GBuffer {
    /// `rgba32float`: world position (m), distance to the camera (m; 0 where nothing is seen; below 0 for
    /// [`VisiblePoints`](crate::VisiblePoints) that are seen by way of mirrors or glass).
    pub position: Handle<Texture>,
    /// `rgba32uint`: shading normal and geometric normal (octahedral), base colour, and roughness, metallic, flags and
    /// f0 in bytes.
    pub surface: Handle<Texture>,
    /// `rgba32float`: radiance the surface itself emits towards the eye (W·m⁻²·sr⁻¹).
    pub emission: Handle<Texture>,
    /// An engine's motion vectors, for the [`Filter`](crate::Filter), `rgba32float`: displacement from the sample's place in this image to that in the previous one
    /// (pixels, right and down), depth along the previous view (m), 1 where that is before the camera and 0 elsewhere. `None`: the filter
    /// computes them.
    pub motion: Option<Handle<Texture>>,
}

shader_struct! {
    struct GBufferParams {
        camera: CameraUniform,
    }
}

/// Resolves visibility into a [`GBuffer`]. Reads: scene, `visibility`. Writes: the three textures. A thread per pixel.
#[derive(Clone, Debug)]
pub struct GBufferPass {
    shader: SceneShader,
}

impl GBufferPass {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: SceneShader::new(sources, "passes/gbuffer.wgsl")? })
    }

    /// Declares the pass.
    pub fn add(
        &self,
        graph: &mut Graph<'_>,
        scene: &SceneHandles,
        camera: &CameraUniform,
        visibility: &Handle<Texture>,
    ) -> GBuffer {
        let mut gbuffer = GBuffer {
            position: graph.texture("gbuffer_position", radiance_desc(camera.size)),
            surface: graph.texture("gbuffer_surface", TextureDesc::new_2d(camera.size, TextureFormat::Rgba32Uint)),
            emission: graph.texture("gbuffer_emission", radiance_desc(camera.size)),
            motion: None,
        };
        scene
            .bind(graph.compute(&self.shader.variant(scene)).params(&GBufferParams { camera: *camera }))
            .read("visibility", visibility)
            .write("position", &mut gbuffer.position)
            .write("surface", &mut gbuffer.surface)
            .write("emission", &mut gbuffer.emission)
            .dispatch_threads([camera.size[0], camera.size[1], 1]);
        gbuffer
    }
}
