//! How maps are drawn, and what photons take from them.

/// What finds the first hits of a light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum RsmKind {
    /// A ray per texel.
    #[default]
    Traced,
    /// Texels look their rays up in rasterised views of the light: a parallel one, a perspective one or the six faces of a cube. Emissive
    /// surfaces, which have no centre to look from, and points past the 42nd are traced. Photons are steered by it and no more: unbiased.
    Rasterised,
    /// As `Rasterised`, and a photon that meets the triangle its texel saw starts from there without a ray.
    ///
    /// Biased: what stands before that triangle and is missed by the texel's centre is missed by the photon. That is at most the
    /// flux through the texels in which outlines of nearer triangles lie; it halves with twice the side.
    FirstHits,
}

/// Maps of all lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct RsmSettings {
    /// Side of a map and of a view (texels), rounded up to a power of two within [`Rsm::SIZES`](super::Rsm::SIZES). Larger ones follow finer
    /// detail, at a ray and 5⅓ bytes a texel; views take another 4 bytes a texel.
    pub side: u32,
    /// What finds the first hits.
    pub kind: RsmKind,
}

impl RsmSettings {
    /// Traced maps of `side` texels across and down.
    pub fn new(side: u32) -> Self {
        Self { side, kind: RsmKind::default() }
    }

    /// The same with first hits found by `kind`.
    pub fn with_kind(self, kind: RsmKind) -> Self {
        Self { kind, ..self }
    }
}

impl Default for RsmSettings {
    /// 256 texels, traced.
    fn default() -> Self {
        Self::new(256)
    }
}
