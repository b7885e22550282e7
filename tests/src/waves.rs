//! Waves of light on a plane, photons drawn at random from them, and the bias and the variance that an estimate of them has.
//!
//! E(x) = 1 + a cos kx (W·m⁻²) on a square that holds whole waves. Photons of equal flux φ = A/N, N drawn independently with a density in
//! proportion to E, are estimated at x by φ Σ κ(x − y), of which, exactly,
//!
//! ```text
//! mean      1 + κ̂(k) a cos kx                       κ̂(k) = 1 − k² M₂/4 + …, so that the bias is r²∇²E M₂/4 to leading order
//! variance  φ (κ²)^(0) + φ (κ²)^(k) a cos kx − mean²/N
//! ```
//!
//! with ^ the Fourier transform of the kernel, or of its square, wherever the kernel lies in the square.

use crate::kernel::Kernel;
use crate::synthetic::{PlaneView, SHADING_EPSILON, falling_photon, flux_word};
use lightloom_passes::Photon;
use std::f64::consts::PI;

/// The waves; what varies is in its methods.
#[derive(Clone, Copy, Debug)]
pub struct Waves;

/// splitmix64 [SLF14], uniform in [0, 1).
///
/// [SLF14]: https://doi.org/10.1145/2714064.2660195 "Fast splittable pseudorandom number generators, Steele, Lea and Flood, 2014"
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

impl Waves {
    /// Edge of the square (m).
    pub const SIDE: f64 = 8.0;
    /// a.
    pub const CONTRAST: f64 = 0.9;
    /// k (1/m): four waves.
    pub const FREQUENCY: f64 = PI;
    /// 15 × 15 points half a metre apart: crests, troughs and the middle between them. Kernels of up to ¼ m do not overlap, those of up
    /// to ½ m lie in the square.
    pub const VIEW: PlaneView = PlaneView { size: [15, 15], width: 7.5, height: 3.0 };

    /// cos kx at the points of the view, row by row.
    pub fn cosines() -> Vec<f64> {
        let [width, height] = Self::VIEW.size;
        (0..width * height).map(|i| (Self::FREQUENCY * Self::VIEW.point(i % width, i / width)[0]).cos()).collect()
    }

    /// 2^`bits` photons, at most 2¹⁶.
    pub fn photons(bits: u32, seed: u64) -> Vec<Photon> {
        // 64 m² W·m⁻² in all: 64 units of 2⁻¹⁶ W, shifted.
        let flux = flux_word([64; 3], 16 - bits);
        let mut random = Random(seed);
        let mut draw = || loop {
            let [x, z] = [random.unit(), random.unit()].map(|u| (u - 0.5) * Self::SIDE);
            if random.unit() * (1.0 + Self::CONTRAST) < 1.0 + Self::CONTRAST * (Self::FREQUENCY * x).cos() {
                break falling_photon(x, z, flux);
            }
        };
        (0..1_u32 << bits).map(|_| draw()).collect()
    }

    /// The truth where cos kx is `cosine` (W·m⁻²), as seen through PHYSICS's shading-normal factor for light from straight above.
    pub fn truth(cosine: f64) -> f64 {
        (1.0 + Self::CONTRAST * cosine) / (1.0 + SHADING_EPSILON)
    }

    /// The amplitude of the bias, which goes as cos kx (W·m⁻²).
    pub fn bias(kernel: Kernel, radius: f64) -> f64 {
        (kernel.transform(Self::FREQUENCY, radius) - 1.0) * Self::CONTRAST / (1.0 + SHADING_EPSILON)
    }

    /// The variance of an estimate from 2^`bits` photons.
    pub fn variance(kernel: Kernel, radius: f64, bits: u32, cosine: f64) -> f64 {
        let count = f64::from(1_u32 << bits);
        let flux = Self::SIDE * Self::SIDE / count;
        let mean = Self::truth(cosine) + Self::bias(kernel, radius) * cosine;
        // The transform of κ² as that of κ, by moments.
        let term = |j: i32| {
            let factorial: f64 = (1..=j).map(f64::from).product();
            (-1.0_f64).powi(j) * (0.5 * Self::FREQUENCY).powi(2 * j) / (factorial * factorial) * kernel.squared(2 * j, radius)
        };
        let wave: f64 = (0..16).map(term).sum();
        flux * (kernel.squared(0, radius) + Self::CONTRAST * cosine * wave) - mean * mean / count
    }

    /// Bound of the excess kurtosis of an estimate, of a compound Poisson sum: φ² ∫Eκ⁴ φ / variance², and ∫Eκ⁴ ≤ max κ² ∫Eκ².
    pub fn kurtosis(kernel: Kernel, radius: f64, bits: u32, cosine: f64) -> f64 {
        let flux = Self::SIDE * Self::SIDE / f64::from(1_u32 << bits);
        (flux * kernel.peak(radius)).powi(2) / Self::variance(kernel, radius, bits, cosine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photons_are_drawn_from_the_waves() {
        let photons = Waves::photons(14, 1);
        let count = photons.len() as f64;
        let cosines: Vec<f64> = photons.iter().map(|photon| (Waves::FREQUENCY * f64::from(photon.position[0])).cos()).collect();
        // ⟨cos⟩ = a/2, ⟨cos²⟩ = ½; the mean of n values is within four of 1/√(2n).
        let mean = cosines.iter().sum::<f64>() / count;
        assert!((mean - 0.5 * Waves::CONTRAST).abs() < 4.0 * (0.5 / count).sqrt(), "{mean}");
        assert!((2.0 * PI / Waves::FREQUENCY * 4.0 - Waves::SIDE).abs() < 1e-12, "whole waves");
    }

    #[test]
    fn variance_is_that_of_sums_on_the_cpu() {
        let (radius, kernel) = (0.5, Kernel::Disc);
        let (mut sum, mut squares, n) = (0.0, 0.0, 400_u32);
        for seed in 0..n {
            let near = |p: &&Photon| f64::from(p.position[0]).hypot(f64::from(p.position[2])) < radius;
            let estimate = Waves::photons(10, u64::from(seed)).iter().filter(near).count() as f64 / 16.0 * kernel.peak(radius);
            sum += estimate;
            squares += estimate * estimate;
        }
        let n = f64::from(n);
        let (mean, variance) = (sum / n, squares / n - (sum / n).powi(2));
        let expected = Waves::variance(kernel, radius, 10, 1.0);
        // Four standard errors of a variance of n values.
        assert!((variance / expected - 1.0).abs() < 4.0 * (2.1 / n).sqrt(), "{variance} and {expected}");
        let biased = Waves::truth(1.0) + Waves::bias(kernel, radius);
        assert!((mean - biased).abs() < 4.0 * (expected / n).sqrt(), "{mean} and {biased}");
    }
}
