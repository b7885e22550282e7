//! Signed relative errors as colour: blue where the image is too dark, red where it is too bright, black where it is right.

use crate::format::number;

/// Errors of this size and more have the full colour.
const FULL: f32 = 0.5;

pub(crate) const LEGEND_TEXT: &str =
    "Relative error of the luminance, (x − r) / √(r² + 0.01): blue is too dark, red is too bright, black is right.";

/// 8-bit RGB rows of the errors.
pub(crate) fn error_map_rgb8(errors: &[f32]) -> Vec<u8> {
    errors.iter().flat_map(|error| colour(*error)).collect()
}

/// The colours beside their errors.
pub(crate) fn legend() -> String {
    let stops: Vec<String> = (-10..=10)
        .map(|i| {
            let [r, g, b] = colour(i as f32 * 0.1 * FULL);
            format!("rgb({r},{g},{b})")
        })
        .collect();
    let full = number(Some(f64::from(FULL) * 100.0));
    format!(
        "<div class=legend><span>−{full} %</span><i style=\"background:linear-gradient(to right,{})\"></i><span>+{full} %</span></div>\n",
        stops.join(",")
    )
}

/// Black over saturated blue or red to a light tint; each step is brighter, so the size reads without the hue as well.
fn colour(error: f32) -> [u8; 3] {
    let t = (error.abs() / FULL).clamp(0.0, 1.0);
    let rise = (t * 1.5).min(1.0);
    let tint = ((t - 0.5) * 2.0).max(0.0) * 0.7;
    let channel = |x: f32| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    if error < 0.0 {
        [channel(tint * 0.6), channel(rise * 0.35 + tint * 0.5), channel(rise)]
    } else {
        [channel(rise), channel(rise * 0.25 + tint * 0.6), channel(tint * 0.5)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sign_is_hue_and_size_is_brightness() {
        assert_eq!(colour(0.0), [0, 0, 0]);
        let sum = |error| colour(error).iter().map(|x| u32::from(*x)).sum::<u32>();
        for sign in [-1.0, 1.0] {
            let sums: Vec<u32> = (0..=10).map(|i| sum(sign * FULL * 0.1 * i as f32)).collect();
            assert!(sums.windows(2).all(|pair| pair[0] < pair[1]), "not rising: {sums:?}");
        }
        assert!(colour(-0.2)[2] > colour(-0.2)[0], "too dark is blue");
        assert!(colour(0.2)[0] > colour(0.2)[2], "too bright is red");
        assert_eq!(colour(99.0), colour(FULL));
        assert_eq!(error_map_rgb8(&[0.0, f32::NAN]).len(), 6);
    }
}
