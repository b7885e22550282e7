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

use super::{ALIGN, Item, Lot, SlotKind, bytes, pack, pool};
use crate::declaration::{Access, Declaration, PassKind, ResourceKind};
use std::ops::Range;

/// No arena is larger (bytes): `max_buffer_size` of `WebGPU`'s default limits.
pub(in super::super) const LARGEST_ARENA: u64 = 256 << 20;

/// Colours at most.
const MOST_ARENAS: usize = 8;

/// How a step uses a buffer; a buffer object has one such state in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Use {
    #[default]
    No,
    Read,
    /// In a shader.
    Write,
    /// As the target of a copy or a clear.
    CopyTarget,
}

impl Use {
    fn of(access: &Access) -> Self {
        match access.writes() || access.exclusive {
            false => Self::Read,
            true if access.usage & wgpu::BufferUsages::COPY_DST.bits() != 0 => Self::CopyTarget,
            true => Self::Write,
        }
    }
}

/// Places all buffers among `items`: in arenas, or in objects of equal size where those take less.
pub(super) fn buffers<'a>(declaration: &Declaration, order: &[usize], steps: &[Range<usize>], items: &'a [Item]) -> Vec<Lot<'a>> {
    let is_buffer = |item: &&Item| matches!(declaration.resources[item.resource].kind, ResourceKind::Buffer(_));
    let buffers: Vec<&Item> = items.iter().filter(is_buffer).collect();
    if buffers.is_empty() {
        return Vec::new();
    }
    let uses = Uses::new(declaration, order, steps, &buffers);
    let mut colours: Vec<Vec<Use>> = Vec::new();
    let mut members: Vec<Vec<&Item>> = Vec::new();
    let mut whole: Vec<&Item> = Vec::new();
    for (index, &item) in buffers.iter().enumerate() {
        if uses.by_closure[index] || item.bytes == 0 || item.bytes > LARGEST_ARENA {
            whole.push(item);
            continue;
        }
        let uses = uses.of(index);
        let fits = |states: &Vec<Use>| uses.iter().all(|&(step, how)| [Use::No, how].contains(&states[step as usize]));
        let colour = colours.iter().position(fits).unwrap_or(colours.len());
        if colour == MOST_ARENAS {
            whole.push(item);
            continue;
        }
        if colour == colours.len() {
            colours.push(vec![Use::No; steps.len()]);
            members.push(Vec::new());
        }
        for &(step, how) in uses {
            colours[colour][step as usize] = how;
        }
        members[colour].push(item);
    }
    let mut in_arenas: Vec<Lot<'_>> = members.into_iter().flat_map(arenas).collect();
    in_arenas.extend(pool::buffers(whole.into_iter()));
    let objects = pool::buffers(buffers.into_iter());
    if bytes(&in_arenas) <= bytes(&objects) { in_arenas } else { objects }
}

/// Packs buffers of one colour into one arena, or into more where one would be too large.
fn arenas(mut items: Vec<&Item>) -> Vec<Lot<'_>> {
    let mut lots = Vec::new();
    while !items.is_empty() {
        let blocks: Vec<pack::Block> = items.iter().map(|item| item.block(item.bytes, ALIGN)).collect();
        let mut lot = Lot { kind: SlotKind::Arena, bytes: 0, members: Vec::with_capacity(items.len()) };
        let mut left = Vec::new();
        for (item, offset) in items.into_iter().zip(pack::pack(&blocks, u64::MAX).offsets) {
            let end = offset.saturating_add(item.bytes);
            if end <= LARGEST_ARENA {
                lot.bytes = lot.bytes.max(end);
                lot.members.push((item, offset));
            } else {
                left.push(item);
            }
        }
        lots.push(lot);
        items = left;
    }
    lots
}

/// Per buffer: the steps that use it, and how.
#[derive(Debug)]
struct Uses {
    starts: Vec<usize>,
    found: Vec<(u32, Use)>,
    by_closure: Vec<bool>,
}

impl Uses {
    fn new(declaration: &Declaration, order: &[usize], steps: &[Range<usize>], buffers: &[&Item]) -> Self {
        let mut index_of = vec![u32::MAX; declaration.resources.len()];
        for (index, item) in buffers.iter().enumerate() {
            index_of[item.resource] = index as u32;
        }
        let mut by_closure = vec![false; buffers.len()];
        let mut found: Vec<(u32, u32, Use)> = Vec::new();
        for (step, positions) in steps.iter().enumerate() {
            let before = found.len();
            for pass in order[positions.clone()].iter().map(|&pass| &declaration.passes[pass]) {
                for access in &pass.accesses {
                    let index = index_of[access.resource];
                    if index == u32::MAX {
                        continue;
                    }
                    by_closure[index as usize] |= pass.kind == PassKind::Closure;
                    // Several uses by one step: what it writes, it writes.
                    match found[before..].iter_mut().find(|(other, ..)| *other == index) {
                        Some((_, _, how)) if *how == Use::Read => *how = Use::of(access),
                        Some(_) => {}
                        None => found.push((index, step as u32, Use::of(access))),
                    }
                }
            }
        }
        let mut starts = vec![0; buffers.len() + 2];
        for (index, ..) in &found {
            starts[*index as usize + 2] += 1;
        }
        for at in 2..starts.len() {
            starts[at] += starts[at - 1];
        }
        let mut by_buffer = vec![(0, Use::No); found.len()];
        for (index, step, how) in found {
            let at = &mut starts[index as usize + 1];
            by_buffer[*at] = (step, how);
            *at += 1;
        }
        Self { starts, found: by_buffer, by_closure }
    }

    fn of(&self, index: usize) -> &[(u32, Use)] {
        &self.found[self.starts[index]..self.starts[index + 1]]
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
