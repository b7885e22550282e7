//! Mesh primitives → triangles in mesh space.

use super::{SceneError, Source, accessor, label, materials, skins};
use crate::scene::Triangle;
use crate::scene::animation::Binding;
use glam::{Vec2, Vec3};
use gltf::Semantic;
use gltf::mesh::Mode;
use std::collections::BTreeSet;
use std::sync::Arc;

/// A primitive in the space of its mesh.
pub(super) struct Shape {
    /// Those without normals have zeros in their place.
    pub(super) triangles: Arc<[Triangle]>,
    /// How the corners are bound to joints; `None`: not at all.
    pub(super) bindings: Option<Arc<[[Binding; 3]]>>,
}

/// Decodes the primitives of a mesh, once for all its instances; those that are not triangles are skipped with a warning.
pub(super) fn decode_mesh(
    source: &Source<'_>,
    mesh: &gltf::Mesh<'_>,
    warnings: &mut BTreeSet<String>,
) -> Result<Vec<Shape>, SceneError> {
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
        if primitive.get(&Semantic::Joints(1)).is_some() {
            warnings.insert(format!("{mesh_label} has vertices of more than four joints; the first four count"));
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
) -> Result<Shape, SceneError> {
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
    let normals: Option<Vec<Vec3>> = match primitive.get(&Semantic::Normals) {
        Some(accessor) => {
            let read = accessor::read_vectors(source, &accessor, &what("NORMAL"))?;
            same_count("NORMAL", read.len())?;
            Some(read.into_iter().map(Vec3::from_array).collect())
        }
        None => None,
    };
    let set = materials::uv_set(&primitive.material());
    let uvs: Option<Vec<Vec2>> = match primitive.get(&Semantic::TexCoords(set)) {
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
    let material = primitive.material().index().unwrap_or(default) as u32;
    let triangle = |corners: [u32; 3]| {
        let corners = corners.map(|i| i as usize);
        Triangle {
            positions_world: corners.map(|i| positions[i]),
            normals_world: normals.as_ref().map_or([Vec3::ZERO; 3], |normals| corners.map(|i| normals[i])),
            uvs: uvs.as_ref().map_or([Vec2::ZERO; 3], |uvs| corners.map(|i| uvs[i])),
            material,
        }
    };
    let corners = assemble(mode, &indices);
    let vertices = skins::read_bindings(source, primitive, place, positions.len())?;
    let bindings = vertices.map(|of| corners.iter().map(|corners| corners.map(|i| of[i as usize])).collect());
    Ok(Shape { triangles: corners.into_iter().map(triangle).collect(), bindings })
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
}
