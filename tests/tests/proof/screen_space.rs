//! The caustics of `screen-space` are those of `exact` on the same photons, and those that `path` connects to the eye by rays.

use crate::determinism::settings;
use lightloom_passes::scene::builtin;
use lightloom_passes::{PhotonFlags, PhotonSettings};
use lightloom_strategies::{Exact, Path, ScreenSpace, Strategy};
use lightloom_tests::{Frame, Lab, View};

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
        all.push(with(Box::new(strategy), &[("denoiser", denoiser), ("roughness", "0.2")]));
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
