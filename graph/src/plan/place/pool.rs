//! Objects that hold resources one after the other, on every backend.
//!
//! ```text
//!   position   0 1 2 3 4          slot 0: a, then c (same description, lifetimes apart)
//!   a          ■ ■                slot 1: b
//!   b            ■ ■
//!   c                ■ ■
//! ```
//!
//! Among resources of equal description, each takes a free object by time of first use; that needs no more objects than are
//! alive at once. A texture may also serve one with fewer mips or layers: there the largest choose first, and the small move
//! into the times they leave. An object is added only when all those of the same description are busy, so this never takes
//! more than equal descriptions would.

use super::{Item, Lot, is_transient_attachment};
use crate::{
    TextureDesc,
    declaration::{Declaration, ResourceKind},
};
use std::{
    cmp::Reverse,
    collections::{BinaryHeap, HashMap},
    hash::{BuildHasherDefault, Hash, Hasher},
};

/// Each its own object.
pub(in super::super) fn alone(items: &[Item]) -> Vec<Lot<'_>> {
    items.iter().map(Lot::object).collect()
}

/// One object for resources of equal description and usages.
pub(in super::super) fn exact<'a>(declaration: &'a Declaration, items: &'a [Item]) -> Vec<Lot<'a>> {
    let groups = groups(items.iter(), |item| (texture(declaration, item), words(item), item.usage));
    groups.into_iter().flat_map(in_turn).collect()
}

/// One object for textures of which one description serves all.
pub(super) fn textures<'a>(declaration: &'a Declaration, items: impl Iterator<Item = &'a Item>) -> Vec<Lot<'a>> {
    let mut lots = Vec::new();
    for group in groups(items, |item| {
        let desc = texture(declaration, item)?;
        // A volume has no layers to leave out.
        let flat = desc.dimension == wgpu::TextureDimension::D2;
        let extent = [desc.size[0], desc.size[1], if flat { 1 } else { desc.size[2] }];
        let mips = if flat { 1 } else { desc.mip_level_count };
        let one_pass = is_transient_attachment(declaration, item);
        Some((extent, mips, desc.sample_count, desc.dimension, desc.format, one_pass))
    }) {
        let room = |item: &Item| Room::of(declaration, item);
        if group.iter().all(|item| room(item) == room(group[0])) {
            lots.extend(in_turn(group));
            continue;
        }
        lots.extend(largest_first(group, room));
    }
    lots
}

/// One object for buffers of equal size.
pub(super) fn buffers<'a>(items: impl Iterator<Item = &'a Item>) -> Vec<Lot<'a>> {
    groups(items, words).into_iter().flat_map(in_turn).collect()
}

fn texture<'a>(declaration: &'a Declaration, item: &Item) -> Option<&'a TextureDesc> {
    match &declaration.resources[item.resource].kind {
        ResourceKind::Texture(desc) => Some(desc),
        ResourceKind::Buffer(_) | ResourceKind::Tlas => None,
    }
}

/// The bytes, in whole words: wgpu makes no other buffers.
fn words(item: &Item) -> u64 {
    item.bytes.saturating_add(3) & !3
}

/// What one texture must have at least as much of as another to serve it, all else being equal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
struct Room {
    bytes: u64,
    mips: u32,
    layers: u32,
}

impl Room {
    fn of(declaration: &Declaration, item: &Item) -> Self {
        let (mips, layers) = texture(declaration, item).map_or((1, 1), |desc| (desc.mip_level_count, desc.size[2]));
        Self { bytes: item.bytes, mips, layers }
    }

    fn serves(self, other: Self) -> bool {
        self.bytes >= other.bytes && self.mips >= other.mips && self.layers >= other.layers
    }
}

/// Items by key, in order of the first of each.
fn groups<'a, K: Hash + Eq>(items: impl Iterator<Item = &'a Item>, key: impl Fn(&'a Item) -> K) -> Vec<Vec<&'a Item>> {
    let mut groups: Vec<Vec<&Item>> = Vec::new();
    let mut index: HashMap<K, usize, BuildHasherDefault<Mix>> =
        HashMap::with_capacity_and_hasher(64, BuildHasherDefault::default());
    for item in items {
        let group = *index.entry(key(item)).or_insert(groups.len());
        if group == groups.len() {
            groups.push(Vec::new());
        }
        groups[group].push(item);
    }
    groups
}

/// Hashes descriptions: a few small numbers that nobody chooses against us, so a multiplication for each will do.
#[derive(Default)]
struct Mix(u64);

impl Hasher for Mix {
    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(byte.into());
        }
    }

    fn write_u32(&mut self, word: u32) {
        self.write_u64(word.into());
    }

    fn write_u64(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(23);
    }

    fn write_usize(&mut self, word: usize) {
        self.write_u64(word as u64);
    }

    fn write_isize(&mut self, word: isize) {
        self.write_u64(word as u64);
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

/// Items by first use; each takes the object that has been free longest.
fn in_turn(items: Vec<&Item>) -> Vec<Lot<'_>> {
    if let [item] = items[..] {
        return vec![Lot::object(item)];
    }
    let mut lots: Vec<Lot<'_>> = Vec::new();
    // Last positions of lots, with the lots; earliest first.
    let mut ends: BinaryHeap<Reverse<(usize, usize)>> = BinaryHeap::new();
    for item in items {
        let lot = match ends.peek() {
            Some(&Reverse((end, lot))) if end < item.lifetime.first => {
                ends.pop();
                lots[lot].members.push((item, 0));
                lot
            }
            _ => {
                lots.push(Lot::object(item));
                lots.len() - 1
            }
        };
        ends.push(Reverse((item.lifetime.last, lot)));
    }
    lots
}

/// The largest first, equal ones by first use; each takes the first object that is free over its life and has room for it.
fn largest_first(mut items: Vec<&Item>, room: impl Fn(&Item) -> Room) -> Vec<Lot<'_>> {
    items.sort_by_key(|&item| (Reverse(room(item)), item.lifetime.first));
    let mut lots: Vec<Lot<'_>> = Vec::new();
    // Per lot: its room, and the lives it holds, sorted.
    let mut held: Vec<(Room, Vec<(usize, usize)>)> = Vec::new();
    for item in items {
        let (wanted, life) = (room(item), (item.lifetime.first, item.lifetime.last));
        let found = held.iter_mut().position(|(room, lives)| {
            let at = lives.partition_point(|other| other.0 < life.0);
            let free = (at == 0 || lives[at - 1].1 < life.0) && lives.get(at).is_none_or(|next| life.1 < next.0);
            let fits = free && room.serves(wanted);
            if fits {
                lives.insert(at, life);
            }
            fits
        });
        if let Some(lot) = found {
            lots[lot].members.push((item, 0));
        } else {
            lots.push(Lot::object(item));
            held.push((wanted, vec![life]));
        }
    }
    lots
}

#[cfg(test)]
mod tests {
    use super::super::super::{Plan, PlanOptions, plan};
    use crate::Declaration;

    /// Textures of these (mips, layers), each written by one pass and read by the next, which lets it go.
    fn one_after_the_other(shapes: &[(u32, u32)]) -> Plan {
        let mut resources = vec![r#"{"name": "out", "kind": "buffer", "origin": "imported", "bytes": 4}"#.to_owned()];
        let mut passes = Vec::new();
        for (at, (mips, layers)) in shapes.iter().enumerate() {
            resources.push(format!(
                r#"{{"name": "r{at}", "kind": "texture", "origin": "transient", "format": "r32float", "size": [64, 64, {layers}], "mips": {mips}}}"#
            ));
            passes.push(format!(r#"{{"name": "w{at}", "kind": "compute", "writes": [{{"resource": "r{at}"}}]}}"#));
            passes.push(format!(
                r#"{{"name": "u{at}", "kind": "compute", "reads": ["r{at}"], "writes": [{{"resource": "out", "preserve": true}}]}}"#
            ));
        }
        let (resources, passes) = (resources.join(","), passes.join(","));
        let frame = format!(r#"{{"frame": "f", "resources": [{resources}], "passes": [{passes}]}}"#);
        plan(&Declaration::from_frame_json(&frame).unwrap(), &PlanOptions::default()).unwrap()
    }

    #[test]
    fn a_texture_serves_those_with_fewer_mips_or_layers() {
        let plan = one_after_the_other(&[(1, 1), (4, 2), (2, 1), (1, 2)]);
        assert_eq!(plan.slots.len(), 1, "{:?}", plan.slots);
        assert_eq!(plan.slots[0].resources, [1, 2, 3, 4]);
        assert_eq!(plan.memory.pooled_bytes, 2 * 4 * (64 * 64 + 32 * 32 + 16 * 16 + 8 * 8), "as large as the largest");
    }

    #[test]
    fn of_two_textures_that_each_have_more_of_something_neither_serves_the_other() {
        assert_eq!(one_after_the_other(&[(4, 1), (1, 4)]).slots.len(), 2);
    }
}
