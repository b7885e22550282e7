//! Light through frosted panes: photons carry flux downwards, paths carry radiance upwards, and both find the same irradiance on the
//! floor. Across a single interface, with the floor inside the medium, they agree only if the square of the index is in the one and not in
//! the other.

use crate::beams::horizontal;
use crate::determinism::settings;
use glam::Vec3;
use lightloom_passes::scene::{Camera, Light, Material, Scene};
use lightloom_passes::{PhotonFlags, decode_flux};
use lightloom_strategies::{Layer, Pipeline, Settings, by_name};
use lightloom_tests::{Image, Lab, Mean, Pixels, View};
use std::f64::consts::PI;
use std::ops::ControlFlow;

const ALBEDO: f32 = 0.5;
const BOUNCES: u32 = 8;
/// Half the width of the part of the floor that is looked at (m).
const HALF: f32 = 0.5;
const CAMERA_HEIGHT: f32 = 1.0;
const SEEDS: u32 = 8;

/// What is between the lamp, 2.2 m above the floor, and the floor.
#[derive(Clone, Copy, Debug)]
enum Pane {
    /// 0.2 m thick.
    Slab,
    Thin,
    /// The upper face alone: the floor is in the medium.
    Interface,
}

fn glass(pane: Pane, roughness: f32) -> Material {
    let thickness_m = if let Pane::Thin = pane { 0.0 } else { 0.2 };
    Material { roughness, ..Material::glass("glass", 1.5, thickness_m) }
}

fn scene(pane: Pane, glass: Material) -> Scene {
    let mut triangles = vec![horizontal(0.0, 2.0, true, 0), horizontal(1.8, 2.0, true, 1)];
    if let Pane::Slab = pane {
        triangles.push(horizontal(1.6, 2.0, false, 1));
    }
    Scene {
        triangles: triangles.concat(),
        materials: vec![Material::lambert("floor", Vec3::splat(ALBEDO)), glass],
        ..Scene::default()
    }
}

#[derive(Clone, Copy, Debug)]
enum Lamp {
    Spot,
    /// A square of 2 m that faces down.
    Panel,
}

fn lit(mut scene: Scene, lamp: Lamp) -> Scene {
    if let Lamp::Spot = lamp {
        scene.lights = vec![Light::Spot {
            position_world: Vec3::new(0.1, 4.0, 0.0),
            direction_world: Vec3::NEG_Y,
            intensity: Vec3::ONE,
            cos_inner: 0.9,
            cos_outer: 0.75,
        }];
        return scene;
    }
    scene.materials.push(Material::emitter("panel", Vec3::splat(4.0)));
    scene.triangles.extend(horizontal(2.6, 1.0, false, 2));
    scene
}

/// Mean irradiance (W·m⁻²) of the part of the floor, of light that met something before.
fn by_photons(lab: &mut Lab, scene: &Scene, emitted: u32) -> Mean {
    let scene = lab.upload(scene);
    let irradiance = |seed| {
        let traced = lab.photons(&scene, &settings(emitted, BOUNCES, seed));
        assert_eq!(traced.state.dropped, 0, "every photon is stored");
        assert!(traced.state.flux_ledger().balances(), "{:?}", traced.state.flux_ledger());
        let inside = traced
            .records
            .iter()
            .filter(|p| p.position[1].abs() < 1e-4 && p.position[0].abs() < HALF && p.position[2].abs() < HALF);
        inside.map(|photon| f64::from(decode_flux(photon.flux).y)).sum::<f64>() / f64::from(4.0 * HALF * HALF)
    };
    Mean::of(&(0..SEEDS).map(irradiance).collect::<Vec<_>>())
}

/// A camera that sees exactly that part: film and floor are parallel, so that the mean over pixels is the mean over the floor.
fn view() -> View {
    let eye = Vec3::new(0.0, CAMERA_HEIGHT, 0.0);
    View::new(Camera::look_at("down", eye, Vec3::ZERO, Vec3::NEG_Z, 2.0 * (HALF / CAMERA_HEIGHT).atan()), [16, 16])
}

fn by_paths(lab: &mut Lab, scene: &Scene, samples: u32) -> Mean {
    let scene = lab.upload(scene);
    let images = lab.path(&scene, &view(), samples, 1, BOUNCES);
    assert!(images.direct.mean.mean()[1] < 1e-9, "the pane is in the way");
    from_radiance(images.indirect.grey())
}

/// Irradiance of the Lambertian floor.
fn from_radiance(mean: Mean) -> Mean {
    let scale = PI / f64::from(ALBEDO);
    Mean { value: mean.value * scale, standard_error: mean.standard_error * scale }
}

#[track_caller]
fn assert_agree(photons: Mean, paths: Mean, what: &str) {
    let error = photons.standard_error.hypot(paths.standard_error);
    Mean { value: photons.value, standard_error: error }.assert_near(paths.value, 0.0, what);
    assert!(error < 0.025 * paths.value, "{what}: precise enough to mean something: {photons:?}, {paths:?}");
}

#[test]
fn photons_and_paths_agree_below_frosted_panes() {
    let Some(mut lab) = Lab::open() else { return };
    let cases = [
        (Pane::Slab, 0.2, Lamp::Panel),
        (Pane::Slab, 0.8, Lamp::Spot),
        (Pane::Thin, 0.5, Lamp::Panel),
        (Pane::Interface, 0.2, Lamp::Panel),
        (Pane::Interface, 0.8, Lamp::Spot),
    ];
    for (pane, roughness, lamp) in cases {
        let scene = lit(scene(pane, glass(pane, roughness)), lamp);
        let (photons, paths) = (by_photons(&mut lab, &scene, 50_000), by_paths(&mut lab, &scene, 256));
        assert_agree(photons, paths, &format!("{pane:?}, roughness {roughness}, {lamp:?}"));
    }
}

/// The part of a lamp's light that is specular at a surface which is so in part comes from light paths.
#[test]
fn photons_and_paths_agree_below_a_half_clear_pane() {
    let Some(mut lab) = Lab::open() else { return };
    let material = Material { transmission: 0.5, roughness: 0.0, ..glass(Pane::Thin, 0.0) };
    let scene = lit(scene(Pane::Thin, material), Lamp::Spot);
    let photons = by_photons(&mut lab, &scene, 20_000);
    let View { camera, size, .. } = view();
    let settings = Settings { size, frames: 8, bounces: BOUNCES, seed: 1, layers: vec![Layer::Indirect], ..Settings::default() };
    let gpu_scene = lab.upload(&scene);
    let mut pipeline = Pipeline::new(by_name("path").expect("it exists")).expect("the shaders are valid");
    pipeline.strategy_mut().set("light_paths", "20000").expect("it has the parameter");
    let rendered = pipeline.render(&mut lab.executor, &gpu_scene, &camera, &settings, &mut |_| ControlFlow::Continue(()));
    let rendered = rendered.unwrap_or_else(|error| panic!("{error}"));
    let layer = rendered.layer(Layer::Indirect).expect("it was asked for");
    let errors = layer.standard_error.as_ref().expect("of many frames");
    let [mean, standard_error] = [&layer.pixels, errors].map(|pixels| Image::from_rgb(size, pixels));
    assert_agree(photons, from_radiance(Pixels { mean, standard_error }.grey()), "half clear");
}

/// Below `MIN_ALPHA` what passes is a caustic, above it is not.
#[test]
fn the_finest_frost_is_smooth() {
    let Some(mut lab) = Lab::open() else { return };
    for (roughness, caustic) in [(0.0, true), (0.03, true), (0.033, false)] {
        let scene = lab.upload(&lit(scene(Pane::Slab, glass(Pane::Slab, roughness)), Lamp::Spot));
        let records = lab.photons(&scene, &settings(2_000, 2, 1)).records;
        let below: Vec<_> = records.iter().filter(|photon| photon.position[1].abs() < 1e-4 && photon.bounces() == 2).collect();
        assert!(below.len() > 500, "roughness {roughness}: {} photons", below.len());
        for photon in below {
            let expected = if caustic { PhotonFlags::CAUSTIC | PhotonFlags::LIGHT_ONLY } else { PhotonFlags::GLOSSY };
            assert_eq!(photon.bounce_flags & 0xff00, expected, "roughness {roughness}");
        }
    }
}
