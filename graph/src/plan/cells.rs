//! The parts of resources that a frame tells apart: what is read and written on its own.
//!
//! A resource that is only used whole is one cell. One of which passes use single mips or layers is cut at every edge of
//! such a part, so a mip chain of twelve levels is twelve cells, and a pass that uses all of it covers them all.
//!
//! ```text
//!   accesses of a texture        cells (mips →, layers ↓)
//!     mip 0, mips 1…3, layer 2     │0│1 2 3│      0 | 1
//!                                  │─┼─────│      2 | 3     (layer 2)
//! ```

use crate::declaration::{Access, Declaration, ResourceKind};
use std::ops::Range;

/// Cells of all resources, numbered through.
#[derive(Debug)]
pub(crate) struct Cells {
    /// How many there are.
    count: usize,
    /// Per resource its first cell, and `count` at the end; empty where each resource is one cell.
    first: Vec<u32>,
    /// Cuts of the resources that have any, by resource.
    cuts: Vec<(usize, Cuts)>,
}

/// Where a resource is cut: the first mip and layer of each row and column of cells, and the ends.
#[derive(Debug, Default)]
struct Cuts {
    mips: Vec<u32>,
    layers: Vec<u32>,
}

impl Cells {
    /// The cells of a declaration whose indices are sound.
    pub(crate) fn new(declaration: &Declaration) -> Self {
        let mut cuts: Vec<(usize, Cuts)> = Vec::new();
        for access in declaration.passes.iter().flat_map(|pass| &pass.accesses).filter(|access| !access.part.is_all()) {
            let [mip_count, layer_count] = counts(declaration, access.resource);
            let at = match cuts.binary_search_by_key(&access.resource, |(resource, _)| *resource) {
                Ok(at) => at,
                Err(at) => {
                    let whole = Cuts { mips: vec![0, mip_count], layers: vec![0, layer_count] };
                    cuts.insert(at, (access.resource, whole));
                    at
                }
            };
            let cut = &mut cuts[at].1;
            let (mips, layers) = (access.part.mips_of(mip_count), access.part.layers_of(layer_count));
            cut.mips.extend([mips.start.min(mip_count), mips.end]);
            cut.layers.extend([layers.start.min(layer_count), layers.end]);
        }
        for axis in cuts.iter_mut().flat_map(|(_, cut)| [&mut cut.mips, &mut cut.layers]) {
            axis.sort_unstable();
            axis.dedup();
        }
        let mut first = Vec::with_capacity(declaration.resources.len() + 1);
        let mut next = 0;
        let mut cut = cuts.iter().peekable();
        for resource in 0..declaration.resources.len() {
            first.push(next);
            next += match cut.next_if(|(of, _)| *of == resource) {
                Some((_, cut)) => ((cut.mips.len() - 1) * (cut.layers.len() - 1)) as u32,
                None => 1,
            };
        }
        first.push(next);
        Self { count: next as usize, first, cuts }
    }

    /// One for each of so many resources.
    pub(crate) fn uncut(resources: usize) -> Self {
        Self { count: resources, first: Vec::new(), cuts: Vec::new() }
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.count
    }

    /// The cells of a whole resource.
    pub(crate) fn of_resource(&self, resource: usize) -> Range<usize> {
        if self.first.is_empty() {
            return resource..resource + 1;
        }
        self.first[resource] as usize..self.first[resource + 1] as usize
    }

    /// The cells of an access, as rows without gaps: one row, unless it leaves out layers of several mips.
    #[inline]
    pub(crate) fn of(&self, access: &Access) -> impl Iterator<Item = Range<usize>> + use<> {
        let all = self.of_resource(access.resource);
        let (first, width, rows, stride) =
            if access.part.is_all() || all.len() == 1 { (all.start, all.len(), 1, 0) } else { self.part(access) };
        (0..rows).map(move |row| first + row * stride..first + row * stride + width)
    }

    /// First cell, width, number, and distance of the rows.
    fn part(&self, access: &Access) -> (usize, usize, usize, usize) {
        let Ok(at) = self.cuts.binary_search_by_key(&access.resource, |(resource, _)| *resource) else {
            return (0, 0, 0, 0);
        };
        let cut = &self.cuts[at].1;
        let inside = |axis: &[u32], [start, end]: [u32; 2]| {
            let last = axis.len() - 1;
            let first = axis.partition_point(|&edge| edge < start).min(last);
            first..axis[..last].partition_point(|&edge| edge < end).max(first)
        };
        let (mips, layers) = (inside(&cut.mips, access.part.mips), inside(&cut.layers, access.part.layers));
        let stride = cut.layers.len() - 1;
        let first = self.first[access.resource] as usize + mips.start * stride + layers.start;
        if layers.len() == stride { (first, mips.len() * stride, 1, 0) } else { (first, layers.len(), mips.len(), stride) }
    }
}

/// Mip levels and layers of a resource; 3D textures and buffers have one layer.
pub(crate) fn counts(declaration: &Declaration, resource: usize) -> [u32; 2] {
    match &declaration.resources[resource].kind {
        ResourceKind::Texture(desc) if desc.dimension == wgpu::TextureDimension::D3 => [desc.mip_level_count, 1],
        ResourceKind::Texture(desc) => [desc.mip_level_count, desc.size[2]],
        ResourceKind::Buffer(_) | ResourceKind::Tlas => [1, 1],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Subresources, declaration::Write};

    #[test]
    fn resources_are_cut_where_passes_use_parts() {
        let frame = r#"{"frame": "f",
            "resources": [{"name": "a", "kind": "buffer", "origin": "transient", "bytes": 4},
                          {"name": "t", "kind": "texture", "origin": "transient", "format": "r32float", "size": [8, 8, 3], "mips": 4},
                          {"name": "z", "kind": "buffer", "origin": "transient", "bytes": 4}],
            "passes": [{"name": "p", "kind": "compute"}]}"#;
        let mut declaration = Declaration::from_frame_json(frame).unwrap();
        let access = |resource, part| Access { part, ..Access::new(resource, "x", true, Write::No, 0) };
        let parts = [Subresources::mip(0), Subresources::mips(1..4).layer(2), Subresources::ALL];
        declaration.passes[0].accesses = parts.iter().map(|&part| access(1, part)).collect();
        let cells = Cells::new(&declaration);
        assert_eq!(cells.len(), 1 + 4 + 1);
        let of = |resource, part| cells.of(&access(resource, part)).flatten().collect::<Vec<_>>();
        assert_eq!(of(0, Subresources::ALL), [0]);
        assert_eq!(of(2, Subresources::ALL), [5]);
        assert_eq!(of(1, Subresources::mip(0)), [1, 2], "mip 0: layers 0…1, and layer 2");
        assert_eq!(of(1, Subresources::mips(1..4).layer(2)), [4]);
        assert_eq!(of(1, Subresources::ALL), [1, 2, 3, 4]);
        assert_eq!(of(1, Subresources::mip(9)), Vec::<usize>::new(), "outside is nothing");
    }
}
