//! PHYSICS check 10: with the automatic radii, which fall as N^(−1/6), the mean squared error falls as N^(−2/3), bias² and variance alike; a fixed
//! radius levels off at its bias².
//!
//! Waves of light with random photons (`Waves`), 2¹⁰ to 2¹⁶ of them, 16 sets each. The mean squared error of a set is a mean over 225 points whose
//! kernels overlap; its scatter over the sets gives its standard error whatever the points share. The slope is a least-squares fit of ln MSE to
//! ln N, weighted by those errors, which give its own.
//!
//! The scene is so wide that the automatic radius of 2¹⁰ photons is half a metre, where bias² and variance are of one size: in a
//! narrower one all would be variance, and its slope −2/3 whatever the bias. −2/3 itself holds to leading order in the radius. Beyond that the
//! closed forms of bias and variance say what the slope is, by the same fit: the measured slope is held to that within four standard errors, and
//! that to −2/3 within what the next order can bring.

use lightloom_passes::scene::{GpuScene, builtin};
use lightloom_strategies::{SortedGrid, Strategy};
use lightloom_tests::kernel::Kernel;
use lightloom_tests::{Lab, Mean, Waves};

const SEEDS: u64 = 16;
const BITS: [u32; 4] = [10, 12, 14, 16];
/// Radius (m) of 2¹⁰ photons, and the fixed one.
const RADIUS: f64 = 0.5;

/// Mean squared errors of 2^bits photons, for the automatic and the fixed radius.
fn errors(lab: &mut Lab, scene: &GpuScene, bits: u32, strategies: &mut [Box<dyn Strategy>]) -> [Mean; 2] {
    let cosines = Waves::cosines();
    let mut errors = [const { Vec::new() }; 2];
    for seed in 0..SEEDS {
        let photons = Waves::photons(bits, seed + 100 * u64::from(bits));
        let estimates = Waves::VIEW.irradiance(lab, scene, &photons, strategies);
        for (errors, [image, _]) in errors.iter_mut().zip(&estimates.layers) {
            let squares = image.pixels.iter().zip(&cosines).map(|(pixel, &c)| (pixel[1] - Waves::truth(c)).powi(2));
            errors.push(squares.sum::<f64>() / cosines.len() as f64);
        }
    }
    errors.map(|errors| Mean::of(&errors))
}

/// Squared bias and variance by their closed forms, means over the points.
fn closed(bits: u32, radius: f64) -> [f64; 2] {
    let cosines = Waves::cosines();
    let mean = |f: &dyn Fn(f64) -> f64| cosines.iter().map(|&c| f(c)).sum::<f64>() / cosines.len() as f64;
    let bias = Waves::bias(Kernel::Cone, radius);
    [mean(&|c| (bias * c).powi(2)), mean(&|c| Waves::variance(Kernel::Cone, radius, bits, c))]
}

/// Slope of ln `values` to the logarithms of the numbers of photons, each weighted by `weights`; and its variance, the weights being those of variances.
fn slope(values: &[f64], weights: &[f64]) -> (f64, f64) {
    let points = || values.iter().zip(weights).zip(BITS).map(|((v, w), bits)| (f64::from(bits) * 2.0_f64.ln(), v.ln(), *w));
    let total: f64 = weights.iter().sum();
    let center = points().map(|(x, _, w)| w * x).sum::<f64>() / total;
    let spread: f64 = points().map(|(x, _, w)| w * (x - center).powi(2)).sum();
    (points().map(|(x, y, w)| w * (x - center) * y).sum::<f64>() / spread, 1.0 / spread)
}

#[test]
fn errors_fall_as_the_radii_shrink_and_level_off_where_they_do_not() {
    let Some(mut lab) = Lab::open() else { return };
    // r = R/10 N^(−1/6), R the radius about the square.
    let across = 10.0 * RADIUS * 1024.0_f64.powf(1.0 / 6.0) * 2.0_f64.sqrt();
    let scene = lab.upload(&builtin::plane(across as f32));
    let automatic = SortedGrid::new(&lab.sources).expect("sorted-grid builds");
    let mut fixed = SortedGrid::new(&lab.sources).expect("sorted-grid builds");
    fixed.set("radius", &RADIUS.to_string()).expect("a length");
    let mut strategies: Vec<Box<dyn Strategy>> = vec![Box::new(automatic), Box::new(fixed)];
    let (mut found, mut weights, mut expected) = (Vec::new(), Vec::new(), Vec::new());
    for bits in BITS {
        let radius = strategies[0].reach_m(&scene.info(), 1 << bits).expect("it has a reach");
        let [shrinking, level] = errors(&mut lab, &scene, bits, &mut strategies);
        let [bias, variance] = closed(bits, f64::from(radius));
        println!("2^{bits} photons: r = {radius:.4} m, bias² {bias:.5}, variance {variance:.5}");
        assert!((0.1..4.0).contains(&(bias / variance)), "both parts count: {bias} and {variance}");
        shrinking.assert_near(bias + variance, 0.0, "mean squared error, automatic radius");
        found.push(shrinking.value);
        weights.push((shrinking.value / shrinking.standard_error).powi(2));
        expected.push(bias + variance);

        let [bias, variance] = closed(bits, RADIUS);
        level.assert_near(bias + variance, 0.0, "mean squared error, fixed radius");
        if bits == 16 {
            assert!(level.value < 1.1 * bias && level.value > bias, "{} levels off at {bias}", level.value);
        }
    }
    let (measured, variance) = slope(&found, &weights);
    let (closed, _) = slope(&expected, &weights);
    Mean { value: measured, standard_error: variance.sqrt() }.assert_near(closed, 0.0, "slope of the mean squared error");
    // Bias is (1 − ε) of its leading order, ε = (q⁴ M₄/64)/(q² M₂/4), and so up to ε at the widest radius, where it is weakest. Its square being
    // at most some half of the whole, the slope over ln 64 is off by less than 2ε · ½ / ln 64.
    let kernel = Kernel::Cone;
    let next = Waves::FREQUENCY.powi(2) * kernel.moment(4, RADIUS) / (16.0 * kernel.moment(2, RADIUS));
    println!("of closed forms {closed:.4}; the next order brings up to {next:.4} of the bias");
    assert!((closed + 2.0 / 3.0).abs() < next / 64.0_f64.ln(), "the slope by closed forms is {closed}");
}
