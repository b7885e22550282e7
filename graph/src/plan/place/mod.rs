//! Gives transient resources their memory.
//!
//! | [`Sharing`](super::Sharing) | textures | buffers |
//! |---|---|---|
//! | `Off` | each its own object | each its own object |
//! | `Exact` | one object for equal descriptions | one object for equal sizes |
//! | `Merged` ([`merged`]) | one object for descriptions of which one serves all ([`pool`]) | ranges of arenas ([`arena`]) |
//! | `Placed` | offsets of heaps ([`heap`]) | offsets of heaps |
//!
//! Two resources in use at the same position never share a byte, whichever way.

mod arena;
mod heap;
mod merged;
mod pack;
mod pool;

use super::{
    ALIGN, Need,
    lifetimes::{Lifetime, transient},
    timeline::Timeline,
};
use crate::declaration::{Declaration, ResourceKind};
pub(super) use arena::BufferUses;
pub(super) use heap::heaps;
pub(super) use merged::{Draft, least};
pub(super) use pool::{alone, exact};

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

/// A transient resource in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Item {
    /// Its index.
    resource: usize,
    lifetime: Lifetime,
    bytes: u64,
    /// wgpu usage bits of the passes that run.
    usage: u32,
}

impl Item {
    fn block(&self, bytes: u64, align: u64) -> pack::Block {
        pack::Block { first: self.lifetime.first, last: self.lifetime.last, bytes, align }
    }
}

/// The transient resources in use, by time of first use.
pub(super) fn items(declaration: &Declaration, timeline: &Timeline, usages: &[u32]) -> Vec<Item> {
    // A counting sort by the first position: those of one position stay in the order of resources.
    let mut starts = vec![0_u32; timeline.order.len() + 1];
    for (_, lifetime) in transient(declaration, &timeline.lifetimes) {
        starts[lifetime.first + 1] += 1;
    }
    for at in 1..starts.len() {
        starts[at] += starts[at - 1];
    }
    let count = starts.last().map_or(0, |&count| count as usize);
    let mut items = vec![Item { resource: 0, lifetime: Lifetime { first: 0, last: 0 }, bytes: 0, usage: 0 }; count];
    for (resource, lifetime) in transient(declaration, &timeline.lifetimes) {
        let (bytes, usage) = (declaration.resources[resource].bytes, usages[resource]);
        let at = &mut starts[lifetime.first];
        items[*at as usize] = Item { resource, lifetime, bytes, usage };
        *at += 1;
    }
    items
}

/// Whether it is a texture that has no memory outside its render pass.
fn is_transient_attachment(declaration: &Declaration, item: &Item) -> bool {
    matches!(declaration.resources[item.resource].kind, ResourceKind::Texture(_))
        && item.usage & wgpu::TextureUsages::TRANSIENT_ATTACHMENT.bits() != 0
}

/// Slots to be, and where the items lie in them.
#[derive(Clone, Debug, Default)]
pub(super) struct Lots {
    /// What each is, and its bytes.
    slots: Vec<(SlotKind, u64)>,
    /// Item to its lot and its offset there. Items that have none yet are at [`NOWHERE`].
    places: Vec<(u32, u64)>,
}

/// No lot.
const NOWHERE: u32 = u32::MAX;

impl Lots {
    /// None, for so many items.
    fn new(items: usize) -> Self {
        Self { slots: Vec::new(), places: vec![(NOWHERE, 0); items] }
    }

    /// One more.
    fn open(&mut self, kind: SlotKind, bytes: u64) -> u32 {
        self.slots.push((kind, bytes));
        self.slots.len() as u32 - 1
    }

    /// An object for one item.
    fn object(&mut self, items: &[Item], item: u32) -> u32 {
        let lot = self.open(SlotKind::Object, items[item as usize].bytes);
        self.put(item, lot, 0);
        lot
    }

    fn put(&mut self, item: u32, lot: u32, offset: u64) {
        self.places[item as usize] = (lot, offset);
    }

    /// Adds the lots of other items.
    fn join(&mut self, other: &Self) {
        let first = self.slots.len() as u32;
        self.slots.extend_from_slice(&other.slots);
        for (place, &(lot, offset)) in self.places.iter_mut().zip(&other.places) {
            if lot != NOWHERE {
                *place = (first + lot, offset);
            }
        }
    }

    /// Bytes of all.
    pub(super) fn bytes(&self) -> u64 {
        self.slots.iter().fold(0, |total, (_, bytes)| total.saturating_add(*bytes))
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
    /// Slots by time of first use, which is the order of the items.
    pub(super) fn new(resources: usize, items: &[Item], lots: &Lots) -> Self {
        let mut members = vec![0_u32; lots.slots.len()];
        for &(lot, _) in &lots.places {
            members[lot as usize] += 1;
        }
        let mut opened = vec![NOWHERE; lots.slots.len()];
        let mut slots: Vec<Slot> = Vec::with_capacity(lots.slots.len());
        let (mut slot_of, mut offsets) = (vec![None; resources], vec![None; resources]);
        for (item, &(lot, offset)) in items.iter().zip(&lots.places) {
            let slot = &mut opened[lot as usize];
            if *slot == NOWHERE {
                *slot = slots.len() as u32;
                let (kind, bytes) = lots.slots[lot as usize];
                let resources = Vec::with_capacity(members[lot as usize] as usize);
                slots.push(Slot { kind, bytes, usage: 0, resources });
            }
            let index = *slot as usize;
            slots[index].usage |= item.usage;
            slots[index].resources.push(item.resource);
            slot_of[item.resource] = Some(index);
            offsets[item.resource] = Some(offset);
        }
        Self { slots, slot_of, offsets }
    }
}
