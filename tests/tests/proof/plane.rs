//! PHYSICS checks 4 and 5 on a plane, with photons on a square lattice and the G-buffer imported as an engine would.
//!
//! A lattice in place of random photons: the density estimate is then a quadrature of the kernel's integral, with an error
//! bounded by `kernel::lattice_error`, and no noise. A photon's mantissas hold a whole number per channel; two photons in one place, the
//! second 256 times the unit, hold any of 16 bits, so polynomial fields are represented exactly.
//!
//! A field E of second degree with second derivatives H has ∫κ(v) E(x + v) dv = E(x) + ½ Σ H ∫κ v vᵀ = E(x) + M₂ ∇²E/4, since ∫κ v vᵀ is M₂/2
//! times the identity. For the disc of PHYSICS M₂ is r²/2, the bias r²∇²E/8; for the cone kernel M₂ = 0.4133 r².

use lightloom_passes::Photon;
use lightloom_passes::scene::builtin;
use lightloom_tests::synthetic::{FLUX_UNIT, PlaneView, SHADING_EPSILON, falling_photon, flux_word};
use lightloom_tests::{Lab, kernel, strategies};

/// Spacing of the lattice (m).
const SPACING: f64 = 1.0 / 64.0;
/// Kernel radius (m): 48 spacings.
const RADIUS: f64 = 0.75;
/// Half the width of the lattice, in photons.
const HALF: i32 = 96;
/// Of a sum of some 7,000 terms in f32, in the worst case n ulp/2 = 4·10⁻⁴, at random √n ulp/2; and of the kernel's evaluation, a few ulp.
const ROUNDING: f64 = 2.0e-5;

/// Odd, so that a column of pixels lies on x = 0 and a pixel on the origin.
const VIEW: PlaneView = PlaneView { size: [45, 33], width: 1.5, height: 3.0 };

/// Photons at ((i + ½), (j + ½)) · `SPACING` whose irradiance (units of [`FLUX_UNIT`] per cell) is `field(i, j)`.
fn lattice(field: impl Fn(i32, i32) -> [u32; 3]) -> Vec<Photon> {
    let mut photons = Vec::new();
    for j in -HALF..HALF {
        for i in -HALF..HALF {
            let [x, z] = [i, j].map(|k| (f64::from(k) + 0.5) * SPACING);
            let values = field(i, j);
            assert!(values.iter().all(|&value| value < 1 << 16), "{values:?} fits 16 bits");
            let [low, high] = [0, 8].map(|shift| values.map(|value| (value >> shift) as u8));
            for (bytes, shift) in [(low, 0), (high, 8)] {
                if bytes != [0; 3] {
                    photons.push(falling_photon(x, z, flux_word(bytes, shift)));
                }
            }
        }
    }
    photons
}

/// W·m⁻² of a field value, as seen through PHYSICS's shading-normal factor for light from straight above.
fn irradiance(value: f64) -> f64 {
    value * FLUX_UNIT / (SPACING * SPACING) / (1.0 + SHADING_EPSILON)
}

/// Whether the kernel around (x, z) lies within the lattice.
fn whole([x, z]: [f64; 2]) -> bool {
    x.abs().max(z.abs()) + RADIUS < f64::from(HALF) * SPACING
}

#[test]
fn fields_of_first_degree_are_exact_and_of_second_degree_off_by_the_moment() {
    const BASE: u32 = 8192;
    let Some(mut lab) = Lab::open() else { return };
    let scene = lab.upload(&builtin::plane(8.0));
    // Linear, a bowl, a saddle, in the middle of the cells: (i + ½)² is a quarter off i² + i.
    let photons = lattice(|i, j| {
        let (bowl, saddle) = (i * i + i + j * j + j, i * i + i - j * j - j);
        [(20_000 + 100 * i + 60 * j) as u32, BASE + bowl as u32, (20_000 + saddle) as u32]
    });
    let mut all = strategies(&lab.sources, RADIUS as f32, RADIUS as f32);
    let estimates = VIEW.irradiance(&mut lab, &scene, &photons, &mut all);
    let quadrature = kernel::lattice_error(RADIUS, SPACING);
    let (mut points, mut worst) = (0, 0.0_f64);
    for (strategy, [image, _]) in all.iter().zip(&estimates.layers) {
        for row in 0..VIEW.size[1] {
            for column in 0..VIEW.size[0] {
                let point = VIEW.point(column, row);
                if !whole(point) {
                    continue;
                }
                points += 1;
                // In spacings from the origin; the lattice's points are at i + ½.
                let [x, z] = point.map(|p| p / SPACING);
                let radius = RADIUS / SPACING;
                let linear = 20_000.0 + 100.0 * (x - 0.5) + 60.0 * (z - 0.5);
                let bowl = f64::from(BASE) + x * x + z * z - 0.5;
                let saddle = 20_000.0 + x * x - z * z;
                // ∇² of the bowl is 4, of the others 0.
                let expected = [linear, bowl + kernel::moment(2, radius), saddle];
                // The largest value within the kernel scales the quadrature's error.
                let most = [
                    linear + 117.0 * radius,
                    f64::from(BASE) + (x.hypot(z) + radius).powi(2),
                    20_000.0 + (x.hypot(z) + radius).powi(2),
                ];
                let found = image.at(column, row);
                for c in 0..3 {
                    let (error, bound) =
                        ((found[c] - irradiance(expected[c])).abs(), irradiance((quadrature + ROUNDING) * most[c]));
                    worst = worst.max(error / irradiance(expected[c]));
                    assert!(
                        error <= bound,
                        "{} at {point:?}, channel {c}: {} in place of {}, allowed {bound:e}",
                        strategy.name(),
                        found[c],
                        irradiance(expected[c])
                    );
                }
            }
        }
    }
    println!("{points} points, worst relative error {worst:e}, quadrature bound {quadrature:e}");
    assert!(points > 3 * 500, "{points} points have their whole kernel on the lattice");
    // The bias is many times what the bound would hide.
    assert!(kernel::moment(2, RADIUS / SPACING) / f64::from(BASE) > 50.0 * quadrature, "the bowl's bias shows");
}

#[test]
fn even_light_is_flux_per_area_and_half_of_it_on_a_straight_edge() {
    const VALUE: u32 = 200;
    let Some(mut lab) = Lab::open() else { return };
    let scene = lab.upload(&builtin::plane(8.0));
    // Light for x > 0 only. The edge x = 0 is half a spacing from the first column: a line of symmetry of the lattice.
    let photons = lattice(|i, _| if i >= 0 { [VALUE; 3] } else { [0; 3] });
    let mut all = strategies(&lab.sources, RADIUS as f32, RADIUS as f32);
    let estimates = VIEW.irradiance(&mut lab, &scene, &photons, &mut all);
    let flux_per_area = irradiance(f64::from(VALUE));
    let bound = flux_per_area * (kernel::lattice_error(RADIUS, SPACING) + ROUNDING);
    let middle = VIEW.size[0] / 2;
    for (strategy, [image, _]) in all.iter().zip(&estimates.layers) {
        let (mut on_edge, mut monotone) = (0, 0.0_f64);
        for row in 0..VIEW.size[1] {
            assert!(VIEW.point(middle, row)[0].abs() < 1e-12, "the middle column is the edge");
            if !whole([0.0, VIEW.point(middle, row)[1]]) {
                continue;
            }
            on_edge += 1;
            let half = image.at(middle, row)[0];
            assert!(
                (half - 0.5 * flux_per_area).abs() < 0.5 * bound,
                "{}: {half} on the edge, Φ/A is {flux_per_area}",
                strategy.name()
            );
            for column in 0..VIEW.size[0] {
                // The share within the half-plane, by the same function that the closed box uses.
                let x = VIEW.point(column, row)[0];
                let share = if x < 0.0 { 1.0 - inside(-x) } else { inside(x) };
                let found = image.at(column, row)[0];
                monotone = monotone.max((found - share * flux_per_area).abs());
            }
        }
        assert!(on_edge > 10, "{on_edge} points on the edge");
        // Away from the line of symmetry the edge cuts the kernel, and the strip of half a spacing beside it is counted whole or not
        // at all: in a smooth field the midpoint rule's error, h²/24 · slope of the kernel's profile, of order 1/r per r.
        let cut = flux_per_area * (SPACING / RADIUS).powi(2);
        println!(
            "{}: worst error across the edge {:e} of Φ/A, bound {:e}",
            strategy.name(),
            monotone / flux_per_area,
            (bound + cut) / flux_per_area
        );
        assert!(monotone < bound + cut, "{}: off by {monotone} across the edge", strategy.name());
    }
}

/// Check 4 for radii by neighbours, where the density of photons changes and that of light does not: each photon's kernel is normalised, so that
/// E is Φ/A on either side and in the mean over the seam. (A gather of the k nearest at each point finds too much or too little there.)
#[test]
fn radii_by_neighbours_keep_the_flux() {
    const NEAREST: f64 = 200.0;
    const VALUE: u32 = 60;
    let Some(mut lab) = Lab::open() else { return };
    let scene = lab.upload(&builtin::plane(8.0));
    // Left of x = 0 each photon of the lattice; right of it one in four, with four times the light, in the middle of the four.
    let mut photons = Vec::new();
    for (i, j) in (-HALF..HALF).flat_map(|j| (-HALF..HALF).map(move |i| (i, j))) {
        let [x, z] = [i, j].map(f64::from);
        if i < 0 {
            photons.push(falling_photon((x + 0.5) * SPACING, (z + 0.5) * SPACING, flux_word([VALUE as u8; 3], 0)));
        } else if i % 2 == 0 && j % 2 == 0 {
            photons.push(falling_photon((x + 1.0) * SPACING, (z + 1.0) * SPACING, flux_word([4 * VALUE as u8; 3], 0)));
        }
    }
    // A gather and a splat; the others equal `exact`.
    let mut all = strategies(&lab.sources, 0.05, 0.5);
    all.retain(|strategy| ["exact", "splat-compute"].contains(&strategy.name()));
    for strategy in &mut all {
        strategy.set("nearest", &NEAREST.to_string()).expect("every strategy has it");
    }
    let estimates = VIEW.irradiance(&mut lab, &scene, &photons, &mut all);
    let flux_per_area = irradiance(f64::from(VALUE));
    // A circle on a lattice that holds n points has the area of n cells, to 3 % of its radius for n = 200 (Gauss' circle problem: at most
    // 10 points more or less); so the radii, 8 spacings on either side.
    let radius = (NEAREST / std::f64::consts::PI).sqrt();
    let bound = flux_per_area * (kernel::lattice_error(0.97 * radius, 1.0) + ROUNDING);
    // Radii are those of one density as far from the seam as the kernels of the other reach, and as far again.
    let pure = [-4.0 * radius * SPACING, 4.0 * radius * SPACING];
    for (strategy, [image, _]) in all.iter().zip(&estimates.layers) {
        let (mut inside, mut seam) = (0, 0.0_f64);
        for row in 0..VIEW.size[1] {
            let mut mean = 0.0;
            for column in 0..VIEW.size[0] {
                let (x, found) = (VIEW.point(column, row)[0], image.at(column, row)[0]);
                mean += found / f64::from(VIEW.size[0]);
                if x < pure[0] || x > pure[1] {
                    inside += 1;
                    let name = strategy.name();
                    assert!((found - flux_per_area).abs() < bound, "{name} at x = {x}: {found}, Φ/A is {flux_per_area}");
                }
            }
            seam = seam.max((mean - flux_per_area).abs());
        }
        println!("{}: worst row mean {:e} of Φ/A off", strategy.name(), seam / flux_per_area);
        assert!(inside > 300, "{inside} points away from the seam");
        assert!(seam < bound, "{}: a row's mean is {seam} off Φ/A = {flux_per_area}", strategy.name());
    }
}

/// Share of the kernel at distance `x` ≥ 0 inside a straight edge.
fn inside(x: f64) -> f64 {
    kernel::share_in_rectangle([x, 10.0], [20.0, 20.0], RADIUS)
}
