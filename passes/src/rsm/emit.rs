//! Photons leave the lights by the maps.

use super::{FirstHit, RsmMaps};
use crate::scene::{Emission, SceneHandles, SceneInfo};
use crate::{LightInfo, PathBuffers, PhotonBatch, PhotonEmit, PhotonSource, SceneShader};
use lightloom_graph::{Graph, ShaderError, WgslSources, shader_struct};

shader_struct! {
    struct RsmEmitParams {
        lights: LightInfo,
        emitted: u32,
        first: u32,
        count: u32,
        seed: u32,
        maps: u32,
        first_hits: u32,
        pad0: u32,
        pad1: u32,
    }
}

/// The pass. Reads: lights, maps. Writes: rays, paths. A thread per photon.
#[derive(Clone, Debug)]
pub(super) struct RsmEmit {
    shader: SceneShader,
    /// For scenes whose light is all from the environment, or none.
    uniform: PhotonEmit,
}

impl RsmEmit {
    pub(super) fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: SceneShader::new(sources, "passes/rsm_emit.wgsl")?, uniform: PhotonEmit::new(sources)? })
    }
}

/// Photons that follow maps; see [`Rsm::source`](super::Rsm::source).
#[derive(Clone, Copy, Debug)]
pub struct RsmSource<'a> {
    pub(super) emit: &'a RsmEmit,
    pub(super) maps: &'a RsmMaps,
}

impl PhotonSource for RsmSource<'_> {
    fn add(&self, graph: &mut Graph<'_>, scene: &SceneHandles, info: &SceneInfo, batch: PhotonBatch, out: &mut PathBuffers) {
        if self.maps.count == 0 {
            return self.emit.uniform.add(graph, scene, info, batch, out);
        }
        let PhotonBatch { emitted, first, count, seed } = batch;
        let maps = self.maps.count;
        let first_hits = (self.maps.first_hit == FirstHit::Map).into();
        // Maps steer; guides would do so too.
        let lights = (&info.with_emission(Emission::Uniform)).into();
        let params = RsmEmitParams { lights, emitted, first, count, seed, maps, first_hits, pad0: 0, pad1: 0 };
        scene
            .bind(graph.compute(&self.emit.shader.variant(scene)).params(&params))
            .read("held", &self.maps.held)
            .read("importance", &self.maps.importance)
            .write("rays", &mut out.rays)
            .write("paths", &mut out.paths)
            .write("live", &mut out.live)
            .dispatch_1d(count);
    }
}
