//! How a layer is shown as an 8-bit image.

use lightloom_strategies::Layer;

use crate::exposure::{Exposure, encode_numbers, encode_srgb};
use crate::format::number;
use crate::picture::Picture;
use crate::texels::{Numbers, Texels};

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
    /// Numbers: black at one end, white at the other.
    Range {
        /// Black at and below this.
        low: f32,
        /// White at and above this.
        high: f32,
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

    /// What suits a texture of unknown meaning: radiance where it can be that, else the range its format or its values have.
    pub(crate) fn choose_for(texels: &Texels) -> Self {
        let picture = &texels.picture;
        let channels = || picture.pixels().as_flattened().iter().copied().filter(|x| x.is_finite());
        let largest = match texels.numbers {
            Numbers::Srgb => return Self::BaseColour,
            Numbers::Unorm => return Self::Range { low: 0.0, high: 1.0 },
            Numbers::Snorm => return Self::Range { low: -1.0, high: 1.0 },
            Numbers::Float if channels().all(|x| x >= 0.0) => return Self::Radiance(Exposure::automatic(picture)),
            // "No index", which would leave nothing to see of the others.
            Numbers::Whole { largest } => largest as f32,
            Numbers::Float | Numbers::Data => f32::INFINITY,
        };
        let low = channels().fold(f32::INFINITY, f32::min);
        let high = channels().filter(|x| *x < largest).fold(f32::NEG_INFINITY, f32::max);
        if low < high {
            return Self::Range { low, high };
        }
        // One value everywhere, or none.
        let value = if low.is_finite() { low } else { 0.0 };
        Self::Range { low: value.min(0.0), high: value.max(0.0) + 1.0 }
    }

    /// How it is shown, for people.
    pub(crate) fn describe(self) -> String {
        let number = |x: f32| number(Some(x.into()));
        match self {
            Self::Radiance(exposure) => format!("as radiance, exposed {} ×", number(exposure.factor())),
            Self::BaseColour => "as colour, 0 to 1".to_owned(),
            Self::Direction => "-1 as black to 1 as white".to_owned(),
            Self::Distance { farthest_m } => format!("0 as black to {} as white", number(farthest_m)),
            Self::Range { low, high } => format!("{} as black to {} as white", number(low), number(high)),
        }
    }

    /// 8-bit RGB rows.
    pub(crate) fn rgb8(self, picture: &Picture) -> Vec<u8> {
        match self {
            Self::Radiance(exposure) => exposure.tone_map(picture),
            Self::BaseColour => encode_srgb(picture),
            Self::Direction => encode_numbers(picture, 0.5, 0.5),
            Self::Range { low, high } => encode_numbers(picture, 1.0 / (high - low), -low / (high - low)),
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
    fn data_spans_its_range_and_the_largest_index_is_nothing() {
        let texels = |numbers, values: &[f32]| {
            let pixels = values.iter().map(|x| [*x; 3]).collect();
            Texels { picture: Picture::new([values.len() as u32, 1], pixels), numbers, more_layers: 0 }
        };
        let indices = texels(Numbers::Whole { largest: u32::MAX }, &[2.0, 4.0, u32::MAX as f32]);
        let display = Display::choose_for(&indices);
        assert_eq!(display, Display::Range { low: 2.0, high: 4.0 });
        assert_eq!(display.rgb8(&indices.picture), [0, 0, 0, 255, 255, 255, 255, 255, 255]);
        assert_eq!(display.describe(), "2.00 as black to 4.00 as white");
        let radiance = Display::choose_for(&texels(Numbers::Float, &[0.5, 2.0]));
        assert!(matches!(radiance, Display::Radiance(_)), "{radiance:?}");
        let signed = Display::choose_for(&texels(Numbers::Float, &[-0.5, f32::INFINITY, 2.0]));
        assert_eq!(signed, Display::Range { low: -0.5, high: 2.0 });
        for same in [&[5.0_f32, 5.0][..], &[f32::NAN]] {
            let Display::Range { low, high } = Display::choose_for(&texels(Numbers::Data, same)) else { panic!("no range") };
            assert!(low < high && high.is_finite(), "{same:?}: {low} to {high}");
        }
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
