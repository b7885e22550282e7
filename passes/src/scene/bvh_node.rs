//! Nodes of the hierarchy for shaders: those of `obvhs`, their children in another order.
//!
//! [Ylitie17] and `obvhs` spend a byte of meta data on each child, to say what it is and where it lies, and order the children so
//! that their slots tell which are nearer. Here inner children come first and leaves follow in the order of their triangles. So a
//! child's place says where it lies, and one AND with the bits of the children says what a ray met:
//!
//! ```text
//! child c is inner:  bit 24 + c          node       first_child + c
//! child c is a leaf: bits 3 c … 3 c + 2  triangles  first_triangle + the set bits below
//! ```
//!
//! A node is five vectors of 16 bytes, not fields of four: adapters load a vector at once, software ones with a single test of its
//! bounds for each ray.
//!
//! The ray knows the distances of the boxes that it met, and sorts by those.
//!
//! [Ylitie17]: https://doi.org/10.1145/3105762.3105773 "Ylitie, Karras, Laine: Efficient incoherent ray traversal on GPUs through compressed wide BVHs, HPG 2017"

use super::gpu_types::BvhNode;
use obvhs::cwbvh::node::CwBvhNode;

/// Triangles of a leaf, at most: the bits of `children` that are its.
pub(super) const LEAF_TRIANGLES: usize = 3;

const WIDTH: usize = 8;

impl From<&CwBvhNode> for BvhNode {
    fn from(node: &CwBvhNode) -> Self {
        let is_inner = |slot: usize| node.imask >> slot & 1 == 1;
        // How many in unary (3 bits), and the first (5 bits); 0: the slot is empty.
        let meta = |slot: usize| node.child_meta[slot];
        let inner = (0..WIDTH).filter(|&slot| is_inner(slot));
        let mut leaves: Vec<usize> = (0..WIDTH).filter(|&slot| !is_inner(slot) && meta(slot) != 0).collect();
        leaves.sort_by_key(|&slot| meta(slot) & 0x1f);
        let order: Vec<usize> = inner.chain(leaves).collect();
        let bits = order.iter().enumerate().map(|(child, &slot)| {
            let leaf = u32::from(meta(slot) >> 5) << (LEAF_TRIANGLES * child);
            if is_inner(slot) { 1 << (24 + child) } else { leaf }
        });
        let planes = |least: [u8; WIDTH], greatest: [u8; WIDTH]| {
            let mut bytes = [0; 2 * WIDTH];
            for (child, &slot) in order.iter().enumerate() {
                (bytes[child], bytes[WIDTH + child]) = (least[slot], greatest[slot]);
            }
            bytemuck::cast::<[u8; 16], [[u8; 4]; 4]>(bytes).map(u32::from_le_bytes)
        };
        let [x, y, z] = node.e;
        Self {
            grid: [node.p.x.to_bits(), node.p.y.to_bits(), node.p.z.to_bits(), u32::from_le_bytes([x, y, z, 0])],
            links: [node.child_base_idx, node.primitive_base_idx, bits.fold(0, |all, bit| all | bit), 0],
            x_planes: planes(node.child_min_x, node.child_max_x),
            y_planes: planes(node.child_min_y, node.child_max_y),
            z_planes: planes(node.child_min_z, node.child_max_z),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Bvh, builtin};
    use glam::Vec3;

    /// Least and greatest corner of a child.
    fn bounds(node: &BvhNode, child: usize) -> [Vec3; 2] {
        let byte = |planes: [u32; 4], at: usize| f32::from(planes[at / 4].to_le_bytes()[at % 4]);
        let [origin @ .., exponents] = node.grid;
        let exponents = exponents.to_le_bytes();
        let step = Vec3::from_array([0, 1, 2].map(|axis| f32::from_bits(u32::from(exponents[axis]) << 23)));
        [child, WIDTH + child].map(|at| {
            let steps = Vec3::new(byte(node.x_planes, at), byte(node.y_planes, at), byte(node.z_planes, at));
            Vec3::from(origin.map(f32::from_bits)) + step * steps
        })
    }

    /// Counts the triangles below `index`, each of which must lie in the boxes of its leaf and of all nodes above.
    fn check(nodes: &[BvhNode], corners: &[[Vec3; 3]], index: u32, boxes: &mut Vec<[Vec3; 2]>, seen: &mut [u32]) {
        let node = &nodes[index as usize];
        let [first_child, first_triangle, children, _] = node.links;
        let mut triangle = first_triangle as usize;
        for child in 0..WIDTH {
            boxes.push(bounds(node, child));
            if children >> (24 + child) & 1 == 1 {
                check(nodes, corners, first_child + child as u32, boxes, seen);
            }
            for _ in 0..((children & 0x00ff_ffff) >> (LEAF_TRIANGLES * child) & 0b111).count_ones() {
                seen[triangle] += 1;
                for corner in corners[triangle] {
                    // The grid's planes are computed here in f32, and rounded by at most an ulp of the scene's metres.
                    let inside = |[least, greatest]: &[Vec3; 2]| {
                        (corner - least).min_element() > -1e-5 && (greatest - corner).min_element() > -1e-5
                    };
                    assert!(boxes.iter().all(inside), "triangle {triangle} at {corner} leaves one of {boxes:?}");
                }
                triangle += 1;
            }
            boxes.pop();
        }
    }

    #[test]
    fn every_triangle_lies_in_the_boxes_above_it() {
        for scene in [builtin::caustics(), builtin::cornell(), builtin::closed_sphere(3)] {
            let bvh = Bvh::build(&scene.name, &scene.triangles).unwrap();
            let nodes: Vec<BvhNode> = bvh.nodes().collect();
            let corners: Vec<[Vec3; 3]> =
                bvh.leaf_order().iter().map(|&index| scene.triangles[index as usize].positions_world).collect();
            let mut seen = vec![0; corners.len()];
            check(&nodes, &corners, 0, &mut Vec::new(), &mut seen);
            assert!(seen.iter().all(|&times| times == 1), "{}: each once", scene.name);
        }
    }
}
