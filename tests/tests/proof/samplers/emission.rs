//! Emission: where photons start and whereto. Each photon is mapped back to the unit square or the unit hypercube by the
//! distribution it is to have; there all must be uniform, together and not only one by one. Its flux is what the light radiates
//! at that place into that direction over the density.

use super::TESTS;
use crate::lights;
use glam::{DVec3, Vec2, Vec3};
use lightloom_passes::scene::{Environment, Light, Material, Scene, Triangle, builtin};
use lightloom_tests::{ChiSquare, Lab};
use std::f64::consts::{PI, TAU};

const COUNT: u32 = 100_000;
/// The scene's only light.
const EMIT: &str = r"
    var rng = rng_new(params.seed, 0u, i);
    let photon = emit_from_light(lights[0], rng_next4(&rng), 1.0, params.lights);
    drawn[2u * i] = vec4f(photon.origin, photon.flux.x);
    drawn[2u * i + 1u] = vec4f(photon.direction, photon.flux.y);
}";

struct Emitted {
    origin: DVec3,
    direction: DVec3,
    /// Red and green (W).
    flux: [f64; 2],
}

/// The photons, and the centre (m) and radius (m) of the scene's bounding sphere.
fn emit(lab: &mut Lab, scene: &Scene) -> (Vec<Emitted>, DVec3, f64) {
    let scene = lab.upload(scene);
    let info = scene.info();
    let words = lights::draw(lab, &scene, &info, EMIT, COUNT, 1);
    let vector = |v: [f32; 4]| Vec3::from_slice(&v[..3]).as_dvec3();
    let photon = |[origin, direction]: [[f32; 4]; 2]| Emitted {
        origin: vector(origin),
        direction: vector(direction),
        flux: [origin[3], direction[3]].map(f64::from),
    };
    (words.into_iter().map(photon).collect(), info.bounds_center.as_dvec3(), f64::from(info.bounds_radius))
}

/// χ² of points in cells of the unit hypercube, 24² or 5⁴.
#[track_caller]
fn assert_uniform<const N: usize>(points: impl Iterator<Item = [f64; N]>, what: &str) {
    let side: usize = if N == 2 { 24 } else { 5 };
    let mut counts = vec![0.0; side.pow(N as u32)];
    for point in points {
        let cell = point.iter().fold(0, |cell, &u| {
            // Rounding in floats may step over the border of the square, by a few ulp.
            assert!((-1e-4..=1.0 + 1e-4).contains(&u), "{what}: {point:?} lies outside");
            cell * side + ((u * side as f64).max(0.0) as usize).min(side - 1)
        });
        counts[cell] += 1.0;
    }
    let expected = counts.iter().sum::<f64>() / counts.len() as f64;
    ChiSquare::of(counts.into_iter().map(|count| (count, expected))).assert_probable(TESTS, what);
}

/// Angle of `w` about `axis`, as a part of the whole turn; its zero depends on the axis only.
fn turn(axis: DVec3, w: DVec3) -> f64 {
    let x = axis.any_orthonormal_vector();
    (w.dot(axis.cross(x)).atan2(w.dot(x)) / TAU).rem_euclid(1.0)
}

/// Where a photon crosses the disc that the sphere shows to it.
fn on_disc(photon: &Emitted, center: DVec3, radius: f64) -> [f64; 2] {
    let from_center = photon.origin - center;
    let across = from_center - photon.direction * from_center.dot(photon.direction);
    [across.length_squared() / (radius * radius), turn(photon.direction, across)]
}

fn assert_flux(photon: &Emitted, expected: [f64; 2], what: &str) {
    for (flux, expected) in photon.flux.into_iter().zip(expected) {
        // Floats; a cosine near the rim of a spot's cone is off by 10⁻⁷, and the falloff by 10⁻⁵ of the peak.
        assert!((flux - expected).abs() <= 1e-5 * (expected + 20.0), "{what}: {flux} W of {expected}");
    }
}

fn lit_by(light: Light) -> Scene {
    Scene { lights: vec![light], ..builtin::plane(3.0) }
}

/// Red and green of the intensity, irradiance or radiance of every light here.
const STRENGTH: [f64; 2] = [2.0, 0.5];

fn strength() -> Vec3 {
    Vec3::new(STRENGTH[0] as f32, STRENGTH[1] as f32, 0.0)
}

#[test]
fn a_point_radiates_evenly() {
    let Some(mut lab) = Lab::open() else { return };
    let (photons, ..) = emit(&mut lab, &lit_by(Light::Point { position_world: Vec3::Y, intensity: strength() }));
    for photon in &photons {
        assert!(photon.origin == DVec3::Y && (photon.direction.length() - 1.0).abs() < 1e-5, "unit, from the lamp");
        assert_flux(photon, STRENGTH.map(|i| 4.0 * PI * i), "point");
    }
    let pole = DVec3::new(0.6, 0.64, -0.48);
    assert_uniform(photons.iter().map(|p| [0.5 - 0.5 * p.direction.dot(pole), turn(pole, p.direction)]), "point");
}

#[test]
fn a_spot_fills_its_cone() {
    let Some(mut lab) = Lab::open() else { return };
    let axis = Vec3::new(0.6, -0.64, 0.48);
    for (cos_inner, cos_outer) in [(0.9_f32, 0.6_f32), (1.0, 0.999), (0.2, -0.5)] {
        let light = Light::Spot { position_world: Vec3::Y, direction_world: axis, intensity: strength(), cos_inner, cos_outer };
        let (photons, ..) = emit(&mut lab, &lit_by(light));
        let [inner, outer] = [cos_inner, cos_outer].map(f64::from);
        let axis = axis.as_dvec3().normalize();
        let what = format!("spot of cosines {inner} and {outer}");
        let one_minus_cos = |w: DVec3| 0.5 * w.normalize().distance_squared(axis);
        for photon in &photons {
            let falloff = ((1.0 - one_minus_cos(photon.direction) - outer) / (inner - outer)).clamp(0.0, 1.0).powi(2);
            // A narrow cone's floats: its cosine is stored with an error of 3·10⁻⁸, of a range of 10⁻³.
            let expected = STRENGTH.map(|i| TAU * (1.0 - outer) * i * falloff);
            let bound = 3e-4 * TAU * (1.0 - outer) * STRENGTH[0];
            let apart = (photon.flux[0] - expected[0]).abs();
            assert!(apart < bound, "{what}: {} W of {}", photon.flux[0], expected[0]);
        }
        assert_uniform(photons.iter().map(|p| [one_minus_cos(p.direction) / (1.0 - outer), turn(axis, p.direction)]), &what);
    }
}

#[test]
fn a_sun_fills_its_disc() {
    let Some(mut lab) = Lab::open() else { return };
    let direction_world = Vec3::new(0.6, -0.64, 0.48);
    let (photons, center, radius) = emit(&mut lab, &lit_by(Light::Directional { direction_world, irradiance: strength() }));
    for photon in &photons {
        assert!(photon.direction.distance(direction_world.as_dvec3()) < 1e-6, "all in one direction");
        assert_flux(photon, STRENGTH.map(|e| PI * radius * radius * e), "directional");
    }
    assert_uniform(photons.iter().map(|p| on_disc(p, center, radius)), "directional");
}

/// Place and direction together: the sky's photons must not start where their direction would betray it.
#[test]
fn an_even_sky_fills_directions_and_discs() {
    let Some(mut lab) = Lab::open() else { return };
    let mut scene = Scene { lights: Vec::new(), ..builtin::plane(3.0) };
    scene.set_environment(Environment::constant(strength()).expect("sound"));
    let (photons, center, radius) = emit(&mut lab, &scene);
    for photon in &photons {
        assert_flux(photon, STRENGTH.map(|l| 4.0 * PI * PI * radius * radius * l), "environment");
    }
    let point = |p: &Emitted| {
        let [area, angle] = on_disc(p, center, radius);
        [0.5 - 0.5 * p.direction.y, turn(DVec3::Y, p.direction), area, angle]
    };
    assert_uniform(photons.iter().map(point), "environment");
}

#[test]
fn a_triangle_emits_everywhere_by_the_cosine() {
    let Some(mut lab) = Lab::open() else { return };
    for double_sided in [false, true] {
        let corners = [Vec3::new(0.1, 0.9, 0.0), Vec3::new(1.3, 1.0, 0.4), Vec3::new(0.5, 1.9, -0.2)];
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a).normalize();
        let material = Material { double_sided, ..Material::emitter("lamp", strength()) };
        let triangle =
            Triangle { positions_world: corners, normals_world: [normal.as_vec3(); 3], uvs: [Vec2::ZERO; 3], material: 0 };
        let scene = Scene { triangles: vec![triangle], materials: vec![material], ..Scene::default() };
        let (photons, ..) = emit(&mut lab, &scene);
        let area = 0.5 * (b - a).cross(c - a).length();
        let sides = if double_sided { 2.0 } else { 1.0 };
        let what = format!("triangle of {sides} sides");
        let point = |p: &Emitted| {
            let bary = |from: DVec3, to: DVec3| (to - from).cross(p.origin - from).dot(normal) / (2.0 * area);
            // The share of the corner opposite of the edge.
            let (third, first) = (bary(a, b), bary(b, c));
            let cos = p.direction.dot(normal);
            let sin2 = p.direction.cross(normal).length_squared();
            let side = if cos > 0.0 { 0.0 } else { 1.0 };
            [(1.0 - first).powi(2), third / (1.0 - first), (side + sin2) / sides, turn(normal, p.direction)]
        };
        for photon in &photons {
            // Radiance over the densities 1/(A·sides) and cos/π.
            assert_flux(photon, STRENGTH.map(|l| PI * sides * area * l), &what);
        }
        assert_uniform(photons.iter().map(point), &what);
    }
}
