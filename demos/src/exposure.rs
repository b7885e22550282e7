//! From linear radiance to what a screen shows.
//!
//! One exposure serves every image of a comparison, so a strategy that loses light looks darker. Automatic exposure is
//! [Rei02] Eq. 2, key over the log-average luminance of the pixels that are not black, but never so bright that a tenth of them
//! comes near white: sparse photons make a low average. The curve is [Rei02] Eq. 4 per
//! channel, `L (1 + L / L_w²) / (1 + L)`, with everything from `L_w` = 4 up shown white, then the sRGB transfer function.
//!
//! [Rei02]: https://doi.org/10.1145/566654.566575 "Reinhard, Stark, Shirley, Ferwerda, Photographic tone reproduction for digital images, 2002"

use crate::picture::{Picture, luminance};

/// The exposed luminance that the scene's log-average is brought to.
const KEY: f32 = 0.25;
/// The exposed luminance that the brightest tenth of the pixels may begin at; the curve shows it as two thirds of white.
const BRIGHT: f32 = 1.5;
/// Exposed values from here up are white.
const WHITE: f32 = 4.0;
/// Luminance at or below this is black: not counted in the average (W·m⁻²·sr⁻¹).
const BLACK: f32 = 1e-6;

/// A factor on radiance before the tone curve (m²·sr·W⁻¹).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure(f32);

impl Exposure {
    /// A given factor.
    pub fn fixed(factor: f32) -> Self {
        Self(factor)
    }

    /// The exposure that suits a picture; 1 for a black one.
    pub fn automatic(picture: &Picture) -> Self {
        let luminances = picture.pixels().iter().map(|pixel| luminance(*pixel));
        let mut lit: Vec<f32> = luminances.filter(|y| y.is_finite() && *y > BLACK).collect();
        if lit.is_empty() {
            return Self(1.0);
        }
        let log_sum: f64 = lit.iter().map(|y| f64::from(*y).ln()).sum();
        let log_average = (log_sum / lit.len() as f64).exp() as f32;
        let bright_rank = lit.len() * 9 / 10;
        let (_, bright, _) = lit.select_nth_unstable_by(bright_rank, f32::total_cmp);
        Self((KEY / log_average).min(BRIGHT / *bright))
    }

    /// The factor on radiance.
    pub fn factor(self) -> f32 {
        self.0
    }

    /// 8-bit sRGB rows of the picture through exposure and curve.
    pub fn tone_map(self, picture: &Picture) -> Vec<u8> {
        encode(picture, |x| srgb(curve(x * self.0)))
    }
}

/// 8-bit rows of values that are already within 0 to 1 and linear, such as base colour.
pub(crate) fn encode_srgb(picture: &Picture) -> Vec<u8> {
    encode(picture, srgb)
}

/// 8-bit rows of numbers that are not colour: `value · scale + offset`, clamped, with no transfer function.
pub(crate) fn encode_numbers(picture: &Picture, scale: f32, offset: f32) -> Vec<u8> {
    encode(picture, |x| x * scale + offset)
}

fn encode(picture: &Picture, map: impl Fn(f32) -> f32) -> Vec<u8> {
    let channels = picture.pixels().as_flattened().iter();
    // `as` turns NaN into 0.
    channels.map(|x| (map(*x).clamp(0.0, 1.0) * 255.0 + 0.5) as u8).collect()
}

fn curve(x: f32) -> f32 {
    let x = x.max(0.0);
    if x >= WHITE {
        return 1.0;
    }
    x * (1.0 + x / (WHITE * WHITE)) / (1.0 + x)
}

/// The sRGB transfer function (IEC 61966-2-1).
fn srgb(x: f32) -> f32 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curve_rises_from_black_to_white_without_a_step() {
        let mut last = -1.0;
        for i in 0..500 {
            let y = curve(i as f32 * 0.01);
            assert!((0.0..=1.0).contains(&y) && y >= last, "at {i}: {y} after {last}");
            assert!(y - last < 0.02 || i == 0, "a step at {i}");
            last = y;
        }
        assert!((curve(WHITE - 1e-4) - 1.0).abs() < 1e-3);
        assert!((curve(f32::INFINITY) - 1.0).abs() < f32::EPSILON);
    }

    #[test]
    fn automatic_exposure_follows_the_scale_of_the_light() {
        let dim = Picture::new([2, 1], vec![[0.5; 3], [2.0; 3]]);
        let bright = Picture::new([2, 1], vec![[50.0; 3], [200.0; 3]]);
        // Geometric mean of ½ and 2 is 1.
        assert!((Exposure::automatic(&dim).factor() - KEY).abs() < 1e-6);
        assert_eq!(Exposure::automatic(&dim).tone_map(&dim), Exposure::automatic(&bright).tone_map(&bright));
        // One pixel in five is a hundred times as bright as the rest.
        let mixed: Vec<[f32; 3]> = (0..100).map(|i| [if i % 5 == 0 { 100.0 } else { 1.0 }; 3]).collect();
        let spotted = Exposure::automatic(&Picture::new([10, 10], mixed));
        assert!((spotted.factor() * 100.0 - BRIGHT).abs() < 1e-4, "{spotted:?}");
        let black = Picture::new([1, 1], vec![[0.0; 3]]);
        assert_eq!(Exposure::automatic(&black), Exposure::fixed(1.0));
    }

    #[test]
    fn transfer_function_hits_known_points() {
        // 18 % grey is 0.4614 in sRGB; the two branches meet.
        assert!((srgb(0.18) - 0.4614).abs() < 1e-3);
        assert!((srgb(0.003_130_8) - srgb(0.003_130_9)).abs() < 1e-5);
        let nan = Picture::new([1, 1], vec![[f32::NAN, 1.0, 0.0]]);
        assert_eq!(encode_srgb(&nan), [0, 255, 0]);
    }
}
