//! Binding a scene to a pass: the group of resources that all rays need.

use crate::RayBackend;
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
            .read_if_used("light_groups", &$scene.light_groups)
            .read_if_used("light_views", &$scene.light_views)
            .read_if_used("texels", &$scene.texels)
            .read_as_if_used("texels_srgb", &$scene.texels, TextureFormat::Rgba8UnormSrgb)
            .read_if_used("environment", &$scene.environment)
    };
}

impl SceneHandles {
    /// What traces the scene's rays.
    pub fn rays(&self) -> RayBackend {
        if self.ray_query_scene.is_some() {
            RayBackend::RayQuery
        } else if self.ray_pipeline_scene.is_some() {
            RayBackend::Pipeline
        } else {
            RayBackend::Bvh
        }
    }

    /// Binds what the shader uses of `shared/scene_bindings.wgsl` and `shared/ray_query.wgsl`.
    pub fn bind<'g, 'f>(&self, pass: ComputePass<'g, 'f>) -> ComputePass<'g, 'f> {
        let pass = bind!(pass, self);
        match &self.ray_query_scene {
            Some(structure) => pass.read_if_used("ray_query_scene", structure),
            None => pass,
        }
    }

    /// Binds what the shader uses of `shared/scene_bindings.wgsl`.
    pub fn bind_raster<'g, 'f>(&self, pass: RasterPass<'g, 'f>) -> RasterPass<'g, 'f> {
        bind!(pass, self)
    }
}
