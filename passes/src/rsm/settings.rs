//! How maps are drawn, and what photons take from them.

/// What finds the first hits of which maps are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum MapsBy {
    /// A ray per texel.
    #[default]
    Rays,
    /// Rasterised views of each punctual light, in which texels look their rays up: a parallel one, a perspective one or the six faces of
    /// a cube. Emissive surfaces, which have no centre to look from, and points past the 42nd are traced.
    ///
    /// Each view draws the whole scene. On a software adapter that costs as much as the rays in a room of forty triangles,
    /// two to three times as much with twenty thousand and five to seven times as much in Sponza, whose views are thirteen.
    Raster,
}

/// Where photons that follow maps begin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FirstHit {
    /// At the light: their first rays are traced. Unbiased.
    #[default]
    Traced,
    /// At the triangle that their texel holds, if they meet it; all others are traced. Biased: what stands before that triangle and is
    /// missed by the texel's centre is missed by the photon. That is less than the flux through texels in which there are outlines, and
    /// about halves with twice the side; in a room with a glass ball 6 ‰ of the photons with 32 texels, 1 ‰ with 256. Photons of emissive
    /// surfaces, whose maps know no place, are traced.
    Map,
}

/// Maps of all lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct RsmSettings {
    /// Side of a map and of a view (texels), rounded up to a power of two within [`Rsm::SIZES`](super::Rsm::SIZES). Larger ones follow finer
    /// detail, at a ray and 9⅓ bytes a texel; views take another 4 bytes a texel.
    pub side: u32,
    /// What finds the first hits of which maps are made.
    pub maps_by: MapsBy,
    /// Where photons begin.
    pub first_hit: FirstHit,
}

impl RsmSettings {
    /// Traced maps of `side` texels across and down, and traced photons.
    pub fn new(side: u32) -> Self {
        Self { side, maps_by: MapsBy::Rays, first_hit: FirstHit::Traced }
    }
}

impl Default for RsmSettings {
    /// 256 texels.
    fn default() -> Self {
        Self::new(256)
    }
}
