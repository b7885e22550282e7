//! The caustics of `screen-space` are those of `exact` on the same photons, and those that `path` connects to the eye by rays.

use crate::determinism::settings;
use lightloom_passes::scene::builtin;
use lightloom_passes::{PhotonFlags, PhotonSettings, PhotonStore};
use lightloom_strategies::{Exact, Layer, Path, Pipeline, ScreenSpace, Settings, Strategy, by_name_with};
use lightloom_tests::{Frame, Image, Lab, View};
use std::ops::ControlFlow;

#[test]
fn caustics_in_screen_space_are_those_of_exact_and_of_paths() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::caustics();
    let gpu_scene = lab.upload(&scene);
    let view = View::new(scene.cameras[0].clone(), [150, 100]);
    let with = |mut strategy: Box<dyn Strategy>, settings: &[(&str, &str)]| {
        for (key, value) in settings {
            strategy.set(key, value).expect("it has the parameter");
        }
        strategy
    };
    // As many light paths as photons, from one seed: they are the same.
    let denoisers = ["none", "guided", "bilateral"];
    let mut all = vec![
        with(Box::new(Exact::new(&lab.sources).expect("it builds")), &[("radius", "0.04")]),
        with(Box::new(Path::new(&lab.sources).expect("it builds")), &[("light_paths", "90000")]),
    ];
    for denoiser in denoisers {
        let strategy = ScreenSpace::new(&lab.sources).expect("it builds");
        all.push(with(Box::new(strategy), &[("denoiser", denoiser), ("roughness", "0.1")]));
    }
    let photons = PhotonSettings { caustics_only: true, ..settings(90_000, 5, 3) };
    let frame = Frame { photons, maps: None, deterministic: false };
    let estimates = lab.estimate(&gpu_scene, &view, frame, &mut all);
    let caustics = estimates.traced.records.iter().filter(|photon| photon.bounce_flags & PhotonFlags::CAUSTIC != 0).count();
    let [exact, path] = [0, 1].map(|index| estimates.layers[index][1].mean()[1]);
    println!("{caustics} caustic photons; mean radiance of exact {exact:.5}, of paths {path:.5}");
    for (denoiser, layers) in denoisers.iter().zip(&estimates.layers[2..]) {
        let found = layers[1].mean()[1];
        println!("{denoiser}: {:.4} of exact's, {:.4} of paths'", found / exact, found / path);
        // The glass's bright spot lies in a corner, and kernels of 4 cm lose what reaches beyond a wall; the others spread it over 10 cm as well.
        assert!((found / exact - 1.0).abs() < 0.04, "{denoiser}: {} of exact's caustics", found / exact);
        // The same photons: what one loses at silhouettes is less than a hundredth of them each way, and denoisers conserve flux, not radiance.
        assert!((found / path - 1.0).abs() < 0.03, "{denoiser}: {} of the paths' caustics", found / path);
        assert!(layers[0] == layers[1], "{denoiser}: caustics and nothing else");
    }
}

/// Positions of the compact store are off by 2·10⁻⁶ m: photons stay on their surfaces, and one in some thousands goes to the next pixel, whose
/// area is nearly the same.
#[test]
fn a_compact_store_holds_the_same_caustics() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::caustics();
    let gpu_scene = lab.upload(&scene);
    let [whole, compact] = PhotonStore::ALL.map(|store| {
        let sources = store.shaders();
        let strategy = by_name_with(ScreenSpace::NAME, &sources).expect("it exists");
        let mut pipeline = Pipeline::with_shaders(strategy, &sources).expect("the shaders are valid");
        let settings = Settings { size: [80, 45], photons: 40_000, layers: vec![Layer::Caustic], ..Settings::default() };
        let camera = &scene.cameras[0];
        let rendered = pipeline.render(&mut lab.executor, &gpu_scene, camera, &settings, &mut |_| ControlFlow::Continue(()));
        let rendered = rendered.unwrap_or_else(|error| panic!("{error}"));
        assert!(rendered.warnings.is_empty(), "{:?}", rendered.warnings);
        Image::from_rgb(settings.size, &rendered.layers[0].pixels).mean()
    });
    for channel in 0..3 {
        let ratio = compact[channel] / whole[channel];
        assert!((ratio - 1.0).abs() < 1e-3, "{ratio} of the light");
    }
}
