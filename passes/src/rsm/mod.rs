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

pub use emit::RsmSource;

use crate::scene::{SceneHandles, SceneInfo};
use emit::RsmEmit;
use lightloom_graph::{Graph, Handle, ShaderError, Texture, TextureDesc, WgslSources, wgpu::TextureFormat};
use map::RsmMap;
use pyramid::RsmPyramid;

/// The passes.
#[derive(Clone, Debug)]
pub struct Rsm {
    map: RsmMap,
    pyramid: RsmPyramid,
    emit: RsmEmit,
}

/// Importance of the directions of each lamp.
#[derive(Debug)]
pub struct RsmMaps {
    /// A layer for each of the first lights of the list; each level holds the sums of the quads of the one below, the last is one texel.
    pub importance: Handle<Texture>,
    /// Lights that have a map, the first ones of the list.
    pub count: u32,
}

impl Rsm {
    /// Side of a map (texels) when nothing else is said.
    pub const DEFAULT_SIZE: u32 = 256;
    /// Sides of the smallest and the largest map (texels).
    pub const SIZES: [u32; 2] = [16, 2048];

    /// Parses the shaders.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { map: RsmMap::new(sources)?, pyramid: RsmPyramid::new(sources)?, emit: RsmEmit::new(sources)? })
    }

    /// Declares the passes that draw the maps of all punctual lights, `size` texels across and down: rounded up to a power of two
    /// within [`Self::SIZES`]. Larger maps follow finer detail, at a ray and 5⅓ bytes a texel. Lights past the 256th have none.
    pub fn add(&self, graph: &mut Graph<'_>, scene: &SceneHandles, info: &SceneInfo, size: u32) -> RsmMaps {
        let [least, most] = Self::SIZES;
        let size = size.clamp(least, most).next_power_of_two();
        let count = info.light_group_count;
        let desc = TextureDesc::new_2d([size; 2], TextureFormat::R32Float).layers(count.max(1)).mip_levels(size.ilog2() + 1);
        let mut maps = RsmMaps { importance: graph.texture("rsm_importance", desc), count };
        if count > 0 {
            self.map.add(graph, scene, info, size, &mut maps);
            self.pyramid.add(graph, size, &mut maps);
        }
        maps
    }

    /// Photons that follow `maps`; those of emissive triangles, and of lights without a map, leave as from
    /// [`PhotonEmit`](crate::PhotonEmit). Lights get their share by power.
    pub fn source<'a>(&'a self, maps: &'a RsmMaps) -> RsmSource<'a> {
        RsmSource { emit: &self.emit, maps }
    }
}
