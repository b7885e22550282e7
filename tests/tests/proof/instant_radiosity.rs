//! `instant-radiosity` against closed forms, `path`, and itself.
//!
//! Lights are the same for all pixels of a frame, so that errors of pixels are not independent: standard errors below come from the scatter of
//! whole images of different seeds.

use glam::Vec3;
use lightloom_passes::scene::{Camera, GpuScene, Light, Material, builtin};
use lightloom_passes::{PhotonFlags, PhotonSettings, PhotonStore, decode_flux};
use lightloom_strategies::{InstantRadiosity, Layer, Pipeline, Rendered, Settings, by_name_with};
use lightloom_tests::{Image, Lab, Mean, View};
use std::f64::consts::PI;
use std::ops::ControlFlow;

const PROGRESSIVE: &[(&str, &str)] = &[("lights", "256")];
const REALTIME: &[(&str, &str)] = &[("mode", "realtime"), ("lights", "256"), ("tile", "2"), ("history", "4")];

fn pipeline(lab: &Lab, name: &str, set: &[(&str, &str)]) -> Pipeline {
    let mut strategy = by_name_with(name, &lab.sources).expect("it exists");
    for (key, value) in set {
        strategy.set(key, value).expect("it has the parameter");
    }
    Pipeline::new(strategy).expect("the shaders are valid")
}

fn render(lab: &mut Lab, pipeline: &mut Pipeline, scene: &GpuScene, camera: &Camera, settings: &Settings) -> Rendered {
    lab.executor.set_timing(false);
    let rendered = pipeline.render(&mut lab.executor, scene, camera, settings, &mut |_| ControlFlow::Continue(()));
    rendered.unwrap_or_else(|error| panic!("{error}"))
}

fn image(rendered: &Rendered, layer: Layer) -> Image {
    Image::from_rgb(rendered.size, &rendered.layer(layer).expect("it was asked for").pixels)
}

fn settings(size: [u32; 2], frames: u32, bounces: u32) -> Settings {
    let layers = vec![Layer::Indirect, Layer::Caustic];
    Settings { size, frames, bounces, photons: 4_000, layers, ..Settings::default() }
}

fn grey(image: &Image) -> f64 {
    image.mean().iter().sum::<f64>() / 3.0
}

/// Mean of indirect light over the images of `seeds`.
fn mean(lab: &mut Lab, scene: &GpuScene, camera: &Camera, settings: &Settings, set: &[(&str, &str)], seeds: u32) -> Mean {
    let mut pipeline = pipeline(lab, InstantRadiosity::NAME, set);
    let means: Vec<_> = (0..seeds)
        .map(|seed| {
            let settings = Settings { seed, ..settings.clone() };
            let rendered = render(lab, &mut pipeline, scene, camera, &settings);
            assert!(rendered.warnings.is_empty(), "{:?}", rendered.warnings);
            grey(&image(&rendered, Layer::Indirect))
        })
        .collect();
    Mean::of(&means)
}

/// PHYSICS check 1. Inside a sphere cos θ cos θ′ / r² is ¼ for any two points, so that every light lights every pixel alike, the estimate of a pixel
/// is the flux of all vertices, and candidates that bring the same are resampled without noise: what is left is the scatter of the number of
/// vertices to a photon. On the polyhedron ¼ is off by its planes' distance from the centre, squared, less than 1 %; and no shadow ray may be stopped.
#[test]
fn half_of_the_light_in_a_sphere_is_indirect() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::closed_sphere(4);
    let gpu_scene = lab.upload(&scene);
    let camera = Camera::look_at("wide", Vec3::new(0.03, 0.05, 0.11), Vec3::new(0.4, 0.1, -1.0), Vec3::Y, 2.0);
    for set in [PROGRESSIVE, REALTIME] {
        let settings = Settings { photons: 8_000, ..settings([12, 12], 2, 24) };
        let mean = mean(&mut lab, &gpu_scene, &camera, &settings, set, 4);
        // A photon leaves 1 + n vertices, n of variance 2 about 1: 0.7/√N of the sum, 0.0014 of four images, which tell it within a factor of 2.5.
        let noise = 0.5 * 0.7 / (4.0 * 2.0 * 8_000.0_f64).sqrt();
        assert!(mean.standard_error < 2.5 * noise, "{mean:?}");
        mean.assert_near(0.5, 0.5 * 0.01, &format!("{set:?}"));
    }
}

/// PHYSICS check 6, the emitting disc replaced by one that the sun lights evenly, aslant and past the other: as bright as ρE/π, it sends 0.5390 times that to
/// the other on average. The lattice of pixels counts the disc's area within 1 %, see `discs`.
#[test]
fn a_lit_disc_lights_another_by_their_form_factor() {
    const SIZE: u32 = 48;
    let Some(mut lab) = Lab::open() else { return };
    let mut scene = builtin::two_discs();
    scene.materials[1] = Material::lambert("sender", Vec3::splat(0.5));
    let direction_world = Vec3::new(0.75_f32.sqrt(), 0.5, 0.0);
    scene.lights = vec![Light::Directional { direction_world, irradiance: Vec3::splat(2.0) }];
    let gpu_scene = lab.upload(&scene);
    let camera = &scene.cameras[0];
    let across = 2.0 * (0.5 * f64::from(camera.yfov)).tan() * f64::from(camera.position_world().y);
    // L = ρ/π, twice; from the mean over the picture to that over the disc.
    let expected = 0.25 / (PI * PI) * PI * 0.5 * (6.0 - 32.0_f64.sqrt());
    let scale = across * across / PI;
    for set in [PROGRESSIVE, REALTIME] {
        let Mean { value, standard_error } = mean(&mut lab, &gpu_scene, camera, &settings([SIZE, SIZE], 1, 1), set, 6);
        let mean = Mean { value: value * scale, standard_error: standard_error * scale };
        assert!(mean.standard_error < 0.02 * expected, "{mean:?}");
        mean.assert_near(expected, 0.01 * expected, &format!("{set:?}"));
    }
}

/// Light of one and of two scatterings before the visible surface is that of paths.
#[test]
fn light_of_few_bounces_is_that_of_paths() {
    const SIZE: [u32; 2] = [24, 18];
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::cornell();
    let gpu_scene = lab.upload(&scene);
    let camera = &scene.cameras[0];
    for bounces in [1, 2] {
        let path = lab.path(&gpu_scene, &View::new(camera.clone(), SIZE), 96, bounces, bounces).indirect.grey();
        for set in [PROGRESSIVE, REALTIME] {
            let Mean { value, standard_error } = mean(&mut lab, &gpu_scene, camera, &settings(SIZE, 2, bounces), set, 6);
            let standard_error = standard_error.hypot(path.standard_error);
            assert!(standard_error < 0.03 * value, "precise enough to mean something: {value} ± {standard_error}");
            Mean { value, standard_error }.assert_near(path.value, 0.0, &format!("{bounces} bounces, {set:?}"));
        }
    }
}

/// Two images of one seed differ by just what is reported.
#[test]
fn what_the_clamp_took_is_reported() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::cornell();
    let gpu_scene = lab.upload(&scene);
    let luminance = |[r, g, b]: [f64; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    for (clamp, warns) in [("0.3", false), ("1.5", true)] {
        let settings = settings([32, 24], 1, 4);
        let [free, clamped] = [&[][..], &[("clamp", clamp)]].map(|set| {
            let mut pipeline = pipeline(&lab, InstantRadiosity::NAME, set);
            render(&mut lab, &mut pipeline, &gpu_scene, &scene.cameras[0], &settings)
        });
        let ppm = |rendered: &Rendered| {
            rendered
                .stats
                .iter()
                .find(|(name, _)| name == "clamp_removed_ppm")
                .map(|(_, ppm)| f64::from(*ppm))
                .expect("it is counted")
        };
        let [all, left] = [&free, &clamped].map(|rendered| image(rendered, Layer::Indirect));
        let pairs = all.pixels.as_flattened().iter().zip(left.pixels.as_flattened());
        assert!(pairs.clone().all(|(all, left)| *left <= all * 1.000_01), "a clamp only darkens");
        let taken = 1.0e6 * (1.0 - luminance(left.mean()) / luminance(all.mean()));
        println!("clamp {clamp}: {taken:.1} ppm taken, {} reported", ppm(&clamped));
        assert!(taken > 100.0 && (ppm(&clamped) - taken).abs() < 20.0, "{taken} ppm, reported {}", ppm(&clamped));
        assert!(ppm(&free) == 0.0 && free.warnings.is_empty(), "{:?}", free.warnings);
        let told = clamped.warnings.iter().any(|warning| warning.contains("clamp_removed_ppm") && warning.contains('%'));
        assert_eq!(told, warns, "{:?}", clamped.warnings);
    }
}

#[test]
fn images_are_equal_bit_for_bit() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::cornell();
    let gpu_scene = lab.upload(&scene);
    for set in [PROGRESSIVE, REALTIME] {
        let mut pipeline = pipeline(&lab, InstantRadiosity::NAME, set);
        let settings = settings([24, 16], 2, 4);
        let [first, second] = [(); 2].map(|()| render(&mut lab, &mut pipeline, &gpu_scene, &scene.cameras[0], &settings));
        assert!(first.layers == second.layers, "{set:?}");
        assert!(grey(&image(&first, Layer::Indirect)) > 0.0, "{set:?}: it sees light");
        assert!(grey(&image(&first, Layer::Caustic)) == 0.0, "{set:?}: no caustics");
    }
}

/// All light is in one of the two terms: beside `screen-space` every pixel has what both bring alone, from the same photons.
#[test]
fn caustics_come_from_a_strategy_beside_it() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::caustics();
    let gpu_scene = lab.upload(&scene);
    let settings = settings([36, 24], 1, 6);
    let [alone, caustics, both] = ["instant-radiosity", "screen-space", "instant-radiosity+screen-space"].map(|name| {
        let mut pipeline = pipeline(&lab, name, &[]);
        render(&mut lab, &mut pipeline, &gpu_scene, &scene.cameras[0], &settings)
    });
    assert!(both.warnings.is_empty(), "{:?}", both.warnings);
    assert!(image(&both, Layer::Caustic) == image(&caustics, Layer::Caustic), "caustics are those of the one");
    let sum = image(&alone, Layer::Indirect).zip(&image(&caustics, Layer::Caustic), |a, b| a + b);
    let pairs = image(&both, Layer::Indirect).zip(&sum, |a, b| (a - b).abs() / b.max(1.0e-9));
    // A sum of two floats.
    assert!(pairs.pixels.as_flattened().iter().all(|&apart| apart < 1.0e-6), "indirect light is the sum");
    assert!(grey(&image(&caustics, Layer::Caustic)) > 0.01 * grey(&sum), "both count");
}

/// First vertices hold the light that leaves the lights; beyond them the records are those that are gathered otherwise, but for the last.
#[test]
fn light_vertices_are_all_from_the_first() {
    let Some(mut lab) = Lab::open() else { return };
    let gpu_scene = lab.upload(&builtin::caustics());
    let usual = PhotonSettings::new(8_000, 3, 5);
    let [gathered, vertices] =
        [false, true].map(|light_vertices| lab.photons(&gpu_scene, &PhotonSettings { light_vertices, ..usual }));
    assert_eq!(gathered.state.flux_ledger(), vertices.state.flux_ledger(), "the same photons");
    let caustic = |flags: u32| flags & PhotonFlags::CAUSTIC != 0;
    let later: Vec<_> = vertices.records.iter().filter(|photon| photon.bounces() > 0).collect();
    let kept: Vec<_> = gathered.records.iter().filter(|photon| photon.bounces() < 3 || caustic(photon.bounce_flags)).collect();
    assert!(later == kept && later.len() > 4_000, "{} and {}", later.len(), kept.len());
    assert!(later.iter().any(|photon| photon.bounces() == 3), "caustics of the last scattering");
    let first: Vec<_> = vertices.records.iter().filter(|photon| photon.bounces() == 0).collect();
    assert!(first.iter().all(|photon| photon.bounce_flags & 0xff00 == 0), "direct light is no caustic");

    let closed = lab.upload(&builtin::closed_box(0.5));
    let traced = lab.photons(&closed, &PhotonSettings { light_vertices: true, ..usual });
    let flux = |bounces| {
        let records = traced.records.iter().filter(|photon| photon.bounces() == bounces);
        records.map(|photon| f64::from(decode_flux(photon.flux).y)).sum::<f64>()
    };
    let emitted = f64::from(closed.info().total_power.y);
    // Flux is rounded by chance, to 2⁻⁸ of each record; roulette keeps half.
    assert!((flux(0) / emitted - 1.0).abs() < 1e-3, "{} of {emitted} W", flux(0));
    assert!((flux(1) / emitted - 0.5).abs() < 4.0 * (0.25 / 8_000.0_f64).sqrt(), "{} of {emitted} W", flux(1));
    assert!(flux(3) == 0.0, "vertices of the last scattering send nothing on");
}

/// Lights lie on their surfaces in a compact store, too, whose positions are off by 2·10⁻⁶ m, directions by 10⁻³.
#[test]
fn a_compact_store_holds_the_same_lights() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::cornell();
    let gpu_scene = lab.upload(&scene);
    let [whole, compact] = PhotonStore::ALL.map(|store| {
        let sources = store.shaders();
        let strategy = by_name_with(InstantRadiosity::NAME, &sources).expect("it exists");
        let mut pipeline = Pipeline::with_shaders(strategy, &sources).expect("the shaders are valid");
        let rendered = render(&mut lab, &mut pipeline, &gpu_scene, &scene.cameras[0], &settings([36, 24], 1, 3));
        let count = |name: &str| rendered.stats.iter().find(|(found, _)| found == name).map(|(_, count)| *count);
        assert!(count("lights_lost") == Some(0) && count("lights") > Some(40), "{:?}", rendered.stats);
        grey(&image(&rendered, Layer::Indirect))
    });
    assert!((compact / whole - 1.0).abs() < 1e-3, "{} of the light", compact / whole);
}

/// What was kept is found where the camera moved to, and brings no other light.
#[test]
fn a_moving_camera_keeps_the_light() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::cornell();
    let gpu_scene = lab.upload(&scene);
    let settings = settings([20, 15], 1, 4);
    let mut pipeline = pipeline(&lab, InstantRadiosity::NAME, &[("mode", "realtime"), ("lights", "1024")]);
    let at = |step: u32| {
        let x = 0.02 * step as f32;
        Camera::look_at("moving", Vec3::new(x, 1.0, 1.0), Vec3::new(0.5 * x, 0.93, -1.0), Vec3::Y, 1.05)
    };
    let mut means = [Vec::new(), Vec::new()];
    for seed in 0..16 {
        pipeline.reset();
        let mut last = 0.0;
        for step in 0..3 {
            let settings = Settings { seed: 10 * seed + step, ..settings.clone() };
            let rendered =
                pipeline.render_next(&mut lab.executor, &gpu_scene, &at(step), &settings, &mut |_| ControlFlow::Continue(()));
            last = grey(&image(&rendered.unwrap_or_else(|error| panic!("{error}")), Layer::Indirect));
        }
        means[0].push(last);
        let still = render(&mut lab, &mut pipeline, &gpu_scene, &at(2), &Settings { seed: 10 * seed + 2, ..settings.clone() });
        means[1].push(grey(&image(&still, Layer::Indirect)));
    }
    let [moved, still] = means.map(|means| Mean::of(&means));
    let both = Mean { standard_error: moved.standard_error.hypot(still.standard_error), ..moved };
    both.assert_near(still.value, 0.0, "indirect light in the third frame of a moving camera");
    assert!(both.standard_error < 0.02 * still.value, "{both:?}");
}
