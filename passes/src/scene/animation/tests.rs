//! Poses: what they move, what they keep, what they refuse.

use super::*;
use crate::scene::{Light, builtin};
use glam::Vec2;

/// Centre of the triangles of that material.
fn center(scene: &Scene, material: u32) -> Vec3 {
    let of = scene.triangles.iter().filter(|t| t.material == material);
    let corners: Vec<Vec3> = of.flat_map(|t| t.positions_world).collect();
    let (least, most) = corners.iter().fold((corners[0], corners[0]), |(least, most), &p| (least.min(p), most.max(p)));
    0.5 * (least + most)
}

fn light_at(scene: &Scene) -> Vec3 {
    let Light::Point { position_world, .. } = scene.lights[0] else { panic!("a point light") };
    position_world
}

/// One moving triangle, and nothing else.
fn one(tracks: Tracks) -> Scene {
    let corner = Triangle {
        positions_world: [Vec3::ZERO, Vec3::X, Vec3::Y],
        normals_world: [Vec3::Z; 3],
        uvs: [Vec2::ZERO, Vec2::X, Vec2::Y],
        material: 0,
    };
    let mut animation = Animation::default();
    let local = Local::Moving(Transform::default(), Box::new(tracks));
    let node = animation.add_node(Node { label: "node 0 `kite`".into(), parent: Parent::Still(Mat4::IDENTITY), local });
    animation.add_instance(node, 0, [corner].as_slice().into());
    Scene { name: "one".into(), triangles: vec![corner], animation: Some(Arc::new(animation)), ..Scene::default() }
}

fn moved_to(to: Vec3) -> Scene {
    one(Tracks { translation: Track::new(vec![1.0, 2.0], vec![Vec3::ZERO, to], Interpolation::Linear), ..Tracks::default() })
}

#[test]
fn objects_lights_and_cameras_follow_their_nodes() {
    let mut scene = builtin::moving();
    assert!((scene.duration().unwrap() - 4.0).abs() < 1e-6, "{:?}", scene.duration());
    for (time, lamp_x, quarter_turns) in [(0.0, -0.6, 0.0_f32), (1.0, 0.0, 1.0), (2.0, 0.6, 2.0), (3.5, -0.3, 3.5)] {
        scene.pose(time).unwrap();
        let lamp = center(&scene, 3);
        assert!(lamp.abs_diff_eq(Vec3::new(lamp_x, 1.95, 0.0), 1e-5), "lamp at {lamp}, {time} s");
        let eye = scene.camera(Some("ride")).unwrap().position_world();
        assert!(eye.abs_diff_eq(lamp, 1e-5), "camera at {eye}, {time} s");
        // Above the corner of a block that turns about (−0.2, −0.4).
        let (sin, cos) = (quarter_turns * std::f32::consts::FRAC_PI_2).sin_cos();
        let expected = Vec3::new(-0.2 + 0.3 * (cos + sin), 1.1, -0.4 + 0.3 * (cos - sin));
        assert!(light_at(&scene).abs_diff_eq(expected, 1e-5), "light at {} ≠ {expected}, {time} s", light_at(&scene));
        assert_eq!(scene.cameras[0], builtin::moving().cameras[0], "`fill` stands still");
    }
}

#[test]
fn a_pose_does_not_depend_on_those_before() {
    let mut wandering = builtin::moving();
    for time in [3.0, 0.1, -5.0, 1e9, 1.7] {
        wandering.pose(time).unwrap();
    }
    let mut straight = builtin::moving();
    straight.pose(1.7).unwrap();
    assert_eq!(wandering.triangles, straight.triangles);
    assert_eq!((wandering.lights, wandering.cameras), (straight.lights, straight.cameras));
}

#[test]
fn time_ends_at_the_keys_and_must_be_a_number() {
    let mut scene = moved_to(Vec3::X);
    for (time, x) in [(-1e30, 0.0_f32), (0.0, 0.0), (1.5, 0.5), (2.0, 1.0), (f32::MAX, 1.0)] {
        scene.pose(time).unwrap();
        assert_eq!(scene.triangles[0].positions_world[0].x.to_bits(), x.to_bits(), "at {time}");
    }
    let before = scene.triangles.clone();
    for time in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let error = scene.pose(time).unwrap_err().to_string();
        assert!(error.contains("`one`") && error.contains("finite number of seconds"), "{error}");
    }
    assert_eq!(scene.triangles, before);
    assert!(builtin::cornell().pose(1.0).is_ok() && builtin::cornell().duration().is_none(), "a still scene stays");
}

#[test]
fn what_moves_out_of_range_is_named_and_nothing_is_changed() {
    let mut scene = moved_to(Vec3::X * 3e8);
    scene.pose(1.1).unwrap();
    let before = scene.triangles.clone();
    let error = scene.pose(1.9).unwrap_err().to_string();
    for part in ["`one`", "1.9 s", "node 0 `kite`", "1e8 m"] {
        assert!(error.contains(part), "`{error}` should say `{part}`");
    }
    assert_eq!(scene.triangles, before);
    let mut scene = moved_to(Vec3::X * f32::MAX);
    assert!(scene.pose(1.5).is_err(), "halfway to the largest number");
    let mut scene = builtin::moving();
    scene.triangles.pop();
    scene.triangles.truncate(20);
    let error = scene.pose(1.0).unwrap_err().to_string();
    assert!(error.contains("were removed"), "{error}");
}

#[test]
fn a_mesh_may_shrink_to_nothing_and_grow_again() {
    let sizes = vec![Vec3::ONE, Vec3::ZERO, Vec3::ONE];
    let scale = Track::new(vec![0.0, 1.0, 2.0], sizes, Interpolation::Linear);
    let mut scene = one(Tracks { scale, ..Tracks::default() });
    let whole = scene.triangles.clone();
    scene.pose(1.0).unwrap();
    assert_eq!(scene.triangles[0].positions_world, [Vec3::ZERO; 3]);
    assert!(scene.triangles[0].normals_world.iter().all(|n| n.is_finite()), "{:?}", scene.triangles);
    scene.pose(2.0).unwrap();
    assert_eq!(scene.triangles, whole);
}
