//! Skins: meshes whose vertices follow several nodes at once, the joints (glTF 2.0, 3.7.3).
//!
//! A vertex goes by the weighted mean of what its joints do to it, `Σ w · world_from_joint · joint_from_mesh`: linear blend skinning.

use crate::scene::Triangle;
use crate::scene::placement::Placement;
use glam::Mat4;

/// Joints of one vertex, by index into those of the skin, and their weights, whose sum is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::scene) struct Binding {
    pub(in crate::scene) joints: [u16; 4],
    pub(in crate::scene) weights: [f32; 4],
}

impl Binding {
    /// `weights` are scaled to a sum of one. A vertex without any follows its first joint; what has no weight names no joint. `None`
    /// if a weight is negative or not finite.
    pub(in crate::scene) fn new(joints: [f32; 4], weights: [f32; 4]) -> Option<Self> {
        let sum: f32 = weights.iter().sum();
        if !sum.is_finite() || weights.iter().any(|&weight| weight < 0.0) {
            return None;
        }
        let weights = if sum > 0.0 { weights.map(|weight| weight / sum) } else { [1.0, 0.0, 0.0, 0.0] };
        let mut joints = joints.map(|joint| joint as u16);
        for (joint, weight) in joints.iter_mut().zip(weights) {
            if weight <= 0.0 {
                *joint = 0;
            }
        }
        Some(Self { joints, weights })
    }

    /// The mean of `world_from_mesh`, which has a matrix for each joint.
    fn blend(&self, world_from_mesh: &[Mat4]) -> Mat4 {
        let terms = self.joints.iter().zip(self.weights).filter(|&(_, weight)| weight > 0.0);
        terms.map(|(&joint, weight)| world_from_mesh[usize::from(joint)] * weight).fold(Mat4::ZERO, |sum, term| sum + term)
    }
}

/// The triangles in world space, given a matrix for each joint.
pub(in crate::scene) fn place_skinned<'a>(
    mesh: &'a [Triangle],
    bindings: &'a [[Binding; 3]],
    world_from_mesh: &'a [Mat4],
) -> impl Iterator<Item = Triangle> + 'a {
    mesh.iter().zip(bindings).map(move |(triangle, bindings)| {
        let placements = bindings.each_ref().map(|binding| Placement::new(binding.blend(world_from_mesh)));
        Placement::place_corners(placements.each_ref(), triangle)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec2, Vec3};

    #[test]
    fn weights_sum_to_one_and_what_has_none_names_no_joint() {
        let binding = Binding::new([1.0, 2.0, 99.0, 0.0], [1.0, 3.0, 0.0, 0.0]).unwrap();
        assert_eq!(binding, Binding { joints: [1, 2, 0, 0], weights: [0.25, 0.75, 0.0, 0.0] });
        assert_eq!(Binding::new([7.0, 1.0, 1.0, 1.0], [0.0; 4]).unwrap().joints, [7, 0, 0, 0]);
        assert!(Binding::new([0.0; 4], [1.0, -0.5, 0.0, 0.0]).is_none(), "negative");
        assert!(Binding::new([0.0; 4], [f32::NAN; 4]).is_none(), "not a number");
    }

    #[test]
    fn vertices_go_by_the_mean_of_their_joints() {
        let bound = |joints, weights| Binding::new(joints, weights).unwrap();
        let bindings = [[
            bound([0.0; 4], [1.0, 0.0, 0.0, 0.0]),
            bound([1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]),
            bound([0.0, 1.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0]),
        ]];
        let mesh = [Triangle {
            positions_world: [Vec3::ZERO, Vec3::X, Vec3::Y],
            normals_world: [Vec3::Z; 3],
            uvs: [Vec2::ZERO, Vec2::X, Vec2::Y],
            material: 5,
        }];
        let joints = [Mat4::IDENTITY, Mat4::from_translation(Vec3::new(2.0, 0.0, 4.0))];
        let placed: Vec<Triangle> = place_skinned(&mesh, &bindings, &joints).collect();
        assert_eq!(placed[0].positions_world, [Vec3::ZERO, Vec3::new(3.0, 0.0, 4.0), Vec3::new(1.0, 1.0, 2.0)]);
        assert_eq!((placed[0].normals_world, placed[0].uvs, placed[0].material), ([Vec3::Z; 3], mesh[0].uvs, 5));
    }
}
