//! How a layer is shown as an 8-bit image.

use lightloom_strategies::Layer;

use crate::exposure::{Exposure, encode_numbers, encode_srgb};
use crate::picture::Picture;

/// From a layer's numbers to colours; one serves every image of a comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Display {
    /// Radiance, exposed and through the tone curve.
    Radiance(Exposure),
    /// Base colour, 0 to 1.
    BaseColour,
    /// Directions, each axis from −1..1 to 0..1.
    Direction,
    /// Distance: black at the eye, white at this distance and in the background (m).
    Distance {
        /// The farthest distance of the picture it was chosen for.
        farthest_m: f32,
    },
}

impl Display {
    /// What suits `layer`, with the scale taken from `picture`.
    pub(crate) fn choose(layer: Layer, picture: &Picture) -> Self {
        match layer {
            Layer::Final | Layer::Direct | Layer::Indirect | Layer::Caustic => Self::Radiance(Exposure::automatic(picture)),
            Layer::Albedo => Self::BaseColour,
            Layer::Normal => Self::Direction,
            Layer::Depth => {
                let distances = picture.pixels().iter().map(|p| p[0]);
                let farthest = distances.filter(|d| d.is_finite()).fold(0.0, f32::max);
                Self::Distance { farthest_m: if farthest > 0.0 { farthest } else { 1.0 } }
            }
        }
    }

    /// 8-bit RGB rows.
    pub(crate) fn rgb8(self, picture: &Picture) -> Vec<u8> {
        match self {
            Self::Radiance(exposure) => exposure.tone_map(picture),
            Self::BaseColour => encode_srgb(picture),
            Self::Direction => encode_numbers(picture, 0.5, 0.5),
            Self::Distance { farthest_m } => {
                // The background has distance 0: no surface at all.
                let far = |d: f32| if d > 0.0 { d } else { farthest_m };
                let pixels = picture.pixels().iter().map(|p| p.map(far)).collect();
                encode_numbers(&Picture::new(picture.size(), pixels), 1.0 / farthest_m, 0.0)
            }
        }
    }

    /// The factor on radiance; 1 for layers that are not radiance.
    pub(crate) fn exposure(self) -> f32 {
        match self {
            Self::Radiance(exposure) => exposure.factor(),
            _ => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_runs_from_black_to_white_and_nothing_is_white() {
        let picture = Picture::new([3, 1], vec![[1.0; 3], [4.0; 3], [0.0; 3]]);
        let display = Display::choose(Layer::Depth, &picture);
        let grey: Vec<u8> = display.rgb8(&picture).chunks(3).map(|p| p[0]).collect();
        assert_eq!(grey, [64, 255, 255]);
    }

    #[test]
    fn directions_map_to_half_grey_around_zero() {
        let picture = Picture::new([1, 1], vec![[-1.0, 0.0, 1.0]]);
        assert_eq!(Display::choose(Layer::Normal, &picture).rgb8(&picture), [0, 128, 255]);
    }

    #[test]
    fn radiance_is_exposed_by_the_picture_it_was_chosen_for() {
        let picture = Picture::new([1, 1], vec![[8.0; 3]]);
        let display = Display::choose(Layer::Indirect, &picture);
        assert!((display.exposure() * 8.0 - 0.25).abs() < 1e-6, "{}", display.exposure());
    }
}
