//! Photons leave the lights.

use crate::photon_path::{PathBuffers, PhotonBatch, PhotonSource};
use crate::scene::{SceneHandles, SceneInfo};
use crate::{LightInfo, SceneShader};
use lightloom_graph::{Graph, ShaderError, WgslSources, shader_struct};

shader_struct! {
    struct PhotonEmitParams {
        lights: LightInfo,
        emitted: u32,
        first: u32,
        count: u32,
        seed: u32,
    }
}

/// The pass: photons drawn from all lights by power. Reads: lights. Writes: rays, paths. A thread per photon.
#[derive(Clone, Debug)]
pub struct PhotonEmit {
    shader: SceneShader,
}

impl PhotonEmit {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: SceneShader::new(sources, "passes/photon_emit.wgsl")? })
    }
}

impl PhotonSource for PhotonEmit {
    fn add(&self, graph: &mut Graph<'_>, scene: &SceneHandles, info: &SceneInfo, batch: PhotonBatch, out: &mut PathBuffers) {
        let PhotonBatch { emitted, first, count, seed } = batch;
        let params = PhotonEmitParams { lights: info.into(), emitted, first, count, seed };
        scene
            .bind(graph.compute(&self.shader.variant(scene)).params(&params))
            .write("rays", &mut out.rays)
            .write("paths", &mut out.paths)
            .write("live", &mut out.live)
            .dispatch_1d(count);
    }
}
