//! Scenes that move: nodes with keys over time, and the triangles, lights and cameras that follow them.
//!
//! ```text
//! Scene::load ──▶ Scene (at rest) ──pose(t)──▶ Scene at t ──Bvh::follow──▶ Bvh ──GpuScene::update──▶ GpuScene
//! ```
//!
//! An animated scene is as flat as any other. What moves is besides kept as it is in its mesh, so that a pose is placed anew by
//! the very arithmetic of loading, and does not depend on the poses before it. Places are kept: triangle, light and camera `i`
//! are the same ones in every pose, and a triangle that a pose leaves without area stays where it is and is hit by nothing.
//!
//! All animations of a file are played together. Before its first key and after its last one a property holds their value
//! (glTF 2.0, 3.11), so time ends by itself; who wants a loop poses at `time.rem_euclid(duration)`.

mod skin;
mod track;

pub(super) use skin::{Binding, place_skinned};
pub(super) use track::{Interpolation, Track, Value};

use super::placement::{Placement, Transform};
use super::{Camera, LARGEST_COORDINATE_M, Scene, SceneError, Triangle};
use glam::{Mat4, Quat, Vec3};
use std::sync::Arc;

/// What moves in a scene, and how.
#[derive(Clone, Debug, Default)]
pub struct Animation {
    /// Parents before their children.
    nodes: Vec<Node>,
    instances: Vec<Instance>,
    /// Light and node.
    lights: Vec<(usize, usize)>,
    /// Camera and node.
    cameras: Vec<(usize, usize)>,
}

/// A node that moves.
#[derive(Clone, Debug)]
pub(super) struct Node {
    /// What messages call it.
    pub(super) label: String,
    pub(super) parent: Parent,
    pub(super) local: Local,
}

/// What a node's transform starts from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Parent {
    /// Stands still: world from parent.
    Still(Mat4),
    /// Moves: an earlier node of the animation.
    Moving(usize),
}

/// A node's transform within its parent.
#[derive(Clone, Debug)]
pub(super) enum Local {
    /// Never changes.
    Still(Mat4),
    /// Follows tracks; what has none stays at rest.
    Moving(Transform, Box<Tracks>),
}

/// The properties of a node over time.
#[derive(Clone, Debug, Default)]
pub(super) struct Tracks {
    pub(super) translation: Option<Track<Vec3>>,
    pub(super) rotation: Option<Track<Quat>>,
    pub(super) scale: Option<Track<Vec3>>,
}

/// A node that a skin follows.
#[derive(Clone, Copy, Debug)]
pub(super) struct SkinJoint {
    pub(super) node: usize,
    pub(super) joint_from_mesh: Mat4,
}

/// What triangles follow.
#[derive(Clone, Debug)]
enum Follows {
    Node(usize),
    Skin(Vec<SkinJoint>, Arc<[[Binding; 3]]>),
}

/// Triangles that follow nodes.
#[derive(Clone, Debug)]
struct Instance {
    follows: Follows,
    /// Index of the first in the scene.
    first: usize,
    /// In the space of the node, or of the skinned mesh.
    mesh: Arc<[Triangle]>,
    /// Greatest absolute coordinates of the mesh.
    reach: Vec3,
}

impl Tracks {
    /// Time of the last key (s).
    fn end(&self) -> f32 {
        let ends = [
            self.translation.as_ref().map(Track::end),
            self.rotation.as_ref().map(Track::end),
            self.scale.as_ref().map(Track::end),
        ];
        ends.into_iter().flatten().fold(0.0, f32::max)
    }

    fn at(&self, time: f32, rest: Transform) -> Transform {
        Transform {
            translation: self.translation.as_ref().map_or(rest.translation, |track| track.at(time)),
            rotation: self.rotation.as_ref().map_or(rest.rotation, |track| track.at(time)),
            scale: self.scale.as_ref().map_or(rest.scale, |track| track.at(time)),
        }
    }
}

impl Instance {
    /// The nodes that it follows, world from mesh by each of them, and how far the mesh reaches.
    fn transforms(&self, world_from_nodes: &[Mat4]) -> Vec<(usize, Mat4, Vec3)> {
        match &self.follows {
            Follows::Node(node) => vec![(*node, world_from_nodes[*node], self.reach)],
            Follows::Skin(joints, _) => {
                let of = |joint: &SkinJoint| (joint.node, world_from_nodes[joint.node] * joint.joint_from_mesh, self.reach);
                joints.iter().map(of).collect()
            }
        }
    }

    fn place(&self, world_from_nodes: &[Mat4], triangles: &mut [Triangle]) {
        match &self.follows {
            Follows::Node(node) => {
                let placement = Placement::new(world_from_nodes[*node]);
                for (triangle, mesh) in triangles.iter_mut().zip(self.mesh.iter()) {
                    *triangle = placement.place(mesh);
                }
            }
            Follows::Skin(_, bindings) => {
                let world_from_mesh: Vec<Mat4> = self.transforms(world_from_nodes).into_iter().map(|(_, m, _)| m).collect();
                for (triangle, placed) in triangles.iter_mut().zip(place_skinned(&self.mesh, bindings, &world_from_mesh)) {
                    *triangle = placed;
                }
            }
        }
    }
}

impl Animation {
    /// Adds a node, whose parent must be there already.
    pub(super) fn add_node(&mut self, node: Node) -> usize {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// Lets the triangles from `first` on, which are `mesh` in the space of `node`, follow it.
    pub(super) fn add_instance(&mut self, node: usize, first: usize, mesh: Arc<[Triangle]>) {
        self.add(Follows::Node(node), first, mesh);
    }

    /// Lets the triangles from `first` on follow the joints of a skin, to which `bindings` bind the corners of `mesh`.
    pub(super) fn add_skinned(
        &mut self,
        joints: Vec<SkinJoint>,
        bindings: Arc<[[Binding; 3]]>,
        first: usize,
        mesh: Arc<[Triangle]>,
    ) {
        self.add(Follows::Skin(joints, bindings), first, mesh);
    }

    fn add(&mut self, follows: Follows, first: usize, mesh: Arc<[Triangle]>) {
        let reach = mesh.iter().flat_map(|t| t.positions_world).fold(Vec3::ZERO, |reach, p| reach.max(p.abs()));
        self.instances.push(Instance { follows, first, mesh, reach });
    }

    /// Lets a light of the scene follow `node`.
    pub(super) fn add_light(&mut self, light: usize, node: usize) {
        self.lights.push((light, node));
    }

    /// Lets a camera of the scene follow `node`.
    pub(super) fn add_camera(&mut self, camera: usize, node: usize) {
        self.cameras.push((camera, node));
    }

    /// Lets go of all lights, for a scene whose lights are replaced.
    pub(super) fn release_lights(&mut self) {
        self.lights.clear();
    }

    /// Whether nothing that is shown moves.
    pub(super) fn is_idle(&self) -> bool {
        self.instances.is_empty() && self.lights.is_empty() && self.cameras.is_empty()
    }

    /// Time of the last key of all (s); the pose stays from there on.
    pub fn duration(&self) -> f32 {
        let end = |node: &Node| match &node.local {
            Local::Still(_) => 0.0,
            Local::Moving(_, tracks) => tracks.end(),
        };
        self.nodes.iter().map(end).fold(0.0, f32::max)
    }

    /// World from node, for each node; or what is wrong with one of them.
    fn world_from_nodes(&self, time: f32) -> Result<Vec<Mat4>, String> {
        let mut world_from_nodes: Vec<Mat4> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let world_from_parent = match node.parent {
                Parent::Still(world_from_parent) => world_from_parent,
                Parent::Moving(index) => world_from_nodes[index],
            };
            let parent_from_node = match &node.local {
                Local::Still(parent_from_node) => *parent_from_node,
                Local::Moving(rest, tracks) => tracks.at(time, *rest).parent_from_node(),
            };
            let world_from_node = world_from_parent * parent_from_node;
            if !world_from_node.is_finite() {
                return Err(format!("the transform of {} is not finite", node.label));
            }
            world_from_nodes.push(world_from_node);
        }
        for (node, m, reach) in self.instances.iter().flat_map(|instance| instance.transforms(&world_from_nodes)) {
            let [x, y, z, w] = [m.x_axis, m.y_axis, m.z_axis, m.w_axis].map(|axis| axis.truncate().abs());
            if !m.is_finite() || (x * reach.x + y * reach.y + z * reach.z + w).max_element() >= LARGEST_COORDINATE_M {
                let label = &self.nodes[node].label;
                return Err(format!("{label} reaches beyond {LARGEST_COORDINATE_M:e} m from the origin"));
            }
        }
        Ok(world_from_nodes)
    }
}

impl Scene {
    /// Length of the animation (s): the time of its last key. `None` for a scene that does not move.
    pub fn duration(&self) -> Option<f32> {
        self.animation.as_ref().map(|animation| animation.duration())
    }

    /// Moves triangles, lights and cameras to where they are `time` seconds into the animation. Before the first key and after
    /// the last one the pose is theirs. A scene without animation stays as it is.
    ///
    /// A hierarchy over its triangles and the scene on the GPU do not follow by themselves:
    /// [`Bvh::follow`](super::Bvh::follow) and [`GpuScene::update`](super::GpuScene::update).
    ///
    /// # Errors
    /// [`SceneError::Pose`] if the time is no finite number, if something is moved out of range, or if triangles, lights or cameras
    /// were removed since the scene was loaded. The scene is then as it was.
    pub fn pose(&mut self, time: f32) -> Result<(), SceneError> {
        let Some(animation) = self.animation.clone() else { return Ok(()) };
        let wrong = |problem: String| SceneError::Pose { scene: self.name.clone(), time, problem };
        if !time.is_finite() {
            return Err(wrong("give a finite number of seconds".into()));
        }
        let complete = animation.instances.iter().all(|i| i.first + i.mesh.len() <= self.triangles.len())
            && animation.lights.iter().all(|&(light, _)| light < self.lights.len())
            && animation.cameras.iter().all(|&(camera, _)| camera < self.cameras.len());
        if !complete {
            return Err(wrong("triangles, lights or cameras that it moves were removed; set `animation` to `None` too".into()));
        }
        let world_from_nodes = animation.world_from_nodes(time).map_err(wrong)?;
        for instance in &animation.instances {
            instance.place(&world_from_nodes, &mut self.triangles[instance.first..]);
        }
        for &(light, node) in &animation.lights {
            self.lights[light].move_to(world_from_nodes[node]);
        }
        for &(camera, node) in &animation.cameras {
            let camera = &mut self.cameras[camera];
            *camera = Camera::from_node(&camera.name, world_from_nodes[node], camera.yfov);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
