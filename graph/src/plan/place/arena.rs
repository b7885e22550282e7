//! Buffers as ranges of a few large ones.
//!
//! wgpu tracks the hazards of a buffer as a whole: within one step it may be written in one way, any number of times, or be
//! read, in any number of ways, but not both. So what a step reads may not lie in the arena that it writes, and the two ends
//! of a copy lie in different arenas. One arena is not enough for a pass that reads and writes; two mostly are:
//!
//! ```text
//!   step       0        1        2        3          arena 0 │ a  a  c  c        a and c share their range: lives apart
//!   reads               a        b        c                  │
//!   writes     a        b        c        d          arena 1 │    b  b  d        b and d too
//! ```
//!
//! Which buffer lies in which arena is a colouring: a buffer takes the first arena in which none of its steps sees both
//! kinds of use. Reads that go round in a ring of three need a third arena, and so on, up to [`MOST_ARENAS`]; what fits none
//! has an object of its own, and so has what no arena can hold, and what a closure uses, since that is handed a whole buffer.
//!
//! Rejected: one arena with a barrier by hand, which wgpu has not; one arena per usage, since most buffers are first written
//! and then read.

use super::{
    super::{
        merge::Units,
        uses::{Use, Uses},
    },
    ALIGN, Item, Lots, SlotKind, pack,
};
use crate::declaration::{Declaration, PassKind, ResourceDecl, ResourceKind};

/// No arena is larger (bytes): `max_buffer_size` of `WebGPU`'s default limits.
pub(in super::super) const LARGEST_ARENA: u64 = 256 << 20;

/// Colours at most.
const MOST_ARENAS: usize = 8;

/// How a step uses a buffer; a buffer object has one such state in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum How {
    #[default]
    Read,
    /// In a shader.
    Write,
    /// As the target of a copy or a clear.
    CopyTarget,
}

impl How {
    fn of(used: &Use) -> Self {
        match used.writes || used.exclusive {
            false => Self::Read,
            true if used.usage & wgpu::BufferUsages::COPY_DST.bits() != 0 => Self::CopyTarget,
            true => Self::Write,
        }
    }
}

/// Which buffers lie in which arena.
#[derive(Debug, Default)]
pub(super) struct Colours {
    /// Items of each, by time of first use.
    pub(super) members: Vec<Vec<u32>>,
    /// Items that lie in none.
    pub(super) apart: Vec<u32>,
}

impl Colours {
    /// Of the buffers among `items`.
    pub(super) fn new(uses: &BufferUses, items: &[Item], buffers: &[u32]) -> Self {
        // Unit to the arenas, as bits, that are used there in each of the three ways.
        let mut states = vec![[0_u8; 3]; uses.units];
        let mut colours = Self::default();
        for &buffer in buffers {
            let item = &items[buffer as usize];
            let uses_of = uses.of(item.resource);
            let taken = uses_of.iter().fold(0, |taken, &(unit, how)| {
                let state = states[unit as usize];
                taken | state[(how as usize + 1) % 3] | state[(how as usize + 2) % 3]
            });
            let colour = taken.trailing_ones() as usize;
            let fits = colour < MOST_ARENAS && item.bytes > 0 && item.bytes <= LARGEST_ARENA;
            if !fits || uses.by_closure[item.resource] {
                colours.apart.push(buffer);
                continue;
            }
            if colour == colours.members.len() {
                colours.members.push(Vec::with_capacity(buffers.len()));
            }
            for &(unit, how) in uses_of {
                states[unit as usize][how as usize] |= 1 << colour;
            }
            colours.members[colour].push(buffer);
        }
        colours
    }
}

/// Packs buffers of one colour into one arena, or into more where one would be too large.
pub(super) fn pack(items: &[Item], members: &[u32], lots: &mut Lots) {
    let mut members = members.to_vec();
    while !members.is_empty() {
        let blocks: Vec<pack::Block> = members
            .iter()
            .map(|&member| {
                let item = &items[member as usize];
                item.block(item.bytes, ALIGN)
            })
            .collect();
        let packing = pack::pack(&blocks, u64::MAX);
        let mut places = packing.offsets.iter().zip(&blocks);
        let arena = lots.open(SlotKind::Arena, 0);
        let mut height = 0;
        members.retain(|&member| {
            let Some((&offset, block)) = places.next() else { return false };
            let end = offset.saturating_add(block.bytes);
            let fits = end <= LARGEST_ARENA;
            if fits {
                height = height.max(end);
                lots.put(member, arena, offset);
            }
            !fits
        });
        lots.slots[arena as usize].1 = height;
    }
}

/// Per transient buffer: the units that use it, and how. A unit is what runs as one step, whatever the order.
#[derive(Debug)]
pub(in super::super) struct BufferUses {
    units: usize,
    /// By resource: where its entries of `found` begin.
    starts: Vec<u32>,
    found: Vec<(u32, How)>,
    /// By resource.
    by_closure: Vec<bool>,
}

impl BufferUses {
    pub(in super::super) fn new(declaration: &Declaration, uses: &Uses, units: &Units) -> Self {
        const NONE: u32 = u32::MAX;
        /// The last of `found` about it, for a resource that is no buffer.
        const OTHER: u32 = u32::MAX - 1;
        let is_buffer = |resource: &ResourceDecl| matches!(resource.kind, ResourceKind::Buffer(_));
        let resources = &declaration.resources;
        let mut last: Vec<u32> = resources.iter().map(|resource| if is_buffer(resource) { NONE } else { OTHER }).collect();
        let mut by_closure = vec![false; resources.len()];
        let mut found: Vec<(u32, u32, How)> = Vec::with_capacity(2 * resources.len());
        let mut starts = vec![0_u32; resources.len() + 2];
        for unit in 0..units.len() as u32 {
            for &pass in units.unit(unit as usize) {
                let is_closure = declaration.passes[pass].kind == PassKind::Closure;
                for used in uses.of(pass).iter().filter(|used| used.transient) {
                    let last = &mut last[used.resource as usize];
                    if *last == OTHER {
                        continue;
                    }
                    by_closure[used.resource as usize] |= is_closure;
                    // Several uses by one unit: what it writes, it writes.
                    match found.get_mut(*last as usize).filter(|(_, before, _)| *before == unit) {
                        Some((_, _, how)) if *how == How::Read => *how = How::of(used),
                        Some(_) => {}
                        None => {
                            *last = found.len() as u32;
                            found.push((used.resource, unit, How::of(used)));
                            starts[used.resource as usize + 2] += 1;
                        }
                    }
                }
            }
        }
        for at in 2..starts.len() {
            starts[at] += starts[at - 1];
        }
        let mut by_resource = vec![(0, How::Read); found.len()];
        for (resource, unit, how) in found {
            let at = &mut starts[resource as usize + 1];
            by_resource[*at as usize] = (unit, how);
            *at += 1;
        }
        Self { units: units.len(), starts, found: by_resource, by_closure }
    }

    fn of(&self, resource: usize) -> &[(u32, How)] {
        &self.found[self.starts[resource] as usize..self.starts[resource + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{Plan, PlanOptions, SlotKind, plan};
    use crate::{Declaration, declaration::PassKind};

    /// Buffers `r0`, `r1`, … of these bytes, and passes by what they read and write; `out` is imported and added to by all.
    fn frame(bytes: &[u64], passes: &[(&[usize], &[usize])]) -> Declaration {
        let name = |resource: &usize| format!("r{resource}");
        let mut resources = vec![serde_json::json!({"name": "out", "kind": "buffer", "origin": "imported", "bytes": 4})];
        resources.extend(
            (0..bytes.len())
                .map(|at| serde_json::json!({"name": name(&at), "kind": "buffer", "origin": "transient", "bytes": bytes[at]})),
        );
        let passes: Vec<serde_json::Value> = (0..)
            .zip(passes)
            .map(|(at, (reads, writes))| {
                let reads: Vec<String> = reads.iter().map(name).collect();
                let mut writes: Vec<_> = writes.iter().map(|write| serde_json::json!({"resource": name(write)})).collect();
                writes.push(serde_json::json!({"resource": "out", "preserve": true}));
                serde_json::json!({"name": format!("p{at}"), "kind": "compute", "reads": reads, "writes": writes})
            })
            .collect();
        let frame = serde_json::json!({"frame": "f", "resources": resources, "passes": passes});
        Declaration::from_frame_json(&frame.to_string()).unwrap()
    }

    fn planned(declaration: &Declaration) -> Plan {
        plan(declaration, &PlanOptions::default()).unwrap()
    }

    #[test]
    fn what_is_read_in_a_ring_of_three_takes_three_arenas() {
        // Each pair of the three meets in a step that reads one and writes the other.
        let plan = planned(&frame(&[512, 512, 512], &[(&[], &[0]), (&[0], &[1]), (&[0, 1], &[2]), (&[2], &[])]));
        assert_eq!(plan.slots.len(), 3, "{:?}", plan.slots);
        assert!(plan.slots.iter().all(|slot| slot.kind == SlotKind::Arena), "{:?}", plan.slots);
    }

    #[test]
    fn what_one_step_writes_lies_in_one_arena() {
        let plan = planned(&frame(&[512, 300, 512], &[(&[], &[0, 1, 2]), (&[0, 1, 2], &[])]));
        assert_eq!(plan.slots.len(), 1, "{:?}", plan.slots);
        assert_eq!((plan.offsets[1], plan.offsets[2], plan.offsets[3]), (Some(0), Some(1024), Some(512)));
        assert_eq!(plan.memory.pooled_bytes, 1324);
    }

    #[test]
    fn copies_and_stores_of_one_step_lie_apart() {
        let mut declaration = frame(&[512, 512], &[(&[], &[0, 1]), (&[0, 1], &[])]);
        let copy = wgpu::BufferUsages::COPY_DST.bits();
        declaration.passes[0].accesses.iter_mut().find(|access| access.resource == 2).unwrap().usage = copy;
        assert_eq!(planned(&declaration).slots.len(), 2);
    }

    #[test]
    fn what_wgpu_takes_for_a_write_lies_apart_from_what_is_read() {
        let mut declaration = frame(&[512, 512], &[(&[], &[0, 1]), (&[0, 1], &[])]);
        assert_eq!(planned(&declaration).slots.len(), 1, "both are read");
        declaration.passes[1].accesses.iter_mut().find(|access| access.resource == 1).unwrap().exclusive = true;
        assert_eq!(planned(&declaration).slots.len(), 2);
    }

    #[test]
    fn closures_and_what_is_too_large_have_objects_of_their_own() {
        let passes: [(&[usize], &[usize]); 3] = [(&[], &[0, 1, 2]), (&[0], &[]), (&[1, 2], &[])];
        let mut declaration = frame(&[512, 512, super::LARGEST_ARENA + 4], &passes);
        declaration.passes[1].kind = PassKind::Closure;
        let plan = planned(&declaration);
        let kind = |resource: usize| plan.slots[plan.slot_of[resource].unwrap()].kind;
        assert_eq!([kind(1), kind(2), kind(3)], [SlotKind::Object, SlotKind::Arena, SlotKind::Object]);
    }

    #[test]
    fn an_arena_that_would_be_too_large_is_two() {
        let half = super::LARGEST_ARENA / 2 + 256;
        let plan = planned(&frame(&[half, half], &[(&[], &[0, 1]), (&[0, 1], &[])]));
        let arenas: Vec<u64> = plan.slots.iter().filter(|slot| slot.kind == SlotKind::Arena).map(|slot| slot.bytes).collect();
        assert_eq!(arenas, [half, half]);
    }

    #[test]
    fn objects_are_taken_where_arenas_would_take_more() {
        // The second large one may not lie where the first was, since its writer reads what lies there now.
        let passes: [(&[usize], &[usize]); 5] = [(&[], &[0]), (&[0], &[]), (&[], &[1]), (&[1], &[2]), (&[2], &[])];
        let plan = planned(&frame(&[1024, 4, 1024], &passes));
        assert!(plan.slots.iter().all(|slot| slot.kind == SlotKind::Object), "{:?}", plan.slots);
        assert_eq!(plan.memory.pooled_bytes, 1024 + 4);
    }
}
