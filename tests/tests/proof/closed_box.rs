//! PHYSICS check 2: in a closed box of one albedo ρ, each bounce keeps the share ρ of all light, so that summed over the
//! walls indirect flux is direct flux · (ρ + ρ² + …) = direct flux · ρ/(1 − ρ), wherever the light falls.
//!
//! **Area-weighted means.** Six cameras at the centre, one per wall, each just filled by its wall: film and wall are parallel, so
//! every pixel is the same area of wall, and the plain mean over all pixels is the mean over the walls.
//!
//! **Density estimation.** Integrated over a wall W, the estimate ∫_W κ(x − y) dx of a photon at y is the share C(y) of its kernel that
//! lies inside W: exactly, photon by photon, the mean estimate is Σ Φ C(y) / area. The neighbouring walls' photons are refused by
//! their normals (`MIN_NORMAL_COSINE`), so what kernels send over the edges is lost: of evenly spread light the perimeter times
//! M₁/π of the wall's area (`kernel::boundary_loss`), here times the ratio of the light within a radius of the edges to the mean,
//! since indirect light is weaker there.
//!
//! Pixels sample the estimate at a lattice of spacing h, not its integral. For smooth functions the midpoint rule errs by
//! h²/24 times the difference of the derivative at both ends: here the estimate's slope at each edge, E · `kernel::edge_slope`.

use crate::determinism::settings;
use glam::Vec3;
use lightloom_passes::scene::{Camera, Light, builtin};
use lightloom_passes::{Photon, decode_flux, decode_octahedral};
use lightloom_tests::synthetic::SHADING_EPSILON;
use lightloom_tests::{Frame, Lab, Mean, View, kernel, strategies};
use std::f64::consts::PI;

const SIZE: Vec3 = Vec3::new(3.0, 4.0, 5.0);
const AREA: f64 = 94.0;
const ALBEDO: f64 = 0.5;
/// ρ²⁴ of the light is left out: 6·10⁻⁸.
const BOUNCES: u32 = 24;
const PIXELS_PER_METRE: u32 = 12;

/// A camera at the box's centre for each wall; the image has [`PIXELS_PER_METRE`].
fn views() -> Vec<View> {
    let center = 0.5 * SIZE;
    // Out of the centre, the image's up, and the axes across, up and forward.
    let walls = [
        (Vec3::X, Vec3::Y, [2, 1, 0]),
        (Vec3::NEG_X, Vec3::Y, [2, 1, 0]),
        (Vec3::Y, Vec3::Z, [0, 2, 1]),
        (Vec3::NEG_Y, Vec3::Z, [0, 2, 1]),
        (Vec3::Z, Vec3::Y, [0, 1, 2]),
        (Vec3::NEG_Z, Vec3::Y, [0, 1, 2]),
    ];
    walls
        .into_iter()
        .map(|(out, up, [across, upward, forward])| {
            let yfov = 2.0 * (SIZE[upward] / SIZE[forward]).atan();
            let camera = Camera::look_at("wall", center, center + out, up, yfov);
            View::new(camera, [across, upward].map(|axis| SIZE[axis] as u32 * PIXELS_PER_METRE))
        })
        .collect()
}

/// Mean direct irradiance (W·m⁻²): the light's flux over the walls.
fn direct() -> f64 {
    let scene = builtin::closed_box(ALBEDO as f32);
    let [Light::Point { intensity, .. }] = scene.lights[..] else { panic!("one point light") };
    4.0 * PI * f64::from(intensity.y) / AREA
}

fn indirect() -> f64 {
    direct() * ALBEDO / (1.0 - ALBEDO)
}

/// Mean over walls from the means of their images, weighted by area; from radiance to irradiance.
fn over_walls(views: &[View], means: &[Mean]) -> Mean {
    let pixels = |view: &View| f64::from(view.size[0] * view.size[1]);
    let total: f64 = views.iter().map(pixels).sum();
    let weighted = || views.iter().zip(means).map(|(view, mean)| (pixels(view) / total * PI / ALBEDO, mean));
    Mean {
        value: weighted().map(|(w, mean)| w * mean.value).sum(),
        standard_error: weighted().map(|(w, mean)| (w * mean.standard_error).powi(2)).sum::<f64>().sqrt(),
    }
}

#[test]
fn path_keeps_the_balance_of_the_walls() {
    let Some(mut lab) = Lab::open() else { return };
    let gpu_scene = lab.upload(&builtin::closed_box(ALBEDO as f32));
    let views = views();
    let images: Vec<_> = views.iter().zip(0..).map(|(view, seed)| lab.path(&gpu_scene, view, 24, seed, BOUNCES)).collect();
    let layer = |f: fn(&lightloom_tests::PathImages) -> Mean| over_walls(&views, &images.iter().map(f).collect::<Vec<_>>());
    // Nothing but noise: rays leave through the whole area of each pixel.
    layer(|images| images.direct.grey()).assert_near(direct(), 0.0, "mean direct irradiance");
    let mean = layer(|images| images.indirect.grey());
    mean.assert_near(indirect(), 0.0, "mean indirect irradiance");
    assert!(mean.standard_error < 2e-3 * mean.value, "precise enough to mean something: {mean:?}");
}

#[test]
fn stored_flux_is_the_walls_irradiance() {
    const EMITTED: u32 = 400_000;
    let Some(mut lab) = Lab::open() else { return };
    let gpu_scene = lab.upload(&builtin::closed_box(ALBEDO as f32));
    let traced = lab.photons(&gpu_scene, &settings(EMITTED, BOUNCES, 4));
    assert_eq!(traced.state.dropped, 0, "every photon is stored");
    let flux: f64 = traced.records.iter().map(|photon| f64::from(decode_flux(photon.flux).y)).sum();
    // Roulette survives with ρ: a photon leaves n records with probability (1 − ρ) ρⁿ, of mean ρ/(1 − ρ) and variance ρ/(1 − ρ)², all of the
    // flux it was emitted with.
    let relative = (1.0 / (f64::from(EMITTED) * ALBEDO)).sqrt();
    let mean = Mean { value: flux / AREA, standard_error: relative * indirect() };
    mean.assert_near(indirect(), 0.0, "Σ stored flux / area");
}

/// Sides and place on its wall of a photon.
fn on_wall(photon: &Photon) -> ([f64; 2], [f64; 2]) {
    let normal = decode_octahedral(photon.normal).abs();
    let [u, v] = if normal.x > 0.9 {
        [1, 2]
    } else if normal.y > 0.9 {
        [0, 2]
    } else {
        [0, 1]
    };
    let pick = |p: Vec3| [f64::from(p[u]), f64::from(p[v])];
    (pick(Vec3::from(photon.position)), pick(SIZE))
}

#[test]
fn estimates_lose_at_the_edges_what_the_kernel_says() {
    const RADIUS: f32 = 0.3;
    const EMITTED: u32 = 40_000;
    let Some(mut lab) = Lab::open() else { return };
    let gpu_scene = lab.upload(&builtin::closed_box(ALBEDO as f32));
    let views = views();
    let mut all = strategies(&lab.sources, RADIUS, RADIUS);
    let mut means = vec![Vec::new(); all.len()];
    let mut records = Vec::new();
    for view in &views {
        // One seed: the same photons in front of every camera.
        let frame = Frame { photons: settings(EMITTED, BOUNCES, 8), maps: None, deterministic: false };
        let estimates = lab.estimate(&gpu_scene, view, frame, &mut all);
        assert_eq!(estimates.traced.state.dropped, 0, "every photon is stored");
        for (means, [indirect, _]) in means.iter_mut().zip(&estimates.layers) {
            means.push(Mean { value: indirect.mean()[1], standard_error: 0.0 });
        }
        records = estimates.traced.records;
    }
    let radius = f64::from(RADIUS);
    let (mut flux, mut inside, mut strip) = (0.0, 0.0, 0.0);
    for photon in &records {
        let power = f64::from(decode_flux(photon.flux).y);
        let (at, size) = on_wall(photon);
        flux += power;
        inside += power * kernel::share_in_rectangle(at, size, radius);
        let near = (0..2).any(|i| at[i].min(size[i] - at[i]) < radius);
        strip += if near { power } else { 0.0 };
    }
    // What even light would lose, wall by wall, and how bright the strips along the edges are.
    let [a, b, c] = SIZE.to_array().map(f64::from);
    let over_walls_of = |f: &dyn Fn([f64; 2]) -> f64| [[a, b], [b, c], [a, c]].iter().map(|&wall| 2.0 * f(wall)).sum::<f64>();
    let even = over_walls_of(&|wall| wall[0] * wall[1] / AREA * kernel::boundary_loss(wall, radius));
    let strip_area = over_walls_of(&|[a, b]| a * b - (a - 2.0 * radius) * (b - 2.0 * radius));
    let brightness = strip / strip_area / (flux / AREA);
    let loss = 1.0 - inside / flux;
    println!(
        "lost at the edges: {loss:.5}, of even light {even:.5}, strips have {brightness:.4} of the mean; {} photons",
        records.len()
    );
    // The loss is concentrated at the very edge, where light is a little weaker than in the strip as a whole: it changes by
    // some 10 % over a strip, and the photons' noise there is 1 %.
    assert!((loss / (even * brightness) - 1.0).abs() < 0.05, "lost {loss}, derived {}", even * brightness);

    // Midpoint rule: h²/24 · 2 slopes per pair of edges and length between them, for both directions of each wall, at most 3 m apart.
    let spacing = 1.0 / f64::from(PIXELS_PER_METRE);
    let midpoint = spacing * spacing / 24.0 * 2.0 * 2.0 * kernel::edge_slope(radius) / 3.0;
    // A photon's kernel is sampled by some 40 pixels, whose sum is off by 1/40 at most in the manner of `kernel::lattice_error`, at random.
    let sampling = 4.0 * (1.0 / 40.0) / (records.len() as f64).sqrt();
    let bias = midpoint + sampling + 2.0 * SHADING_EPSILON;
    let truth = inside / AREA;
    // Against the closed form the photons' own noise comes in, as above.
    let expected = indirect() * (1.0 - loss);
    let noise = expected * (1.0 / (f64::from(EMITTED) * ALBEDO)).sqrt();
    for (strategy, means) in all.iter().zip(&means) {
        let mean = over_walls(&views, means);
        mean.assert_near(truth, bias * truth, &format!("{}, from the same photons", strategy.name()));
        Mean { standard_error: noise, ..mean }.assert_near(expected, bias * expected, strategy.name());
    }
}
