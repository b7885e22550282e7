//! Following moved triangles: new boxes for the same nodes, or a new hierarchy.
//!
//! A refit keeps the topology and computes all boxes from the leaves up. Children stand behind their parent in the array, so one
//! sweep from its end to its start finds every child done. It costs a fraction of a build, but a hierarchy that
//! groups triangles by where they were grows boxes that overlap. How much is told by the surface area heuristic
//! [MacDonald90], in visits that a ray through the root's box is expected to pay:
//!
//! ```text
//! C = 1/A(root) · ( Σ nodes A + 0.3 Σ leaves n A ),   A half the area of a box, n the triangles of a leaf
//! ```
//!
//! [`Bvh::follow`] refits, and builds anew once C exceeds [`MOST_GROWTH`] times that of the last build: a bound on decay, as in [Lauterbach06].
//!
//! [MacDonald90]: https://doi.org/10.1007/BF01911006 "MacDonald, Booth: Heuristics for ray tracing using space subdivision, The Visual Computer 6, 1990"
//! [Lauterbach06]: https://doi.org/10.1109/RT.2006.280213 "Lauterbach, Yoon, Tuft, Manocha: RT-DEFORM: interactive ray tracing of dynamic scenes using BVHs, IEEE Symposium on Interactive Ray Tracing 2006"

use super::{Bvh, SceneError, Triangle, corners};
use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::node::CwBvhNode;

/// Growth of the expected cost of a ray beyond which a hierarchy is built anew: a frame's rays then cost half as much again.
pub const MOST_GROWTH: f32 = 1.5;

/// Cost of a triangle, in node visits: that by which the builder forms leaves.
const TRIANGLE_COST: f32 = 0.3;

/// How a hierarchy followed its triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Followed {
    /// By new boxes for the same nodes: places in leaf order stayed.
    Refit,
    /// By a new build.
    Rebuild,
}

impl Followed {
    /// A word for reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Refit => "refit",
            Self::Rebuild => "rebuild",
        }
    }
}

impl Bvh {
    /// Follows triangles that moved: by [`Self::refit`], and by a new build where their number changed, or where the refitted hierarchy
    /// costs a ray more than [`MOST_GROWTH`] times what it did when it was built. `scene` names the scene in errors.
    ///
    /// # Errors
    /// Those of [`Self::build`].
    pub fn follow(&mut self, scene: &str, triangles: &[Triangle]) -> Result<Followed, SceneError> {
        if self.refit(triangles).is_ok_and(|growth| growth <= MOST_GROWTH) {
            return Ok(Followed::Refit);
        }
        *self = Self::build(scene, triangles)?;
        Ok(Followed::Rebuild)
    }

    /// Gives the nodes new boxes, around the same triangles where they are now, and returns by which factor a ray's expected cost
    /// exceeds that after the last build. A triangle may have lost its area; coordinates must be finite.
    ///
    /// # Errors
    /// [`SceneError::Refit`] if the number of triangles changed.
    pub fn refit(&mut self, triangles: &[Triangle]) -> Result<f32, SceneError> {
        if triangles.len() != self.leaf_triangles.len() {
            return Err(SceneError::Refit { built: self.stats.triangles, given: triangles.len() as u64 });
        }
        // Only who refits pays for the cost after the build.
        let nodes = &mut self.tree.nodes;
        let built = *self.built_cost.get_or_insert_with(|| sweep(nodes, &self.leaf_triangles, |_, _, _| {}).1);
        for (leaf, &index) in self.leaf_triangles.iter_mut().zip(&self.tree.primitive_indices) {
            *leaf = corners(&triangles[index as usize]);
        }
        let (bounds, cost) = sweep(nodes, &self.leaf_triangles, enclose);
        self.tree.total_aabb = bounds;
        Ok(if built > 0.0 {
            cost / built
        } else if cost > 0.0 {
            f32::INFINITY
        } else {
            1.0
        })
    }
}

/// Gives every node the box around its triangles, whatever it was built from.
pub(super) fn enclose_all(tree: &mut CwBvh, leaves: &[obvhs::triangle::Triangle]) {
    (tree.total_aabb, _) = sweep(&mut tree.nodes, leaves, enclose);
}

/// Goes through all nodes from the leaves to the root, with the exact box of each and of its children, and returns the root's box and
/// a ray's expected cost.
fn sweep(
    nodes: &mut [CwBvhNode],
    leaves: &[obvhs::triangle::Triangle],
    mut visit: impl FnMut(&mut CwBvhNode, Aabb, &[Option<Aabb>; 8]),
) -> (Aabb, f32) {
    let mut boxes = vec![Aabb::INVALID; nodes.len()];
    let mut cost = 0.0;
    for (index, node) in nodes.iter_mut().enumerate().rev() {
        let mut children = [None; 8];
        let mut bounds = Aabb::INVALID;
        for (slot, child) in children.iter_mut().enumerate() {
            if node.is_child_empty(slot) {
                continue;
            }
            let own = if node.is_leaf(slot) {
                let (first, count) = node.child_primitives(slot);
                let triangles = &leaves[first as usize..(first + count) as usize];
                let own = triangles.iter().fold(Aabb::INVALID, |all, triangle| all.union(&triangle.aabb()));
                cost += f64::from(TRIANGLE_COST * count as f32 * own.half_area());
                own
            } else {
                boxes[node.child_node_index(slot) as usize]
            };
            bounds = bounds.union(&own);
            *child = Some(own);
        }
        cost += f64::from(bounds.half_area());
        visit(node, bounds, &children);
        boxes[index] = bounds;
    }
    let root = boxes.first().copied().unwrap_or(Aabb::INVALID);
    let area = f64::from(root.half_area());
    (root, if area > 0.0 { (cost / area) as f32 } else { 0.0 })
}

/// Gives a node the box `bounds`, and its children theirs on the node's grid, rounded outwards. In 64 bits, differences of
/// coordinates are exact, or as good: nothing is lost between the boxes of parent and child.
fn enclose(node: &mut CwBvhNode, bounds: Aabb, children: &[Option<Aabb>; 8]) {
    let wide = |v: Vec3A| v.as_dvec3();
    let least = wide(bounds.min);
    node.p = bounds.min.into();
    let extent = wide(bounds.max) - least;
    let mut cell = DVec3::ONE;
    for axis in 0..3 {
        // The least power of two of which 255 span the box. A box without extent gets cells of the least size that `obvhs` makes.
        let exponent = (extent[axis].max(1e-20) / 255.0).log2().ceil().clamp(-126.0, 127.0) as i32;
        // Rounding of the logarithm may leave the box a hair short.
        let exponent = if extent[axis] > 255.0 * 2_f64.powi(exponent) { exponent + 1 } else { exponent };
        node.e[axis] = (exponent + 127) as u8;
        cell[axis] = 2_f64.powi(exponent);
    }
    for (slot, child) in children.iter().enumerate() {
        let Some(child) = child else { continue };
        // Casts saturate at 0 and 255, which the node's own box does not exceed.
        let low = ((wide(child.min) - least) / cell).floor();
        let high = ((wide(child.max) - least) / cell).ceil();
        [node.child_min_x[slot], node.child_min_y[slot], node.child_min_z[slot]] = low.to_array().map(|c| c as u8);
        [node.child_max_x[slot], node.child_max_y[slot], node.child_max_z[slot]] = high.to_array().map(|c| c as u8);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::directions;
    use super::*;
    use crate::scene::{Scene, builtin};
    use glam::{Quat, Vec3};

    /// A scene, and the same moved: everything at once, in parts, and with triangles that lose their area or gain it again.
    fn moved() -> Vec<(&'static str, Vec<Triangle>)> {
        let with = |change: &dyn Fn(usize, Vec3) -> Vec3| -> Vec<Triangle> {
            let Scene { mut triangles, .. } = builtin::caustics();
            for (index, triangle) in triangles.iter_mut().enumerate() {
                triangle.positions_world = triangle.positions_world.map(|p| change(index, p));
            }
            triangles
        };
        vec![
            ("as it was", with(&|_, p| p)),
            ("far away", with(&|_, p| p + Vec3::new(3e5, -20.0, 1e-3))),
            ("small", with(&|_, p| p * 0.01)),
            ("twisted", with(&|_, p| Quat::from_rotation_y(3.0 * p.y) * p)),
            ("a part moved", with(&|i, p| if i < 2000 { p } else { p + Vec3::X })),
            ("a point", with(&|i, p| if i < 20 { p } else { Vec3::splat(0.3) })),
            ("all in a plane", with(&|_, p| Vec3::new(p.x, 0.1, p.z))),
        ]
    }

    /// The triangles below a node, by place in leaf order.
    fn below(bvh: &Bvh, index: u32) -> Vec<u32> {
        let node = &bvh.tree.nodes[index as usize];
        let filled = (0..8).filter(|&slot| !node.is_child_empty(slot));
        filled.flat_map(|slot| below_child(bvh, node, slot)).collect()
    }

    fn below_child(bvh: &Bvh, node: &CwBvhNode, slot: usize) -> Vec<u32> {
        if node.is_leaf(slot) {
            let (first, count) = node.child_primitives(slot);
            return (first..first + count).collect();
        }
        below(bvh, node.child_node_index(slot))
    }

    #[test]
    fn every_box_holds_its_triangles() {
        let scene = builtin::caustics();
        let mut bvh = Bvh::build(&scene.name, &scene.triangles).unwrap();
        for (name, triangles) in moved() {
            bvh.refit(&triangles).unwrap();
            for (index, node) in bvh.tree.nodes.iter().enumerate() {
                let cell = DVec3::from_array(node.e.map(|e| 2_f64.powi(i32::from(e) - 127)));
                let plane = |q: [u8; 3]| node.p.as_dvec3() + DVec3::from_array(q.map(f64::from)) * cell;
                for slot in (0..8).filter(|&slot| !node.is_child_empty(slot)) {
                    let low = plane([node.child_min_x[slot], node.child_min_y[slot], node.child_min_z[slot]]);
                    let high = plane([node.child_max_x[slot], node.child_max_y[slot], node.child_max_z[slot]]);
                    for leaf in below_child(&bvh, node, slot) {
                        let leaf = bvh.leaf_triangles[leaf as usize];
                        let held = [leaf.v0, leaf.v1, leaf.v2].map(Vec3A::as_dvec3);
                        let held = held.iter().all(|p| p.cmpge(low).all() && p.cmple(high).all());
                        assert!(held, "{name}: node {index}, child {slot}: {leaf:?} is not within {low} and {high}");
                    }
                }
            }
        }
    }

    #[test]
    fn hits_are_those_of_a_fresh_build() {
        let scene = builtin::caustics();
        let mut refitted = Bvh::build(&scene.name, &scene.triangles).unwrap();
        for (name, triangles) in moved() {
            refitted.refit(&triangles).unwrap();
            let built = Bvh::build(name, &triangles).unwrap();
            let (least, most) = Scene { triangles, ..Scene::default() }.bounds();
            let mut hits = 0;
            for (i, direction) in directions().enumerate() {
                let origin = least + (most - least) * Vec3::new(0.55, 0.6, 0.65);
                let [a, b] = [&refitted, &built].map(|bvh| bvh.closest_hit(origin, direction, 0.0, f32::INFINITY));
                assert_eq!(a.map(|hit| hit.distance), b.map(|hit| hit.distance), "{name}: ray {i}");
                hits += usize::from(a.is_some());
            }
            println!("{name}: {hits} hits, {} levels", built.stats().depth);
            assert!(built.stats().depth < 16, "{name}: {} levels", built.stats().depth);
        }
    }

    #[test]
    fn decay_is_measured_and_mended() {
        let scene = builtin::caustics();
        let mut bvh = Bvh::build("s", &scene.triangles).unwrap();
        let order = bvh.leaf_order().to_vec();
        assert!((bvh.refit(&scene.triangles).unwrap() - 1.0).abs() < 1e-6, "nothing moved");
        let mut triangles = scene.triangles.clone();
        for triangle in &mut triangles {
            triangle.positions_world = triangle.positions_world.map(|p| 3.0 * p + Vec3::Y);
        }
        assert_eq!(bvh.follow("s", &triangles).unwrap(), Followed::Refit, "moved as a whole");
        assert_eq!(bvh.leaf_order(), order, "places stay");
        // Each triangle somewhere else.
        let count = triangles.len();
        let anywhere: Vec<Triangle> = (0..count).map(|i| scene.triangles[i * 4_099 % count]).collect();
        let growth = bvh.refit(&anywhere).unwrap();
        assert!(growth > 5.0, "growth {growth}");
        assert_eq!(bvh.follow("s", &anywhere).unwrap(), Followed::Rebuild);
        assert!((bvh.refit(&anywhere).unwrap() - 1.0).abs() < 1e-6, "as after a build");
        let error = bvh.refit(&anywhere[1..]).unwrap_err().to_string();
        assert!(error.contains(&count.to_string()) && error.contains("build it anew"), "{error}");
        assert_eq!(bvh.follow("s", &anywhere[1..]).unwrap(), Followed::Rebuild, "another number of triangles");
    }
}
