//! [MML13]'s glossy model in whole scenes: photons and paths find the same light by it, strategies gather alike at it, and what it adds to
//! the light is on the books.
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping, Mara, McGuire and Luebke, I3D 2013"

use crate::beams::horizontal;
use crate::determinism::settings;
use glam::Vec3;
use lightloom_passes::decode_flux;
use lightloom_passes::scene::{Camera, Light, Material, Reflection, Scene, builtin};
use lightloom_strategies::{Splat3d, Splat25d, Strategy};
use lightloom_tests::{Frame, Lab, Mean, View, strategies};
use std::f64::consts::PI;

const ALBEDO: f32 = 0.5;
const BOUNCES: u32 = 5;
const SEEDS: u32 = 8;
/// Half the width of the part of the floor that is looked at (m).
const HALF: f32 = 0.4;

/// A floor of 4 m below a ceiling of 4 m at 1.8 m; between them, facing up, a lamp: a spot, or a panel of 0.6 m.
fn gap(floor: Material, ceiling: Material, panel: bool) -> Scene {
    let mut triangles = vec![horizontal(0.0, 2.0, true, 0), horizontal(1.8, 2.0, false, 1)];
    let mut lights = Vec::new();
    if panel {
        triangles.push(horizontal(1.2, 0.3, true, 2));
    } else {
        lights.push(Light::Spot {
            position_world: Vec3::new(0.1, 1.0, 0.0),
            direction_world: Vec3::Y,
            intensity: Vec3::ONE,
            cos_inner: 0.9,
            cos_outer: 0.75,
        });
    }
    Scene {
        triangles: triangles.concat(),
        materials: vec![floor, ceiling, Material::emitter("panel", Vec3::splat(4.0))],
        lights,
        reflection: Reflection::BlinnPhong,
        ..Scene::default()
    }
}

fn matt() -> Material {
    Material::lambert("matt", Vec3::splat(ALBEDO))
}

/// Sees just that part of the floor from below the lamp; film and floor are parallel, so that pixels are equal pieces of it.
fn view() -> View {
    let eye = Vec3::new(0.0, 0.9, 0.0);
    View::new(Camera::look_at("down", eye, Vec3::ZERO, Vec3::NEG_Z, 2.0 * (HALF / 0.9).atan()), [16, 16])
}

#[test]
fn photons_and_paths_agree_below_a_glossy_ceiling() {
    let Some(mut lab) = Lab::open() else { return };
    let plastic = Material { roughness: 0.25, ..Material::lambert("plastic", Vec3::splat(0.6)) };
    let cases = [
        (plastic, true),
        (Material::metal("brushed", Vec3::splat(0.8), 0.5), false),
        (Material::metal("rough", Vec3::splat(0.5), 1.0), false),
    ];
    for (ceiling, panel) in cases {
        let what = format!("{}, roughness {}, panel {panel}", ceiling.name, ceiling.roughness);
        let scene = lab.upload(&gap(matt(), ceiling, panel));
        let irradiance = |seed| {
            let traced = lab.photons(&scene, &settings(25_000, BOUNCES, seed));
            assert!(traced.state.dropped == 0 && traced.state.flux_ledger().balances(), "{what}: {:?}", traced.state);
            let seen = |p: &[f32; 3]| p[1].abs() < 1e-4 && p[0].abs() < HALF && p[2].abs() < HALF;
            let inside = traced.records.iter().filter(|photon| seen(&photon.position));
            inside.map(|photon| f64::from(decode_flux(photon.flux).y)).sum::<f64>() / f64::from(4.0 * HALF * HALF)
        };
        let photons = Mean::of(&(0..SEEDS).map(irradiance).collect::<Vec<_>>());
        let images = lab.path(&scene, &view(), 160, 1, BOUNCES);
        assert!(images.direct.mean.mean()[1] < 1e-9, "the lamp faces up");
        let (paths, scale) = (images.indirect.grey(), PI / f64::from(ALBEDO));
        let error = photons.standard_error.hypot(paths.standard_error * scale);
        Mean { value: photons.value, standard_error: error }.assert_near(paths.value * scale, 0.0, &what);
        assert!(error < 0.035 * photons.value, "{what}: precise enough to mean something: {photons:?}, {paths:?}");
    }
}

/// The glossy floor is gathered at; photons come from a Lambertian ceiling, which is lit by the lamp.
#[test]
fn gathering_at_a_glossy_floor_agrees_with_paths() {
    let Some(mut lab) = Lab::open() else { return };
    let floor = Material { roughness: 0.5, metallic: 0.5, ..matt() };
    let scene = gap(floor, matt(), false);
    let uploaded = lab.upload(&scene);
    let mut all = strategies(&lab.sources, 0.2, 0.2);
    all.truncate(1);
    let estimate = |seed| {
        let frame = Frame { photons: settings(20_000, BOUNCES, seed), maps: None, deterministic: false };
        lab.estimate(&uploaded, &view(), frame, &mut all).layers[0][0].mean()[1]
    };
    let gathered = Mean::of(&(0..SEEDS).map(estimate).collect::<Vec<_>>());
    let paths = lab.path(&uploaded, &view(), 192, 1, BOUNCES).indirect.grey();
    let error = gathered.standard_error.hypot(paths.standard_error);
    // The kernel's bias, r²∇²E/10 about, of light from a ceiling 1.8 m away: E''/E ≈ 8/1.8² at the most, 1 %; 16-bit codes and 8-bit roughness 0.3 %.
    Mean { value: gathered.value, standard_error: error }.assert_near(paths.value, 0.013 * paths.value, "glossy floor");
    assert!(error < 0.02 * paths.value, "precise enough to mean something: {gathered:?}, {paths:?}");
    let gltf = lab.upload(&Scene { reflection: Reflection::Gltf, ..scene });
    let other = lab.path(&gltf, &view(), 64, 1, BOUNCES).indirect.grey();
    assert!((other.value / paths.value - 1.0).abs() > 0.1, "glTF's model is another: {other:?}, {paths:?}");
}

/// Rasterised splats are variants too. A pixel sums some 45 terms in 16 bits, each partial sum cut by up to 2⁻¹⁰ of itself and so by half of
/// that: 45 · 2⁻¹² of the whole on average.
#[test]
fn splats_reflect_as_exact_does() {
    let Some(mut lab) = Lab::open() else { return };
    let mut scene = builtin::cornell();
    scene.materials[0] = Material { roughness: 0.4, metallic: 0.5, ..scene.materials[0].clone() };
    let view = View::new(scene.cameras[0].clone(), [48, 27]);
    let frame = Frame { photons: settings(6_000, 3, 5), maps: None, deterministic: false };
    let mut all = strategies(&lab.sources, 0.2, 0.2);
    all.truncate(1);
    let splats: [Box<dyn Strategy>; 2] =
        [Box::new(Splat3d::new(&lab.sources).expect("it builds")), Box::new(Splat25d::new(&lab.sources).expect("it builds"))];
    for mut splat in splats {
        for (key, value) in [("shape", "sphere"), ("r_max", "0.2"), ("r_min", "0.2")] {
            splat.set(key, value).expect("it has the parameter");
        }
        all.push(splat);
    }
    let mut means = Vec::new();
    for reflection in [Reflection::Gltf, Reflection::BlinnPhong] {
        scene.reflection = reflection;
        let uploaded = lab.upload(&scene);
        let layers = lab.estimate(&uploaded, &view, frame, &mut all).layers;
        let exact = layers[0][0].mean()[1];
        for layer in &layers[1..] {
            let ratio = layer[0].mean()[1] / exact;
            assert!((ratio - 1.0).abs() < 1.1e-2, "{reflection:?}: a splat sums {ratio} of exact's light");
        }
        means.push(exact);
    }
    assert!((means[1] / means[0] - 1.0).abs() > 0.05, "the models differ: {means:?}");
}

/// White plastic reflects more than it receives: the photons' flux grows, and the ledger says by how much.
#[test]
fn light_that_the_model_adds_is_on_the_books() {
    let Some(mut lab) = Lab::open() else { return };
    let mut scene = builtin::closed_sphere(3);
    scene.materials[0] = Material { roughness: 0.5, ..Material::lambert("white plastic", Vec3::ONE) };
    let mut taken = Vec::new();
    for reflection in [Reflection::Gltf, Reflection::BlinnPhong] {
        scene.reflection = reflection;
        let uploaded = lab.upload(&scene);
        let ledger = lab.photons(&uploaded, &settings(10_000, 3, 1)).state.flux_ledger();
        assert!(ledger.balances(), "{reflection:?}: {ledger:?}");
        taken.push(ledger.absorbed[1] as f64 / ledger.emitted[1] as f64);
    }
    println!("absorbed: {taken:?} of the light");
    assert!(taken[1] < -0.01 && taken[0] > taken[1], "flux grows by what the lobe adds: {taken:?}");
}
