//! What moves in a file, gathered as its nodes are walked, and instances of what moves and of what does not.

use super::primitives::Shape;
use crate::scene::animation::{Animation, Local, Node, Parent, SkinJoint, Tracks, place_skinned};
use crate::scene::placement::{Placement, Transform};
use crate::scene::{LARGEST_COORDINATE_M, Triangle};
use glam::{Mat4, Quat};
use std::collections::HashMap;
use std::sync::Arc;

/// Where a node stands at rest, and which node of the animation it is, if it moves.
#[derive(Clone, Copy)]
pub(super) struct Placed {
    pub(super) world_from_node: Mat4,
    pub(super) moving: Option<usize>,
}

impl Placed {
    /// What the root nodes stand in.
    pub(super) const WORLD: Self = Self { world_from_node: Mat4::IDENTITY, moving: None };
}

/// What moves, as far as the walk has come.
#[derive(Default)]
pub(super) struct Motion {
    /// By the file's index of the node; taken out when the walk comes to it.
    pub(super) tracks: HashMap<usize, Tracks>,
    pub(super) animation: Animation,
    /// Triangles that were left out, because they cannot be hit.
    pub(super) left_out: usize,
}

impl Motion {
    /// Places a node within its parent. It moves if its parent does or tracks move it.
    pub(super) fn place(&mut self, node: &gltf::Node<'_>, parent: Placed, label: impl Fn() -> String) -> Placed {
        let (parent_from_node, rest) = local_transform(node);
        let world_from_node = parent.world_from_node * parent_from_node;
        let local = match (self.tracks.remove(&node.index()), rest) {
            (Some(tracks), Some(rest)) => Local::Moving(rest, Box::new(tracks)),
            _ => Local::Still(parent_from_node),
        };
        let parent = match (parent.moving, &local) {
            (None, Local::Still(_)) => return Placed { world_from_node, moving: None },
            (None, Local::Moving(..)) => Parent::Still(parent.world_from_node),
            (Some(index), _) => Parent::Moving(index),
        };
        let moving = Some(self.animation.add_node(Node { label: label(), parent, local }));
        Placed { world_from_node, moving }
    }

    /// Appends an instance. Of what moves only the triangles are left out that no pose gives an area; it must be in range as a whole.
    pub(super) fn instantiate(&mut self, shape: &Shape, placed: Placed, triangles: &mut Vec<Triangle>) -> Result<(), String> {
        let placement = Placement::new(placed.world_from_node);
        let Some(node) = placed.moving else {
            self.append_still(shape.triangles.iter().map(|triangle| placement.place(triangle)), triangles);
            return Ok(());
        };
        let extended: Arc<[Triangle]> = if shape.triangles.iter().all(Triangle::is_extended) {
            Arc::clone(&shape.triangles)
        } else {
            shape.triangles.iter().filter(|triangle| triangle.is_extended()).copied().collect()
        };
        self.left_out += shape.triangles.len() - extended.len();
        let first = append_moving(extended.iter().map(|triangle| placement.place(triangle)), triangles)?;
        self.animation.add_instance(node, first, extended);
        Ok(())
    }

    /// Appends a mesh that follows joints, each with what brings the mesh into its space.
    pub(super) fn instantiate_skinned(
        &mut self,
        shape: &Shape,
        joints: &[(Placed, Mat4)],
        label: &str,
        triangles: &mut Vec<Triangle>,
    ) -> Result<(), String> {
        let Some(bindings) = &shape.bindings else {
            return Err("it has a skin, but its mesh has no JOINTS_0 and WEIGHTS_0".into());
        };
        let most = bindings.iter().flatten().flat_map(|binding| binding.joints).max().unwrap_or(0);
        if usize::from(most) >= joints.len() {
            return Err(format!("its mesh is bound to joint {most}, its skin has {}", joints.len()));
        }
        let at_rest: Vec<Mat4> = joints.iter().map(|(joint, joint_from_mesh)| joint.world_from_node * *joint_from_mesh).collect();
        let placed = place_skinned(&shape.triangles, bindings, &at_rest);
        if joints.iter().all(|(joint, _)| joint.moving.is_none()) {
            self.append_still(placed, triangles);
            return Ok(());
        }
        let first = append_moving(placed, triangles)?;
        let joints = joints.iter().map(|&(joint, joint_from_mesh)| {
            let still = || Node {
                label: label.to_owned(),
                parent: Parent::Still(joint.world_from_node),
                local: Local::Still(Mat4::IDENTITY),
            };
            let node = joint.moving.unwrap_or_else(|| self.animation.add_node(still()));
            SkinJoint { node, joint_from_mesh }
        });
        let joints = joints.collect();
        self.animation.add_skinned(joints, Arc::clone(bindings), first, Arc::clone(&shape.triangles));
        Ok(())
    }

    fn append_still(&mut self, placed: impl Iterator<Item = Triangle>, triangles: &mut Vec<Triangle>) {
        let left_out = &mut self.left_out;
        triangles.extend(placed.filter(|triangle| {
            let sound = triangle.is_sound();
            *left_out += usize::from(!sound);
            sound
        }));
    }
}

/// Appends all of them, and returns the index of the first.
fn append_moving(placed: impl Iterator<Item = Triangle>, triangles: &mut Vec<Triangle>) -> Result<usize, String> {
    let first = triangles.len();
    triangles.extend(placed);
    if triangles[first..].iter().all(Triangle::is_in_range) {
        return Ok(first);
    }
    Err(format!("it is animated, and at rest it reaches beyond {LARGEST_COORDINATE_M:e} m from the origin"))
}

/// A node's transform within its parent at rest, and its parts, unless it is given as a matrix.
fn local_transform(node: &gltf::Node<'_>) -> (Mat4, Option<Transform>) {
    match node.transform() {
        gltf::scene::Transform::Matrix { matrix } => (Mat4::from_cols_array_2d(&matrix), None),
        gltf::scene::Transform::Decomposed { translation, rotation, scale } => {
            let rotation = Quat::from_array(rotation);
            let parts = Transform { translation: translation.into(), rotation, scale: scale.into() };
            (parts.parent_from_node(), Some(parts))
        }
    }
}
