//! A shader that is specialised to what occurs in a scene.

use crate::scene::SceneTraits;
use lightloom_graph::{ComputeShader, ShaderError, WgslSources};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// A compute shader whose text imports `shared/scene_traits.wgsl`, and its variants so far.
#[derive(Clone, Debug)]
pub struct SceneShader {
    general: ComputeShader,
    variants: Arc<Mutex<HashMap<SceneTraits, ComputeShader>>>,
}

impl SceneShader {
    /// Parses the shader in `path` of `sources`.
    pub fn new(sources: &WgslSources, path: &str) -> Result<Self, ShaderError> {
        Ok(Self { general: ComputeShader::new(sources, path)?, variants: Arc::default() })
    }

    /// The shader for scenes with `traits`.
    pub fn variant(&self, traits: SceneTraits) -> ComputeShader {
        let mut variants = self.variants.lock().unwrap_or_else(PoisonError::into_inner);
        variants
            .entry(traits)
            .or_insert_with(|| specialise(&self.general, traits).unwrap_or_else(|_| self.general.clone()))
            .clone()
    }
}

/// Sets the overrides; a shader that lacks one stays as it is, which is slower and no less right.
fn specialise(general: &ComputeShader, traits: SceneTraits) -> Result<ComputeShader, ShaderError> {
    traits.constants().into_iter().try_fold(general.clone(), |shader, (name, value)| shader.with_constant(name, f64::from(value)))
}
