//! Skins: which nodes a mesh follows, and how a vertex is bound to them.

use super::{SceneError, Source, accessor, label};
use crate::scene::animation::Binding;
use glam::Mat4;
use gltf::Semantic;

/// Where a joint is, and what brings the mesh into its space.
pub(super) struct Joint {
    /// Index of the node.
    pub(super) node: usize,
    pub(super) joint_from_mesh: Mat4,
}

/// The joints of skin `index`, in its order.
pub(super) fn read_joints(source: &Source<'_>, index: usize) -> Result<Vec<Joint>, SceneError> {
    let root = source.document.as_json();
    let Some(skin) = root.skins.get(index) else {
        return Err(source.malformed(format!("skin {index}"), "it does not exist"));
    };
    let place = label("skin", index, skin.name.as_deref());
    let matrices: Vec<[f32; 16]> = match skin.inverse_bind_matrices {
        None => vec![Mat4::IDENTITY.to_cols_array(); skin.joints.len()],
        Some(accessor) => {
            let what = format!("{place}, inverseBindMatrices");
            let Some(accessor) = source.document.accessors().nth(accessor.value()) else {
                return Err(source.malformed(what, format!("accessor {} does not exist", accessor.value())));
            };
            accessor::read_vectors(source, &accessor, &what)?
        }
    };
    if matrices.len() < skin.joints.len() {
        let problem = format!("it has {} joints and {} inverse bind matrices", skin.joints.len(), matrices.len());
        return Err(source.malformed(place, problem));
    }
    if let Some(joint) = matrices.iter().position(|matrix| !matrix.iter().all(|c| c.is_finite())) {
        return Err(source.malformed(place, format!("inverse bind matrix {joint} is not finite")));
    }
    let joints = skin.joints.iter().zip(&matrices);
    Ok(joints.map(|(node, matrix)| Joint { node: node.value(), joint_from_mesh: Mat4::from_cols_array(matrix) }).collect())
}

/// How each of `count` vertices is bound to joints; `None` for a primitive that is not.
pub(super) fn read_bindings(
    source: &Source<'_>,
    primitive: &gltf::Primitive<'_>,
    place: &str,
    count: usize,
) -> Result<Option<Vec<Binding>>, SceneError> {
    let (Some(joints), Some(weights)) = (primitive.get(&Semantic::Joints(0)), primitive.get(&Semantic::Weights(0))) else {
        return Ok(None);
    };
    let what = |semantic: &str| format!("{place}, {semantic}");
    let joints = accessor::read_vectors::<4>(source, &joints, &what("JOINTS_0"))?;
    let weights = accessor::read_vectors::<4>(source, &weights, &what("WEIGHTS_0"))?;
    for (name, elements) in [("JOINTS_0", joints.len()), ("WEIGHTS_0", weights.len())] {
        if elements != count {
            return Err(source.malformed(what(name), format!("it has {elements} elements, POSITION has {count}")));
        }
    }
    let bindings = joints.into_iter().zip(&weights).enumerate().map(|(vertex, (joints, weights))| {
        Binding::new(joints, *weights).ok_or_else(|| {
            let problem = format!("vertex {vertex} has weights {weights:?}; give numbers of 0 and above");
            source.malformed(what("WEIGHTS_0"), problem)
        })
    });
    bindings.collect::<Result<_, _>>().map(Some)
}
