//! Gives transient resources their memory.
//!
//! | [`Sharing`](super::Sharing) | textures | buffers |
//! |---|---|---|
//! | `Off` | each its own object | each its own object |
//! | `Exact` | one object for equal descriptions | one object for equal sizes |
//! | `Merged` | one object for descriptions of which one serves all ([`pool`]) | ranges of arenas ([`arena`]) |
//! | `Placed` | offsets of heaps ([`heap`]) | offsets of heaps |
//!
//! Two resources in use at the same position never share a byte, whichever way.

mod arena;
mod heap;
mod pack;
mod pool;

use super::{
    ALIGN, Need,
    lifetimes::{Lifetime, transient},
};
use crate::declaration::{Declaration, ResourceKind};
pub(super) use heap::heaps;
pub(super) use pool::{alone, exact};
use std::ops::Range;

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
pub(super) fn items(declaration: &Declaration, lifetimes: &[Option<Lifetime>], usages: &[u32]) -> Vec<Item> {
    let mut items: Vec<Item> = transient(declaration, lifetimes)
        .map(|(resource, lifetime)| {
            let (bytes, usage) = (declaration.resources[resource].bytes, usages[resource]);
            Item { resource, lifetime, bytes, usage }
        })
        .collect();
    items.sort_unstable_by_key(|item| (item.lifetime.first, item.resource));
    items
}

/// Textures in objects of merged descriptions, buffers in arenas.
pub(super) fn merged<'a>(
    declaration: &'a Declaration,
    order: &[usize],
    steps: &[Range<usize>],
    items: &'a [Item],
) -> Vec<Lot<'a>> {
    let is_texture = |item: &&Item| matches!(declaration.resources[item.resource].kind, ResourceKind::Texture(_));
    let mut lots = pool::textures(declaration, items.iter().filter(is_texture));
    lots.extend(arena::buffers(declaration, order, steps, items));
    lots
}

/// Whether it is a texture that has no memory outside its render pass.
fn is_transient_attachment(declaration: &Declaration, item: &Item) -> bool {
    matches!(declaration.resources[item.resource].kind, ResourceKind::Texture(_))
        && item.usage & wgpu::TextureUsages::TRANSIENT_ATTACHMENT.bits() != 0
}

/// A slot to be: its items with their offsets.
#[derive(Debug)]
pub(super) struct Lot<'a> {
    kind: SlotKind,
    bytes: u64,
    members: Vec<(&'a Item, u64)>,
}

impl<'a> Lot<'a> {
    /// An object for one item.
    fn object(item: &'a Item) -> Self {
        Self { kind: SlotKind::Object, bytes: item.bytes, members: vec![(item, 0)] }
    }
}

/// Bytes of all.
pub(super) fn bytes(lots: &[Lot<'_>]) -> u64 {
    lots.iter().fold(0, |total, lot| total.saturating_add(lot.bytes))
}

/// Where transient resources lie.
#[derive(Debug)]
pub(super) struct Placed {
    pub(super) slots: Vec<Slot>,
    pub(super) slot_of: Vec<Option<usize>>,
    pub(super) offsets: Vec<Option<u64>>,
}

impl Placed {
    /// Slots by time of first use.
    pub(super) fn new(declaration: &Declaration, mut lots: Vec<Lot<'_>>) -> Self {
        let by_time = |item: &Item| (item.lifetime.first, item.resource);
        for lot in &mut lots {
            lot.members.sort_unstable_by_key(|(item, _)| by_time(item));
        }
        lots.sort_unstable_by_key(|lot| lot.members.first().map(|(item, _)| by_time(item)));
        let resources = declaration.resources.len();
        let (mut slot_of, mut offsets) = (vec![None; resources], vec![None; resources]);
        let mut slots = Vec::with_capacity(lots.len());
        for lot in lots {
            let mut slot = Slot { kind: lot.kind, bytes: lot.bytes, usage: 0, resources: Vec::with_capacity(lot.members.len()) };
            for (item, offset) in lot.members {
                slot.usage |= item.usage;
                slot.resources.push(item.resource);
                slot_of[item.resource] = Some(slots.len());
                offsets[item.resource] = Some(offset);
            }
            slots.push(slot);
        }
        Self { slots, slot_of, offsets }
    }
}
