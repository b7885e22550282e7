//! One bounce: photons leave records where they hit, and are absorbed or scattered.

use crate::photon_path::PathBuffers;
use crate::scene::{SceneHandles, SceneInfo};
use crate::{DepositCull, PhotonSettings, SceneShader};
use lightloom_graph::{Buffer, Graph, Handle, ShaderError, WgslSources, shader_struct};

shader_struct! {
    struct PhotonScatterParams {
        cull: DepositCull,
        seed: u32,
        max_bounces: u32,
        caustics_only: u32,
        light_vertices: u32,
        ledger_scale: f32,
        bounds_radius: f32,
        pad0: u32,
        pad1: u32,
    }
}

/// The pass. Reads: scene, hits. Changes: rays, paths, tally. Writes: staging, one place per path. A thread per path.
#[derive(Clone, Debug)]
pub(crate) struct PhotonScatter {
    shader: SceneShader,
}

/// What a bounce reads and writes besides the paths.
pub(crate) struct BounceBuffers<'a> {
    pub(crate) hits: &'a Handle<Buffer>,
    pub(crate) staging: &'a mut Handle<Buffer>,
    pub(crate) tally: &'a mut Handle<Buffer>,
}

impl PhotonScatter {
    pub(crate) fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: SceneShader::new(sources, "passes/photon_scatter.wgsl")? })
    }

    pub(crate) fn add(
        &self,
        graph: &mut Graph<'_>,
        scene: &SceneHandles,
        info: &SceneInfo,
        settings: &PhotonSettings,
        paths: &mut PathBuffers,
        bounce: &mut BounceBuffers<'_>,
    ) {
        let params = PhotonScatterParams {
            cull: settings.cull.unwrap_or_else(DepositCull::nothing),
            seed: settings.seed,
            max_bounces: settings.max_bounces,
            caustics_only: u32::from(settings.caustics_only),
            light_vertices: u32::from(settings.light_vertices),
            ledger_scale: settings.ledger_scale(info),
            bounds_radius: info.bounds_radius,
            pad0: 0,
            pad1: 0,
        };
        scene
            .bind(graph.compute(&self.shader.variant(scene)).params(&params))
            .read("hits", bounce.hits)
            .write("rays", &mut paths.rays)
            .write("paths", &mut paths.paths)
            .write("staging", bounce.staging)
            .write("tally", bounce.tally)
            .dispatch_indirect(&paths.live, 0);
    }
}
