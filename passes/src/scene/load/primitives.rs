//! Mesh primitives → indexed triangles in mesh space, and their instances in world space.

use super::{SceneError, Source, accessor, label, materials};
use crate::scene::Triangle;
use glam::{Mat3, Mat4, Vec2, Vec3};
use gltf::Semantic;
use gltf::mesh::Mode;
use std::collections::BTreeSet;

/// One primitive, decoded once for all its instances.
pub(super) struct Geometry {
    positions: Vec<Vec3>,
    normals: Option<Vec<Vec3>>,
    uvs: Option<Vec<Vec2>>,
    /// Vertex indices, all within `positions`.
    triangles: Vec<[u32; 3]>,
    material: u32,
}

/// Decodes the primitives of a mesh; those that are not triangles are skipped with a warning.
pub(super) fn decode_mesh(
    source: &Source<'_>,
    mesh: &gltf::Mesh<'_>,
    warnings: &mut BTreeSet<String>,
) -> Result<Vec<Geometry>, SceneError> {
    let mesh_label = label("mesh", mesh.index(), mesh.name());
    let mut decoded = Vec::new();
    for primitive in mesh.primitives() {
        let place = format!("{mesh_label}, primitive {}", primitive.index());
        let mode = primitive.mode();
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            warnings.insert(format!("{place} is made of {mode:?}, not triangles, and was skipped"));
            continue;
        }
        if primitive.morph_targets().len() > 0 {
            warnings.insert(format!("{mesh_label} has morph targets, which are ignored"));
        }
        if primitive.get(&Semantic::Colors(0)).is_some() {
            warnings.insert(format!("{mesh_label} has vertex colours, which are ignored"));
        }
        decoded.push(decode(source, &primitive, &place, warnings)?);
    }
    Ok(decoded)
}

fn decode(
    source: &Source<'_>,
    primitive: &gltf::Primitive<'_>,
    place: &str,
    warnings: &mut BTreeSet<String>,
) -> Result<Geometry, SceneError> {
    let what = |semantic: &str| format!("{place}, {semantic}");
    let Some(accessor) = primitive.get(&Semantic::Positions) else {
        return Err(source.malformed(place, "it has no POSITION"));
    };
    let positions: Vec<Vec3> =
        accessor::read_vectors(source, &accessor, &what("POSITION"))?.into_iter().map(Vec3::from_array).collect();
    if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
        let place = format!("{place}, POSITION, accessor {}", accessor.index());
        let problem = format!("vertex {vertex} is {}, not a finite point", positions[vertex]);
        return Err(source.malformed(place, problem));
    }
    let same_count = |name: &str, count: usize| {
        if count == positions.len() {
            return Ok(());
        }
        let problem = format!("it has {count} elements, POSITION has {}", positions.len());
        Err(source.malformed(what(name), problem))
    };
    let normals = match primitive.get(&Semantic::Normals) {
        Some(accessor) => {
            let read = accessor::read_vectors(source, &accessor, &what("NORMAL"))?;
            same_count("NORMAL", read.len())?;
            Some(read.into_iter().map(Vec3::from_array).collect())
        }
        None => None,
    };
    let set = materials::uv_set(&primitive.material());
    let uvs = match primitive.get(&Semantic::TexCoords(set)) {
        Some(accessor) => {
            let name = format!("TEXCOORD_{set}");
            let read = accessor::read_vectors(source, &accessor, &what(&name))?;
            same_count(&name, read.len())?;
            Some(read.into_iter().map(Vec2::from_array).collect())
        }
        None => None,
    };
    let indices = match primitive.indices() {
        Some(accessor) => accessor::read_indices(source, &accessor, &what("indices"))?,
        None => (0..positions.len() as u32).collect(),
    };
    if let Some(at) = indices.iter().position(|&index| index as usize >= positions.len()) {
        let problem = format!("index {at} is {}, but there are {} vertices", indices[at], positions.len());
        return Err(source.malformed(what("indices"), problem));
    }
    let mode = primitive.mode();
    if mode == Mode::Triangles && indices.len() % 3 != 0 {
        warnings.insert(format!("{place} has {} indices; the odd ones are left out", indices.len()));
    }
    // The default material follows the file's own.
    let default = source.document.materials().len();
    Ok(Geometry {
        triangles: assemble(mode, &indices),
        positions,
        normals,
        uvs,
        material: primitive.material().index().unwrap_or(default) as u32,
    })
}

/// Triangles of a list, strip or fan, all wound alike (glTF 2.0, 3.7.2.1).
fn assemble(mode: Mode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        Mode::TriangleFan => match indices.split_first() {
            Some((&hub, rim)) => rim.windows(2).map(|w| [w[0], w[1], hub]).collect(),
            None => Vec::new(),
        },
        _ => indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}

impl Geometry {
    /// Appends an instance in world space. Mirroring transforms swap two corners, so that front sides
    /// stay front sides; normals go by the inverse transpose.
    pub(super) fn instantiate(&self, world_from_mesh: Mat4, out: &mut Vec<Triangle>) {
        let linear = Mat3::from_mat4(world_from_mesh);
        let mirrored = linear.determinant() < 0.0;
        let normal_matrix = cofactor(linear) * if mirrored { -1.0 } else { 1.0 };
        out.reserve(self.triangles.len());
        for &[a, b, c] in &self.triangles {
            let corners = if mirrored { [a, c, b] } else { [a, b, c] }.map(|i| i as usize);
            let mut triangle = Triangle {
                positions_world: corners.map(|i| world_from_mesh.transform_point3(self.positions[i])),
                normals_world: [Vec3::ZERO; 3],
                uvs: self.uvs.as_ref().map_or([Vec2::ZERO; 3], |uvs| corners.map(|i| uvs[i])),
                material: self.material,
            };
            let flat = triangle.normal_world();
            triangle.normals_world = match &self.normals {
                Some(normals) => corners.map(|i| (normal_matrix * normals[i]).try_normalize().unwrap_or(flat)),
                None => [flat; 3],
            };
            out.push(triangle);
        }
    }
}

/// The inverse transpose times the determinant; it exists for singular matrices too.
fn cofactor(m: Mat3) -> Mat3 {
    Mat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_winding() {
        assert_eq!(assemble(Mode::TriangleStrip, &[0, 1, 2, 3]), [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(assemble(Mode::TriangleFan, &[0, 1, 2, 3]), [[1, 2, 0], [2, 3, 0]]);
        assert_eq!(assemble(Mode::Triangles, &[0, 1, 2, 3]), [[0, 1, 2]]);
        assert!(assemble(Mode::TriangleFan, &[]).is_empty(), "an empty fan");
    }

    #[test]
    fn mirrored_instances_keep_front_and_normals_together() {
        let up = Vec3::Z;
        let geometry = Geometry {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: Some(vec![up; 3]),
            uvs: Some(vec![Vec2::ZERO, Vec2::X, Vec2::Y]),
            triangles: vec![[0, 1, 2]],
            material: 0,
        };
        let turn = Mat4::from_rotation_x(0.4);
        for scale in [Vec3::ONE, Vec3::new(-1.0, 1.0, 1.0), Vec3::new(2.0, -0.5, -3.0), Vec3::splat(-1.0)] {
            let matrix = turn * Mat4::from_scale(scale);
            let mut out = Vec::new();
            geometry.instantiate(matrix, &mut out);
            let expected = turn.transform_vector3(Vec3::new(0.0, 0.0, scale.z.signum()));
            assert!(out[0].normal_world().abs_diff_eq(expected, 1e-5), "front of {scale}");
            assert!(out[0].normals_world[0].abs_diff_eq(expected, 1e-5), "normal of {scale}");
            let mirrored = scale.x * scale.y * scale.z < 0.0;
            assert_eq!(out[0].uvs[1], if mirrored { Vec2::Y } else { Vec2::X });
        }
    }

    #[test]
    fn normals_go_by_the_inverse_transpose() {
        let slope = Vec3::new(1.0, 1.0, 0.0).normalize();
        let geometry = Geometry {
            positions: vec![Vec3::ZERO, Vec3::new(-1.0, 1.0, 0.0), Vec3::Z],
            normals: Some(vec![slope; 3]),
            uvs: None,
            triangles: vec![[0, 1, 2]],
            material: 0,
        };
        let mut out = Vec::new();
        geometry.instantiate(Mat4::from_scale(Vec3::new(3.0, 1.0, 1.0)), &mut out);
        let normal = out[0].normals_world[0];
        assert!(normal.abs_diff_eq(out[0].normal_world(), 1e-5), "stays perpendicular: {normal}");
    }
}
