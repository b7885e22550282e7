//! Images of the surfaces themselves: base colour, shading normal, distance.

use crate::StrategyError;
use lightloom_graph::{ComputeShader, Graph, Handle, Texture, WgslSources, shader_struct};
use lightloom_passes::{CameraUniform, GBuffer, radiance_desc};

shader_struct! {
    struct LayerParams {
        camera_position_world: [f32; 3],
        pad0: u32,
        size: [u32; 2],
        pad1: u32,
        pad2: u32,
    }
}

/// What the pass writes, all rgba32float, alpha 1 where a surface is and 0 elsewhere.
#[derive(Debug)]
pub struct SurfaceImages {
    /// Linear base colour, 0 to 1.
    pub albedo: Handle<Texture>,
    /// Shading normal (world, unit).
    pub normal: Handle<Texture>,
    /// Distance to the camera (m) in each channel.
    pub depth: Handle<Texture>,
}

/// The pass. Reads: G-buffer. One thread per pixel.
#[derive(Clone, Debug)]
pub(crate) struct SurfaceLayers {
    shader: ComputeShader,
}

impl SurfaceLayers {
    pub(crate) fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self { shader: ComputeShader::new(sources, "strategies/surface_layers.wgsl")? })
    }

    /// Declares the pass.
    pub(crate) fn add(&self, graph: &mut Graph<'_>, camera: &CameraUniform, gbuffer: &GBuffer) -> SurfaceImages {
        let mut images = SurfaceImages {
            albedo: graph.texture("albedo", radiance_desc(camera.size)),
            normal: graph.texture("normal", radiance_desc(camera.size)),
            depth: graph.texture("depth", radiance_desc(camera.size)),
        };
        let params = LayerParams { camera_position_world: camera.position_world(), size: camera.size, ..LayerParams::default() };
        graph
            .compute(&self.shader)
            .params(&params)
            .read("position", &gbuffer.position)
            .read("surface", &gbuffer.surface)
            .write("albedo", &mut images.albedo)
            .write("normal", &mut images.normal)
            .write("depth", &mut images.depth)
            .dispatch_threads([camera.size[0], camera.size[1], 1]);
        images
    }
}
