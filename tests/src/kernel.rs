//! The kernels by themselves: the cone κ(s) = min(c, 1 − s/r), c = 1/5 [MML13] Eq. 1, and the disc of [SA19].
//!
//! κ is a stack of discs, κ(s) = ∫₀^c [s < r(1 − v)] dv, so with u = s/r its radial moments are
//!
//! ```text
//! m_k = ∫₀¹ κ u^(k+1) du = ∫₀^c (1 − v)^(k+2) / (k + 2) dv = (1 − (1 − c)^(k+3)) / ((k + 2)(k + 3))
//! ```
//!
//! and the mean of s^k over the normalised kernel is `M_k = r^k m_k / m₀`. m₀ · 2π r² = π r² c (c²/3 − c + 1) is PHYSICS's ∫κ.
//!
//! The disc's are `r^k · 2/(k + 2)`.
//!
//! [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems chapter 24, 2019"
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"

use std::f64::consts::{PI, TAU};

/// Height at which the cone is cut.
pub const CUT: f64 = 0.2;

/// `m_k` of the kernel of radius 1.
fn radial(k: i32) -> f64 {
    (1.0 - (1.0 - CUT).powi(k + 3)) / f64::from((k + 2) * (k + 3))
}

/// `M_k`: mean of s^k over the normalised kernel of radius `radius` (m^k).
pub fn moment(k: i32, radius: f64) -> f64 {
    radius.powi(k) * radial(k) / radial(0)
}

/// Share of the kernel's mass within `u` radii.
fn within(u: f64) -> f64 {
    let flat = 1.0 - CUT;
    let u = u.min(1.0);
    let mass = if u <= flat {
        0.5 * CUT * u * u
    } else {
        0.5 * CUT * flat * flat + (u * u - flat * flat) / 2.0 - (u.powi(3) - flat.powi(3)) / 3.0
    };
    mass / radial(0)
}

/// Share of the kernel around `at` that lies inside the rectangle from 0 to `size`: the integral over direction of the mass
/// before the boundary.
pub fn share_in_rectangle(at: [f64; 2], size: [f64; 2], radius: f64) -> f64 {
    const DIRECTIONS: u32 = 1024;
    let far = |x: f64, size: f64| x.min(size - x) >= radius;
    if far(at[0], size[0]) && far(at[1], size[1]) {
        return 1.0;
    }
    let to_boundary = |x: f64, size: f64, d: f64| if d > 0.0 { (size - x) / d } else { -x / d };
    let sum: f64 = (0..DIRECTIONS)
        .map(|i| {
            let (sin, cos) = (TAU * (f64::from(i) + 0.5) / f64::from(DIRECTIONS)).sin_cos();
            within(to_boundary(at[0], size[0], cos).min(to_boundary(at[1], size[1], sin)) / radius)
        })
        .sum();
    sum / f64::from(DIRECTIONS)
}

/// Share of the light that an evenly lit rectangle's estimates miss because kernels reach over its edges.
///
/// A photon at y spreads over the whole plane; what falls outside is lost. The mean of the share inside over the rectangle R of sides
/// a and b is ∫κ(u, v) |R ∩ (R + (u, v))| du dv / ab with |R ∩ (R + (u, v))| = (a − |u|)(b − |v|). Since the mean of |u| is (2/π) M₁
/// and of |u v| is M₂/π, the loss is (2/π) M₁ (a + b)/ab − M₂/(π ab): the perimeter times M₁/π, less what corners count twice.
pub fn boundary_loss(size: [f64; 2], radius: f64) -> f64 {
    let [a, b] = size;
    (2.0 * moment(1, radius) * (a + b) - moment(2, radius)) / (PI * a * b)
}

/// Mass per length (1/m) of the normalised kernel on a line through its centre: how fast an estimate falls at a straight edge.
pub fn edge_slope(radius: f64) -> f64 {
    // 2 ∫κ(s) ds along the line, over ∫κ.
    2.0 * radius * (CUT * (1.0 - CUT) + 0.5 * CUT * CUT) / (TAU * radius * radius * radial(0))
}

/// Bound of the relative error when the kernel's integral is replaced by a sum over a square lattice of `spacing`.
///
/// Poisson: the error is Σ κ̂(q)/κ̂(0) over the reciprocal lattice but its origin, q = 2π j/spacing. A stack of discs has
/// κ̂(q) = (2π/q) ∫ R J₁(qR) dR / r over R from r(1 − c) to r; R J₁(qR) is √(2R/πq) cos(qR − 3π/4) to leading order, whose
/// integral over any interval is at most 2 √(2r/πq)/q by the second mean-value theorem. Hence |κ̂(q)/κ̂(0)| ≤ 2 √(2/π) (qr)^(−5/2) / m₀,
/// and Σ |j|^(−5/2) over ℤ² without 0 is 4 ζ(5/4) β(5/4) < 16.
pub fn lattice_error(radius: f64, spacing: f64) -> f64 {
    16.0 * 2.0 * (2.0 / PI).sqrt() / radial(0) * (TAU * radius / spacing).powf(-2.5)
}

/// How an estimator spreads a photon over a plane; normalised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// [MML13]'s cut cone.
    ///
    /// [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"
    Cone,
    /// [SA19]'s constant disc, of light that falls straight down.
    ///
    /// [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems chapter 24, 2019"
    Disc,
}

impl Kernel {
    /// `M_k`: mean of s^k (m^k).
    pub fn moment(self, k: i32, radius: f64) -> f64 {
        match self {
            Self::Cone => moment(k, radius),
            Self::Disc => radius.powi(k) * 2.0 / f64::from(k + 2),
        }
    }

    /// ∫κ s^k κ dA (m^(k−2)): what the variance of an estimate scales with.
    pub fn squared(self, k: i32, radius: f64) -> f64 {
        match self {
            // κ² is a stack of discs too, of height 2v dv: q_k = ∫₀¹ κ² u^(k+1) du = ∫₀^c 2v (1 − v)^(k+2) / (k + 2) dv.
            Self::Cone => {
                let power = |n: i32| (1.0 - (1.0 - CUT).powi(n)) / f64::from(n);
                let q = 2.0 * (power(k + 3) - power(k + 4)) / f64::from(k + 2);
                radius.powi(k - 2) * q / (TAU * radial(0) * radial(0))
            }
            Self::Disc => self.moment(k, radius) / (PI * radius * radius),
        }
    }

    /// Its largest value (1/m²).
    pub fn peak(self, radius: f64) -> f64 {
        match self {
            Self::Cone => CUT / (TAU * radial(0) * radius * radius),
            Self::Disc => 1.0 / (PI * radius * radius),
        }
    }

    /// Its Fourier transform at the angular frequency `q` (1/m): by how much it weakens a wave, 1 − q² M₂/4 + q⁴ M₄/64 − …
    pub fn transform(self, q: f64, radius: f64) -> f64 {
        let term = |j: i32| {
            let factorial: f64 = (1..=j).map(f64::from).product();
            (-1.0_f64).powi(j) * (0.5 * q).powi(2 * j) / (factorial * factorial) * self.moment(2 * j, radius)
        };
        (0..16).map(term).sum()
    }

    /// Share of the kernel at distance `x` (m) inside a straight edge, below 0 outside it, that lies inside.
    pub fn beside_edge(self, x: f64, radius: f64) -> f64 {
        match self {
            Self::Cone if x < 0.0 => 1.0 - self.beside_edge(-x, radius),
            Self::Cone => share_in_rectangle([x, 10.0 * radius], [20.0 * radius; 2], radius),
            Self::Disc => {
                let s = (-x / radius).clamp(-1.0, 1.0);
                (s.acos() - s * (1.0 - s * s).sqrt()) / PI
            }
        }
    }

    /// Bound of the relative error when the kernel's integral is replaced by a sum over a square lattice of `spacing`: of the cone
    /// [`lattice_error`]. The number of lattice points in a disc of n spacings' radius is taken to differ from π n² by less than 3 n^(2/3), wherever
    /// its centre: no such constant is proven, but for radii of 5 to 45 spacings the largest found is 2.5.
    pub fn lattice_error(self, radius: f64, spacing: f64) -> f64 {
        let n = radius / spacing;
        match self {
            Self::Cone => lattice_error(radius, spacing),
            Self::Disc => 3.0 * n.powf(2.0 / 3.0) / (PI * n * n),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_match_sums() {
        let kappa = |u: f64| CUT.min(1.0 - u);
        let sum = |k: i32| -> f64 {
            let n = 200_000;
            (0..n).map(|i| (f64::from(i) + 0.5) / f64::from(n)).map(|u| kappa(u) * u.powi(k + 1)).sum::<f64>() / f64::from(n)
        };
        for k in 0..3 {
            assert!((sum(k) - radial(k)).abs() < 1e-9, "moment {k}: {} and {}", sum(k), radial(k));
        }
        // PHYSICS: ∫κ = π r² c (c²/3 − c + 1).
        assert!((TAU * radial(0) - PI * CUT * (CUT * CUT / 3.0 - CUT + 1.0)).abs() < 1e-15, "the integral");
        assert!((within(1.0) - 1.0).abs() < 1e-12, "all mass lies within the radius");
    }

    #[test]
    fn a_rectangle_holds_half_at_its_edge_and_loses_what_is_derived() {
        let (size, radius) = ([2.0, 3.0], 0.4);
        assert!((share_in_rectangle([0.0, 1.5], size, radius) - 0.5).abs() < 1e-6, "edge");
        assert!((share_in_rectangle([2.0, 3.0], size, radius) - 0.25).abs() < 1e-6, "corner");
        let n = 200_u32;
        let at = |i: u32, size: f64| (f64::from(i) + 0.5) / f64::from(n) * size;
        let mean = (0..n * n).map(|i| share_in_rectangle([at(i % n, size[0]), at(i / n, size[1])], size, radius)).sum::<f64>()
            / f64::from(n * n);
        let loss = boundary_loss(size, radius);
        assert!((1.0 - mean - loss).abs() < 1e-3 * loss, "{} and {loss}", 1.0 - mean);
        // The share falls at the edge as steeply as the slope says.
        let slope = (share_in_rectangle([0.01, 1.5], size, radius) - 0.5) / 0.01;
        assert!((slope - edge_slope(radius)).abs() < 0.03 * edge_slope(radius), "{slope} and {}", edge_slope(radius));
    }

    #[test]
    fn squares_and_transforms_match_sums() {
        let radius = 0.7;
        for kernel in [Kernel::Cone, Kernel::Disc] {
            let value = |s: f64| if kernel == Kernel::Cone { CUT.min(1.0 - s / radius) / CUT } else { 1.0 } * kernel.peak(radius);
            let n = 600_i32;
            let (mut square, mut moment, mut wave) = (0.0, 0.0, 0.0);
            for i in -n..n {
                for j in -n..n {
                    let [x, y] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(n) * radius);
                    let s = x.hypot(y);
                    let kappa = if s < radius { value(s) } else { 0.0 };
                    square += kappa * kappa;
                    moment += kappa * kappa * s * s;
                    wave += kappa * (2.0 * x).cos();
                }
            }
            let cell = (radius / f64::from(n)).powi(2);
            // The disc's rim, of 600 cells' radius, is counted within 2·10⁻⁴.
            for (sum, closed) in
                [(square, kernel.squared(0, radius)), (moment, kernel.squared(2, radius)), (wave, kernel.transform(2.0, radius))]
            {
                assert!((sum * cell / closed - 1.0).abs() < 4e-4, "{kernel:?}: {} and {closed}", sum * cell);
            }
        }
    }

    #[test]
    fn lattices_in_discs_are_counted_within_the_bound() {
        let mut most = 0.0_f64;
        for radius in [5.6, 8.0, 16.0, 22.4, 24.0, 31.0, 44.8] {
            let n = radius as i32 + 2;
            for shift in 0..64 {
                let (sx, sy) = (f64::from(shift % 8) / 8.0, f64::from(shift / 8) / 8.0);
                let within = |i: i32| (f64::from(i % (2 * n) - n) - sx).hypot(f64::from(i / (2 * n) - n) - sy) < radius;
                let count = (0..4 * n * n).filter(|&i| within(i)).count() as f64;
                let error = (count / (PI * radius * radius) - 1.0).abs() / Kernel::Disc.lattice_error(radius, 1.0);
                most = most.max(error);
            }
        }
        assert!(most < 1.0 && most > 0.8, "{most} of the bound");
        assert!((Kernel::Disc.beside_edge(0.0, 2.0) - 0.5).abs() < 1e-12, "half on the edge");
        assert!((Kernel::Disc.moment(2, 3.0) - 4.5).abs() < 1e-12, "PHYSICS: r²/2");
    }

    #[test]
    fn lattice_sums_stay_within_their_bound() {
        for radius in [8.0, 16.0, 31.0] {
            let n = radius as i32 + 1;
            let (mut sum, mut most) = (0.0_f64, 0.0_f64);
            for shift in 0..16 {
                let (sx, sy) = (f64::from(shift % 4) / 4.0, f64::from(shift / 4) / 4.0);
                sum = 0.0;
                for y in -n..=n {
                    for x in -n..=n {
                        let s = (f64::from(x) - sx).hypot(f64::from(y) - sy) / radius;
                        sum += CUT.min((1.0 - s).max(0.0));
                    }
                }
                most = most.max((sum / (TAU * radial(0) * radius * radius) - 1.0).abs());
            }
            let bound = lattice_error(radius, 1.0);
            assert!(most < bound && most > 1e-3 * bound, "radius {radius}: {most} of {bound}, last sum {sum}");
        }
    }
}
