//! Instances: where nodes stand, and what becomes of the triangles of a mesh there.

use super::Triangle;
use glam::{Mat3, Mat4, Quat, Vec3};

/// Translation, rotation and scale of a node (glTF 2.0, 3.5.3): scaled first, then turned, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transform {
    /// In the parent's unit.
    pub(super) translation: Vec3,
    /// Of any length: only its direction counts.
    pub(super) rotation: Quat,
    /// Per axis.
    pub(super) scale: Vec3,
}

impl Default for Transform {
    fn default() -> Self {
        Self { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE }
    }
}

impl Transform {
    /// As a matrix.
    pub(super) fn parent_from_node(&self) -> Mat4 {
        // Exporters round; a zero quaternion is no rotation.
        let unit = self.rotation.length_squared().is_normal();
        let rotation = if unit { self.rotation.normalize() } else { Quat::IDENTITY };
        Mat4::from_scale_rotation_translation(self.scale, rotation, self.translation)
    }
}

/// The transform of an instance, ready for its triangles.
pub(super) struct Placement {
    world_from_mesh: Mat4,
    normal_matrix: Mat3,
    mirrored: bool,
}

impl Placement {
    pub(super) fn new(world_from_mesh: Mat4) -> Self {
        let linear = Mat3::from_mat4(world_from_mesh);
        let mirrored = linear.determinant() < 0.0;
        let normal_matrix = cofactor(linear) * if mirrored { -1.0 } else { 1.0 };
        Self { world_from_mesh, normal_matrix, mirrored }
    }

    /// A triangle in world space, out of one in the mesh's space. Mirroring transforms swap two corners, so that front sides stay
    /// front sides; normals go by the inverse transpose, and where there is none the geometric one stands.
    pub(super) fn place(&self, mesh: &Triangle) -> Triangle {
        Self::place_corners([self; 3], mesh)
    }

    /// As [`Self::place`], each corner by a transform of its own; the first says whether fronts are mirrored.
    pub(super) fn place_corners(placements: [&Self; 3], mesh: &Triangle) -> Triangle {
        let order = if placements[0].mirrored { [0, 2, 1] } else { [0, 1, 2] };
        let mut triangle = Triangle {
            positions_world: order.map(|i| placements[i].world_from_mesh.transform_point3(mesh.positions_world[i])),
            normals_world: [Vec3::ZERO; 3],
            uvs: order.map(|i| mesh.uvs[i]),
            material: mesh.material,
        };
        let flat = triangle.normal_world();
        triangle.normals_world =
            order.map(|i| (placements[i].normal_matrix * mesh.normals_world[i]).try_normalize().unwrap_or(flat));
        triangle
    }
}

/// The inverse transpose times the determinant; it exists for singular matrices too.
fn cofactor(m: Mat3) -> Mat3 {
    Mat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    #[test]
    fn mirrored_instances_keep_front_and_normals_together() {
        let mesh = Triangle {
            positions_world: [Vec3::ZERO, Vec3::X, Vec3::Y],
            normals_world: [Vec3::Z; 3],
            uvs: [Vec2::ZERO, Vec2::X, Vec2::Y],
            material: 0,
        };
        let turn = Mat4::from_rotation_x(0.4);
        for scale in [Vec3::ONE, Vec3::new(-1.0, 1.0, 1.0), Vec3::new(2.0, -0.5, -3.0), Vec3::splat(-1.0)] {
            let placed = Placement::new(turn * Mat4::from_scale(scale)).place(&mesh);
            let expected = turn.transform_vector3(Vec3::new(0.0, 0.0, scale.z.signum()));
            assert!(placed.normal_world().abs_diff_eq(expected, 1e-5), "front of {scale}");
            assert!(placed.normals_world[0].abs_diff_eq(expected, 1e-5), "normal of {scale}");
            let mirrored = scale.x * scale.y * scale.z < 0.0;
            assert_eq!(placed.uvs[1], if mirrored { Vec2::Y } else { Vec2::X });
        }
    }

    #[test]
    fn normals_go_by_the_inverse_transpose_or_are_those_of_the_plane() {
        let slope = Vec3::new(1.0, 1.0, 0.0).normalize();
        let mut mesh = Triangle {
            positions_world: [Vec3::ZERO, Vec3::new(-1.0, 1.0, 0.0), Vec3::Z],
            normals_world: [slope; 3],
            uvs: [Vec2::ZERO; 3],
            material: 0,
        };
        let stretched = Placement::new(Mat4::from_scale(Vec3::new(3.0, 1.0, 1.0)));
        let placed = stretched.place(&mesh);
        let normal = placed.normals_world[0];
        assert!(normal.abs_diff_eq(placed.normal_world(), 1e-5), "stays perpendicular: {normal}");
        mesh.normals_world = [Vec3::ZERO; 3];
        let flat = stretched.place(&mesh);
        assert_eq!(flat.normals_world, [flat.normal_world(); 3]);
    }
}
