//! The parts of resources that a frame tells apart.

use lightloom_graph::{Access, Declaration, ResourceKind, wgpu::TextureDimension};
use std::{collections::BTreeSet, ops::Range};

/// A resource, and a mip level and layer that stand for all of those used alike.
pub(super) type Point = (usize, u32, u32);

/// Per resource the mips and layers at which an access begins or ends. Between two of them all is used alike.
pub(super) struct Points<'a> {
    declaration: &'a Declaration,
    cuts: Vec<[BTreeSet<u32>; 2]>,
}

impl<'a> Points<'a> {
    pub(super) fn new(declaration: &'a Declaration) -> Self {
        let mut cuts = vec![[BTreeSet::new(), BTreeSet::new()]; declaration.resources.len()];
        for access in declaration.passes.iter().flat_map(|pass| &pass.accesses) {
            for (axis, range) in ranges(declaration, access).into_iter().enumerate() {
                cuts[access.resource][axis].extend([range.start, range.end]);
            }
        }
        Self { declaration, cuts }
    }

    /// The points of an access.
    pub(super) fn of(&self, access: &Access) -> impl Iterator<Item = Point> {
        let [mips, layers] = ranges(self.declaration, access);
        let ([mip_cuts, layer_cuts], resource) = (&self.cuts[access.resource], access.resource);
        mip_cuts.range(mips).flat_map(move |&mip| layer_cuts.range(layers.clone()).map(move |&layer| (resource, mip, layer)))
    }
}

/// Mips and layers of an access.
fn ranges(declaration: &Declaration, access: &Access) -> [Range<u32>; 2] {
    let [mips, layers] = match &declaration.resources[access.resource].kind {
        ResourceKind::Texture(desc) if desc.dimension == TextureDimension::D3 => [desc.mip_level_count, 1],
        ResourceKind::Texture(desc) => [desc.mip_level_count, desc.size[2]],
        ResourceKind::Buffer(_) | ResourceKind::Tlas => [1, 1],
    };
    [access.part.mips_of(mips), access.part.layers_of(layers)]
}

/// Whether two accesses have something in common.
pub(super) fn overlap(declaration: &Declaration, a: &Access, b: &Access) -> bool {
    let [mine, other] = [a, b].map(|access| ranges(declaration, access));
    a.resource == b.resource && mine.iter().zip(&other).all(|(a, b)| a.start < b.end && b.start < a.end)
}
