//! Bias and variance of every estimator, told apart over 16 sets of photons: see `Waves` for both in closed form.
//!
//! The 225 points' kernels do not overlap, so that 3,600 estimates are independent but for what a fixed number of photons ties together, which makes
//! means and sums calmer than is allowed for. Errors are sums over all of them in units of the predicted variance:
//!
//! - bias: Σ c (x − E)/σ² / Σ c²/σ², c = cos kx, estimates its amplitude with the standard error 1/√Σ c²/σ²;
//! - mean: Σ (x − μ)/σ² against its standard error √Σ 1/σ², μ the predicted mean;
//! - variance: Σ (x − μ)²/σ² is 3,600, with the standard error √Σ(2 + excess kurtosis).
//!
//! Four standard errors are allowed, and to targets of 16 bits what `Sums::rounding` says of each estimate. They get a quarter of the photons.

use lightloom_passes::scene::{GpuScene, builtin};
use lightloom_tests::{Estimator, Lab, Mean, Sums, Waves};
use std::f64::consts::PI;

const SEEDS: u64 = 16;
/// Kernel radius (m): a bias of 6 % of the wave.
const RADIUS: f64 = 0.25;

/// Checks estimates from 2^`bits` photons.
fn check(lab: &mut Lab, scene: &GpuScene, estimators: &[Estimator], bits: u32) {
    let mut strategies: Vec<_> = estimators.iter().map(|it| it.build(&lab.sources, RADIUS, RADIUS)).collect();
    // Estimates of each, seed after seed.
    let mut found = vec![Vec::new(); estimators.len()];
    for seed in 0..SEEDS {
        let estimates = Waves::VIEW.irradiance(lab, scene, &Waves::photons(bits, seed), &mut strategies);
        for (found, [image, _]) in found.iter_mut().zip(&estimates.layers) {
            found.extend(image.pixels.iter().map(|pixel| pixel[1]));
        }
    }
    for (estimator, found) in estimators.iter().zip(&found) {
        assert_predicted(estimator, found, bits);
    }
}

fn assert_predicted(estimator: &Estimator, found: &[f64], bits: u32) {
    let kernel = estimator.kernel;
    let predicted = Waves::bias(kernel, RADIUS);
    // r²∇²E M₂/4, and the next term of the series.
    let leading = -Waves::CONTRAST * Waves::FREQUENCY.powi(2) * kernel.moment(2, RADIUS) / 4.0;
    let next = Waves::CONTRAST * Waves::FREQUENCY.powi(4) * kernel.moment(4, RADIUS) / 64.0;
    assert!((predicted - leading).abs() < next, "{predicted} is {leading} to leading order");

    let photons_per_unit = PI * RADIUS * RADIUS * f64::from(1_u32 << bits) / Waves::SIDE.powi(2);
    let (mut bias, mut weight, mut bias_rounding) = (0.0, 0.0, 0.0);
    let (mut mean, mut precision, mut mean_rounding) = (0.0, 0.0, 0.0);
    let (mut square, mut spread) = (0.0, 0.0);
    for (x, c) in found.iter().zip(Waves::cosines().iter().cycle()) {
        let (truth, variance) = (Waves::truth(*c), Waves::variance(kernel, RADIUS, bits, *c));
        let (error, noise) = (x - truth, x - truth - predicted * c);
        let rounding = truth * estimator.sums.rounding(photons_per_unit * truth, 0.0);
        bias += c * error / variance;
        weight += c * c / variance;
        bias_rounding += c.abs() * rounding / variance;
        mean += noise / variance;
        precision += 1.0 / variance;
        mean_rounding += rounding / variance;
        square += noise * noise / variance;
        spread += 2.0 + Waves::kurtosis(kernel, RADIUS, bits, *c);
    }
    let bias = Mean { value: bias / weight, standard_error: weight.sqrt().recip() };
    bias.assert_near(predicted, bias_rounding / weight, &format!("{estimator}, amplitude of the bias"));
    let hidden = 4.0 * bias.standard_error + bias_rounding / weight;
    assert!(predicted.abs() > hidden, "{estimator}: the bias {predicted} shows above {hidden}");
    let mean = Mean { value: mean / precision, standard_error: precision.sqrt().recip() };
    mean.assert_near(0.0, mean_rounding / precision, &format!("{estimator}, mean error but for the bias"));
    // What rounding takes it takes from each estimate in proportion: of a variance twice its share.
    let count = found.len() as f64;
    let variance = Mean { value: square / count, standard_error: spread.sqrt() / count };
    variance.assert_near(1.0, 2.0 * mean_rounding / precision, &format!("{estimator}, variance"));
}

#[test]
fn bias_and_variance_are_those_of_the_kernel() {
    let Some(mut lab) = Lab::open_blending() else { return };
    let scene = lab.upload(&builtin::plane(Waves::SIDE as f32));
    let able = Estimator::ALL.into_iter().filter(|it| it.runs_on(&lab));
    let (half, full): (Vec<_>, Vec<_>) = able.partition(|it| it.sums == Sums::Half);
    check(&mut lab, &scene, &full, 14);
    check(&mut lab, &scene, &half, 12);
}
