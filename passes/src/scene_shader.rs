//! A shader that is specialised to what occurs in a scene, and to what traces the scene's rays.

use crate::RayBackend;
use crate::scene::{SceneHandles, SceneTraits};
use lightloom_graph::{ComputeShader, RasterShader, ShaderError, WgslSources};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// A compute shader whose text imports `shared/scene_traits.wgsl`, and its variants so far.
#[derive(Clone, Debug)]
pub struct SceneShader {
    general: ComputeShader,
    /// The version that traces by ray queries.
    ray_query: Option<ComputeShader>,
    variants: Arc<Mutex<HashMap<(SceneTraits, RayBackend), ComputeShader>>>,
}

impl SceneShader {
    /// Parses the shader in `path` of `sources` and, for shaders that trace rays, its second version beside it: that of
    /// `mine/gather.wgsl` is `mine/ray_query/gather.wgsl`, three lines like those of `passes/ray_query/trace_rays.wgsl`. A shader
    /// without one traces through the hierarchy, or not at all.
    pub fn new(sources: &WgslSources, path: &str) -> Result<Self, ShaderError> {
        let second = match path.rsplit_once('/') {
            Some((folder, file)) => format!("{folder}/ray_query/{file}"),
            None => format!("ray_query/{path}"),
        };
        let ray_query = if sources.paths().contains(&second) { Some(ComputeShader::new(sources, &second)?) } else { None };
        Ok(Self { general: ComputeShader::new(sources, path)?, ray_query, variants: Arc::default() })
    }

    /// The shader with the WGSL `override` `name` set.
    ///
    /// # Errors
    /// If there is no such override or the value does not fit its type.
    pub fn with_constant(self, name: &str, value: f64) -> Result<Self, ShaderError> {
        let ray_query = self.ray_query.map(|shader| shader.with_constant(name, value)).transpose()?;
        Ok(Self { general: self.general.with_constant(name, value)?, ray_query, variants: Arc::default() })
    }

    /// The shader for `scene`.
    pub fn variant(&self, scene: &SceneHandles) -> ComputeShader {
        let mut variants = self.variants.lock().unwrap_or_else(PoisonError::into_inner);
        let general = match (scene.rays(), &self.ray_query) {
            (RayBackend::RayQuery, Some(ray_query)) => ray_query,
            _ => &self.general,
        };
        variants
            .entry((scene.traits, scene.rays()))
            .or_insert_with(|| specialise(general, scene.traits, ComputeShader::with_constant))
            .clone()
    }
}

/// A raster shader whose text imports `shared/scene_traits.wgsl`, and its variants so far.
#[derive(Clone, Debug)]
pub struct SceneRasterShader {
    general: RasterShader,
    variants: Arc<Mutex<HashMap<SceneTraits, RasterShader>>>,
}

impl SceneRasterShader {
    /// The variants of `general`, in its state of culling, blending and depth test.
    pub fn new(general: RasterShader) -> Self {
        Self { general, variants: Arc::default() }
    }

    /// The shader for `scene`.
    pub fn variant(&self, scene: &SceneHandles) -> RasterShader {
        let mut variants = self.variants.lock().unwrap_or_else(PoisonError::into_inner);
        let variant = || specialise(&self.general, scene.traits, RasterShader::with_constant);
        variants.entry(scene.traits).or_insert_with(variant).clone()
    }
}

/// Sets the overrides; a shader that lacks one, because it knows no surfaces, stays as it is.
fn specialise<S: Clone>(general: &S, traits: SceneTraits, set: impl Fn(S, &'static str, f64) -> Result<S, ShaderError>) -> S {
    let constants = traits.constants().into_iter();
    constants
        .map(|(name, value)| (name, f64::from(value)))
        .try_fold(general.clone(), |shader, (name, value)| set(shader, name, value))
        .unwrap_or_else(|_| general.clone())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{GpuScene, builtin};
    use lightloom_graph::Graph;

    #[test]
    fn the_scene_chooses_the_version() {
        let sources = crate::shaders();
        let scene = |rays| GpuScene::describe(&builtin::cornell()).unwrap().with_rays(rays).unwrap();
        let variant = |shader: &SceneShader, rays| {
            let mut graph = Graph::new("f");
            shader.variant(&scene(rays).declare(&mut graph))
        };
        let both = |path| {
            let shader = SceneShader::new(&sources, path).unwrap();
            [variant(&shader, RayBackend::Bvh), variant(&shader, RayBackend::RayQuery)]
        };
        let [bvh, query] = both("passes/trace_rays.wgsl");
        assert!(!bvh.wgsl().contains("enable wgpu_ray_query;"), "{}", bvh.wgsl());
        assert!(query.wgsl().contains("enable wgpu_ray_query;"), "{}", query.wgsl());
        let [bvh, query] = both("passes/photon_scatter.wgsl");
        assert_eq!(bvh.wgsl(), query.wgsl(), "it traces no rays");
    }
}
