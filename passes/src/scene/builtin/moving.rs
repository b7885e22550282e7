//! A scene that moves.

use super::{FOURTH, THIRD, WHITE, room};
use crate::scene::animation::{Animation, Interpolation, Local, Node, Parent, Track, Tracks};
use crate::scene::mesh::{cuboid, icosphere, quad};
use crate::scene::placement::Transform;
use crate::scene::{Camera, Light, Material, Scene, Triangle};
use glam::{Mat4, Quat, Vec3};
use std::f32::consts::TAU;
use std::sync::Arc;

/// Seconds that [`moving`] takes.
const DURATION: f32 = 4.0;

/// The room of [`cornell`](super::cornell) over 4 s. A lamp of 0.5 × 0.4 m and 20 W·m⁻²·sr⁻¹, flux 4π W, glides below the ceiling from left
/// to right and back; a glass sphere (radius 0.3 m, ior 1.5) rolls the other way; a block turns once about its axis and carries a
/// point light of 0.5 W·sr⁻¹ above one of its corners. Camera `ride` goes along with the lamp; `fill` and `classic` stand still.
pub fn moving() -> Scene {
    let mut scene = room("moving");
    scene.materials.push(Material::emitter("lamp", Vec3::splat(20.0)));
    scene.materials.push(Material::glass("glass", 1.5, 0.6));
    let mut animation = Animation::default();

    let h = Vec3::new(0.25, 0.0, 0.2);
    let lamp = quad([h * Vec3::new(-1.0, 1.0, -1.0), h * Vec3::new(1.0, 1.0, -1.0), h, h * Vec3::new(-1.0, 1.0, 1.0)], THIRD);
    let gliding = animation.add_node(node("lamp", there_and_back(Vec3::new(-0.6, 1.95, 0.0), Vec3::new(0.6, 1.95, 0.0))));
    carry(&mut scene, &mut animation, gliding, lamp);

    let sphere = icosphere(4, FOURTH);
    let rolling = animation.add_node(Node {
        local: Local::Moving(
            Transform { scale: Vec3::splat(0.3), ..Transform::default() },
            Box::new(there_and_back(Vec3::new(0.6, 0.31, 0.4), Vec3::new(-0.4, 0.31, 0.4))),
        ),
        ..node("sphere", Tracks::default())
    });
    carry(&mut scene, &mut animation, rolling, sphere);

    // Thirds of a turn: between two keys a rotation goes the short way.
    let times = [0.0, 1.0, 2.0, 3.0].map(|third| third * DURATION / 3.0).to_vec();
    let turns = [0.0, 1.0, 2.0, 3.0].map(|third| Quat::from_rotation_y(third * TAU / 3.0)).to_vec();
    let turn = Tracks { rotation: Track::new(times, turns, Interpolation::Linear), ..Tracks::default() };
    let at = Transform { translation: Vec3::new(-0.2, 0.0, -0.4), ..Transform::default() };
    let turning = animation.add_node(Node { local: Local::Moving(at, Box::new(turn)), ..node("block", Tracks::default()) });
    carry(&mut scene, &mut animation, turning, cuboid(Vec3::new(-0.3, 0.0, -0.3), Vec3::new(0.3, 0.9, 0.3), WHITE));
    let carried = animation.add_node(Node {
        label: "carried light".into(),
        parent: Parent::Moving(turning),
        local: Local::Still(Mat4::from_translation(Vec3::new(0.3, 1.1, 0.3))),
    });
    animation.add_light(scene.lights.len(), carried);
    scene.lights.push(Light::Point { position_world: Vec3::ZERO, intensity: Vec3::splat(0.5) });
    scene.light_names.push("carried".into());

    animation.add_camera(scene.cameras.len(), gliding);
    scene.cameras.push(Camera::look_at("ride", Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 1.0));
    scene.animation = Some(Arc::new(animation));
    let posed = scene.pose(0.0);
    debug_assert!(posed.is_ok(), "all keys lie within the room: {posed:?}");
    scene
}

fn node(label: &str, tracks: Tracks) -> Node {
    let local = Local::Moving(Transform::default(), Box::new(tracks));
    Node { label: label.into(), parent: Parent::Still(Mat4::IDENTITY), local }
}

fn there_and_back(from: Vec3, to: Vec3) -> Tracks {
    let times = vec![0.0, 0.5 * DURATION, DURATION];
    Tracks { translation: Track::new(times, vec![from, to, from], Interpolation::Linear), ..Tracks::default() }
}

fn carry(scene: &mut Scene, animation: &mut Animation, node: usize, mesh: Vec<Triangle>) {
    animation.add_instance(node, scene.triangles.len(), mesh.as_slice().into());
    scene.triangles.extend(mesh);
}
