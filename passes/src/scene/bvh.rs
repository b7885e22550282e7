//! The bounding volume hierarchy: an eight-wide compressed one after [Ylitie17], built and traversed on the CPU by `obvhs`.
//!
//! Shaders read the same nodes and boxes, laid out as `bvh_node.rs` says. Triangles are stored in leaf order, so that a
//! leaf names a contiguous range.
//!
//! [Ylitie17]: https://doi.org/10.1145/3105762.3105773 "Ylitie, Karras, Laine: Efficient incoherent ray traversal on GPUs through compressed wide BVHs, HPG 2017"

mod flat;
mod refit;

pub use refit::{Followed, MOST_GROWTH};

use super::bvh_node::LEAF_TRIANGLES;
use super::gpu_types::BvhNode;
use super::{SceneError, Triangle};
use glam::{Vec3, Vec3A};
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::ray::{INVALID_ID, Ray, RayHit};
use std::time::{Duration, Instant};

/// Levels that a traversal stack must hold; deeper hierarchies are refused.
pub const MAX_DEPTH: u32 = 32;

/// Size and cost of a hierarchy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BvhStats {
    /// Eight-wide nodes.
    pub nodes: u32,
    /// Triangles in the leaves.
    pub triangles: u32,
    /// Levels of nodes; at most [`MAX_DEPTH`].
    pub depth: u32,
    /// Time that the build took.
    pub build_time: Duration,
}

/// What a ray met first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in units of the ray's direction.
    pub distance: f32,
    /// Index of the triangle in the slice that the hierarchy was built from.
    pub triangle: u32,
}

/// A hierarchy over the triangles of a scene, with a traversal on the CPU.
pub struct Bvh {
    tree: CwBvh,
    leaf_triangles: Vec<obvhs::triangle::Triangle>,
    /// Expected cost of a ray after the build, once a refit has asked for it.
    built_cost: Option<f32>,
    stats: BvhStats,
}

impl std::fmt::Debug for Bvh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Bvh").field("stats", &self.stats).finish_non_exhaustive()
    }
}

impl Bvh {
    /// Builds a hierarchy in which each triangle lies in exactly one leaf.
    ///
    /// # Errors
    /// [`SceneError::Empty`] without triangles, [`SceneError::TooDeep`] beyond [`MAX_DEPTH`];
    /// `scene` names the scene in them.
    pub fn build(scene: &str, triangles: &[Triangle]) -> Result<Self, SceneError> {
        if triangles.is_empty() {
            return Err(SceneError::Empty { scene: scene.into() });
        }
        let corners: Vec<obvhs::triangle::Triangle> = triangles.iter().map(corners).collect();
        let start = Instant::now();
        let stand_ins = flat::stand_ins(triangles, &corners);
        let mut tree = build_tree(stand_ins.as_ref().unwrap_or(&corners));
        let build_time = start.elapsed();
        let depth = depth(&tree);
        if depth > MAX_DEPTH {
            return Err(SceneError::TooDeep { scene: scene.into(), depth, limit: MAX_DEPTH });
        }
        let leaf_triangles: Vec<_> = tree.primitive_indices.iter().map(|&index| corners[index as usize]).collect();
        if stand_ins.is_some() {
            refit::enclose_all(&mut tree, &leaf_triangles);
        }
        let stats = BvhStats { nodes: tree.nodes.len() as u32, triangles: triangles.len() as u32, depth, build_time };
        Ok(Self { tree, leaf_triangles, built_cost: None, stats })
    }

    /// Size and cost.
    pub fn stats(&self) -> BvhStats {
        self.stats
    }

    /// The nodes as shaders read them, the root first.
    pub fn nodes(&self) -> impl ExactSizeIterator<Item = BvhNode> {
        self.tree.nodes.iter().map(BvhNode::from)
    }

    /// For each place in leaf order, the index of its triangle.
    pub fn leaf_order(&self) -> &[u32] {
        &self.tree.primitive_indices
    }

    /// The nearest triangle, seen from either side, at a distance within `[t_min, t_max]`.
    /// `direction_world` need not be a unit vector; a ray that is not finite hits nothing.
    pub fn closest_hit(&self, origin_world: Vec3, direction_world: Vec3, t_min: f32, t_max: f32) -> Option<Hit> {
        let ray = ray(origin_world, direction_world, t_min, t_max)?;
        let mut hit = RayHit::none();
        self.tree.ray_traverse(ray, &mut hit, |ray, id| self.leaf_triangles[id].intersect(ray));
        // A miss may leave any distance behind, but never a primitive.
        (hit.primitive_id != INVALID_ID)
            .then(|| Hit { distance: hit.t, triangle: self.tree.primitive_indices[hit.primitive_id as usize] })
    }

    /// Whether anything lies on the ray between `t_min` and `t_max`.
    pub fn is_occluded(&self, origin_world: Vec3, direction_world: Vec3, t_min: f32, t_max: f32) -> bool {
        ray(origin_world, direction_world, t_min, t_max)
            .is_some_and(|ray| !self.tree.ray_traverse_miss(ray, |ray, id| self.leaf_triangles[id].intersect(ray)))
    }
}

fn corners(triangle: &Triangle) -> obvhs::triangle::Triangle {
    let [v0, v1, v2] = triangle.positions_world.map(Vec3A::from);
    obvhs::triangle::Triangle { v0, v1, v2 }
}

fn ray(origin: Vec3, direction: Vec3, t_min: f32, t_max: f32) -> Option<Ray> {
    let sound = origin.is_finite() && direction.is_finite() && direction != Vec3::ZERO;
    // Adding zero turns −0 into 0: obvhs takes −0 for positive where it orders the planes of a box and
    // for negative where it inverts the direction, and then misses the box.
    let direction = Vec3A::from(direction) + Vec3A::ZERO;
    sound.then(|| Ray::new(origin.into(), direction, t_min, t_max))
}

/// `obvhs::cwbvh::builder::build_cwbvh_from_tris` at its medium quality with more reinsertion, less
/// the validation that it runs in debug builds: that is for its authors, and it panics on scenes of
/// hundreds of metres, whose rounding exceeds its fixed tolerance. No spatial splits, so that
/// triangles and leaf entries are one to one.
fn build_tree(corners: &[obvhs::triangle::Triangle]) -> CwBvh {
    let indices = (0..corners.len() as u32).collect();
    let mut binary =
        PlocBuilder::with_capacity(corners.len()).build(PlocSearchDistance::Medium, corners, indices, SortPrecision::U64, 3);
    ReinsertionOptimizer::default().run(&mut binary, 0.1, None);
    // The order of the children helps only the traversal on the CPU.
    bvh2_to_cwbvh(&binary, LEAF_TRIANGLES as u32, true, false)
}

/// Levels of nodes, found breadth first.
fn depth(tree: &CwBvh) -> u32 {
    let mut depth = 0;
    let mut level = vec![0_u32];
    while !level.is_empty() {
        depth += 1;
        level = level
            .iter()
            .filter_map(|&index| tree.nodes.get(index as usize))
            .flat_map(|node| node.child_base_idx..node.child_base_idx + node.imask.count_ones())
            .collect();
    }
    depth
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    /// Nearest hit by testing every triangle.
    fn by_hand(triangles: &[Triangle], origin: Vec3, direction: Vec3) -> Option<(f32, u32)> {
        let ray = Ray::new_inf(origin.into(), direction.into());
        triangles
            .iter()
            .enumerate()
            .filter_map(|(i, t)| {
                let t = corners(t).intersect(&ray);
                t.is_finite().then_some((t, i as u32))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// 500 of them, evenly over the sphere: a spiral of golden angles.
    pub(super) fn directions() -> impl Iterator<Item = Vec3> {
        (0..500_u16).map(f32::from).map(|i| {
            let turn = i * 2.399_963;
            let y = 1.0 - 2.0 * (i + 0.5) / 500.0;
            let ring = (1.0 - y * y).sqrt();
            Vec3::new(ring * turn.cos(), y, ring * turn.sin())
        })
    }

    #[test]
    fn traversal_agrees_with_testing_every_triangle() {
        let scene = builtin::caustics();
        let bvh = Bvh::build(&scene.name, &scene.triangles).unwrap();
        let mut hits = 0;
        for (i, direction) in directions().enumerate() {
            let origin = Vec3::new(0.1, 1.2, 0.3);
            let found = bvh.closest_hit(origin, direction, 0.0, f32::INFINITY);
            let expected = by_hand(&scene.triangles, origin, direction);
            assert_eq!(found.map(|h| h.distance), expected.map(|(t, _)| t), "ray {i}");
            assert_eq!(bvh.is_occluded(origin, direction, 0.0, f32::INFINITY), expected.is_some(), "occlusion of ray {i}");
            hits += usize::from(found.is_some());
        }
        assert!((100..500).contains(&hits), "some rays leave by the open side: {hits}");
    }

    #[test]
    fn leaves_hold_each_triangle_once() {
        let scene = builtin::closed_sphere(3);
        let bvh = Bvh::build(&scene.name, &scene.triangles).unwrap();
        let mut order = bvh.leaf_order().to_vec();
        order.sort_unstable();
        assert!(order.into_iter().eq(0..scene.triangles.len() as u32), "a permutation");
        assert_eq!(bvh.nodes().len() as u32, bvh.stats().nodes);
    }

    #[test]
    fn one_triangle_and_none() {
        let scene = builtin::cornell();
        let bvh = Bvh::build("one", &scene.triangles[..1]).unwrap();
        assert_eq!((bvh.stats().triangles, bvh.stats().depth), (1, 1));
        let inside = scene.triangles[0].positions_world.iter().sum::<Vec3>() / 3.0;
        let hit = bvh.closest_hit(inside + scene.triangles[0].normal_world(), -scene.triangles[0].normal_world(), 0.0, 9.0);
        assert!(hit.is_some_and(|h| (h.distance - 1.0).abs() < 1e-5), "{hit:?}");
        assert!(bvh.closest_hit(Vec3::splat(f32::NAN), Vec3::X, 0.0, 1.0).is_none(), "no panic");
        assert!(matches!(Bvh::build("none", &[]), Err(SceneError::Empty { .. })), "empty");
    }
}
