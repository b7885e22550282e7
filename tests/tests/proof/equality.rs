//! Every estimator with the cone's kernel sums the same photons as `exact`, in another order: nothing but rounding may differ.
//!
//! A sum of n terms of one sign is rounded by at most n u S in any order, u = 2⁻²⁴ [Higham02] §4.2, so two orders differ by 2 n u S at most.
//! Each term is computed by the same function in both, but compilers may contract or reorder its dozen operations: a few ulp
//! each, 16 u together. n, the photons within reach of a pixel, is counted here on the CPU. A photon missed or counted twice is
//! S/n on average: with n below 400 that is at least 50 times the bound.
//!
//! Splats sum in units of m, the mean radiance that the scene's extent and lights let expect, to the next power of two. `splat-compute` rounds each term to whole
//! numbers of 2⁻³⁴ m in place of its sums: n 2⁻³⁵ m in all. Targets of 16 bits round a sum by up to 2⁻¹⁰ of itself at each photon, and the
//! photon too, or where either is tiny by 2⁻²⁴ m: (n + 1) 2⁻¹⁰ S + n 2⁻²³ m in all. That is below a photon's S/n for up to 30 of them.
//!
//! [Higham02]: https://doi.org/10.1137/1.9780898718027 "Accuracy and stability of numerical algorithms, Higham, 2002"

use crate::determinism::settings;
use glam::Vec3;
use lightloom_passes::Photon;
use lightloom_passes::scene::{Material, Reflection, Scene, SceneInfo, builtin};
use lightloom_tests::kernel::Kernel;
use lightloom_tests::reference::scene_path;
use lightloom_tests::{Estimates, Estimator, Frame, Lab, Sums, View};
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

/// The unit of splats' sums (W·m⁻²·sr⁻¹), with the next power of two at most √2 above.
fn splat_unit(info: &SceneInfo) -> f64 {
    let mean = f64::from(info.total_power.max_element()) / (4.0 * PI * PI * f64::from(info.bounds_radius).powi(2));
    mean * 2.0_f64.sqrt()
}

/// Error that is allowed to a sum of `terms` that is `sum`, against that of `exact`.
fn bound(estimator: &Estimator, terms: u32, sum: f64, unit: f64) -> f64 {
    let n = f64::from(terms);
    let orders = U * (2.0 * n + 16.0) * sum;
    orders
        + match estimator.sums {
            Sums::Float => 0.0,
            Sums::Fixed => n * unit * 2.0_f64.powi(-35),
            Sums::Half => (n + 1.0) * Sums::HALF_ULP * sum + n * unit * 2.0_f64.powi(-23),
        }
}

fn assert_equal(what: &str, estimates: &Estimates, all: &[Estimator], r_max: f64, unit: f64) {
    let reach = within_reach(estimates, (r_max * 1.0001) as f32);
    let most = reach.iter().copied().max().unwrap_or(0);
    let lit = estimates.layers[0][0].pixels.iter().filter(|p| p[1] > 0.0).count();
    assert!(lit * 4 > reach.len(), "{what}: only {lit} of {} pixels are lit", reach.len());
    assert!((20..400).contains(&most), "{what}: up to {most} photons a pixel");
    for (estimator, layers) in all.iter().zip(&estimates.layers).skip(1) {
        let mut worst = 0.0_f64;
        for (layer, (image, exact)) in layers.iter().zip(&estimates.layers[0]).enumerate() {
            for (i, (found, expected)) in image.pixels.iter().zip(&exact.pixels).enumerate() {
                for c in 0..3 {
                    let (error, sum) = ((found[c] - expected[c]).abs(), expected[c].max(found[c]));
                    let bound = bound(estimator, reach[i], sum, unit);
                    worst = worst.max(if sum > 0.0 { error / bound } else { 0.0 });
                    assert!(
                        error <= bound,
                        "{what}, {estimator}, layer {layer}, pixel {i}, channel {c}: {} where exact says {}, {} photons in reach",
                        found[c],
                        expected[c],
                        reach[i]
                    );
                }
            }
        }
        println!("{what}, {estimator}: worst difference {worst:.3} of the bound; up to {most} photons a pixel");
    }
}

/// Radii (m) that give some hundred photons a pixel: a constant one, and one per photon's path probability where asked for.
fn check(lab: &mut Lab, scene: &Scene, emitted: u32, radius: f64, varying: bool) {
    let gpu_scene = lab.upload(scene);
    let view = View::new(scene.cameras[0].clone(), [80, 45]);
    let frame = Frame { photons: settings(emitted, 5, 21), maps: None, deterministic: false };
    let cones: Vec<_> = Estimator::ALL.into_iter().filter(|it| it.kernel == Kernel::Cone && it.runs_on(lab)).collect();
    for (kind, r_min) in [("constant radius", radius), ("varying radii", 0.3 * radius)].into_iter().take(1 + usize::from(varying))
    {
        let mut strategies: Vec<_> = cones.iter().map(|it| it.build(&lab.sources, r_min, radius)).collect();
        let estimates = lab.estimate(&gpu_scene, &view, frame, &mut strategies);
        assert_eq!(estimates.traced.state.dropped, 0, "every photon is stored");
        let what = format!("{}, {kind}", scene.name);
        assert_equal(&what, &estimates, &cones, radius, splat_unit(&gpu_scene.info()));
    }
}

/// Photons and radius (m) of a built-in scene; `None`: the eye sees one surface, and nothing is scattered to it, or hardly anything but water.
fn size_of(name: &str) -> Option<(u32, f64)> {
    Some(match name {
        "cornell" => (30_000, 0.12),
        "caustics" => (12_000, 0.1),
        "closed_sphere" => (4000, 0.2),
        "closed_box" => (4000, 0.5),
        "moving" => (10_000, 0.15),
        "pieces" => (6000, 0.06),
        "corridor" => (6000, 0.8),
        "plane" | "plane_point" | "two_discs" | "pool" => return None,
        _ => panic!("give {name} a number of photons and a radius"),
    })
}

#[test]
fn all_estimators_equal_exact_in_the_built_in_scenes() {
    let Some(mut lab) = Lab::open_blending() else { return };
    for name in builtin::names() {
        let Some((emitted, radius)) = size_of(name) else { continue };
        let scene = builtin::by_name(name).expect("the name is known");
        check(&mut lab, &scene, emitted, radius, ["cornell", "caustics"].contains(name));
    }
}

/// Walls with [MML13]'s lobe beside the diffuse one.
///
/// [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping, Mara, McGuire and Luebke, I3D 2013"
#[test]
fn all_estimators_equal_exact_on_blinn_phong_walls() {
    let Some(mut lab) = Lab::open_blending() else { return };
    let mut scene = builtin::cornell();
    scene.materials[0] = Material { roughness: 0.5, metallic: 0.3, ..scene.materials[0].clone() };
    scene.reflection = Reflection::BlinnPhong;
    check(&mut lab, &scene, 10_000, 0.2, false);
}

#[test]
fn all_estimators_equal_exact_in_the_shared_scenes() {
    let Some(mut lab) = Lab::open_blending() else { return };
    for (name, emitted, radius) in [("cornell_point", 20_000, 0.3), ("caustics_point", 20_000, 0.25), ("sponza", 30_000, 3.0)] {
        let Some(path) = scene_path(name) else { continue };
        let mut scene = Scene::load(&path).unwrap_or_else(|error| panic!("{error}"));
        scene.make_lambert();
        check(&mut lab, &scene, emitted, radius, true);
    }
}
