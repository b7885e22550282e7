//! A thin wall between a lit and a dark room, thinner than kernels are wide. What the estimators guarantee is this, and no more:
//!
//! - A surface takes no photon of one that faces another way. Both sides of a wall oppose each other: by their normals
//!   (`MIN_NORMAL_COSINE`), and by where the light came from, behind the dark side. On the dark side itself there is no light, however thin the wall.
//! - A kernel ends at its radius. Floor, ceiling and side walls go on behind the wall, and their photons before it are within reach of
//!   points behind it that face the same way: light leaks there, as far as a radius from the lit room and no farther. (A disc is stretched where light
//!   grazes; its radius is what the strategy itself states as its reach.)
//!
//! No light means 0, not little. That light does leak within a radius shows that 0 beyond it is the kernels' end and not the photons'.

use crate::determinism::settings;
use glam::{Vec2, Vec3};
use lightloom_passes::scene::{Camera, Scene, Triangle, builtin};
use lightloom_tests::kernel::Kernel;
use lightloom_tests::{Estimator, Frame, Lab, View};

/// Where the wall's lit side is, and its thickness (m).
const WALL: f32 = 3.0;
const THICKNESS: f32 = 0.01;
/// Kernel radii (m): of cones, and of discs before they are stretched.
const CONE: f64 = 0.4;
const DISC: f64 = 0.15;
const EMITTED: u32 = 20_000;

/// A wall across the box at `z`, facing up or down z; it goes on into the box's own walls, so that no edge lets a ray through.
fn wall(z: f32, facing: f32) -> [Triangle; 2] {
    let at = |x: f32, y: f32| Vec3::new(if x > 0.5 { 3.2 } else { -0.2 }, if y > 0.5 { 4.2 } else { -0.2 }, z);
    let corners = [[at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0)], [at(0.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]];
    corners.map(|[a, b, c]| Triangle {
        positions_world: if facing > 0.0 { [a, b, c] } else { [a, c, b] },
        normals_world: [Vec3::new(0.0, 0.0, facing); 3],
        uvs: [Vec2::ZERO; 3],
        material: 0,
    })
}

/// The closed box with its lamp, in two rooms; the eye is in the dark one.
fn scene() -> Scene {
    let mut scene = builtin::closed_box(0.5);
    scene.triangles.extend(wall(WALL, -1.0));
    scene.triangles.extend(wall(WALL + THICKNESS, 1.0));
    scene.cameras = vec![Camera::look_at("dark", Vec3::new(2.8, 3.6, 4.9), Vec3::new(1.2, 1.5, WALL), Vec3::Y, 1.4)];
    scene
}

#[test]
fn no_light_is_gathered_through_a_wall() {
    let Some(mut lab) = Lab::open_blending() else { return };
    let scene = scene();
    let gpu_scene = lab.upload(&scene);
    let view = View::new(scene.cameras[0].clone(), [64, 48]);
    let estimators: Vec<_> = Estimator::ALL.into_iter().filter(|it| it.runs_on(&lab)).collect();
    let radius = |it: &Estimator| if it.kernel == Kernel::Cone { CONE } else { DISC };
    let mut strategies: Vec<_> = estimators.iter().map(|it| it.build(&lab.sources, radius(it), radius(it))).collect();
    let frame = Frame { photons: settings(EMITTED, 8, 12), maps: None, deterministic: false };
    let estimates = lab.estimate(&gpu_scene, &view, frame, &mut strategies);
    let records = &estimates.traced.records;
    assert!(records.iter().all(|photon| photon.position[2] <= WALL * 1.000_001), "every photon is in the lit room");
    let on_wall = records.iter().filter(|photon| photon.position[2] > WALL * 0.999_999).count();
    assert!(on_wall > 500, "{on_wall} photons lie on the wall, a hand's breadth from what the eye sees");

    for ((estimator, strategy), [image, caustic]) in estimators.iter().zip(&strategies).zip(&estimates.layers) {
        let reach = strategy.reach_m(&gpu_scene.info(), EMITTED).expect("kernels end");
        let (mut dark_side, mut beyond, mut leaks) = (0, 0, 0);
        for (index, place) in estimates.positions.iter().enumerate() {
            let ([x, y, z, _], light) = (*place, [image.pixels[index], caustic.pixels[index]]);
            let black = light == [[0.0; 3]; 2];
            // The box is 3 × 4 m across.
            let on_box = [x, y].into_iter().zip([3.0, 4.0]).any(|(at, side)| at.min(side - at) < 1e-3);
            if !on_box && z < WALL + 1.5 * THICKNESS {
                dark_side += 1;
                assert!(black, "{estimator}: {light:?} on the wall's dark side at {place:?}");
            } else if z > WALL + reach {
                beyond += 1;
                assert!(black, "{estimator}: {light:?} at {place:?}, beyond {reach} m from the lit room");
            } else {
                leaks += u32::from(!black);
            }
        }
        println!(
            "{estimator}: reach {reach:.3} m; {dark_side} pixels of the dark side, {beyond} beyond reach, {leaks} within it lit"
        );
        assert!(dark_side > 300 && beyond > 300, "{dark_side} pixels show the dark side, {beyond} what is beyond reach");
        assert!(leaks > 100, "{estimator}: {leaks} pixels within reach are lit");
    }
}
