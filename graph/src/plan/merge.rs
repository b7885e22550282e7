//! Passes that run as one: draws into the same attachments become one render pass, and clears become its loads.
//!
//! ```text
//!   recorded    clear depth   clear color   draw a      draw b      blur
//!                    └────────────┴──────────┐            │
//!   units                              [clear clear draw a draw b]  [blur]
//! ```
//!
//! A draw joins the unit before it if it attaches the same textures, keeps their contents, and neither reads nor writes
//! beside them what the other writes: a render pass has no barriers inside. A clear waits for the first use of what it
//! clears; if that is a draw that attaches it, it becomes the load operation there, else it is a pass of its own. Other
//! passes in between end a unit: what they do to memory must not be reordered here; the next phase may have moved
//! them apart already in recorded order.

use super::lifetimes::Lifetime;
use crate::declaration::{Access, Attachment, Declaration, Origin, PassDecl, PassKind, ResourceKind, Write};
use std::ops::Range;

/// The live passes, cut into units that run as one, in an order that respects every dependency.
#[derive(Debug)]
pub(super) struct Units {
    /// Passes, unit after unit.
    pub(super) passes: Vec<usize>,
    /// Where each unit begins in `passes`, and the end of the last.
    pub(super) starts: Vec<usize>,
}

impl Units {
    pub(super) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// The passes of one unit.
    pub(super) fn unit(&self, unit: usize) -> &[usize] {
        &self.passes[self.starts[unit]..self.starts[unit + 1]]
    }

    /// Passes and steps, for the units in the given order.
    pub(super) fn flatten(&self, sequence: &[u32]) -> (Vec<usize>, Vec<Range<usize>>) {
        let mut order = Vec::with_capacity(self.passes.len());
        let mut steps = Vec::with_capacity(self.len());
        for &unit in sequence {
            let first = order.len();
            order.extend_from_slice(self.unit(unit as usize));
            steps.push(first..order.len());
        }
        (order, steps)
    }
}

/// Units of the passes that run.
pub(super) fn merge(declaration: &Declaration, live: &[bool]) -> Units {
    let folded = fold_clears(declaration, live);
    let mut units = Units { passes: Vec::with_capacity(live.len()), starts: Vec::with_capacity(live.len() + 1) };
    let mut open: Option<Open> = None;
    for (index, pass) in declaration.passes.iter().enumerate().filter(|(index, _)| live[*index]) {
        if folded.iter().any(|&(clear, _)| clear == index) {
            continue;
        }
        let clears = folded.iter().filter(|&&(_, draw)| draw == index).map(|&(clear, _)| clear);
        let joins = open.as_ref().is_some_and(|open| open.takes(declaration, pass)) && clears.clone().next().is_none();
        if !joins {
            units.starts.push(units.passes.len());
            units.passes.extend(clears);
            open = is_draw(pass).then(|| Open { first: index, beside: Vec::new() });
        }
        if let Some(open) = &mut open {
            open.beside.extend(beside(pass).map(|(place, _)| (index, place)));
        }
        units.passes.push(index);
    }
    units.starts.push(units.passes.len());
    units
}

/// A unit of draws that may still grow.
struct Open {
    /// Its first draw: the one whose attachments count.
    first: usize,
    /// What its draws access beside their attachments: pass, and position among its accesses.
    beside: Vec<(usize, usize)>,
}

impl Open {
    /// Whether `pass` can run inside.
    fn takes(&self, declaration: &Declaration, pass: &PassDecl) -> bool {
        let keeps = attached(pass).all(|access| access.write == Write::Keep);
        let mut mine = attached(&declaration.passes[self.first]).map(place);
        let mut its = attached(pass).map(place);
        is_draw(pass) && keeps && mine.by_ref().eq(its.by_ref()) && {
            beside(pass).all(|(_, access)| {
                self.beside.iter().map(|&(other, place)| &declaration.passes[other].accesses[place]).all(|other| {
                    let shares = !(other.writes() || access.writes()) && other.exclusive == access.exclusive;
                    other.resource != access.resource || shares || !other.part.overlaps(access.part)
                })
            })
        }
    }
}

fn place(access: &Access) -> (Option<Attachment>, usize, crate::Subresources) {
    (access.attachment, access.resource, access.part)
}

fn attached(pass: &PassDecl) -> impl Iterator<Item = &Access> {
    pass.accesses.iter().filter(|access| access.attachment.is_some())
}

fn beside(pass: &PassDecl) -> impl Iterator<Item = (usize, &Access)> {
    pass.accesses.iter().enumerate().filter(|(_, access)| access.attachment.is_none())
}

/// A raster pass with attachments, which is not given a submission of its own.
fn is_draw(pass: &PassDecl) -> bool {
    pass.kind == PassKind::Raster && !pass.heavy && attached(pass).next().is_some() && !is_clear(pass)
}

/// A pass that does nothing but clear one texture.
fn is_clear(pass: &PassDecl) -> bool {
    pass.accesses.first().is_some_and(|access| access.attachment == Some(Attachment::Clear))
}

/// The clears that become load operations: clear, and the draw that loads what it cleared.
fn fold_clears(declaration: &Declaration, live: &[bool]) -> Vec<(usize, usize)> {
    let mut folded = Vec::new();
    // Clears that nothing has used yet.
    let mut waiting: Vec<(usize, &Access)> = Vec::new();
    for (index, pass) in declaration.passes.iter().enumerate().filter(|(index, _)| live[*index]) {
        let mut accesses = pass.accesses.iter();
        while let (false, Some(access)) = (waiting.is_empty(), accesses.next()) {
            waiting.retain(|&(clear, cleared)| {
                if cleared.resource != access.resource || !cleared.part.overlaps(access.part) {
                    return true;
                }
                let loads = is_draw(pass) && access.attachment.is_some() && access.write == Write::Keep;
                if loads && cleared.part == access.part {
                    folded.push((clear, index));
                }
                false
            });
        }
        if is_clear(pass) && !pass.pinned && !pass.heavy {
            waiting.extend(pass.accesses.iter().map(|access| (index, access)));
        }
    }
    folded
}

/// Marks textures that are only ever attached, within one render pass: nothing of them need reach memory. What is drawn
/// into them first clears them, as contents from before would be stale.
pub(super) fn transient_attachments(
    declaration: &Declaration,
    lifetimes: &[Option<Lifetime>],
    steps: &[Range<usize>],
    usages: &mut [u32],
) {
    for (index, resource) in declaration.resources.iter().enumerate() {
        let Some(lifetime) = lifetimes[index] else { continue };
        let step = steps.partition_point(|step| step.end <= lifetime.first);
        let attached = usages[index] == wgpu::TextureUsages::RENDER_ATTACHMENT.bits();
        // wgpu has transient textures of one mip and layer only, with no other formats.
        let texture = matches!(&resource.kind, ResourceKind::Texture(desc)
            if desc.mip_level_count == 1 && desc.size[2] == 1 && desc.view_formats.is_empty());
        let inside = steps.get(step).is_some_and(|step| lifetime.last < step.end);
        if texture && attached && inside && resource.origin == Origin::Transient && !resource.keep {
            usages[index] |= wgpu::TextureUsages::TRANSIENT_ATTACHMENT.bits();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Subresources;

    const COLOR: Option<Attachment> = Some(Attachment::Color(0));
    const CLEAR: Option<Attachment> = Some(Attachment::Clear);

    /// A frame of raster passes over textures 0 and 1 and the buffers 2 and 3: per pass its accesses as
    /// (resource, attachment, write).
    fn units(passes: &[&[(usize, Option<Attachment>, Write)]]) -> Vec<Vec<usize>> {
        let access = |&(resource, attachment, write): &(usize, Option<Attachment>, Write)| Access {
            attachment,
            ..Access::new(resource, "x", write != Write::Overwrite, write, 0)
        };
        merged(&passes.iter().map(|accesses| accesses.iter().map(access).collect()).collect::<Vec<_>>())
    }

    fn merged(passes: &[Vec<Access>]) -> Vec<Vec<usize>> {
        merged_as(passes, |_| {})
    }

    /// The same, the first pass changed.
    fn merged_as(passes: &[Vec<Access>], change: impl Fn(&mut PassDecl)) -> Vec<Vec<usize>> {
        let names = (0..passes.len()).map(|i| format!(r#"{{"name": "{i}", "kind": "raster"}}"#)).collect::<Vec<_>>().join(",");
        let texture = |n| {
            format!(r#"{{"name": "{n}", "kind": "texture", "origin": "transient", "format": "r32float", "size": [4, 4, 1]}}"#)
        };
        let buffer = |n| format!(r#"{{"name": "{n}", "kind": "buffer", "origin": "transient", "bytes": 4}}"#);
        let resources = [texture("a"), texture("b"), buffer("c"), buffer("d")].join(",");
        let frame = format!(r#"{{"frame": "f", "resources": [{resources}], "passes": [{names}]}}"#);
        let mut declaration = Declaration::from_frame_json(&frame).unwrap();
        for (pass, accesses) in declaration.passes.iter_mut().zip(passes) {
            pass.accesses.clone_from(accesses);
        }
        change(&mut declaration.passes[0]);
        let units = merge(&declaration, &vec![true; passes.len()]);
        (0..units.len()).map(|unit| units.unit(unit).to_vec()).collect()
    }

    #[test]
    fn draws_into_the_same_attachments_merge() {
        let (first, then) = ((0, COLOR, Write::Overwrite), (0, COLOR, Write::Keep));
        assert_eq!(units(&[&[first], &[then], &[then]]), [vec![0, 1, 2]]);
        assert_eq!(units(&[&[first], &[first]]), [[0], [1]], "the second clears");
        assert_eq!(units(&[&[first], &[(1, COLOR, Write::Overwrite)], &[then]]), [[0], [1], [2]], "another target between");
        let both = [(0, COLOR, Write::Keep), (1, Some(Attachment::Depth), Write::Keep)];
        assert_eq!(units(&[&[first], &both]), [[0], [1]], "another attachment");
    }

    #[test]
    fn what_a_draw_writes_beside_its_target_ends_the_unit() {
        let (first, then) = ((0, COLOR, Write::Overwrite), (0, COLOR, Write::Keep));
        let (reads, writes, other) = ((2, None, Write::No), (2, None, Write::Keep), (3, None, Write::Keep));
        assert_eq!(units(&[&[first, writes], &[then, reads]]), [[0], [1]], "no barrier inside a render pass");
        assert_eq!(units(&[&[first, reads], &[then, writes]]), [[0], [1]]);
        assert_eq!(units(&[&[first, writes], &[then], &[then, reads]]), [vec![0, 1], vec![2]], "nor over a draw between");
        assert_eq!(units(&[&[first, reads], &[then, reads, other]]), [vec![0, 1]]);
    }

    #[test]
    fn what_wgpu_takes_for_a_write_ends_the_unit_too() {
        let read = |exclusive| Access { exclusive, ..Access::new(2, "x", true, Write::No, 0) };
        let draw = |write| Access { attachment: COLOR, ..Access::new(0, "x", write == Write::Keep, write, 0) };
        let count = |first, second| {
            let passes = [vec![read(first), draw(Write::Overwrite)], vec![read(second), draw(Write::Keep)]];
            merged(&passes).len()
        };
        assert_eq!([count(false, true), count(true, false)], [2, 2], "a render pass sees a buffer in one state");
        assert_eq!([count(false, false), count(true, true)], [1, 1]);
    }

    #[test]
    fn only_plain_textures_are_transient_attachments() {
        let transient = |mips: u32, size: [u32; 3]| {
            let frame = format!(
                r#"{{"frame": "f", "resources": [{{"name": "a", "kind": "texture", "origin": "transient", "format": "r32float",
                    "size": {size:?}, "mips": {mips}}}], "passes": [{{"name": "p", "kind": "raster", "writes": [{{"resource": "a"}}]}}]}}"#
            );
            let declaration = Declaration::from_frame_json(&frame).unwrap();
            let mut usages = [wgpu::TextureUsages::RENDER_ATTACHMENT.bits()];
            transient_attachments(
                &declaration,
                &[Some(Lifetime { first: 0, last: 0 })],
                std::slice::from_ref(&(0..1)),
                &mut usages,
            );
            usages[0] & wgpu::TextureUsages::TRANSIENT_ATTACHMENT.bits() != 0
        };
        assert!(transient(1, [4, 4, 1]), "one mip and layer");
        assert!(!transient(2, [4, 4, 1]) && !transient(1, [4, 4, 2]), "wgpu has no others");
    }

    #[test]
    fn clears_become_loads_of_the_first_draw() {
        let (clear_a, clear_b) = ((0, CLEAR, Write::Overwrite), (1, CLEAR, Write::Overwrite));
        let both = [(0, COLOR, Write::Keep), (1, Some(Attachment::Depth), Write::Keep)];
        assert_eq!(units(&[&[clear_a], &[(2, None, Write::Keep)], &[clear_b], &both, &both]), [vec![1], vec![0, 2, 3, 4]]);
        let sampled = (0, None, Write::No);
        assert_eq!(units(&[&[clear_a], &[sampled]]), [[0], [1]], "first use is no attachment");
        let draw = (0, COLOR, Write::Keep);
        assert_eq!(units(&[&[draw], &[clear_a], &[draw]]), [vec![0], vec![1, 2]], "a clear begins a render pass");
    }

    #[test]
    fn a_clear_of_more_than_is_drawn_into_stays_a_pass() {
        let pass = |attachment, write, part| vec![Access { part, attachment, ..Access::new(0, "x", false, write, 0) }];
        let clear = |part| pass(CLEAR, Write::Overwrite, part);
        let draw = pass(COLOR, Write::Keep, Subresources::mip(0));
        assert_eq!(merged(&[clear(Subresources::mip(0)), draw.clone()]), [[0, 1]]);
        assert_eq!(merged(&[clear(Subresources::ALL), draw]), [[0], [1]], "a load would leave the other mips as they were");
    }

    #[test]
    fn a_clear_that_must_stand_where_it_does_stays_a_pass() {
        let pass = |attachment, write| vec![Access { attachment, ..Access::new(0, "x", false, write, 0) }];
        let passes = [pass(CLEAR, Write::Overwrite), pass(COLOR, Write::Keep)];
        assert_eq!(merged(&passes), [[0, 1]]);
        assert_eq!(merged_as(&passes, |clear| clear.pinned = true), [[0], [1]], "its place among pinned passes");
        assert_eq!(merged_as(&passes, |clear| clear.heavy = true), [[0], [1]], "its own submission");
    }
}
