//! What the filters compare of two pixels.

use crate::{CameraUniform, GBuffer};
use lightloom_graph::wgpu::TextureFormat;
use lightloom_graph::{ComputeShader, Graph, Handle, ShaderError, Texture, TextureDesc, WgslSources, shader_struct};

shader_struct! {
    struct GuideParams {
        camera: CameraUniform,
    }
}

/// `rgba32uint` per pixel: depth along the view as bits (m; 0 where nothing is filtered), its slope along the surface (two halves; pixel
/// footprints per pixel to the right and down), geometric and shading normal (octahedral).
#[derive(Debug)]
pub(super) struct Guide {
    /// Of this frame.
    pub(super) now: Handle<Texture>,
    /// Of the frame before; zeros in the first, and after a change of size.
    pub(super) previous: Handle<Texture>,
}

/// Writes a [`Guide`]. Slopes are those of the tangent planes, not differences of pixels, which are wrong at every edge. Reads: G-buffer.
/// A thread per pixel.
#[derive(Clone, Debug)]
pub(super) struct GuidePass {
    shader: ComputeShader,
}

impl GuidePass {
    /// Parses the shader.
    pub(super) fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: ComputeShader::new(sources, "passes/filter_guide.wgsl")? })
    }

    /// Declares the pass.
    pub(super) fn add(&self, graph: &mut Graph<'_>, camera: &CameraUniform, gbuffer: &GBuffer) -> Guide {
        let mut guide = graph.history_texture("filter_guide", TextureDesc::new_2d(camera.size, TextureFormat::Rgba32Uint));
        graph
            .compute(&self.shader)
            .params(&GuideParams { camera: *camera })
            .read("position", &gbuffer.position)
            .read("surface", &gbuffer.surface)
            .write("guide", &mut guide.current)
            .dispatch_threads([camera.size[0], camera.size[1], 1]);
        Guide { now: guide.current, previous: guide.previous }
    }
}
