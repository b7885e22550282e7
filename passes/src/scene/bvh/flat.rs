//! Triangles that a pose leaves without area, as the builder is to see them.
//!
//! A whole mesh that shrank to a point is thousands of equal boxes. Clustering finds no difference between them, makes one long chain of
//! nodes, and recursion over it exhausts the stack. So the builder is given a small grid of points in their place, which makes a shallow
//! tree; its boxes are then computed from the triangles themselves.

use super::Triangle;
use glam::Vec3A;
use obvhs::triangle::Triangle as Corners;

/// Width of the grid, as a share of the scene's: beyond the resolution of the builder's 21-bit grid, and too small to matter.
const WIDTH: f32 = 1e-3;

/// `corners` with a grid of points in place of what cannot be hit; `None` if everything can be.
pub(super) fn stand_ins(triangles: &[Triangle], corners: &[Corners]) -> Option<Vec<Corners>> {
    let flat: Vec<usize> = (0..triangles.len()).filter(|&index| !triangles[index].is_sound()).collect();
    if flat.is_empty() {
        return None;
    }
    let points = || corners.iter().flat_map(|t| [t.v0, t.v1, t.v2]).filter(|p| p.is_finite());
    let (least, most) = points().fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(least, most), p| (least.min(p), most.max(p)));
    let width = WIDTH * (most - least).max_element().max(f32::MIN_POSITIVE);
    let side = (flat.len() as f64).cbrt().ceil().max(1.0) as usize;
    let mut stand_ins = corners.to_vec();
    for (place, &index) in flat.iter().enumerate() {
        let cell = [place % side, place / side % side, place / (side * side)].map(|i| i as f32 / side as f32);
        let at = if corners[index].v0.is_finite() { corners[index].v0 } else { least };
        let point = at + width * Vec3A::from_array(cell);
        stand_ins[index] = Corners { v0: point, v1: point, v2: point };
    }
    Some(stand_ins)
}
