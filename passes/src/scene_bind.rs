//! Binding a scene to a pass: the group of resources that all rays need.

use crate::scene::SceneHandles;
use lightloom_graph::{ComputePass, RasterPass, wgpu::TextureFormat};

macro_rules! bind {
    ($pass:expr, $scene:expr) => {
        $pass
            .read_if_used("bvh_nodes", &$scene.bvh_nodes)
            .read_if_used("bvh_triangles", &$scene.bvh_triangles)
            .read_if_used("triangles", &$scene.triangles)
            .read_if_used("materials", &$scene.materials)
            .read_if_used("lights", &$scene.lights)
            .read_if_used("texels", &$scene.texels)
            .read_as_if_used("texels_srgb", &$scene.texels, TextureFormat::Rgba8UnormSrgb)
            .read_if_used("environment", &$scene.environment)
    };
}

impl SceneHandles {
    /// Binds what the shader uses of `shared/scene_bindings.wgsl`.
    pub fn bind<'g, 'f>(&self, pass: ComputePass<'g, 'f>) -> ComputePass<'g, 'f> {
        bind!(pass, self)
    }

    /// Binds what the shader uses of `shared/scene_bindings.wgsl`.
    pub fn bind_raster<'g, 'f>(&self, pass: RasterPass<'g, 'f>) -> RasterPass<'g, 'f> {
        bind!(pass, self)
    }
}
