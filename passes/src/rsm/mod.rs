//! Reflective shadow maps [SA19, §24.2.1] as a source of photons: lights send more of them where their light meets bright surfaces.
//!
//! ```text
//! rsm_view: a picture per view ─▶ seen ─┐ (or nothing)
//!                                       ▼
//! rays, one per texel ──────────────▶ rsm_map ─┬─▶ importance, level 0 ─▶ rsm_pyramid, rsm_pyramid_top ─▶ all levels ─▶ rsm_emit ─▶ rays, paths
//!                                              └─▶ held ──────────────────────────────────────────────────────────────────▲
//! ```
//!
//! The importance of a texel is luminance(flux × albedo). A map lies over the unit square of which uniform emission takes its
//! directions (or, of a directional light, its positions), an equal-area map of the sphere, of a spot's cone, of the scene's disc, of
//! the cosine-weighted hemisphere over a surface or of both its sides: a texel's flux needs no Jacobian, and one rule of emission serves
//! both. The hardware cannot rasterise such a map; texels look their rays up in views that it can ([`MapsBy::Raster`]).
//!
//! Each punctual light has a map, and each piece of an emissive surface: triangles of one material that are joined and not much bent.
//! Where on it a photon leaves is drawn as ever, by power and area, and the map steers the direction alone: p(x, ω) = p(x) p(ω). Its
//! texels hold the mean over rays from all of the piece, in frames that turn with the normal. One map over position and direction
//! would follow more; in its four dimensions the rays of a frame are few.
//!
//! A photon starts at the light in the very direction that was drawn, Φ = Φ(u) / (N p(u)), and its first ray is traced like any
//! other: the map steers chance alone, so estimates are as unbiased as uniform emission's. For the same reason every
//! texel has importance, even where its centre meets nothing or black: the map may miss what lies beside it. The photon also carries
//! what its texel expects the first surface to keep of it, so that roulette there does not take again what chance has paid for.
//! [`FirstHit::Map`] also lets it start at the triangle that the texel holds: all that a first bounce needs besides the ray, for where
//! and how the triangle is met follows from both.
//!
//! [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems, 2019"

mod emit;
mod map;
mod pyramid;
mod settings;
mod views;

pub use emit::RsmSource;
pub use settings::{FirstHit, MapsBy, RsmSettings};

use crate::scene::{SceneHandles, SceneInfo};
use emit::RsmEmit;
use lightloom_graph::{Graph, Handle, ShaderError, Texture, TextureDesc, WgslSources, wgpu::TextureFormat};
use map::RsmMap;
use pyramid::RsmPyramid;
use views::{RsmViews, Views};

/// The passes.
#[derive(Clone, Debug)]
pub struct Rsm {
    views: RsmViews,
    map: RsmMap,
    pyramid: RsmPyramid,
    emit: RsmEmit,
}

/// Where the light of each group of lights goes: a layer for each of [`SceneHandles::light_groups`].
#[derive(Debug)]
pub struct RsmMaps {
    /// `r32float`; each level holds the sums of the quads of the one below, the last is one texel.
    pub importance: Handle<Texture>,
    /// `r32uint`, what the light meets first: index into the BVH's triangles + 1, 0 where it is nothing, or hangs on where the light leaves.
    pub held: Handle<Texture>,
    /// Groups.
    pub count: u32,
    first_hit: FirstHit,
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
        let desc = |format| TextureDesc::new_2d([size; 2], format).layers(count.max(1));
        let mut maps = RsmMaps {
            importance: graph.texture("rsm_importance", desc(TextureFormat::R32Float).mip_levels(size.ilog2() + 1)),
            held: graph.texture("rsm_held", desc(TextureFormat::R32Uint)),
            count,
            first_hit: settings.first_hit,
        };
        if count > 0 {
            let views = match settings.maps_by {
                MapsBy::Raster if info.light_view_count > 0 => self.views.add(graph, scene, info, size),
                _ => Views::none(graph),
            };
            self.map.add(graph, scene, info, size, &views, &mut maps);
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
