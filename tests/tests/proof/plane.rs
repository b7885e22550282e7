//! PHYSICS checks 4 and 5 on a plane, with photons on a square lattice and the G-buffer imported as an engine would.
//!
//! A lattice in place of random photons: the density estimate is then a quadrature of the kernel's integral, with an error
//! bounded by `Kernel::lattice_error`, and no noise. A photon's mantissas hold a whole number per channel; two photons in one place, the
//! second 256 times the unit, hold any of 16 bits, so polynomial fields are represented exactly.
//!
//! A field E of second degree with second derivatives H has ∫κ(v) E(x + v) dv = E(x) + ½ Σ H ∫κ v vᵀ = E(x) + M₂ ∇²E/4, since ∫κ v vᵀ is M₂/2
//! times the identity. For the disc of PHYSICS M₂ is r²/2, the bias r²∇²E/8; for the cone kernel M₂ = 0.4133 r².
//!
//! **Targets of 16 bits** round their sums at each photon. They get few photons, on a coarse lattice with fields of 8 bits.

use lightloom_passes::Photon;
use lightloom_passes::scene::{GpuScene, builtin};
use lightloom_tests::kernel::Kernel;
use lightloom_tests::synthetic::{FLUX_UNIT, PlaneView, SHADING_EPSILON, falling_photon, flux_word};
use lightloom_tests::{Estimator, Lab, Sums};
use std::f64::consts::PI;

/// Kernel radius (m).
const RADIUS: f64 = 0.7;
/// Of a sum of some 7,000 terms in f32, in the worst case n ulp/2 = 4·10⁻⁴, at random √n ulp/2; and of the kernel's evaluation, a few ulp.
const ROUNDING: f64 = 2.0e-5;

/// Odd, so that a column of pixels lies on x = 0 and a pixel on the origin.
const VIEW: PlaneView = PlaneView { size: [45, 33], width: 1.8, height: 3.0 };

/// Photons at ((i + ½), (j + ½)) · spacing over a square of 3 m, and fields on them in units of [`FLUX_UNIT`] per cell.
struct Lattice {
    /// Spacing (m).
    spacing: f64,
    /// Half the width in photons.
    half: i32,
    /// Even light.
    even: u32,
    /// Linear field: value in the middle and slopes.
    linear: (i32, [i32; 2]),
    /// Bowl and saddle: their values in the middle, and what their squares are divided by.
    curved: ([i32; 2], i32),
    /// Photons that hold a value.
    records: u32,
}

/// 45 spacings to the radius, 6,300 places in a kernel.
const FINE: Lattice =
    Lattice { spacing: 1.0 / 64.0, half: 96, even: 200, linear: (20_000, [100, 60]), curved: ([8192, 20_000], 1), records: 2 };

/// 22 spacings to the radius, 1,580 places in a kernel.
const MEDIUM: Lattice =
    Lattice { spacing: 1.0 / 32.0, half: 48, even: 200, linear: (20_000, [200, 120]), curved: ([2048, 5000], 1), records: 2 };

/// 5.6 spacings to the radius, 99 places in a kernel.
const COARSE: Lattice =
    Lattice { spacing: 1.0 / 8.0, half: 12, even: 200, linear: (120, [5, 3]), curved: ([8, 100], 2), records: 1 };

impl Lattice {
    /// Photons whose irradiance is `field(i, j)`.
    fn photons(&self, field: impl Fn(i32, i32) -> [i32; 3]) -> Vec<Photon> {
        let mut photons = Vec::new();
        for j in -self.half..self.half {
            for i in -self.half..self.half {
                let [x, z] = [i, j].map(|k| (f64::from(k) + 0.5) * self.spacing);
                let values = field(i, j);
                assert!(values.iter().all(|&value| (0..1 << (8 * self.records)).contains(&value)), "{values:?} is represented");
                for shift in (0..self.records).map(|record| 8 * record) {
                    let bytes = values.map(|value| (value >> shift) as u8);
                    if bytes != [0; 3] {
                        photons.push(falling_photon(x, z, flux_word(bytes, shift)));
                    }
                }
            }
        }
        photons
    }

    /// W·m⁻² of a field value, as seen through PHYSICS's shading-normal factor for light from straight above.
    fn irradiance(&self, value: f64) -> f64 {
        value * FLUX_UNIT / (self.spacing * self.spacing) / (1.0 + SHADING_EPSILON)
    }

    /// Whether the kernel around (x, z) lies within the lattice.
    fn whole(&self, [x, z]: [f64; 2]) -> bool {
        x.abs().max(z.abs()) + RADIUS < f64::from(self.half) * self.spacing
    }

    /// Relative errors that are allowed: of the lattice's sum, and of its rounding.
    fn bound(&self, estimator: &Estimator) -> f64 {
        let quadrature = estimator.kernel.lattice_error(RADIUS, self.spacing);
        let terms = f64::from(self.records) * PI * (RADIUS / self.spacing).powi(2) * (1.0 + quadrature);
        // Row by row over a kernel that is symmetric about the point.
        quadrature + estimator.sums.rounding(terms, ROUNDING)
    }
}

fn fields_are_what_they_should_be(lab: &mut Lab, scene: &GpuScene, lattice: &Lattice, estimators: &[Estimator]) {
    let (middle, slopes) = lattice.linear;
    let (middles, divisor) = lattice.curved;
    // Linear, a bowl, a saddle, in the middle of the cells: (i + ½)² is a quarter off i² + i.
    let photons = lattice.photons(|i, j| {
        let (bowl, saddle) = (i * i + i + j * j + j, i * i + i - j * j - j);
        [middle + slopes[0] * i + slopes[1] * j, middles[0] + bowl / divisor, middles[1] + saddle / divisor]
    });
    let mut strategies: Vec<_> = estimators.iter().map(|it| it.build(&lab.sources, RADIUS, RADIUS)).collect();
    let estimates = VIEW.irradiance(lab, scene, &photons, &mut strategies);
    let radius = RADIUS / lattice.spacing;
    let [slope_x, slope_z] = slopes.map(f64::from);
    let [base, level] = middles.map(f64::from);
    let (middle, divisor) = (f64::from(middle), f64::from(divisor));
    for (estimator, [image, _]) in estimators.iter().zip(&estimates.layers) {
        let relative = lattice.bound(estimator);
        // ∇² of the bowl is 4, of the others 0, over the divisor.
        let bias = estimator.kernel.moment(2, radius) / divisor;
        let (mut points, mut worst) = (0, 0.0_f64);
        for (index, found) in image.pixels.iter().enumerate() {
            let point = VIEW.point(index as u32 % VIEW.size[0], index as u32 / VIEW.size[0]);
            if !lattice.whole(point) {
                continue;
            }
            points += 1;
            // In spacings from the origin; the lattice's points are at i + ½.
            let [x, z] = point.map(|p| p / lattice.spacing);
            let linear = middle + slope_x * (x - 0.5) + slope_z * (z - 0.5);
            let expected = [linear, base + (x * x + z * z - 0.5) / divisor + bias, level + (x * x - z * z) / divisor]
                .map(|v| lattice.irradiance(v));
            // The largest value within the kernel scales the errors.
            let far = (x.hypot(z) + radius).powi(2) / divisor;
            let most = [linear + slope_x.hypot(slope_z) * radius, base + far, level + far].map(|v| lattice.irradiance(v));
            for c in 0..3 {
                let (error, bound) = ((found[c] - expected[c]).abs(), relative * most[c]);
                worst = worst.max(error / bound);
                assert!(
                    error <= bound,
                    "{estimator} at {point:?}, channel {c}: {} in place of {}, allowed {bound:e}",
                    found[c],
                    expected[c]
                );
            }
        }
        println!("{estimator}: {points} points, worst error {worst:.3} of the bound {relative:.2e}");
        assert!(points > 500, "{points} points have their whole kernel on the lattice");
        // The bias is many times what the bound would hide, in the middle, where it shows best.
        let hidden = relative * (base + radius * radius / divisor);
        assert!(bias > 2.0 * hidden, "{estimator}: the bowl's bias {bias} does not show above {hidden}");
    }
}

fn even_light_is_flux_per_area_and_half_on_the_edge(
    lab: &mut Lab,
    scene: &GpuScene,
    lattice: &Lattice,
    estimators: &[Estimator],
) {
    // Light for x > 0 only. The edge x = 0 is half a spacing from the first column: a line of symmetry of the lattice.
    let photons = lattice.photons(|i, _| if i >= 0 { [lattice.even as i32; 3] } else { [0; 3] });
    let mut strategies: Vec<_> = estimators.iter().map(|it| it.build(&lab.sources, RADIUS, RADIUS)).collect();
    let estimates = VIEW.irradiance(lab, scene, &photons, &mut strategies);
    let flux_per_area = lattice.irradiance(f64::from(lattice.even));
    let middle = VIEW.size[0] / 2;
    for (estimator, [image, _]) in estimators.iter().zip(&estimates.layers) {
        let bound = lattice.bound(estimator);
        // Away from the line of symmetry the edge cuts the kernel, and the strip of half a spacing beside it is counted whole or not
        // at all: in a smooth field the midpoint rule's error, h²/24 · slope of the kernel's profile, of order 1/r per r.
        let cut = (lattice.spacing / RADIUS).powi(2);
        let (mut on_edge, mut inside, mut worst) = (0, 0, 0.0_f64);
        for row in 0..VIEW.size[1] {
            assert!(VIEW.point(middle, row)[0].abs() < 1e-12, "the middle column is the edge");
            if !lattice.whole([0.0, VIEW.point(middle, row)[1]]) {
                continue;
            }
            on_edge += 1;
            let half = image.at(middle, row)[0] / flux_per_area;
            assert!((half - 0.5).abs() < 0.5 * bound, "{estimator}: {half} of Φ/A on the edge, allowed ½ (1 ± {bound})");
            for column in 0..VIEW.size[0] {
                let x = VIEW.point(column, row)[0];
                if x > 0.0 && !lattice.whole([x, 0.0]) {
                    continue;
                }
                let off = image.at(column, row)[0] / flux_per_area - estimator.kernel.beside_edge(x, RADIUS);
                worst = worst.max(off.abs());
                inside += u32::from(x >= RADIUS);
            }
        }
        println!("{estimator}: worst error across the edge {worst:.2e} of Φ/A, bound {:.2e}", bound + cut);
        assert!(on_edge > 10 && inside > 10, "{on_edge} points on the edge, {inside} within even light");
        assert!(worst < bound + cut, "{estimator}: off by {worst} of Φ/A across the edge, allowed {}", bound + cut);
    }
}

/// What searches for photons, and `splat-compute`, whose sums are as exact: on any device.
fn searches() -> &'static [Estimator] {
    let drawn = Estimator::ALL.iter().position(|it| it.strategy == "splat-3d").expect("splats are drawn");
    &Estimator::ALL[..drawn]
}

#[test]
fn fields_of_first_degree_are_exact_and_of_second_degree_off_by_the_moment() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = lab.upload(&builtin::plane(8.0));
    fields_are_what_they_should_be(&mut lab, &scene, &FINE, searches());
}

#[test]
fn even_light_is_flux_per_area_and_half_of_it_on_a_straight_edge() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = lab.upload(&builtin::plane(8.0));
    even_light_is_flux_per_area_and_half_on_the_edge(&mut lab, &scene, &FINE, searches());
}

#[test]
fn splats_keep_even_light_and_fields_of_first_and_second_degree() {
    let Some(mut lab) = Lab::open_blending() else { return };
    let scene = lab.upload(&builtin::plane(8.0));
    let splats = Estimator::ALL.into_iter().filter(|it| it.splats() && it.runs_on(&lab));
    let (half, full): (Vec<_>, Vec<_>) = splats.partition(|it| it.sums == Sums::Half);
    for (lattice, estimators) in [(MEDIUM, full), (COARSE, half)] {
        fields_are_what_they_should_be(&mut lab, &scene, &lattice, &estimators);
        even_light_is_flux_per_area_and_half_on_the_edge(&mut lab, &scene, &lattice, &estimators);
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
    for (i, j) in (-FINE.half..FINE.half).flat_map(|j| (-FINE.half..FINE.half).map(move |i| (i, j))) {
        let [x, z] = [i, j].map(f64::from);
        if i < 0 {
            photons.push(falling_photon((x + 0.5) * FINE.spacing, (z + 0.5) * FINE.spacing, flux_word([VALUE as u8; 3], 0)));
        } else if i % 2 == 0 && j % 2 == 0 {
            photons.push(falling_photon((x + 1.0) * FINE.spacing, (z + 1.0) * FINE.spacing, flux_word([4 * VALUE as u8; 3], 0)));
        }
    }
    // A gather and a splat; the others equal `exact`.
    let two = searches().iter().filter(|it| ["exact", "splat-compute"].contains(&it.strategy));
    let mut all: Vec<_> = two.map(|it| it.build(&lab.sources, 0.05, 0.5)).collect();
    for strategy in &mut all {
        strategy.set("nearest", &NEAREST.to_string()).expect("every strategy has it");
    }
    let estimates = VIEW.irradiance(&mut lab, &scene, &photons, &mut all);
    let flux_per_area = FINE.irradiance(f64::from(VALUE));
    // A circle on a lattice that holds n points has the area of n cells, to 3 % of its radius for n = 200 (Gauss' circle problem: at most
    // 10 points more or less); so the radii, 8 spacings on either side.
    let radius = (NEAREST / PI).sqrt();
    let bound = flux_per_area * (Kernel::Cone.lattice_error(0.97 * radius, 1.0) + ROUNDING);
    // Radii are those of one density as far from the seam as the kernels of the other reach, and as far again.
    let pure = [-4.0 * radius * FINE.spacing, 4.0 * radius * FINE.spacing];
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
