//! Pearson's χ² test, and how small a probability is small when there are many tests.

/// χ² of counts, and how probable it or a larger one is if what was drawn follows what was expected.
#[derive(Clone, Copy, Debug)]
pub struct ChiSquare {
    /// Σ (observed − expected)² / expected.
    pub value: f64,
    /// Degrees of freedom.
    pub freedom: f64,
    /// Probability of a value at least as large.
    pub p: f64,
}

/// Counts below which the normal approximation of a cell is poor: such cells are put together [Cochran52].
///
/// [Cochran52]: https://doi.org/10.1214/aoms/1177729380 "The χ² test of goodness of fit, Cochran, 1952"
const LEAST_EXPECTED: f64 = 5.0;

impl ChiSquare {
    /// Of pairs (observed, expected), whose sums are the same number of draws. Where all are expected in one cell, p is 1.
    pub fn of(cells: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (mut value, mut freedom) = (0.0, -1.0);
        let mut rare = (0.0, 0.0);
        let mut add = |observed: f64, expected: f64| {
            value += (observed - expected).powi(2) / expected;
            freedom += 1.0;
        };
        for (observed, expected) in cells {
            if expected < LEAST_EXPECTED {
                rare = (rare.0 + observed, rare.1 + expected);
            } else {
                add(observed, expected);
            }
        }
        // Too few even together: a count that cannot be, or that nobody can judge.
        if rare.1 >= LEAST_EXPECTED || rare.0 > rare.1 + 4.0 * LEAST_EXPECTED {
            add(rare.0, rare.1.max(1.0));
        }
        Self::new(value, freedom)
    }

    /// Of a sum of squares of that many independent unit normals.
    pub fn new(value: f64, freedom: f64) -> Self {
        let p = if freedom < 1.0 { 1.0 } else { upper_gamma(0.5 * freedom, 0.5 * value) };
        Self { value, freedom, p }
    }

    /// Asserts that the counts are as probable as right ones are in one of `tests` tests, all of which pass with
    /// a probability of 99 %.
    ///
    /// # Panics
    /// If they are not.
    #[track_caller]
    pub fn assert_probable(&self, tests: u32, what: &str) {
        let least = threshold(tests);
        println!("{what}: χ² = {:.1} of {} degrees of freedom, p = {:.2e}", self.value, self.freedom, self.p);
        assert!(self.p >= least, "{what}: {self:?}, p at least {least:.2e} for one of {tests} tests");
    }
}

/// Smallest p of one of `tests` independent tests, so that all of them pass with a probability of 99 % if all is right
/// [Sidak67].
///
/// [Sidak67]: https://doi.org/10.1080/01621459.1967.10482935 "Rectangular confidence regions for the means of multivariate normal distributions, Šidák, 1967"
fn threshold(tests: u32) -> f64 {
    1.0 - 0.99_f64.powf(1.0 / f64::from(tests))
}

/// Regularised upper incomplete gamma function Q(a, x): the series of P below a + 1, Lentz's continued fraction above.
fn upper_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let scale = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-15 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return 1.0 - scale * sum;
    }
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1e300, 1.0 / b);
    let mut fraction = d;
    for i in 1..10_000 {
        let i = f64::from(i);
        let numerator = -i * (i - a);
        b += 2.0;
        d = 1.0 / (numerator * d + b);
        c = b + numerator / c;
        fraction *= c * d;
        if (c * d - 1.0).abs() < 1e-14 {
            break;
        }
    }
    scale * fraction
}

/// ln Γ(x) by Stirling's series, whose error beyond 10 is below 10⁻¹⁰.
fn ln_gamma(x: f64) -> f64 {
    let (mut x, mut shift) = (x, 0.0);
    while x < 10.0 {
        shift += x.ln();
        x += 1.0;
    }
    let series = 1.0 / (12.0 * x) - 1.0 / (360.0 * x.powi(3)) + 1.0 / (1260.0 * x.powi(5));
    (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + series - shift
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_those_of_the_tables() {
        // Abramowitz and Stegun, table 26.8.
        for (freedom, value, p) in [(1.0, 3.841_46, 0.05), (10.0, 18.307, 0.05), (10.0, 29.588_3, 0.001), (100.0, 149.449, 0.001)]
        {
            let found = upper_gamma(0.5 * freedom, 0.5 * value);
            assert!((found / p - 1.0).abs() < 1e-3, "{freedom} degrees, χ² = {value}: {found}, {p} in the table");
        }
        assert!((upper_gamma(50.0, 40.0) - 0.929_7).abs() < 1e-3, "the series: {}", upper_gamma(50.0, 40.0));
    }

    #[test]
    fn equal_counts_are_probable_and_others_are_not() {
        let fair = ChiSquare::of([(100.0, 100.0), (98.0, 100.0), (102.0, 100.0)]);
        assert!(fair.p > 0.9 && (fair.freedom - 2.0).abs() < 1e-12, "{fair:?}");
        assert!(ChiSquare::of([(160.0, 100.0), (40.0, 100.0)]).p < 1e-10, "a loaded coin");
        assert!(ChiSquare::of([(100.0, 100.0), (70.0, 100.0), (30.0, 0.0)]).p < 1e-10, "what cannot be");
    }
}
