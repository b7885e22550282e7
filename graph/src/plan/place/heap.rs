//! Everything at offsets of shared memory, one heap per class of need.
//!
//! What cannot lie there has an object of its own: attachments that have no memory outside their render pass, and resources
//! whose bytes nobody knows.

use super::{Item, Lots, Need, SlotKind, is_transient_attachment, pack};
use crate::declaration::Declaration;

/// Places all items; more effort is spent while they take more than `goal` bytes.
pub(in super::super) fn heaps(declaration: &Declaration, items: &[Item], needs: &dyn Fn(usize, u32) -> Need, goal: u64) -> Lots {
    let mut lots = Lots::new(items.len());
    // By class; few differ.
    let mut heaps: Vec<(u32, Vec<u32>, Vec<pack::Block>)> = Vec::new();
    for (index, item) in (0..).zip(items) {
        let need = needs(item.resource, item.usage);
        if item.bytes == 0 || is_transient_attachment(declaration, item) {
            lots.object(items, index);
            continue;
        }
        let block = item.block(need.bytes, need.align);
        let at = heaps.iter().position(|(class, ..)| *class == need.class).unwrap_or_else(|| {
            heaps.push((need.class, Vec::with_capacity(items.len()), Vec::with_capacity(items.len())));
            heaps.len() - 1
        });
        heaps[at].1.push(index);
        heaps[at].2.push(block);
    }
    heaps.sort_by_key(|(class, ..)| *class);
    for (_, members, blocks) in heaps {
        let packing = pack::pack(&blocks, goal);
        let heap = lots.open(SlotKind::Heap, packing.height);
        for (item, offset) in members.into_iter().zip(packing.offsets) {
            lots.put(item, heap, offset);
        }
    }
    lots
}

#[cfg(test)]
mod tests {
    use super::super::super::{Need, PlanOptions, Sharing, SlotKind, plan_with_needs};
    use crate::Declaration;

    #[test]
    fn attachments_without_memory_and_unknown_bytes_lie_alone_and_classes_apart() {
        let frame = r#"{"frame": "f",
            "resources": [{"name": "color", "kind": "texture", "origin": "transient", "format": "r32float", "size": [8, 8, 1]},
                          {"name": "depth", "kind": "texture", "origin": "transient", "format": "depth32float", "size": [8, 8, 1]},
                          {"name": "bvh", "kind": "buffer", "origin": "transient", "bytes": 0},
                          {"name": "list", "kind": "buffer", "origin": "transient", "bytes": 100},
                          {"name": "sums", "kind": "buffer", "origin": "transient", "bytes": 100}],
            "passes": [{"name": "draw", "kind": "raster", "side_effect": true,
                        "writes": [{"resource": "color"}, {"resource": "depth"}, {"resource": "bvh"}, {"resource": "list"},
                                   {"resource": "sums"}]}]}"#;
        let mut declaration = Declaration::from_frame_json(frame).unwrap();
        declaration.passes[0].accesses[1].usage = wgpu::TextureUsages::TRANSIENT_ATTACHMENT.bits();
        // A buffer's usage bits mean something else.
        declaration.passes[0].accesses[3].usage = wgpu::TextureUsages::TRANSIENT_ATTACHMENT.bits();
        let needs = |resource: usize, _| Need { bytes: 1000, align: 4096, class: u32::from(resource == 0) };
        let plan = plan_with_needs(&declaration, &PlanOptions::default().sharing(Sharing::Placed), &needs).unwrap();
        let of = |resource: usize| &plan.slots[plan.slot_of[resource].unwrap()];
        assert_eq!([0, 1, 2, 3].map(|r| of(r).kind), [SlotKind::Heap, SlotKind::Object, SlotKind::Object, SlotKind::Heap]);
        assert_eq!((of(0).bytes, of(3).bytes), (1000, 4096 + 1000), "by class, each as large as its needs");
        assert_eq!(plan.slot_of[3], plan.slot_of[4]);
    }
}
