//! Parts of a texture: mip levels and array layers.

use std::{fmt, ops::Range};

/// A rectangle of a texture's mip levels and array layers; passes read and write these apart.
///
/// A buffer, and a whole texture, is [`Subresources::ALL`].
///
/// ```
/// use lightloom_graph::Subresources;
/// let part = Subresources::mip(3).layer(0);
/// assert_eq!(part.to_string(), "mip 3, layer 0");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Subresources {
    pub(crate) mips: [u32; 2],
    pub(crate) layers: [u32; 2],
}

/// An end that means "to the last one".
const END: u32 = u32::MAX;

impl Subresources {
    /// Every mip level and layer.
    pub const ALL: Self = Self { mips: [0, END], layers: [0, END] };

    /// One mip level, all layers.
    pub fn mip(level: u32) -> Self {
        Self::mips(level..level.saturating_add(1))
    }

    /// Some mip levels, all layers.
    pub fn mips(levels: Range<u32>) -> Self {
        Self { mips: [levels.start, levels.end], ..Self::ALL }
    }

    /// The same mip levels, of one layer only.
    pub fn layer(self, layer: u32) -> Self {
        self.layers(layer..layer.saturating_add(1))
    }

    /// The same mip levels, of some layers only.
    pub fn layers(self, layers: Range<u32>) -> Self {
        Self { layers: [layers.start, layers.end], ..self }
    }

    /// Whether it stands for the whole, however many mips and layers there are.
    pub fn is_all(self) -> bool {
        self == Self::ALL
    }

    /// The mip levels, from 0, in a texture of `count`.
    pub fn mips_of(self, count: u32) -> Range<u32> {
        self.mips[0]..self.mips[1].min(count)
    }

    /// The layers, from 0, in a texture of `count`; a volume has one.
    pub fn layers_of(self, count: u32) -> Range<u32> {
        self.layers[0]..self.layers[1].min(count)
    }

    /// Whether both have a mip level and layer in common.
    pub(crate) fn overlaps(self, other: Self) -> bool {
        let meet = |a: [u32; 2], b: [u32; 2]| a[0] < b[1] && b[0] < a[1];
        meet(self.mips, other.mips) && meet(self.layers, other.layers)
    }
}

impl Default for Subresources {
    fn default() -> Self {
        Self::ALL
    }
}

impl fmt::Display for Subresources {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let one = |what: &str, [start, end]: [u32; 2]| match end {
            END if start == 0 => None,
            END => Some(format!("{what}s {start}…")),
            end if start.checked_add(1) == Some(end) => Some(format!("{what} {start}")),
            end => Some(format!("{what}s {start}…{}", end.saturating_sub(1))),
        };
        let parts: Vec<String> = [one("mip", self.mips), one("layer", self.layers)].into_iter().flatten().collect();
        if parts.is_empty() { f.write_str("all mips and layers") } else { f.write_str(&parts.join(", ")) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_overlap_in_both_axes() {
        let a = Subresources::mip(1).layer(2);
        assert!(a.overlaps(Subresources::ALL) && a.overlaps(a) && a.overlaps(Subresources::mips(0..2)));
        assert!(!a.overlaps(Subresources::mip(2)) && !a.overlaps(Subresources::mip(1).layer(1)));
        assert_eq!((a.mips_of(8), a.layers_of(1).len()), (1..2, 0), "out of range is empty");
        assert_eq!(Subresources::mips(1..4).to_string(), "mips 1…3");
        assert_eq!(Subresources::ALL.to_string(), "all mips and layers");
    }
}
