//! Everything at offsets of shared memory, one heap per class of need.
//!
//! What cannot lie there has an object of its own: attachments that have no memory outside their render pass, and resources
//! whose bytes nobody knows.

use super::{Item, Lot, Need, SlotKind, is_transient_attachment, pack};
use crate::declaration::Declaration;

/// Places all items.
pub(in super::super) fn heaps<'a>(
    declaration: &Declaration,
    items: &'a [Item],
    needs: &dyn Fn(usize, u32) -> Need,
) -> Vec<Lot<'a>> {
    let mut lots = Vec::new();
    // By class; few differ.
    let mut heaps: Vec<(u32, Vec<&Item>, Vec<pack::Block>)> = Vec::new();
    for item in items {
        let need = needs(item.resource, item.usage);
        if item.bytes == 0 || need.bytes == 0 || is_transient_attachment(declaration, item) {
            lots.push(Lot::object(item));
            continue;
        }
        let block = item.block(need.bytes, need.align);
        match heaps.iter_mut().find(|(class, ..)| *class == need.class) {
            Some((_, members, blocks)) => {
                members.push(item);
                blocks.push(block);
            }
            None => heaps.push((need.class, vec![item], vec![block])),
        }
    }
    heaps.sort_by_key(|(class, ..)| *class);
    for (_, members, blocks) in heaps {
        let packing = pack::pack(&blocks);
        let members = members.into_iter().zip(packing.offsets).collect();
        lots.push(Lot { kind: SlotKind::Heap, bytes: packing.height, members });
    }
    lots
}
