//! Gives transient resources their objects, and estimates what one shared heap would take.
//!
//! ```text
//!   position   0 1 2 3 4          slot 0: a, then c (same description, lifetimes apart)
//!   a          ■ ■                slot 1: b
//!   b            ■ ■
//!   c                ■ ■
//! ```

use super::{
    ALIGN, Need, Sharing,
    lifetimes::{Lifetime, transient},
};
use crate::declaration::{Declaration, ResourceKind};
use std::{
    cmp::Reverse,
    collections::{BinaryHeap, HashMap},
};

/// One object and the transient resources it holds.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct Slot {
    /// What kind of object it is.
    pub kind: SlotKind,
    /// Bytes.
    pub bytes: u64,
    /// Union of the wgpu usage bits.
    pub usage: u32,
    /// Resources, by time of first use.
    pub resources: Vec<usize>,
}

/// What a slot is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum SlotKind {
    /// A wgpu texture or buffer that holds its resources one after the other, each at offset 0.
    Object,
    /// A wgpu buffer of which resources are ranges.
    Arena,
    /// Memory in which textures and buffers lie at offsets.
    Heap,
}

impl SlotKind {
    /// Its name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Object => "object",
            Self::Arena => "arena",
            Self::Heap => "heap",
        }
    }
}

/// Where transient resources lie.
#[derive(Debug)]
pub(super) struct Placed {
    pub(super) slots: Vec<Slot>,
    pub(super) slot_of: Vec<Option<usize>>,
    pub(super) offsets: Vec<Option<u64>>,
}

impl Placed {
    /// Bytes of all slots.
    pub(super) fn bytes(&self) -> u64 {
        self.slots.iter().fold(0, |total, slot| total.saturating_add(slot.bytes))
    }
}

/// Resources with equal keys may share an object.
fn key(declaration: &Declaration, resource: usize, usage: u32) -> (ResourceKind, u64, u32) {
    let resource = &declaration.resources[resource];
    let mut kind = resource.kind.clone();
    if let ResourceKind::Buffer(desc) = &mut kind {
        // What lies in it does not matter to the memory.
        desc.element = None;
        desc.size = desc.padded();
    }
    (kind, resource.bytes, usage)
}

/// Last positions of slots, with the slots; earliest first.
type Ends = BinaryHeap<Reverse<(usize, usize)>>;

/// Slots, and the slot of each resource. By first use, each resource takes a free object of its description: for equal
/// descriptions that needs no more objects than are live at once.
pub(super) fn pool(declaration: &Declaration, lifetimes: &[Option<Lifetime>], usages: &[u32], sharing: Sharing) -> Placed {
    let mut items: Vec<(usize, Lifetime)> = transient(declaration, lifetimes).collect();
    items.sort_by_key(|(resource, lifetime)| (lifetime.first, *resource));
    let mut slots: Vec<Slot> = Vec::new();
    let mut slot_of = vec![None; declaration.resources.len()];
    let mut offsets = vec![None; declaration.resources.len()];
    // By description: the slots, earliest end first.
    let mut ends: HashMap<(ResourceKind, u64, u32), Ends> = HashMap::new();
    for (resource, lifetime) in items {
        let heap =
            ends.entry(key(declaration, resource, if sharing == Sharing::Exact { usages[resource] } else { 0 })).or_default();
        let slot = match heap.peek() {
            Some(&Reverse((end, slot))) if end < lifetime.first && sharing != Sharing::Off => {
                heap.pop();
                slot
            }
            _ => {
                let bytes = declaration.resources[resource].bytes;
                slots.push(Slot { kind: SlotKind::Object, bytes, usage: 0, resources: Vec::new() });
                slots.len() - 1
            }
        };
        heap.push(Reverse((lifetime.last, slot)));
        slots[slot].usage |= usages[resource];
        slots[slot].resources.push(resource);
        slot_of[resource] = Some(slot);
        offsets[resource] = Some(0);
    }
    Placed { slots, slot_of, offsets }
}

/// Beyond this many resources only the order of time is tried, whose cost is resources × live resources.
const SEARCH: usize = 2048;

#[derive(Clone, Copy)]
struct Block {
    resource: usize,
    lifetime: Lifetime,
    bytes: u64,
}

/// What blocks are sorted by, largest first.
type Order = fn(&Block) -> (u64, u64);

/// Offsets in one heap and its size: first fit, in several orders, the smallest result.
pub(super) fn heap(
    declaration: &Declaration,
    lifetimes: &[Option<Lifetime>],
    usages: &[u32],
    needs: &dyn Fn(usize, u32) -> Need,
) -> Placed {
    let by_time: Vec<Block> = {
        let mut blocks: Vec<Block> = transient(declaration, lifetimes)
            .map(|(resource, lifetime)| Block { resource, lifetime, bytes: needs(resource, usages[resource]).bytes })
            .collect();
        blocks.sort_by_key(|block| (block.lifetime.first, Reverse(block.bytes), block.resource));
        blocks
    };
    let mut best = first_fit_by_time(&by_time);
    let bound = 0;
    if by_time.len() <= SEARCH {
        let orders: [Order; 3] = [
            |block| (block.bytes, block.lifetime.last as u64 - block.lifetime.first as u64),
            |block| (block.bytes.saturating_mul(block.lifetime.last as u64 - block.lifetime.first as u64 + 1), block.bytes),
            |block| (block.lifetime.last as u64 - block.lifetime.first as u64, block.bytes),
        ];
        for order in orders {
            if best.1 == bound {
                break;
            }
            let mut blocks = by_time.clone();
            blocks.sort_by_key(|block| Reverse(order(block)));
            let found = first_fit(&blocks);
            if found.1 < best.1 {
                best = found;
            }
        }
    }
    let mut offsets = vec![None; declaration.resources.len()];
    let mut slot_of = vec![None; declaration.resources.len()];
    for (block, offset) in best.0 {
        offsets[block.resource] = Some(offset);
        slot_of[block.resource] = Some(0);
    }
    let resources = by_time.iter().map(|block| block.resource).collect();
    Placed { slots: vec![Slot { kind: SlotKind::Heap, bytes: best.1, usage: 0, resources }], slot_of, offsets }
}

type Fit = (Vec<(Block, u64)>, u64);

/// Each block at the lowest offset free over its whole life.
fn first_fit(blocks: &[Block]) -> Fit {
    let mut placed: Vec<(Block, u64)> = Vec::with_capacity(blocks.len());
    let mut size = 0;
    for &block in blocks {
        let mut taken: Vec<(u64, u64)> = placed
            .iter()
            .filter(|(other, _)| other.lifetime.overlaps(block.lifetime))
            .map(|(other, offset)| (*offset, offset.saturating_add(other.bytes)))
            .collect();
        taken.sort_unstable();
        let offset = gap(&taken, block.bytes);
        size = size.max(offset.saturating_add(block.bytes));
        placed.push((block, offset));
    }
    (placed, size)
}

/// As [`first_fit`] for blocks sorted by their first use, where only blocks in use can be in the way.
fn first_fit_by_time(blocks: &[Block]) -> Fit {
    let mut placed = Vec::with_capacity(blocks.len());
    let mut size = 0;
    // Sorted by offset: (offset, end, last position).
    let mut active: Vec<(u64, u64, usize)> = Vec::new();
    let mut taken = Vec::new();
    for &block in blocks {
        active.retain(|(_, _, last)| *last >= block.lifetime.first);
        taken.clear();
        taken.extend(active.iter().map(|(offset, end, _)| (*offset, *end)));
        let offset = gap(&taken, block.bytes);
        let end = offset.saturating_add(block.bytes);
        size = size.max(end);
        let at = active.partition_point(|(other, ..)| *other < offset);
        active.insert(at, (offset, end, block.lifetime.last));
        placed.push((block, offset));
    }
    (placed, size)
}

/// The lowest aligned offset at which `bytes` lie clear of the sorted ranges `taken`.
fn gap(taken: &[(u64, u64)], bytes: u64) -> u64 {
    let mut offset = 0_u64;
    for &(start, end) in taken {
        if offset.saturating_add(bytes) <= start {
            break;
        }
        offset = offset.max(end.checked_next_multiple_of(ALIGN).unwrap_or(u64::MAX));
    }
    offset
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(resource: usize, first: usize, last: usize, bytes: u64) -> Block {
        Block { resource, lifetime: Lifetime { first, last }, bytes }
    }

    #[test]
    fn gaps_are_aligned_and_large_enough() {
        assert_eq!(gap(&[], 10), 0);
        assert_eq!(gap(&[(0, 100)], 10), 256, "the next multiple of 256");
        assert_eq!(gap(&[(256, 300)], 256), 0, "the front is free");
        assert_eq!(gap(&[(256, 300)], 257), 512, "too long for the front");
        assert_eq!(gap(&[(0, 10), (1024, 1100)], 768), 256, "fits between");
        assert_eq!(gap(&[(0, u64::MAX)], 1), u64::MAX, "saturates");
    }

    #[test]
    fn blocks_whose_lives_are_apart_share_an_offset() {
        let blocks = [block(0, 0, 1, 512), block(1, 1, 2, 256), block(2, 2, 3, 512)];
        for (placed, size) in [first_fit(&blocks), first_fit_by_time(&blocks)] {
            assert_eq!(placed.iter().map(|(_, offset)| *offset).collect::<Vec<_>>(), [0, 512, 0]);
            assert_eq!(size, 768);
        }
    }
}
