//! PHYSICS check 1: inside a closed diffuse sphere of radius 1 and albedo ½, lit by I = π at its centre, L = 1 everywhere,
//! of which ½ is indirect.
//!
//! **Tessellation.** The sphere is a polyhedron of area 4π whose planes lie between h and R from the centre: R − h is the sagitta of
//! its facets. Direct irradiance at distance d on a plane at distance p is π p/d³ with h ≤ p ≤ d ≤ R, hence within π (1 ± δ),
//! δ = max(1 − h/R³, 1/h² − 1). In a closed convex body every direction of the hemisphere ends on a wall, ∫cos θ dω = π whatever the
//! shape, so if all walls send L (1 ± δ), all receive π L (1 ± δ): the bound passes unchanged from bounce to bounce, and
//! direct, indirect and total radiance are off by δ at most, relatively.
//!
//! **Density estimation.** By Archimedes' theorem the cap of a unit sphere within the chord s has the area π s², as in the plane, so
//! the kernel's integral over the sphere is exactly ∫κ: curvature alone brings no bias. Two things remain.
//! Light is lost below the horizon: a photon at chord s lies on a surface turned by α, cos α = 1 − s²/2. Of light of the cosine law
//! around its own normal, the share (1 − cos α)/2 = s²/4 arrives below the horizon of the point that gathers: a loss of M₂/4.
//! And PHYSICS's ε takes 2ε (see `SHADING_EPSILON`).
//! Summed over the whole sphere, a photon's kernel counts with the share of it that is not lost, whatever the photons' own noise: so
//! the mean estimate is compared with the flux of the very same photons, and that flux with ½ apart.
//! On the polyhedron, radial projection changes areas by d³/p within h² … R³/h and distances by factors within h … R, so the
//! kernel's integral by R³/h³ at most; facets are turned by up to β against the sphere, which adds β²/2 to the loss
//! (β averages out over a facet, β² does not).

use crate::determinism::settings;
use glam::Vec3;
use lightloom_passes::decode_flux;
use lightloom_passes::scene::{Camera, Light, Scene, builtin};
use lightloom_tests::synthetic::SHADING_EPSILON;
use lightloom_tests::{Frame, Image, Lab, Mean, Traced, View, kernel, strategies};
use std::f64::consts::PI;

/// 20,480 facets.
const SUBDIVISIONS: u32 = 5;
/// The light that further bounces carry, 2⁻²⁴ of all, is below any other error.
const BOUNCES: u32 = 24;

/// Bounds of the polyhedron's error.
struct Tessellation {
    /// δ: relative error of radiance.
    radiance: f64,
    /// Relative error of the kernel's integral.
    kernel: f64,
    /// β²/2: further loss below the horizon.
    turned: f64,
}

impl Tessellation {
    fn of(scene: &Scene) -> Self {
        let (mut h, mut r, mut cos_beta) = (f64::MAX, 0.0_f64, 1.0_f64);
        for triangle in &scene.triangles {
            let corners = triangle.positions_world.map(Vec3::as_dvec3);
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
            let plane = normal.dot(corners[0]).abs();
            h = h.min(plane);
            for corner in corners {
                r = r.max(corner.length());
                cos_beta = cos_beta.min(plane / corner.length());
            }
        }
        let radiance = (1.0 - h / r.powi(3)).max(1.0 / (h * h) - 1.0);
        println!("sphere: h {h:.6} m, R {r:.6} m, β {:.4} rad", cos_beta.acos());
        Self { radiance, kernel: (r / h).powi(3) - 1.0, turned: 0.5 * cos_beta.acos().powi(2) }
    }
}

fn scene() -> Scene {
    let scene = builtin::closed_sphere(SUBDIVISIONS);
    assert!(matches!(scene.lights[..], [Light::Point { .. }]), "one point light");
    scene
}

/// Near the centre, with a wide view: a third of the sphere.
fn view() -> View {
    let eye = Vec3::new(0.03, 0.05, 0.11);
    View::new(Camera::look_at("wide", eye, Vec3::new(0.4, 0.1, -1.0), Vec3::Y, 2.0), [48, 48])
}

#[test]
fn path_sees_radiance_one_of_which_half_is_indirect() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = scene();
    let bound = Tessellation::of(&scene).radiance;
    let gpu_scene = lab.upload(&scene);
    let images = lab.path(&gpu_scene, &view(), 64, 11, BOUNCES);
    let (direct, indirect) = (images.direct.grey(), images.indirect.grey());
    direct.assert_near(0.5, 0.5 * bound, "direct radiance");
    indirect.assert_near(0.5, 0.5 * bound, "indirect radiance");
    let total = Mean {
        value: direct.value + indirect.value,
        // Both layers come from the same paths.
        standard_error: direct.standard_error + indirect.standard_error,
    };
    total.assert_near(1.0, bound, "radiance");
    assert!(indirect.standard_error < 1e-3, "precise enough to mean something: {indirect:?}");
}

/// Six square views of 90° from the centre: together they see all of the sphere once.
fn all_around() -> Vec<View> {
    let quarter = std::f32::consts::FRAC_PI_2;
    [
        (Vec3::X, Vec3::Y),
        (Vec3::NEG_X, Vec3::Y),
        (Vec3::Y, Vec3::Z),
        (Vec3::NEG_Y, Vec3::Z),
        (Vec3::Z, Vec3::Y),
        (Vec3::NEG_Z, Vec3::Y),
    ]
    .into_iter()
    .map(|(out, up)| View::new(Camera::look_at("face", Vec3::ZERO, out, up, quarter), [FACE, FACE]))
    .collect()
}

/// Edge of a view of [`all_around`] (pixels).
const FACE: u32 = 24;

/// Mean of such a view weighted with each pixel's solid angle, which is its area of the sphere within the bound, and the sum of
/// the weights (sr).
fn weighted(image: &Image) -> [f64; 2] {
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(FACE) * 2.0 - 1.0;
    let mut sums = [0.0; 2];
    for i in 0..FACE * FACE {
        let (x, y) = (i % FACE, i / FACE);
        let weight = (2.0 / f64::from(FACE)).powi(2) * (1.0 + at(x).powi(2) + at(y).powi(2)).powf(-1.5);
        sums[0] += weight * image.at(x, y)[1];
        sums[1] += weight;
    }
    sums
}

/// Stored flux (W).
fn stored(traced: &Traced) -> f64 {
    assert_eq!(traced.state.dropped, 0, "every photon is stored");
    traced.records.iter().map(|photon| f64::from(decode_flux(photon.flux).y)).sum()
}

#[test]
fn stored_flux_is_half_of_all_light() {
    let Some(mut lab) = Lab::open() else { return };
    let gpu_scene = lab.upload(&scene());
    // Radiance of stored flux Φ spread over 4π m²: ρ/π · Φ/4π.
    let radiance = |flux: f64| 0.5 / PI * flux / (4.0 * PI);
    let means: Vec<f64> =
        (0..8).map(|seed| radiance(stored(&lab.photons(&gpu_scene, &settings(60_000, BOUNCES, seed))))).collect();
    let mean = Mean::of(&means);
    mean.assert_near(0.5, 0.0, "indirect radiance by stored flux");
    // Roulette leaves a geometric number of records, relative variance 1/(Nρ): the scatter of eight runs is that within a factor of 2
    // (χ² with 7 degrees: once in 100).
    let expected = 0.5 * (1.0 / (8.0 * 60_000.0 * 0.5_f64)).sqrt();
    let ratio = mean.standard_error / expected;
    assert!((0.5..2.0).contains(&ratio), "standard error {} where theory says {expected}", mean.standard_error);
}

#[test]
fn estimates_are_the_stored_flux_less_the_derived_loss() {
    const RADIUS: f32 = 0.3;
    const EMITTED: u32 = 60_000;
    let Some(mut lab) = Lab::open() else { return };
    let scene = scene();
    let tessellation = Tessellation::of(&scene);
    let gpu_scene = lab.upload(&scene);
    let mut all = strategies(&lab.sources, RADIUS, RADIUS);
    let mut sums = vec![[0.0; 2]; all.len()];
    let mut flux = 0.0;
    for view in all_around() {
        // One seed: the same photons in front of every camera.
        let frame = Frame { photons: settings(EMITTED, BOUNCES, 17), maps: None, deterministic: false };
        let estimates = lab.estimate(&gpu_scene, &view, frame, &mut all);
        flux = stored(&estimates.traced);
        for (sums, [indirect, _]) in sums.iter_mut().zip(&estimates.layers) {
            let [sum, weight] = weighted(indirect);
            *sums = [sums[0] + sum, sums[1] + weight];
        }
    }
    let loss = kernel::moment(2, RADIUS.into()) / 4.0 + 2.0 * SHADING_EPSILON;
    // A photon's kernel is sampled at some 40 points: its sum is off by 1/40 at most in the manner of `kernel::lattice_error`, at
    // random; the area of a pixel on the polyhedron by the factor d³/p of the kernel's bound.
    let sampling = 4.0 / 40.0 / f64::from(EMITTED).sqrt();
    let bias = tessellation.kernel + tessellation.turned + sampling;
    println!("derived loss {loss:.5}, bound {bias:.5}");
    assert!(bias < 0.25 * loss, "the bound shows the loss");
    let from_photons = 0.5 / PI * flux / (4.0 * PI) * (1.0 - loss);
    for (strategy, [sum, weight]) in all.iter().zip(sums) {
        assert!((weight / (4.0 * PI) - 1.0).abs() < 1e-3, "the views cover the sphere: {weight} sr");
        let mean = Mean { value: sum / weight, standard_error: 0.0 };
        mean.assert_near(from_photons, bias * from_photons, &format!("{}, from the same photons", strategy.name()));
        // And against ½, with the photons' own noise.
        let noise = 0.5 * (1.0 / (f64::from(EMITTED) * 0.5)).sqrt();
        Mean { standard_error: noise, ..mean }.assert_near(0.5 * (1.0 - loss), 0.5 * bias, strategy.name());
    }
}
