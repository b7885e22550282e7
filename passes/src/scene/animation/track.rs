//! Keys over time, and the values between them.

use glam::{Quat, Vec3};

/// How values between two keys are found (glTF 2.0, 3.11).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::scene) enum Interpolation {
    /// The earlier key's.
    Step,
    /// In proportion to time, rotations on the shortest great arc.
    Linear,
    /// A cubic Hermite spline: each key is its in-tangent, value and out-tangent (per second).
    Cubic,
}

/// What can be interpolated.
pub(in crate::scene) trait Value: Copy {
    /// The value at `s` in (0, 1) between two keys.
    fn between(self, next: Self, s: f32) -> Self;
    /// A weighted sum.
    fn sum(terms: [(f32, Self); 4]) -> Self;
}

impl Value for Vec3 {
    fn between(self, next: Self, s: f32) -> Self {
        self.lerp(next, s)
    }

    fn sum(terms: [(f32, Self); 4]) -> Self {
        terms.iter().map(|&(weight, value)| weight * value).sum()
    }
}

impl Value for Quat {
    fn between(self, next: Self, s: f32) -> Self {
        self.slerp(next, s)
    }

    fn sum(terms: [(f32, Self); 4]) -> Self {
        terms.into_iter().fold(Self::from_array([0.0; 4]), |sum, (weight, value)| sum + value * weight)
    }
}

/// One property over time.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::scene) struct Track<V> {
    /// Times of the keys (s), increasing.
    times: Vec<f32>,
    /// One for each key, three for each key of [`Interpolation::Cubic`].
    values: Vec<V>,
    interpolation: Interpolation,
}

impl<V: Value> Track<V> {
    /// `None` without keys, and where keys and values do not fit.
    pub(in crate::scene) fn new(times: Vec<f32>, values: Vec<V>, interpolation: Interpolation) -> Option<Self> {
        let fits = !times.is_empty() && times.len().checked_mul(Self::values_per_key(interpolation)) == Some(values.len());
        fits.then_some(Self { times, values, interpolation })
    }

    /// Values that each key has.
    pub(in crate::scene) fn values_per_key(interpolation: Interpolation) -> usize {
        if interpolation == Interpolation::Cubic { 3 } else { 1 }
    }

    /// Time of the last key (s).
    pub(in crate::scene) fn end(&self) -> f32 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// The value at a time (s). Before the first key and after the last one, theirs.
    pub(in crate::scene) fn at(&self, time: f32) -> V {
        let next = self.times.partition_point(|&key| key <= time);
        let here = next.saturating_sub(1);
        let per_key = Self::values_per_key(self.interpolation);
        let value = |key: usize| self.values[key * per_key + per_key / 2];
        // At a key, its value as it is: without rounding.
        if next == 0 || next == self.times.len() || self.times[here] >= time {
            return value(here);
        }
        let span = self.times[next] - self.times[here];
        let s = (time - self.times[here]) / span;
        match self.interpolation {
            Interpolation::Step => value(here),
            Interpolation::Linear => value(here).between(value(next), s),
            Interpolation::Cubic => {
                let (s2, s3) = (s * s, s * s * s);
                V::sum([
                    (2.0 * s3 - 3.0 * s2 + 1.0, value(here)),
                    (span * (s3 - 2.0 * s2 + s), self.values[here * 3 + 2]),
                    (3.0 * s2 - 2.0 * s3, value(next)),
                    (span * (s3 - s2), self.values[next * 3]),
                ])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn along(interpolation: Interpolation, values: &[f32]) -> Track<Vec3> {
        let values = values.iter().map(|&x| Vec3::X * x).collect();
        Track::new(vec![1.0, 3.0], values, interpolation).unwrap()
    }

    #[test]
    fn the_first_and_the_last_key_hold_beyond_them() {
        let track = along(Interpolation::Linear, &[2.0, 6.0]);
        for (time, expected) in [(f32::MIN, 2.0), (1.0, 2.0), (1.5, 3.0), (3.0, 6.0), (f32::MAX, 6.0)] {
            assert_eq!(track.at(time), Vec3::X * expected, "at {time}");
        }
        assert_eq!(track.end().to_bits(), 3.0_f32.to_bits());
    }

    #[test]
    fn steps_wait_for_their_key() {
        let track = along(Interpolation::Step, &[2.0, 6.0]);
        assert_eq!([track.at(2.999).x, track.at(3.0).x].map(f32::to_bits), [2.0_f32, 6.0].map(f32::to_bits));
    }

    #[test]
    fn a_cubic_with_the_tangents_of_a_parabola_is_it() {
        // x = t²: tangents 2t at both keys, per second, though the keys are two apart.
        let track = along(Interpolation::Cubic, &[0.0, 1.0, 2.0, 6.0, 9.0, 0.0]);
        for i in 0..=20_u8 {
            let t = 1.0 + 0.1 * f32::from(i);
            assert!((track.at(t).x - t * t).abs() < 1e-5, "{} at {t}", track.at(t));
        }
    }

    #[test]
    fn rotations_take_the_short_way_at_constant_speed() {
        let quarter = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
        // −q is the same rotation as q.
        let track = Track::new(vec![0.0, 1.0], vec![Quat::IDENTITY, -quarter], Interpolation::Linear).unwrap();
        for s in [0.25, 0.5, 0.9] {
            let turned = track.at(s) * Vec3::X;
            let expected = Quat::from_rotation_y(s * std::f32::consts::FRAC_PI_2) * Vec3::X;
            assert!(turned.abs_diff_eq(expected, 1e-5), "{turned} for {expected} at {s}");
        }
    }

    #[test]
    fn keys_and_values_must_fit() {
        assert!(Track::<Vec3>::new(vec![], vec![], Interpolation::Linear).is_none(), "no keys");
        assert!(Track::new(vec![0.0], vec![Vec3::X; 2], Interpolation::Step).is_none(), "too many");
        assert!(Track::new(vec![0.0], vec![Vec3::X], Interpolation::Cubic).is_none(), "no tangents");
    }
}
