//! Textures in objects of merged descriptions, buffers in arenas or in objects of equal size, whichever take less.
//!
//! Packing arenas is the dear part. So the rest is done first, as a draft, which also knows what no packing can do without: then of
//! two drafts (of two orders of a frame) the one that promises less is packed first, and the other only if it may still be less.

use super::{Item, Lots, arena, pool};
use crate::declaration::{Declaration, ResourceKind};

/// All but the packing.
#[derive(Debug)]
pub(in super::super) struct Draft<'a> {
    items: &'a [Item],
    textures: Lots,
    /// Buffers in objects of equal size.
    objects: Lots,
    /// Buffers in arenas: those that lie in none have their objects; the others are still to be packed.
    in_arenas: Lots,
    colours: arena::Colours,
    /// The least that arenas, and buffers beside them, take (bytes).
    arenas_least: u64,
}

impl<'a> Draft<'a> {
    /// Of items by time of first use.
    pub(in super::super) fn new(declaration: &Declaration, uses: &arena::BufferUses, items: &'a [Item]) -> Self {
        let (mut textures, mut buffers) = (Vec::with_capacity(items.len()), Vec::with_capacity(items.len()));
        for (index, item) in (0..).zip(items) {
            match declaration.resources[item.resource].kind {
                ResourceKind::Texture(_) => textures.push(index),
                ResourceKind::Buffer(_) => buffers.push(index),
                // Always imported.
                ResourceKind::Tlas => {}
            }
        }
        let mut draft = Self {
            items,
            textures: Lots::new(items.len()),
            objects: Lots::default(),
            in_arenas: Lots::default(),
            colours: arena::Colours::default(),
            arenas_least: 0,
        };
        pool::textures(declaration, items, &textures, &mut draft.textures);
        if !buffers.is_empty() {
            (draft.objects, draft.in_arenas) = (Lots::new(items.len()), Lots::new(items.len()));
            pool::buffers(items, &buffers, &mut draft.objects);
            draft.colours = arena::Colours::new(uses, items, &buffers);
            pool::buffers(items, &draft.colours.apart, &mut draft.in_arenas);
            let mut ends = Vec::with_capacity(buffers.len());
            let packed = draft.colours.members.iter().map(|members| most_live(items, members, &mut ends));
            draft.arenas_least = packed.fold(draft.in_arenas.bytes(), u64::saturating_add);
        }
        draft
    }

    /// No way of packing takes less (bytes).
    pub(in super::super) fn least(&self) -> u64 {
        self.textures.bytes().saturating_add(self.objects.bytes().min(self.arenas_least))
    }

    /// The whole, packed.
    pub(in super::super) fn pack(mut self) -> Lots {
        let objects = self.objects.bytes();
        if self.arenas_least <= objects {
            for members in &self.colours.members {
                arena::pack(self.items, members, &mut self.in_arenas);
            }
            if self.in_arenas.bytes() <= objects {
                self.textures.join(&self.in_arenas);
                return self.textures;
            }
        }
        self.textures.join(&self.objects);
        self.textures
    }
}

/// Of the drafts the one that takes least when packed, the first of several; and which it is.
pub(in super::super) fn least<'a>(drafts: impl Iterator<Item = Draft<'a>>) -> (usize, Lots) {
    let mut drafts: Vec<(usize, Draft<'_>)> = drafts.enumerate().collect();
    drafts.sort_by_key(|(_, draft)| draft.least());
    let mut best: Option<(u64, usize, Lots)> = None;
    for (which, draft) in drafts {
        if best.as_ref().is_some_and(|(bytes, other, _)| (*bytes, *other) <= (draft.least(), which)) {
            continue;
        }
        let lots = draft.pack();
        if best.as_ref().is_none_or(|(bytes, other, _)| (lots.bytes(), which) < (*bytes, *other)) {
            best = Some((lots.bytes(), which, lots));
        }
    }
    best.map(|(_, which, lots)| (which, lots)).unwrap_or_default()
}

/// The most bytes of `members` that are alive at once; they come by first position.
fn most_live(items: &[Item], members: &[u32], ends: &mut Vec<(usize, u64)>) -> u64 {
    ends.clear();
    ends.extend(members.iter().map(|&member| (items[member as usize].lifetime.last, items[member as usize].bytes)));
    ends.sort_unstable();
    // All together may be more than 64 bits hold.
    let (mut live, mut most, mut ended) = (0_u128, 0, 0);
    for item in members.iter().map(|&member| &items[member as usize]) {
        while ends[ended].0 < item.lifetime.first {
            live -= u128::from(ends[ended].1);
            ended += 1;
        }
        live += u128::from(item.bytes);
        most = live.max(most);
    }
    u64::try_from(most).unwrap_or(u64::MAX)
}
