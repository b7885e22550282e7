//! `tiled`, `hash-grid`, `sorted-grid`, `view-grid` and `splat-compute` sum the same photons as `exact`, in another order: nothing but rounding may differ.
//!
//! A sum of n terms of one sign is rounded by at most n u S in any order, u = 2⁻²⁴ [Higham02] §4.2, so two orders differ by 2 n u S at most.
//! Each term is computed by the same function in both, but compilers may contract or reorder its dozen operations: a few ulp
//! each, 16 u together. n, the photons within reach of a pixel, is counted here on the CPU. A photon missed or counted twice is
//! S/n on average: with n below 400 that is at least 50 times the bound. `splat-compute` rounds each term to whole numbers of 2⁻³⁴ m in place of its
//! sums, m the mean radiance that the scene's extent and lights let expect: n 2⁻³⁵ m in all.
//!
//! [Higham02]: https://doi.org/10.1137/1.9780898718027 "Accuracy and stability of numerical algorithms, Higham, 2002"

use crate::determinism::settings;
use glam::Vec3;
use lightloom_passes::Photon;
use lightloom_passes::scene::{Material, Reflection, Scene, SceneInfo, builtin};
use lightloom_strategies::{SplatCompute, Strategy};
use lightloom_tests::reference::scene_path;
use lightloom_tests::{Estimates, Frame, Lab, View, strategies};
use std::f64::consts::PI;

const U: f64 = 1.0 / 16_777_216.0;

/// Photons within `radius` of each pixel's point, an upper bound of the terms of its sum.
fn within_reach(estimates: &Estimates, radius: f32) -> Vec<u32> {
    let photons: Vec<Vec3> = estimates.traced.records.iter().map(|photon: &Photon| Vec3::from(photon.position)).collect();
    let count = |p: &[f32; 4]| {
        let point = Vec3::new(p[0], p[1], p[2]);
        photons.iter().filter(|photon| photon.distance_squared(point) < radius * radius).count() as u32
    };
    estimates.positions.iter().map(|p| if p[3] > 0.0 { count(p) } else { 0 }).collect()
}

/// The unit of fixed-point sums (W·m⁻²·sr⁻¹): the module documentation of `splat-compute`, with the next power of two at most √2 above.
fn fixed_point_unit(info: &SceneInfo) -> f64 {
    let mean = f64::from(info.total_power.max_element()) / (4.0 * PI * PI * f64::from(info.bounds_radius).powi(2));
    mean * 2.0_f64.sqrt() / 2.0_f64.powi(34)
}

fn assert_equal(what: &str, estimates: &Estimates, all: &[Box<dyn Strategy>], r_max: f32, unit: f64) {
    let reach = within_reach(estimates, r_max * 1.0001);
    let most = reach.iter().copied().max().unwrap_or(0);
    let lit = estimates.layers[0][0].pixels.iter().filter(|p| p[1] > 0.0).count();
    assert!(lit * 4 > reach.len(), "{what}: only {lit} of {} pixels are lit", reach.len());
    assert!((20..400).contains(&most), "{what}: up to {most} photons a pixel");
    for (strategy, layers) in all.iter().zip(&estimates.layers).skip(1) {
        let unit = if strategy.name() == SplatCompute::NAME { unit } else { 0.0 };
        let mut worst = 0.0_f64;
        for (layer, (image, exact)) in layers.iter().zip(&estimates.layers[0]).enumerate() {
            for (i, (found, expected)) in image.pixels.iter().zip(&exact.pixels).enumerate() {
                let (bound, rounded) = (U * f64::from(2 * reach[i] + 16), 0.5 * unit * f64::from(reach[i]));
                for c in 0..3 {
                    let (error, sum) = ((found[c] - expected[c]).abs(), expected[c].max(found[c]));
                    let bound = bound * sum + rounded;
                    worst = worst.max(if sum > 0.0 { error / bound } else { 0.0 });
                    assert!(
                        error <= bound,
                        "{what}, {}, layer {layer}, pixel {i}, channel {c}: {} where exact says {}, {} photons in reach",
                        strategy.name(),
                        found[c],
                        expected[c],
                        reach[i]
                    );
                }
            }
        }
        println!("{what}, {}: worst difference {worst:.3} of the bound; up to {most} photons a pixel", strategy.name());
    }
}

/// Radii (m) that give some hundred photons a pixel: a constant one, and one per photon's path probability.
fn check(lab: &mut Lab, scene: &Scene, emitted: u32, radius: f32) {
    check_radii(lab, scene, emitted, radius, &[("constant radius", radius), ("varying radii", 0.3 * radius)]);
}

/// With these least radii (m).
fn check_radii(lab: &mut Lab, scene: &Scene, emitted: u32, radius: f32, kinds: &[(&str, f32)]) {
    let gpu_scene = lab.upload(scene);
    let view = View::new(scene.cameras[0].clone(), [80, 45]);
    let frame = Frame { photons: settings(emitted, 5, 21), maps: None, deterministic: false };
    for &(kind, r_min) in kinds {
        let mut all = strategies(&lab.sources, r_min, radius);
        let estimates = lab.estimate(&gpu_scene, &view, frame, &mut all);
        assert_eq!(estimates.traced.state.dropped, 0, "every photon is stored");
        assert_equal(&format!("{}, {kind}", scene.name), &estimates, &all, radius, fixed_point_unit(&gpu_scene.info()));
    }
}

#[test]
fn all_strategies_equal_exact_in_a_cornell_room() {
    let Some(mut lab) = Lab::open() else { return };
    check(&mut lab, &builtin::cornell(), 30_000, 0.12);
}

#[test]
fn all_strategies_equal_exact_among_caustics() {
    let Some(mut lab) = Lab::open() else { return };
    check(&mut lab, &builtin::caustics(), 12_000, 0.1);
}

/// Walls with [MML13]'s lobe beside the diffuse one.
///
/// [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping, Mara, McGuire and Luebke, I3D 2013"
#[test]
fn all_strategies_equal_exact_on_blinn_phong_walls() {
    let Some(mut lab) = Lab::open() else { return };
    let mut scene = builtin::cornell();
    scene.materials[0] = Material { roughness: 0.5, metallic: 0.3, ..scene.materials[0].clone() };
    scene.reflection = Reflection::BlinnPhong;
    check_radii(&mut lab, &scene, 10_000, 0.2, &[("varying radii", 0.06)]);
}

#[test]
fn all_strategies_equal_exact_in_the_shared_scenes() {
    let Some(mut lab) = Lab::open() else { return };
    for (name, emitted, radius) in [("cornell_point", 20_000, 0.3), ("caustics_point", 20_000, 0.25), ("sponza", 30_000, 3.0)] {
        let Some(path) = scene_path(name) else { return };
        let mut scene = Scene::load(&path).unwrap_or_else(|error| panic!("{error}"));
        scene.make_lambert();
        check(&mut lab, &scene, emitted, radius);
    }
}
