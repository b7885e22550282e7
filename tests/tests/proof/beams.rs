//! Ray differentials against closed forms. A beam's footprint is the area over which its photon stands for light, so the footprints
//! of all photons on a surface add up to the area that their light covers, each area as often as it is covered: a Monte Carlo
//! integral of the Jacobian from emission to surface. The tolerance is three standard errors of that sum, taken from the sample itself, and
//! what the geometry's facets add.

use glam::Vec3;
use lightloom_passes::scene::{Light, Material, Scene, Triangle, builtin};
use lightloom_passes::{Photon, PhotonFlags, PhotonSettings};
use lightloom_tests::Lab;
use std::f64::consts::PI;

/// Areas of the footprints (m²) of photons that were scattered `bounces` times, always specularly.
fn footprints(records: &[Photon], bounces: u32) -> Vec<f64> {
    let chosen = records.iter().filter(|photon| photon.bounce_flags & PhotonFlags::CAUSTIC != 0 && photon.bounces() == bounces);
    chosen.map(|photon| PI * f64::from(photon.footprint_radius()).powi(2)).collect()
}

/// Asserts that `areas` of photons drawn from `drawn` add up to `expected` (m²).
fn assert_sum(name: &str, areas: &[f64], drawn: u32, expected: f64, geometry: f64) {
    let sum: f64 = areas.iter().sum();
    let squares: f64 = areas.iter().map(|a| a * a).sum();
    let error = (squares - sum * sum / f64::from(drawn)).sqrt();
    println!("{name}: {} photons cover {sum:.4} ± {error:.4} m², expected {expected:.4}", areas.len());
    assert!(areas.len() > 1000, "{name}: {} photons", areas.len());
    assert!((sum - expected).abs() < 3.0 * error + geometry * expected, "{name}: {sum} ± {error} against {expected} m²");
}

/// All around a mirror ball: what a light sends to it covers the wall but for the cap in its shadow.
#[test]
fn a_mirror_ball_spreads_its_light_over_the_whole_wall() {
    const RADIUS: f64 = 0.2;
    const DISTANCE: f64 = 0.6;
    const EMITTED: u32 = 300_000;
    let Some(mut lab) = Lab::open() else { return };
    let mut scene = builtin::closed_sphere(5);
    let ball = builtin::closed_sphere(5).triangles.into_iter().map(|triangle| {
        // The wall's fronts look inwards.
        let [a, b, c] = triangle.positions_world.map(|p| p.normalize() * RADIUS as f32);
        let normals_world = [a, c, b].map(Vec3::normalize);
        Triangle { positions_world: [a, c, b], normals_world, material: 1, ..triangle }
    });
    scene.triangles.extend(ball);
    scene.materials.push(Material::metal("mirror", Vec3::ONE, 0.0));
    scene.lights = vec![Light::Point { position_world: Vec3::new(0.0, 0.0, DISTANCE as f32), intensity: Vec3::ONE }];
    let records = lab.photons(&lab.upload(&scene), &PhotonSettings::new(EMITTED, 1, 3)).records;

    let alpha = (RADIUS / DISTANCE).asin();
    let along = DISTANCE * alpha.cos();
    let reach = along + (along * along - DISTANCE * DISTANCE + 1.0).sqrt();
    let cos_cap = reach * alpha.cos() - DISTANCE;
    // 20,480 facets: edges of 0.03 rad leave sagittas of 10⁻⁴ of the ball's radius; at its silhouette, where the map is steepest,
    // that moves the limit of the light by √(2 · 10⁻⁴) rad.
    assert_sum("mirror ball", &footprints(&records, 1), EMITTED, 2.0 * PI * (1.0 + cos_cap), 0.015);
}

/// A square of `2 half` metres in the plane `y`, about the y axis.
pub(crate) fn horizontal(y: f32, half: f32, up: bool, material: u32) -> [Triangle; 2] {
    let at = |x: f32, z: f32| Vec3::new(x * half, y, z * half);
    let triangle = |positions_world: [Vec3; 3]| {
        let positions_world = if up { positions_world } else { [positions_world[0], positions_world[2], positions_world[1]] };
        let normal = if up { Vec3::Y } else { Vec3::NEG_Y };
        Triangle { positions_world, normals_world: [normal; 3], uvs: [glam::Vec2::ZERO; 3], material }
    };
    [triangle([at(-1.0, 1.0), at(1.0, 1.0), at(1.0, -1.0)]), triangle([at(-1.0, 1.0), at(1.0, -1.0), at(-1.0, -1.0)])]
}

/// A cone of light through a thick pane: Snell's law sets the radius of its spot, Fresnel's how many photons arrive.
#[test]
fn a_pane_narrows_a_cone_as_snell_says() {
    const EMITTED: u32 = 40_000;
    const IOR: f64 = 1.5;
    const THICKNESS: f64 = 1.6;
    /// Of the path from the light to the floor outside the pane (m).
    const AIR: f64 = 0.4;
    let half_angle = 0.9_f64;
    let Some(mut lab) = Lab::open() else { return };
    let scene = Scene {
        name: "pane".into(),
        triangles: [horizontal(0.0, 5.0, true, 0), horizontal(1.8, 5.0, true, 1), horizontal(0.2, 5.0, false, 1)].concat(),
        materials: vec![Material::lambert("floor", Vec3::splat(0.5)), Material::glass("pane", IOR as f32, THICKNESS as f32)],
        lights: vec![Light::Spot {
            position_world: Vec3::new(0.0, 2.0, 0.0),
            direction_world: Vec3::NEG_Y,
            intensity: Vec3::ONE,
            cos_inner: half_angle.cos() as f32 + 1e-3,
            cos_outer: half_angle.cos() as f32,
        }],
        ..Scene::default()
    };
    let records = lab.photons(&lab.upload(&scene), &PhotonSettings::new(EMITTED, 2, 5)).records;

    let radius = |theta: f64| {
        let inside = (theta.sin() / IOR).asin();
        (AIR * theta.tan() + THICKNESS * inside.tan(), inside)
    };
    // Reflectance of one face; the ray leaves the pane at the angle it entered, so both faces have the same.
    let transmitted = |theta: f64, inside: f64| {
        let s = (theta.cos() - IOR * inside.cos()) / (theta.cos() + IOR * inside.cos());
        let p = (IOR * theta.cos() - inside.cos()) / (IOR * theta.cos() + inside.cos());
        (1.0 - 0.5 * (s * s + p * p)).powi(2)
    };
    let steps = 2000;
    let mut expected = 0.0;
    for step in 0..steps {
        let at = |i: f64| half_angle * i / f64::from(steps);
        let (inner, outer, middle) = (radius(at(step.into())).0, radius(at(f64::from(step) + 1.0)).0, at(f64::from(step) + 0.5));
        expected += PI * (outer * outer - inner * inner) * transmitted(middle, radius(middle).1);
    }
    // Flat faces: nothing but chance, and radii rounded to halves (2⁻¹¹, by chance up or down).
    assert_sum("pane", &footprints(&records, 2), EMITTED, expected, 0.0);
}
