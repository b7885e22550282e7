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
//! On the polyhedron, radial projection changes areas by d³/p within h² … R³/h and distances by factors within h … R, so the
//! kernel's integral by R³/h³ at most; facets are turned by up to β against the sphere, which adds β²/2 to the loss
//! (β averages out over a facet, β² does not).

use crate::determinism::settings;
use lightloom_passes::scene::{Camera, Light, Scene, builtin};
use lightloom_tests::synthetic::SHADING_EPSILON;
use lightloom_tests::{Frame, Lab, Mean, View, kernel, strategies};
use glam::Vec3;

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
    assert!(indirect.standard_error < 5e-4, "precise enough to mean something: {indirect:?}");
}

#[test]
fn estimates_are_half_within_the_derived_bias() {
    const RADIUS: f32 = 0.2;
    const SEEDS: u32 = 6;
    let Some(mut lab) = Lab::open() else { return };
    let scene = scene();
    let tessellation = Tessellation::of(&scene);
    let gpu_scene = lab.upload(&scene);
    let mut all = strategies(&lightloom_passes::shaders(), RADIUS, RADIUS);
    let mut means = vec![Vec::new(); all.len()];
    for seed in 0..SEEDS {
        let frame = Frame { photons: settings(60_000, BOUNCES, seed), deterministic: false };
        let estimates = lab.estimate(&gpu_scene, &view(), frame, &mut all);
        assert_eq!(estimates.traced.state.dropped, 0, "every photon is stored");
        for (means, [indirect, _]) in means.iter_mut().zip(&estimates.layers) {
            means.push(indirect.mean()[1]);
        }
    }
    let loss = kernel::moment(2, RADIUS.into()) / 4.0 + 2.0 * SHADING_EPSILON;
    let expected = 0.5 * (1.0 - loss);
    let bias = 0.5 * (tessellation.radiance + tessellation.kernel + tessellation.turned);
    for (strategy, means) in all.iter().zip(&means) {
        let mean = Mean::of(means);
        mean.assert_near(expected, bias, strategy.name());
        assert!(4.0 * mean.standard_error + bias < 0.01, "precise enough to mean something: {mean:?}, {bias}");
    }
}
