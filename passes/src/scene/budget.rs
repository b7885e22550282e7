//! How photons are shared among lamps.
//!
//! In proportion to the power they emit the noise would be least where all light mixes, but a small lamp in a sunlit scene would
//! get no photons and its corner none of its light. So a lamp l of n that shine, with the share s of all power and the
//! user's weight w, gets the share
//!
//! ```text
//! p = q / Σ q,   q = w max(s, F / n),   F = 1/4
//! ```
//!
//! of the photons: unweighted at least F / ((1 + F) n). A photon carries the lamp's flux / (N p), so nothing is biased. A lamp is a
//! punctual light, all triangles of one emissive material (which divide its photons by power), or the environment.

use super::gpu_types::{LightKind, NONE};
use glam::Vec3;

/// Share of the photons that is spread evenly over the lamps, whatever their power.
const FLOOR: f64 = 0.25;
/// Weights that a user may give. A photon's flux may then exceed the mean by their square, 2⁸, for which the ledger of the flux has room.
const WEIGHTS: std::ops::RangeInclusive<f32> = 0.0625..=16.0;
/// The unit of shares: 2⁻³².
const UNITS: f64 = 4_294_967_296.0;

/// Whether a user may give this weight.
pub(crate) fn is_weight(weight: f32) -> bool {
    WEIGHTS.contains(&weight)
}

/// What photons are budgeted for.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamp {
    /// Name of the light or of the emissive material, or `environment`.
    pub name: String,
    /// What it is.
    pub kind: LightKind,
    /// Flux (W).
    pub power: Vec3,
    /// The user's factor on its photons.
    pub weight: f32,
}

/// The lamps of a scene and the photons each is given by uniform emission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PhotonBudget {
    lamps: Vec<Lamp>,
    /// Of each light of the list: its lamp, and where its share of the photons starts.
    lamp_of: Vec<u32>,
    starts: Vec<u32>,
}

impl PhotonBudget {
    pub(super) fn new(lamps: Vec<Lamp>, lamp_of: Vec<u32>, starts: Vec<u32>) -> Self {
        Self { lamps, lamp_of, starts }
    }

    /// The lamps, in the order of the light list.
    pub fn lamps(&self) -> &[Lamp] {
        &self.lamps
    }

    /// How many of `emitted` photons each lamp gets with that seed; what `photon_light` of `shared/emission.wgsl` does.
    pub fn photons(&self, emitted: u32, seed: u32) -> Vec<u32> {
        let shift = pcg4d([seed, 0x4c49_4748, 0, 0])[0];
        let first = |light: usize| match self.starts.get(light) {
            None | Some(&NONE) => emitted,
            Some(&start) => ((u64::from(start) * u64::from(emitted) + u64::from(shift)) >> 32) as u32,
        };
        let mut photons = vec![0; self.lamps.len()];
        for (light, &lamp) in self.lamp_of.iter().enumerate() {
            photons[lamp as usize] += first(light + 1) - first(light);
        }
        photons
    }
}

/// The share of the photons of each lamp, given its power (W) and weight; all alike where nothing shines.
pub(super) fn shares(lamps: &[(f64, f32)]) -> Vec<f64> {
    let total: f64 = lamps.iter().map(|lamp| lamp.0).sum();
    let lit = lamps.iter().filter(|lamp| lamp.0 > 0.0).count();
    if !(total > 0.0 && total.is_finite()) {
        return vec![1.0 / lamps.len().max(1) as f64; lamps.len()];
    }
    let wanted = |&(power, weight): &(f64, f32)| {
        if power > 0.0 { f64::from(weight) * (power / total).max(FLOOR / lit as f64) } else { 0.0 }
    };
    let sum: f64 = lamps.iter().map(wanted).sum();
    lamps.iter().map(|lamp| wanted(lamp) / sum).collect()
}

/// Where each light's share of the photons starts (2⁻³²; [`NONE`] where none is left), and the share itself after rounding.
pub(super) fn divide(shares: &[f64]) -> Vec<(u32, f32)> {
    // The last light with a share takes what rounding leaves.
    let last = shares.iter().rposition(|&share| share > 0.0);
    let mut sum = 0.0;
    let ends: Vec<u64> = shares
        .iter()
        .enumerate()
        .map(|(index, share)| {
            sum += share;
            if Some(index) >= last { UNITS as u64 } else { (sum * UNITS).round().min(UNITS) as u64 }
        })
        .collect();
    let mut start = 0;
    let mut divided = Vec::with_capacity(shares.len());
    for end in ends {
        divided.push((u32::try_from(start).unwrap_or(NONE), ((end - start) as f64 / UNITS) as f32));
        start = end;
    }
    divided
}

/// `pcg4d` of `shared/rng.wgsl`.
fn pcg4d(input: [u32; 4]) -> [u32; 4] {
    let mut v = input.map(|x| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let mix = |v: &mut [u32; 4]| {
        // All four components at once, as the vector expression does.
        let old = *v;
        for (i, [a, b]) in [[1, 3], [2, 0], [0, 1], [1, 2]].into_iter().enumerate() {
            v[i] = old[i].wrapping_add(old[a].wrapping_mul(old[b]));
        }
    };
    mix(&mut v);
    v = v.map(|x| x ^ (x >> 16));
    mix(&mut v);
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_lamps_keep_their_floor_and_weights_multiply() {
        // A sun of 10⁶ W and fifty lamps of 1 W.
        let mut lamps = vec![(1e6, 1.0)];
        lamps.extend([(1.0, 1.0); 50]);
        let even = shares(&lamps);
        assert!((even.iter().sum::<f64>() - 1.0).abs() < 1e-12, "all photons");
        assert!(even.iter().all(|&p| p >= FLOOR / ((1.0 + FLOOR) * 51.0) - 1e-12), "{even:?}");
        lamps[7].1 = 4.0;
        let weighted = shares(&lamps);
        assert!((weighted[7] / weighted[8] - 4.0).abs() < 1e-9, "four times its neighbour");
        lamps[8].0 = 0.0;
        assert!(shares(&lamps)[8] == 0.0, "a dark lamp gets none");
        assert_eq!(shares(&[(0.0, 1.0), (0.0, 2.0)]), [0.5, 0.5]);
    }

    #[test]
    fn shares_are_divided_without_rest() {
        let divided = divide(&[0.0, 0.25, 0.0, 0.75 - 1e-12, 0.0]);
        assert_eq!(divided, [(0, 0.0), (0, 0.25), (1 << 30, 0.0), (1 << 30, 0.75), (NONE, 0.0)]);
        assert_eq!(divide(&[]), []);
    }

    #[test]
    fn counts_are_whole_and_right_on_average() {
        let parts = [0.1, 0.004, 0.0, 0.8, 0.096];
        let starts = divide(&parts).iter().map(|d| d.0).collect();
        let lamp = Lamp { name: String::new(), kind: LightKind::Point, power: Vec3::ONE, weight: 1.0 };
        let budget = PhotonBudget::new(vec![lamp; 5], (0..5).collect(), starts);
        let mut sums = [0_u64; 5];
        for seed in 0..1000 {
            let photons = budget.photons(777, seed);
            assert_eq!(photons.iter().sum::<u32>(), 777);
            for (lamp, &count) in photons.iter().enumerate() {
                let exact = 777.0 * parts[lamp];
                assert!((f64::from(count) - exact).abs() < 1.0, "lamp {lamp}: {count} of {exact}");
                sums[lamp] += u64::from(count);
            }
        }
        // The rounding of one count is Bernoulli: standard deviation at most ½, of the mean of 1000 at most 0.016; four of them.
        for (lamp, sum) in sums.into_iter().enumerate() {
            let mean = sum as f64 / 1000.0;
            assert!((mean - 777.0 * parts[lamp]).abs() < 0.064, "lamp {lamp}: {mean}");
        }
    }
}
