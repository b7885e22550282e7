//! In a frame of two strategies every photon counts once: its light is that of `exact`, and its caustics are those of one of the two.

use crate::determinism::settings;
use glam::Vec3;
use lightloom_passes::scene::{Camera, Scene, builtin};
use lightloom_passes::{CameraUniform, DepositCull, Photon, PhotonFlags, PhotonSettings};
use lightloom_strategies::{Exact, Layer, Pipeline, Settings, Strategy, by_name, by_name_with};
use lightloom_tests::{Estimates, Frame, Image, Lab, View};
use std::ops::ControlFlow;

const RADIUS_M: f32 = 0.04;
const SIZE: [u32; 2] = [75, 50];

/// A strategy that estimates caustics alone; how far (m) from what is seen its photons count, splats of 31 texels included; and the setting under
/// which it blurs no more than `exact` with this radius.
type CausticPart = (&'static str, f32, (&'static str, &'static str));

const CAUSTIC: [CausticPart; 2] = [("screen-space", RADIUS_M, ("denoiser", "none")), ("caustic-map", 0.3, ("side", "256"))];

/// A composition of `global` and one of [`CAUSTIC`], after its parts and `exact`, all of one frame's photons.
fn composed(
    lab: &mut Lab,
    scene: &Scene,
    camera: &Camera,
    global: &str,
    (caustic, reach_m, (key, value)): CausticPart,
    photons: PhotonSettings,
) -> Estimates {
    let with = |mut strategy: Box<dyn Strategy>, settings: &[(&str, &str)]| {
        for (key, value) in settings {
            strategy.set(key, value).expect("it has the parameter");
        }
        strategy
    };
    let build = |name: &str| by_name_with(name, &lab.sources).expect("it exists");
    let radius = RADIUS_M.to_string();
    let radius = ("radius", radius.as_str());
    let mut all = [
        with(build(Exact::NAME), &[radius]),
        with(build(global), &[radius]),
        with(build(caustic), &[(key, value)]),
        with(build(&format!("{global}+{caustic}")), &[radius, (&format!("{caustic}.{key}"), value)]),
    ];
    let gpu_scene = lab.upload(scene);
    let uniform = CameraUniform::new(camera, SIZE, [0.5; 2], gpu_scene.info().bounds_radius);
    let photons = PhotonSettings { cull: Some(DepositCull::new(&uniform, reach_m)), ..photons };
    let view = View::new(camera.clone(), SIZE);
    lab.estimate(&gpu_scene, &view, Frame { photons, maps: None, deterministic: true }, &mut all)
}

fn is_caustic(photon: &Photon) -> bool {
    photon.bounce_flags & PhotonFlags::CAUSTIC != 0
}

#[test]
fn every_photon_counts_once() {
    let Some(mut lab) = Lab::open() else { return };
    for caustic in CAUSTIC {
        assert_counted_once(&mut lab, caustic);
    }
}

fn assert_counted_once(lab: &mut Lab, caustic: CausticPart) {
    let camera = Camera::look_at("ring", Vec3::new(-0.2, 1.6, 0.9), Vec3::new(-0.34, 0.0, 0.05), Vec3::Y, 0.4);
    let name = caustic.0;
    let estimates = composed(lab, &builtin::caustics(), &camera, "sorted-grid", caustic, settings(60_000, 5, 3));
    let [exact, global, caustic, found] = [0, 1, 2, 3].map(|index| &estimates.layers[index]);
    let caustics = estimates.traced.records.iter().filter(|photon| is_caustic(photon)).count();
    let photons = estimates.traced.records.len();
    assert!(caustics > 500 && 2 * caustics < photons, "{caustics} of {photons} photons are caustic: some of both kinds");

    // Pixel by pixel: a difference and a sum of 32-bit numbers, each rounded by at most 2⁻²⁴ of itself.
    assert!(found[1] == caustic[1], "the caustics are those of one part");
    let mut lit = 0;
    for (index, pixel) in found[0].pixels.iter().enumerate() {
        for (channel, &found) in pixel.iter().enumerate() {
            let [all, replaced] = [0, 1].map(|layer: usize| global[layer].pixels[index][channel]);
            let caustic = caustic[1].pixels[index][channel];
            let expected = all - replaced + caustic;
            assert!((found - expected).abs() <= 1.2e-7 * (all + expected), "pixel {index}: {found} and not {expected}");
            assert!(found >= caustic, "pixel {index}: what is not caustic is not negative");
            lit += u32::from(replaced > 0.0 && all > replaced);
        }
    }
    assert!(lit > 500, "{lit} values have light of both kinds");

    // All in all: `exact` has the same kernels, so that the rest is its rest but for rounding, and all light is its light but for what
    // the other part makes of the caustics, for which its own proof allows 4 %; they are a fifth of it.
    let [rest, exact_rest] = [global, exact].map(|layers| layers[0].zip(&layers[1], |all, caustic| all - caustic).mean());
    for channel in 0..3 {
        let [all, share] = [0, 1].map(|layer: usize| exact[layer].mean()[channel]);
        assert!((rest[channel] / exact_rest[channel] - 1.0).abs() < 1e-5, "the rest: {rest:?} of {exact_rest:?}");
        let excess = found[0].mean()[channel] - all;
        println!("{name}: light {all:.5}, caustics {share:.5}, composed {excess:+.5}: {:+.4} of the caustics", excess / share);
        assert!(excess.abs() < 0.04 * share, "{excess} W·m⁻²·sr⁻¹ too much, of {share} in caustics");
    }
}

/// Where no photon is caustic, to the last bit.
#[test]
fn light_without_caustics_is_left_as_it_is() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::cornell();
    let estimates = composed(&mut lab, &scene, &scene.cameras[0], Exact::NAME, CAUSTIC[0], settings(3_000, 3, 3));
    assert!(!estimates.traced.records.iter().any(is_caustic), "nothing is specular");
    assert!(estimates.layers[3] == estimates.layers[1] && estimates.layers[1][0].mean()[1] > 0.0, "all is left as it was");
}

/// The whole pipeline: what `auto` measures and chooses reaches it through the composition, counts of both parts are reported, and the light is that
/// of one strategy alone.
#[test]
fn parts_are_heard_and_reported() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::caustics();
    let gpu_scene = lab.upload(&scene);
    let layers = vec![Layer::Indirect, Layer::Caustic];
    let settings = Settings { size: [48, 32], photons: 15_000, frames: 2, layers, ..Settings::default() };
    let [alone, both] = ["auto", "auto+screen-space"].map(|name| {
        let mut pipeline = Pipeline::new(by_name(name).expect("it exists")).expect("the shaders are valid");
        pipeline.strategy_mut().set("radius", &RADIUS_M.to_string()).expect("a part has it");
        let rendered =
            pipeline.render(&mut lab.executor, &gpu_scene, &scene.cameras[0], &settings, &mut |_| ControlFlow::Continue(()));
        rendered.unwrap_or_else(|error| panic!("{error}"))
    });
    assert!(both.warnings.is_empty(), "{:?}", both.warnings);
    assert!(both.choice.as_ref().is_some_and(|choice| choice.starts_with("auto: ")), "{:?}", both.choice);
    let count = |name: &str| both.stats.iter().find(|(found, _)| found == name).map(|(_, count)| *count);
    let counts = ["auto.entries", "screen-space.photons_seen"].map(count);
    assert!(counts.iter().all(|count| count.is_some_and(|count| count > 0)), "{:?}", both.stats);
    let [alone, both] = [alone, both].map(|rendered| {
        [Layer::Indirect, Layer::Caustic]
            .map(|layer| Image::from_rgb(rendered.size, &rendered.layer(layer).expect("it was asked for").pixels).mean()[1])
    });
    println!("indirect light and caustics: {alone:?} alone, {both:?} composed");
    // Pixels whose first surface is specular are the same in both, and so is all that is not caustic, but for the rounding of sums in
    // whatever order: what the caustics differ by is what the light differs by.
    let [light, caustics] = [0, 1].map(|layer| both[layer] - alone[layer]);
    assert!((light - caustics).abs() < 1e-5 * alone[0], "{light} W·m⁻²·sr⁻¹ by {caustics} in caustics");
    assert!(caustics.abs() > 1e-3 * alone[0], "the parts see caustics differently: {caustics}");
}
