//! The scenes for show: light that enters the pool against a quadrature over its waves (PHYSICS check 9), and the ledger of each (check 3).

use crate::determinism::settings;
use glam::{DVec3, Vec3};
use lightloom_passes::scene::{Light, Scene, Triangle, builtin};
use lightloom_passes::{PhotonFlags, PhotonSettings, decode_flux, decode_octahedral};
use lightloom_tests::microfacet::fresnel;
use lightloom_tests::{Lab, Mean};

/// The pool without what floats and stands there, in clear water, under the sun alone.
fn empty_pool() -> Scene {
    let mut scene = builtin::pool();
    let named = |name: &str| scene.materials.iter().position(|material| material.name == name).expect("it is there");
    let things = ["ball", "polished steel"].map(named);
    let water = named("water");
    scene.triangles.retain(|triangle| !things.contains(&(triangle.material as usize)));
    scene.materials[water].attenuation_distance_m = f32::INFINITY;
    scene.environment = None;
    scene
}

/// Points of a triangle at the middles of its n² parts, as weights of its corners.
fn middles(n: u32) -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
        let at = |shift: f64| [f64::from(i) + shift, f64::from(j) + shift].map(|x| x / f64::from(n));
        points.extend([Some(at(1.0 / 3.0)), (i + j + 1 < n).then(|| at(2.0 / 3.0))].into_iter().flatten());
    }
    points.into_iter().map(|[u, v]| [1.0 - u - v, u, v]).collect()
}

/// Flux (W) of a sun of 1 W·m⁻² that passes the water: `Σ A |d·n| (1 − F(d·n_s))` where the sun shines, n the facets' normals and `n_s` those
/// between their corners.
fn entering(water: &[Triangle], ior: f64, sun: DVec3, half: [f64; 2]) -> f64 {
    let inside = |p: DVec3| p.x.abs() < half[0] && p.z.abs() < half[1];
    let middles = middles(4);
    let passes = |triangle: &Triangle| {
        let [corners, normals] = [triangle.positions_world, triangle.normals_world].map(|three| three.map(Vec3::as_dvec3));
        let mix = |three: [DVec3; 3], weights: &[f64; 3]| three[0] * weights[0] + three[1] * weights[1] + three[2] * weights[2];
        let across = -sun.dot(triangle.normal_world().as_dvec3()) * f64::from(triangle.area());
        let lit = middles.iter().filter_map(|weights| {
            let point = mix(corners, weights);
            // Where the ray crosses the level of the deck.
            let entry = point - sun * (point.y / sun.y);
            (inside(point) && inside(entry)).then(|| 1.0 - fresnel(-sun.dot(mix(normals, weights).normalize()), ior))
        });
        across * lit.sum::<f64>() / middles.len() as f64
    };
    water.iter().map(passes).sum()
}

#[test]
fn waves_pass_what_fresnel_leaves() {
    const EMITTED: u32 = 250_000;
    let Some(mut lab) = Lab::open() else { return };
    let scene = empty_pool();
    let [Light::Directional { direction_world, irradiance }] = scene.lights[..] else { panic!("one sun") };
    let water = scene.materials.iter().position(|material| material.name == "water").expect("it is there");
    let surface: Vec<_> = scene.triangles.iter().filter(|triangle| triangle.material as usize == water).copied().collect();
    let ior = f64::from(scene.materials[water].ior);
    let sun = direction_world.as_dvec3();
    let [passed, all] = [ior, 1.0].map(|ior| f64::from(irradiance.y) * entering(&surface, ior, sun, [3.0, 2.0]));

    // One scattering, at the water: what goes down below it has passed, what goes up was reflected.
    let records = lab.photons(&lab.upload(&scene), &PhotonSettings::new(EMITTED, 1, 5)).records;
    let down = records
        .iter()
        .filter(|photon| photon.bounce_flags & PhotonFlags::CAUSTIC != 0 && decode_octahedral(photon.direction).y < 0.0);
    let flux = down.map(|photon| f64::from(decode_flux(photon.flux).y));
    let (sum, squares) = flux.fold((0.0, 0.0), |(sum, squares), flux| (sum + flux, squares + flux * flux));
    let found = Mean { value: sum, standard_error: (squares - sum * sum / f64::from(EMITTED)).sqrt() };
    println!("{passed:.2} of {all:.2} W pass");
    // Edges of the light are known to a quarter of a cell, 1 cm of some 4 m, and to either side.
    found.assert_near(passed, 1e-3 * passed, "light below the waves");
    assert!(4.0 * found.standard_error < all - passed, "Fresnel's part shows: {found:?} and {all}");
}

#[test]
fn flux_balances_in_each_scene() {
    let Some(mut lab) = Lab::open() else { return };
    for (scene, open) in [(builtin::pool(), true), (builtin::pieces(), true), (builtin::corridor(), false)] {
        let name = &scene.name;
        let gpu_scene = lab.upload(&scene);
        let settings = settings(40_000, 6, 1);
        let ledger = lab.photons(&gpu_scene, &settings).state.flux_ledger();
        println!("{name}: {ledger:?}");
        assert!(ledger.balances(), "{name}: {ledger:?}");
        let photon = ledger.emitted[1] / i64::from(settings.emitted);
        assert_eq!(ledger.escaped[1] > 100 * photon, open, "{name}: {} photons escape", ledger.escaped[1] / photon);
        // Lights of several colours, drawn by their power: 40,000 draws tell each channel to a hundredth.
        let scale = f64::from(settings.ledger_scale(&gpu_scene.info()));
        for (channel, &emitted) in ledger.emitted.iter().enumerate() {
            let ratio = emitted as f64 / scale / f64::from(gpu_scene.info().total_power[channel]);
            assert!((ratio - 1.0).abs() < 0.01, "{name}: channel {channel} emitted {ratio} of the lights' power");
        }
    }
}
