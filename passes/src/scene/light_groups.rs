//! Lights that are steered as one: a punctual light each, and pieces of emissive surfaces.

use super::Triangle;
use super::gpu_types::LightGroup;
use glam::Vec3;
use std::collections::HashMap;

/// Groups at most: the layers of an array texture that every WebGPU device has.
const MOST_GROUPS: usize = 256;
/// Cosine of the angle by which the normals of a piece may differ from its first one's: a flat lamp is one piece, a sphere some
/// fifteen. Photons of a group share one map of directions, in frames that turn with the normal.
const PIECE_COSINE: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// A group before it is known how many photons it has.
pub(super) struct Group {
    /// Where its lights lie in the list.
    pub(super) first: u32,
    pub(super) count: u32,
    /// Normal of its first triangle; zero of a punctual light.
    pub(super) axis: Vec3,
}

/// The piece of each triangle, counted from 0 as they appear, where a piece is made of one material, joined by corners and not
/// bent by more than [`PIECE_COSINE`] says.
pub(super) fn pieces(triangles: &[&Triangle]) -> Vec<u32> {
    let shapes = shapes(triangles);
    let mut axes: HashMap<usize, Vec<(Vec3, u32)>> = HashMap::new();
    let mut count = 0;
    let piece_of = |(triangle, &shape): (&&Triangle, &usize)| {
        let normal = triangle.normal_world();
        let known = axes.entry(shape).or_default();
        if let Some(&(_, piece)) = known.iter().find(|(axis, _)| axis.dot(normal) >= PIECE_COSINE) {
            return piece;
        }
        known.push((normal, count));
        count += 1;
        count - 1
    };
    triangles.iter().zip(&shapes).map(piece_of).collect()
}

/// A triangle that stands for all those that each one is joined to.
fn shapes(triangles: &[&Triangle]) -> Vec<usize> {
    let mut parent: Vec<usize> = (0..triangles.len()).collect();
    let root = |parent: &mut Vec<usize>, mut at: usize| {
        while parent[at] != at {
            parent[at] = parent[parent[at]];
            at = parent[at];
        }
        at
    };
    let mut at_corner = HashMap::new();
    for (index, triangle) in triangles.iter().enumerate() {
        for corner in triangle.positions_world {
            // Zeros of either sign are one place.
            let place = (corner + Vec3::ZERO).to_array().map(f32::to_bits);
            let neighbour = *at_corner.entry((place, triangle.material)).or_insert(index);
            let (a, b) = (root(&mut parent, index), root(&mut parent, neighbour));
            parent[a.max(b)] = a.min(b);
        }
    }
    (0..triangles.len()).map(|index| root(&mut parent, index)).collect()
}

/// The groups from which photons leave, the strongest if there are too many, in the order of their lights. `share` is the
/// share of the photons of a light.
pub(super) fn strongest(groups: &[Group], share: impl Fn(u32) -> f32) -> Vec<LightGroup> {
    let with_share = |group: &Group| {
        let Group { first, count, axis } = *group;
        let photon_probability = (first..first + count).map(|light| f64::from(share(light))).sum::<f64>() as f32;
        LightGroup { axis: axis.to_array(), first, count, photon_probability, ..LightGroup::default() }
    };
    let mut all: Vec<_> = groups.iter().map(with_share).filter(|group| group.photon_probability > 0.0).collect();
    all.sort_by(|a, b| b.photon_probability.total_cmp(&a.photon_probability));
    all.truncate(MOST_GROUPS);
    all.sort_by_key(|group| group.first);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::mesh::{cuboid, icosphere, placed, quad};
    use glam::Mat4;

    fn count(triangles: &[Triangle]) -> u32 {
        pieces(&triangles.iter().collect::<Vec<_>>()).into_iter().max().map_or(0, |last| last + 1)
    }

    #[test]
    fn pieces_are_joined_and_hardly_bent() {
        let square = quad([Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y], 0);
        assert_eq!(count(&square), 1);
        let away = Mat4::from_translation(Vec3::new(4.0, -0.0, 0.0));
        let both: Vec<_> = square.iter().copied().chain(placed(square.clone(), away)).collect();
        assert_eq!(pieces(&both.iter().collect::<Vec<_>>()), [0, 0, 1, 1], "two panels of one material");
        let mut beside = square.clone();
        beside.extend(quad([Vec3::X, Vec3::X * 2.0, Vec3::X * 2.0 + Vec3::Y, Vec3::X + Vec3::Y], 1));
        assert_eq!(count(&beside), 2, "another material");
        assert_eq!(count(&cuboid(Vec3::ZERO, Vec3::ONE, 0)), 6, "a side each");
        let sphere = count(&icosphere(3, 0));
        assert!((8..=20).contains(&sphere), "{sphere} pieces of a sphere");
        assert_eq!(count(&[]), 0);
    }

    #[test]
    fn the_strongest_are_kept_in_order() {
        let groups: Vec<_> = (0..300).map(|i| Group { first: 2 * i, count: 2, axis: Vec3::Z }).collect();
        // The first forty give nothing, and the next four less than all others.
        let share = |light: u32| if light < 80 { 0.0 } else { light as f32 / 1e6 };
        let kept = strongest(&groups, share);
        assert_eq!(kept.len(), 256);
        assert_eq!((kept[0].first, kept[255].first), (88, 598));
        assert!((kept[0].photon_probability - (88.0 + 89.0) / 1e6).abs() < 1e-9, "{:?}", kept[0]);
    }
}
