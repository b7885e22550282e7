//! Importance of each texel.

use super::RsmMaps;
use super::views::Views;
use crate::scene::{SceneHandles, SceneInfo};
use crate::{LightInfo, SceneShader};
use lightloom_graph::{Graph, ShaderError, Subresources, WgslSources, shader_struct};

/// Added to the albedo of every texel, so that what lies beside a texel's centre is reached too: among texels of equal flux, with at
/// most (1 + 0.05) / 0.05 = 21 times the flux of a photon of uniform emission.
const ALBEDO_FLOOR: f32 = 0.05;

shader_struct! {
    struct RsmMapParams {
        lights: LightInfo,
        size: u32,
        albedo_floor: f32,
        views_drawn: u32,
        pad0: u32,
    }
}

/// The pass. Reads: scene, views. Writes: level 0 of the maps. A thread per texel.
#[derive(Clone, Debug)]
pub(super) struct RsmMap {
    shader: SceneShader,
}

impl RsmMap {
    pub(super) fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: SceneShader::new(sources, "passes/rsm_map.wgsl")? })
    }

    pub(super) fn add(
        &self,
        graph: &mut Graph<'_>,
        scene: &SceneHandles,
        info: &SceneInfo,
        size: u32,
        views: &Views,
        maps: &mut RsmMaps,
    ) {
        let views_drawn = views.drawn.into();
        let params = RsmMapParams { lights: info.into(), size, albedo_floor: ALBEDO_FLOOR, views_drawn, pad0: 0 };
        scene
            .bind(graph.compute(&self.shader.variant(scene)).params(&params))
            .write_at("importance", &mut maps.importance, Subresources::mip(0))
            .write("held", &mut maps.held)
            .read("seen", &views.seen)
            .heavy()
            .dispatch([size / 8, size / 8, maps.count]);
    }
}
