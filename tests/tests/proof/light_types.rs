//! Photons and paths agree within 2 % in the mean for each type of light: below a wall that it falls on, a floor is lit by what the wall
//! reflects, as photons gathered by `hash-grid` say and as paths from the eye say.
//!
//! Kernels of 0.1 m bias the mean over 2 m × 2 m of smooth light by far less (r²∇²E/8), and none reaches over the floor's edge. The means are
//! required to be so precise that three of their errors are about the 2 %.

use crate::determinism::settings;
use crate::{beams::horizontal, lights::sky};
use glam::{Vec2, Vec3};
use lightloom_passes::scene::{Camera, Light, Material, Scene, Triangle};
use lightloom_strategies::HashGrid;
use lightloom_tests::{Frame, Lab, Mean, View, strategies};

const BOUNCES: u32 = 4;
const SEEDS: u32 = 8;
const RADIUS: f32 = 0.1;
/// Half the width of the part of the floor that is looked at (m).
const HALF: f32 = 1.0;

/// A floor of 4 m × 4 m and, 1.5 m behind its middle, a wall 3 m high.
fn corner() -> Scene {
    let at = |x: f32, y: f32| Vec3::new(x, y, -1.5);
    let wall = [[at(-2.0, 0.0), at(2.0, 0.0), at(2.0, 3.0)], [at(-2.0, 0.0), at(2.0, 3.0), at(-2.0, 3.0)]];
    let wall =
        wall.map(|positions_world| Triangle { positions_world, normals_world: [Vec3::Z; 3], uvs: [Vec2::ZERO; 3], material: 0 });
    Scene {
        triangles: [horizontal(0.0, 2.0, true, 0), wall].concat(),
        materials: vec![Material::lambert("grey", Vec3::splat(0.7))],
        ..Scene::default()
    }
}

#[track_caller]
fn assert_agree(scene: &Scene, emitted: u32, samples: u32) {
    let Some(mut lab) = Lab::open() else { return };
    let scene = lab.upload(scene);
    let height = 1.0;
    let camera = Camera::look_at("down", Vec3::new(0.0, height, 0.0), Vec3::ZERO, Vec3::NEG_Z, 2.0 * (HALF / height).atan());
    let view = View::new(camera, [24, 24]);
    let mut hash_grid = strategies(&lab.sources, RADIUS, RADIUS);
    hash_grid.retain(|strategy| strategy.name() == HashGrid::NAME);
    let gathered = |seed| {
        let frame = Frame { photons: settings(emitted, BOUNCES, seed), maps: None, deterministic: false };
        let estimates = lab.estimate(&scene, &view, frame, &mut hash_grid);
        assert_eq!(estimates.traced.state.dropped, 0, "every photon is stored");
        estimates.layers[0][0].mean().iter().sum::<f64>() / 3.0
    };
    let photons = Mean::of(&(1..=SEEDS).map(gathered).collect::<Vec<_>>());
    let paths = lab.path(&scene, &view, samples, 1, BOUNCES).indirect.grey();
    let ratio = photons.value / paths.value;
    let error = photons.standard_error.hypot(paths.standard_error) / paths.value;
    println!("photons {photons:?}, paths {paths:?}: ratio {ratio:.4} ± {error:.4}");
    assert!(error < 0.008, "precise enough to mean something: {error}");
    assert!((ratio - 1.0).abs() < 0.02, "photons find {ratio} of what paths find");
}

#[test]
fn a_point_light() {
    let mut scene = corner();
    scene.lights = vec![Light::Point { position_world: Vec3::new(0.3, 1.2, -0.8), intensity: Vec3::ONE }];
    assert_agree(&scene, 200_000, 512);
}

#[test]
fn a_spot_light() {
    let mut scene = corner();
    scene.lights = vec![Light::Spot {
        position_world: Vec3::new(0.0, 1.5, 1.0),
        direction_world: Vec3::new(0.1, -0.1, -1.0).normalize(),
        intensity: Vec3::ONE,
        cos_inner: 0.95,
        cos_outer: 0.85,
    }];
    assert_agree(&scene, 60_000, 512);
}

#[test]
fn a_directional_light() {
    let mut scene = corner();
    let direction_world = Vec3::new(0.1, -0.5, -1.0).normalize();
    scene.lights = vec![Light::Directional { direction_world, irradiance: Vec3::ONE }];
    assert_agree(&scene, 150_000, 384);
}

#[test]
fn a_panel_that_emits() {
    let mut scene = corner();
    scene.materials.push(Material::emitter("panel", Vec3::ONE));
    scene.triangles.extend(horizontal(2.0, 0.4, false, 1));
    assert_agree(&scene, 150_000, 384);
}

#[test]
fn an_environment() {
    let mut scene = corner();
    scene.set_environment(sky());
    assert_agree(&scene, 200_000, 256);
}
