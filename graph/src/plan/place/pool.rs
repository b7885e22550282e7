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

use super::{Item, Lots, is_transient_attachment};
use crate::{
    TextureDesc,
    declaration::{Declaration, ResourceKind},
    hash::FoldedMap,
};
use std::{cmp::Reverse, collections::BinaryHeap, hash::Hash};

/// Each its own object.
pub(in super::super) fn alone(items: &[Item]) -> Lots {
    let mut lots = Lots::new(items.len());
    lots.slots.reserve(items.len());
    for item in 0..items.len() as u32 {
        lots.object(items, item);
    }
    lots
}

/// One object for resources of equal description and usages.
pub(in super::super) fn exact(declaration: &Declaration, items: &[Item]) -> Lots {
    let mut lots = Lots::new(items.len());
    let all: Vec<u32> = (0..items.len() as u32).collect();
    let groups = Groups::new(items, &all, |item| (texture(declaration, item), words(item), item.usage));
    let mut turns = Turns::default();
    groups.iter().for_each(|group| turns.share(items, group.iter().copied(), &mut lots));
    lots
}

/// One object for textures of which one description serves all.
pub(super) fn textures(declaration: &Declaration, items: &[Item], textures: &[u32], lots: &mut Lots) {
    let mut turns = Turns::default();
    let groups = Groups::new(items, textures, |item| {
        let desc = texture(declaration, item)?;
        // A volume has no layers to leave out.
        let flat = desc.dimension == wgpu::TextureDimension::D2;
        let extent = [desc.size[0], desc.size[1], if flat { 1 } else { desc.size[2] }];
        let mips = if flat { 1 } else { desc.mip_level_count };
        let one_pass = is_transient_attachment(declaration, item);
        Some((extent, mips, desc.sample_count, desc.dimension, desc.format, one_pass))
    });
    for group in groups.iter() {
        let room = |item: u32| Room::of(declaration, &items[item as usize]);
        let first = room(group[0]);
        if group.iter().all(|&item| room(item) == first) {
            turns.share(items, group.iter().copied(), lots);
        } else {
            largest_first(items, group, room, lots);
        }
    }
}

/// One object for buffers of equal size.
pub(super) fn buffers(items: &[Item], buffers: &[u32], lots: &mut Lots) {
    let mut sorted: Vec<(u64, u32)> = buffers.iter().map(|&buffer| (words(&items[buffer as usize]), buffer)).collect();
    sorted.sort_unstable();
    lots.slots.reserve(sorted.len());
    let mut turns = Turns::default();
    for group in sorted.chunk_by(|one, other| one.0 == other.0) {
        turns.share(items, group.iter().map(|&(_, buffer)| buffer), lots);
    }
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

/// Items of equal key, in one vector; groups by the first of each, items as they came.
#[derive(Debug)]
struct Groups {
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Groups {
    fn new<'a, K: Hash + Eq>(items: &'a [Item], members: &[u32], key: impl Fn(&'a Item) -> K) -> Self {
        if members.is_empty() {
            return Self { starts: vec![0], members: Vec::new() };
        }
        let mut group_of: FoldedMap<K, u32> = FoldedMap::with_capacity_and_hasher(members.len().min(64), <_>::default());
        let mut groups: Vec<u32> = Vec::with_capacity(members.len());
        // Counts, then a running sum that is moved on as the groups fill: it begins one place early.
        let mut starts: Vec<u32> = Vec::with_capacity(members.len().min(64) + 2);
        starts.extend([0, 0]);
        for &member in members {
            let next = starts.len() as u32 - 2;
            let group = *group_of.entry(key(&items[member as usize])).or_insert(next);
            if group == next {
                starts.push(0);
            }
            starts[group as usize + 2] += 1;
            groups.push(group);
        }
        for at in 2..starts.len() {
            starts[at] += starts[at - 1];
        }
        let mut sorted = vec![0; members.len()];
        for (&member, group) in members.iter().zip(groups) {
            let at = &mut starts[group as usize + 1];
            sorted[*at as usize] = member;
            *at += 1;
        }
        starts.pop();
        Self { starts, members: sorted }
    }

    fn iter(&self) -> impl Iterator<Item = &[u32]> {
        self.starts.windows(2).map(|range| &self.members[range[0] as usize..range[1] as usize])
    }
}

/// Objects that are taken in turn.
#[derive(Debug, Default)]
struct Turns {
    /// Last positions of lots, with the lots; earliest first.
    ends: BinaryHeap<Reverse<(usize, u32)>>,
}

impl Turns {
    /// Items by first use; each takes the object that has been free longest.
    fn share(&mut self, items: &[Item], group: impl ExactSizeIterator<Item = u32>, lots: &mut Lots) {
        let alone = group.len() == 1;
        self.ends.clear();
        for index in group {
            let lifetime = items[index as usize].lifetime;
            let lot = match self.ends.peek() {
                Some(&Reverse((end, lot))) if end < lifetime.first => {
                    self.ends.pop();
                    lots.put(index, lot, 0);
                    lot
                }
                _ => lots.object(items, index),
            };
            if !alone {
                self.ends.push(Reverse((lifetime.last, lot)));
            }
        }
    }
}

/// First and last position of use.
type Life = (usize, usize);

/// The largest first, equal ones by first use; each takes the first object that is free over its life and has room for it.
fn largest_first(items: &[Item], group: &[u32], room: impl Fn(u32) -> Room, lots: &mut Lots) {
    let mut group = group.to_vec();
    group.sort_by_key(|&item| (Reverse(room(item)), items[item as usize].lifetime.first));
    // Lots with their room, and the lives they hold, sorted.
    let mut held: Vec<(u32, Room, Vec<Life>)> = Vec::new();
    for index in group {
        let lifetime = items[index as usize].lifetime;
        let (wanted, life) = (room(index), (lifetime.first, lifetime.last));
        let found = held.iter_mut().find_map(|(lot, room, lives)| {
            let at = lives.partition_point(|other| other.0 < life.0);
            let free = (at == 0 || lives[at - 1].1 < life.0) && lives.get(at).is_none_or(|next| life.1 < next.0);
            let fits = free && room.serves(wanted);
            if fits {
                lives.insert(at, life);
            }
            fits.then_some(*lot)
        });
        if let Some(lot) = found {
            lots.put(index, lot, 0);
        } else {
            held.push((lots.object(items, index), wanted, vec![life]));
        }
    }
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
