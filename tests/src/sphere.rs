//! The sphere in cells about a pole, small where a lobe is narrow.
//!
//! With m = (1 − cos θ)/2, the area of the sphere within θ of the pole over its whole, rings are even steps of
//! ln(1 + m/c²): even by area within the angle 2c of the pole, each a fixed factor larger than the one before beyond it. One choice
//! so resolves a narrow lobe and all that surrounds it.

use glam::DVec3;
use std::f64::consts::TAU;

/// Rings and sectors about a pole.
#[derive(Clone, Copy, Debug)]
pub struct Cells {
    /// Two directions that make a frame with the pole, and the pole.
    pub axes: [DVec3; 3],
    /// c: half the angle (rad) within which rings are even.
    pub width: f64,
    /// Steps from the pole to its antipode, and around.
    pub rings: u32,
    /// See `rings`.
    pub sectors: u32,
}

impl Cells {
    /// About `pole` (unit).
    pub fn new(pole: DVec3, width: f64, rings: u32, sectors: u32) -> Self {
        let across = pole.any_orthonormal_vector();
        Self { axes: [across, pole.cross(across), pole], width, rings, sectors }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        (self.rings * self.sectors) as usize
    }

    /// ln(1 + 1/c²).
    pub fn span(&self) -> f64 {
        self.width.powi(-2).ln_1p()
    }

    /// The cell that holds `direction` (unit).
    pub fn index(&self, direction: DVec3) -> usize {
        // From the chord, which keeps its digits near the pole.
        let m = 0.25 * direction.distance_squared(self.axes[2]);
        let ring = (m / self.width.powi(2)).ln_1p() / self.span() * f64::from(self.rings);
        let angle = direction.dot(self.axes[1]).atan2(direction.dot(self.axes[0])).rem_euclid(TAU);
        let sector = angle / TAU * f64::from(self.sectors);
        let [ring, sector] = [(ring, self.rings), (sector, self.sectors)].map(|(at, n)| (at as u32).min(n - 1));
        (ring * self.sectors + sector) as usize
    }

    /// ∫ f dω over the whole sphere, by `fine`² midpoints per cell.
    pub fn integrate(&self, fine: u32, f: impl Fn(DVec3) -> f64) -> f64 {
        let [rings, sectors] = [self.rings, self.sectors].map(|n| n * fine);
        let mut sum = 0.0;
        for ring in 0..rings {
            let within = self.width.powi(2) * ((f64::from(ring) + 0.5) / f64::from(rings) * self.span()).exp_m1();
            let (cos, sin) = (1.0 - 2.0 * within, 2.0 * (within * (1.0 - within)).max(0.0).sqrt());
            // dω = 2 dm dφ.
            let solid_angle = 2.0 * TAU * (within + self.width.powi(2)) * self.span() / f64::from(rings * sectors);
            for sector in 0..sectors {
                let (sin_phi, cos_phi) = ((f64::from(sector) + 0.5) / f64::from(sectors) * TAU).sin_cos();
                let [x, y, z] = self.axes;
                sum += solid_angle * f(x * (sin * cos_phi) + y * (sin * sin_phi) + z * cos);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_cover_the_sphere_and_hold_their_points() {
        for width in [0.01, 1.0] {
            let cells = Cells::new(DVec3::new(0.6, 0.0, -0.8), width, 8, 12);
            assert!((cells.integrate(32, |_| 1.0) / (2.0 * TAU) - 1.0).abs() < 1e-3, "4π sr");
            let square = cells.integrate(32, |w| w.x * w.x);
            assert!((square / (2.0 * TAU / 3.0) - 1.0).abs() < 1e-3, "∫x² = 4π/3: {square}");
        }
        let cells = Cells::new(DVec3::Z, 0.1, 4, 4);
        assert!(cells.index(DVec3::Z) < 4 && cells.index(DVec3::NEG_Z) >= 12, "pole and antipode");
        let of = |i: usize| cells.integrate(32, |w| f64::from(u8::from(cells.index(w) == i)));
        // Even steps of ln(1 + m/c²): the first of four ends at m = c²((1 + c⁻²)^¼ − 1).
        let first = 0.01 * (101.0_f64.powf(0.25) - 1.0);
        assert!((of(2) / (TAU * first * 0.5) - 1.0).abs() < 1e-3, "a quarter of the first ring: {}", of(2));
    }
}
