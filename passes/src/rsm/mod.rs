//! Reflective shadow maps [SA19, §24.2.1] as a source of photons: lamps send more of them where their light meets bright surfaces.
//!
//! ```text
//! rsm_map: one ray per texel ─▶ importance, level 0 ─▶ rsm_pyramid, rsm_pyramid_top ─▶ all levels ─▶ rsm_emit ─▶ rays, paths
//! ```
//!
//! The importance of a texel is luminance(flux × albedo). A map lies over the unit square of which uniform emission takes its
//! directions (or, of a directional light, its positions), an equal-area map of the sphere, of a spot's cone, of the scene's disc: a
//! texel's flux needs no Jacobian, and one rule of emission serves both. A perspective map, which the hardware could rasterise, was
//! the alternative; it stops short of a half space and its texels are unequal.
//!
//! A photon starts at the light in the very direction that was drawn, Φ = Φ(u) / (N p(u)), and its first ray is traced like any
//! other: the map steers chance and holds nothing else, so estimates are as unbiased as uniform emission's. For the same reason every
//! texel has importance, even where its centre meets nothing or black: the map may miss what lies beside it. The photon also carries
//! what its texel expects the first surface to keep of it, so that roulette there does not take again what chance has paid for.
//!
//! [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems, 2019"

mod emit;
mod map;
mod pyramid;
mod settings;
mod views;

pub use emit::RsmSource;
pub use settings::{RsmKind, RsmSettings};

use crate::scene::{SceneHandles, SceneInfo};
use emit::RsmEmit;
use lightloom_graph::{Graph, Handle, Load, ShaderError, Subresources, Texture, TextureDesc, WgslSources, wgpu::TextureFormat};
use map::RsmMap;
use pyramid::RsmPyramid;
use views::RsmViews;

/// Views of a light at most: the faces of a cube.
const VIEWS: u32 = 6;

/// The passes.
#[derive(Clone, Debug)]
pub struct Rsm {
    views: RsmViews,
    map: RsmMap,
    pyramid: RsmPyramid,
    emit: RsmEmit,
}

/// Where the light of each group of lights goes.
#[derive(Debug)]
pub struct RsmMaps {
    /// A layer for each group of [`SceneHandles::light_groups`]; each level holds the sums of the quads of the one below, the last is one texel.
    pub importance: Handle<Texture>,
    /// What the lights see: a layer for each of [`SceneHandles::light_views`], `r32uint`, index into the BVH's triangles + 1, 0 where nothing
    /// is. One empty texel where nothing was rasterised.
    pub seen: Handle<Texture>,
    /// Groups, each of which has a map.
    pub count: u32,
    /// Views of a light that were drawn, at most.
    views: u32,
    /// Photons start from what was seen.
    first_hits: bool,
}

impl Rsm {
    /// Sides of the smallest and the largest map (texels).
    pub const SIZES: [u32; 2] = [16, 2048];

    /// Parses the shaders.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self {
            views: RsmViews::new(sources)?,
            map: RsmMap::new(sources)?,
            pyramid: RsmPyramid::new(sources)?,
            emit: RsmEmit::new(sources)?,
        })
    }

    /// Declares the passes that draw the maps of all groups of lights; of more than 256 the strongest have one.
    pub fn add(&self, graph: &mut Graph<'_>, scene: &SceneHandles, info: &SceneInfo, settings: RsmSettings) -> RsmMaps {
        let [least, most] = Self::SIZES;
        let size = settings.side.clamp(least, most).next_power_of_two();
        let count = info.light_group_count;
        let desc = TextureDesc::new_2d([size; 2], TextureFormat::R32Float).layers(count.max(1)).mip_levels(size.ilog2() + 1);
        let rasterised = settings.kind != RsmKind::Traced && info.light_view_count > 0;
        let seen = if rasterised { self.views.add(graph, scene, info, size) } else { nothing_seen(graph) };
        let mut maps = RsmMaps {
            importance: graph.texture("rsm_importance", desc),
            seen,
            count,
            views: if rasterised { VIEWS } else { 0 },
            first_hits: settings.kind == RsmKind::FirstHits,
        };
        if count > 0 {
            self.map.add(graph, scene, info, size, &mut maps);
            self.pyramid.add(graph, size, &mut maps);
        }
        maps
    }

    /// Photons that follow `maps`; those of lights without a map, and of the environment, leave as from
    /// [`PhotonEmit`](crate::PhotonEmit). Lights get their share by power.
    pub fn source<'a>(&'a self, maps: &'a RsmMaps) -> RsmSource<'a> {
        RsmSource { emit: &self.emit, maps }
    }
}

/// For shaders that look nothing up, and bind a texture all the same.
fn nothing_seen(graph: &mut Graph<'_>) -> Handle<Texture> {
    let mut seen = graph.texture("rsm_seen", TextureDesc::new_2d([1; 2], TextureFormat::R32Uint).layers(1));
    graph.clear_texture_at(&mut seen, Subresources::ALL, Load::Clear([0.0; 4]));
    seen
}
