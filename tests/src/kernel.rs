//! The cone kernel κ(s) = min(c, 1 − s/r), c = 1/5 [MML13] Eq. 1, by itself.
//!
//! κ is a stack of discs, κ(s) = ∫₀^c [s < r(1 − v)] dv, so with u = s/r its radial moments are
//!
//! ```text
//! m_k = ∫₀¹ κ u^(k+1) du = ∫₀^c (1 − v)^(k+2) / (k + 2) dv = (1 − (1 − c)^(k+3)) / ((k + 2)(k + 3))
//! ```
//!
//! and the mean of s^k over the normalised kernel is `M_k = r^k m_k / m₀`. m₀ · 2π r² = π r² c (c²/3 − c + 1) is PHYSICS's ∫κ.
//!
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
