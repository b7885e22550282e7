//! What a user can choose of the strategy `caustic-map`.

use crate::StrategyError;
use crate::parameter::{Assignment, Parameter};
use std::fmt;

/// How broad the splats of photons are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SplatSize {
    /// All the same.
    Fixed,
    /// Of four breadths, 3, 7, 11 and 15 texels, of which every texel takes as much as the photons around it bear [WD08] section 4.1.
    ///
    /// [WD08]: http://jgt.akpeters.com/papers/WymanDachsbacher08/ "Reducing noise in image-space caustics with variable-sized splatting, Wyman and Dachsbacher, Journal of Graphics Tools 13(1), 2008"
    MultiResolution,
    /// As the beam of each, by the equation of a thin lens [WD08] section 4.2, for light that came through one solid: in at one face and out at
    /// another, each taken for a sphere. Of other photons as `Differential` says. Two rays a photon.
    ///
    /// [WD08]: http://jgt.akpeters.com/papers/WymanDachsbacher08/ "Reducing noise in image-space caustics with variable-sized splatting, Wyman and Dachsbacher, Journal of Graphics Tools 13(1), 2008"
    ThinLens,
    /// The same with the lens's thickness.
    ThickLens,
    /// As the beam of each, by its ray differentials: two principal curvatures, any number of mirrors and interfaces.
    #[default]
    Differential,
}

/// What a user can choose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CausticMapConfig {
    /// How broad splats are.
    pub mode: SplatSize,
    /// Side of a light's view (texels), 16 to 2048. Raising it makes caustics finer and, for the modes whose splats are counted in texels, noisier,
    /// at a cost in memory that grows with its square. Automatic: 512, or as much of it as a storage buffer holds for all views.
    pub side: Option<u32>,
    /// `fixed`: diameter of a splat (texels), 3 to 63; raising it blurs and calms, at a cost that grows with its square. 7, as in [WD08].
    ///
    /// [WD08]: http://jgt.akpeters.com/papers/WymanDachsbacher08/ "Reducing noise in image-space caustics with variable-sized splatting, Wyman and Dachsbacher, Journal of Graphics Tools 13(1), 2008"
    pub diameter: f32,
    /// `thin-lens`, `thick-lens`, `differential`: diameter of a splat over the breadth of its beam, above 0 and at most 16; raising it calms and blurs.
    /// With 1.13 a splat is as large as the beam, with 4 a dozen neighbours overlap. It stands for the D₀ of [WD08].
    ///
    /// [WD08]: http://jgt.akpeters.com/papers/WymanDachsbacher08/ "Reducing noise in image-space caustics with variable-sized splatting, Wyman and Dachsbacher, Journal of Graphics Tools 13(1), 2008"
    pub spread: f32,
    /// The same: largest diameter (texels), 3 to 63; raising it calms where light is spread thin, at a cost that grows with its square. 31.
    pub most: f32,
}

impl Default for CausticMapConfig {
    fn default() -> Self {
        Self { mode: SplatSize::default(), side: None, diameter: 7.0, spread: 4.0, most: 31.0 }
    }
}

/// Side of a view where nothing else is said and memory allows it (texels).
const SIDE: u32 = 512;
/// Sides of the smallest and the largest view (texels).
const SIDES: [u32; 2] = [16, 2048];

/// Words of a texel's sum of light, and of its four sums and counts: as in `shared/caustic_sums.wgsl`.
pub(super) const ONE_WORDS: u64 = 7;
pub(super) const FOUR_WORDS: u64 = 13;

impl SplatSize {
    const ALL: [Self; 5] = [Self::Fixed, Self::MultiResolution, Self::ThinLens, Self::ThickLens, Self::Differential];

    /// Words that a texel has in the larger of the mode's buffers.
    fn words(self) -> u64 {
        if self == Self::MultiResolution { FOUR_WORDS } else { ONE_WORDS }
    }

    /// Whether lenses are looked for, and whether they have a thickness.
    pub(super) fn lens(self) -> Option<bool> {
        match self {
            Self::ThinLens => Some(false),
            Self::ThickLens => Some(true),
            Self::Fixed | Self::MultiResolution | Self::Differential => None,
        }
    }
}

impl fmt::Display for SplatSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fixed => "fixed",
            Self::MultiResolution => "multi-resolution",
            Self::ThinLens => "thin-lens",
            Self::ThickLens => "thick-lens",
            Self::Differential => "differential",
        })
    }
}

impl CausticMapConfig {
    /// Refuses what code may have set and `--set` would not.
    pub(super) fn check(&self) -> Result<(), StrategyError> {
        let refuse = |setting, value: String, expected| Err(StrategyError::BadSetting { setting, value, expected });
        if let Some(side) = self.side.filter(|&side| !is_side(side)) {
            return refuse("side", side.to_string(), "a number of texels from 16 to 2048 is needed");
        }
        for (setting, value) in [("diameter", self.diameter), ("most", self.most)] {
            if !is_diameter(value) {
                return refuse(setting, value.to_string(), "a number of texels from 3 to 63 is needed");
            }
        }
        if !is_spread(self.spread) {
            return refuse("spread", self.spread.to_string(), "a number above 0, at most 16, is needed");
        }
        Ok(())
    }

    /// Side of the views (texels) where there are `views`, and a buffer holds `bytes`.
    pub(super) fn side(&self, views: u32, bytes: u64) -> Result<u32, StrategyError> {
        let fits = |side: u32| u64::from(side) * u64::from(side) * u64::from(views) * self.mode.words() * 4 <= bytes;
        match self.side {
            Some(side) if fits(side) => Ok(side),
            Some(side) => Err(StrategyError::BadSetting {
                setting: "side",
                value: side.to_string(),
                expected: "the sums of all the lights' views must fit a storage buffer of the device; lower it, or say `auto`",
            }),
            // Steps of eight; of 256 views, the most there are, the least fits WebGPU's buffers.
            None => Ok((SIDES[0]..=SIDE).rev().step_by(8).find(|&side| fits(side)).unwrap_or(SIDES[0])),
        }
    }

    /// Diameter (texels) of every splat; `None` where beams decide.
    pub(super) fn diameter(&self) -> Option<f32> {
        match self.mode {
            SplatSize::Fixed => Some(self.diameter),
            SplatSize::MultiResolution => Some(15.0),
            SplatSize::ThinLens | SplatSize::ThickLens | SplatSize::Differential => None,
        }
    }

    /// Sets the parameter of that key; `false` if the key is another.
    pub(super) fn set(&mut self, assignment: &Assignment<'_>) -> Result<bool, StrategyError> {
        const DIAMETER: &str = "a number of texels from 3 to 63, or `auto`, is needed";
        let default = Self::default();
        match assignment.key {
            "mode" if assignment.value == "auto" => self.mode = default.mode,
            "mode" => {
                let named = SplatSize::ALL.into_iter().find(|mode| mode.to_string() == assignment.value);
                let expected = "`fixed`, `multi-resolution`, `thin-lens`, `thick-lens`, `differential` or `auto` is needed";
                self.mode = named.ok_or_else(|| assignment.refuse(expected))?;
            }
            "side" => {
                let expected = "a number of texels from 16 to 2048, or `auto`, is needed";
                self.side = assignment.parse(|&side| is_side(side), expected)?;
            }
            "diameter" => {
                self.diameter = assignment.parse(|&value| is_diameter(value), DIAMETER)?.unwrap_or(default.diameter);
            }
            "spread" => {
                let expected = "a number above 0, at most 16, or `auto`, is needed";
                self.spread = assignment.parse(|&value| is_spread(value), expected)?.unwrap_or(default.spread);
            }
            "most" => self.most = assignment.parse(|&value| is_diameter(value), DIAMETER)?.unwrap_or(default.most),
            _ => return Ok(false),
        }
        Ok(true)
    }

    pub(super) fn parameters(&self) -> Vec<Parameter> {
        let mode =
            "how broad splats are: `fixed`, `multi-resolution`, or as beams by `thin-lens`, `thick-lens` or `differential`";
        let side = "side of a light's view (texels); raising it makes caustics finer, and costs memory by its square";
        let diameter = "fixed: diameter of a splat (texels); raising it blurs and calms, and costs its square";
        let spread = "by beams: diameter of a splat over the breadth of its beam; raising it calms and blurs";
        let most = "by beams: largest diameter (texels); raising it calms where light is spread thin, and costs its square";
        vec![
            Parameter::new("mode", Some(self.mode), mode),
            Parameter::new("side", self.side, side),
            Parameter::new("diameter", Some(self.diameter), diameter),
            Parameter::new("spread", Some(self.spread), spread),
            Parameter::new("most", Some(self.most), most),
        ]
    }
}

fn is_side(side: u32) -> bool {
    (SIDES[0]..=SIDES[1]).contains(&side)
}

fn is_diameter(texels: f32) -> bool {
    (3.0..=63.0).contains(&texels)
}

fn is_spread(spread: f32) -> bool {
    spread > 0.0 && spread <= 16.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const BUFFER: u64 = 128 << 20;

    #[test]
    fn values_out_of_range_are_refused() {
        let refused = [
            ("mode", "thin"),
            ("side", "15"),
            ("side", "2049"),
            ("side", "-1"),
            ("diameter", "2.9"),
            ("diameter", "64"),
            ("spread", "0"),
            ("spread", "nan"),
            ("most", "1"),
            ("most", "inf"),
        ];
        let mut config = CausticMapConfig::default();
        for (key, value) in refused {
            let error = config.set(&Assignment { strategy: "caustic-map", key, value }).unwrap_err().to_string();
            assert!(error.contains(key) && error.contains(value) && error.contains("is needed"), "{error}");
        }
        assert_eq!(config, CausticMapConfig::default(), "what is refused changes nothing");
        let parameters = config.parameters();
        let mut set = |key: &str, value: &str| config.set(&Assignment { strategy: "caustic-map", key, value }).unwrap();
        assert!(!set("radius", "1"), "an unknown key is left to others");
        for mode in SplatSize::ALL {
            assert!(set("mode", &mode.to_string()), "{mode}");
        }
        for (key, value) in [("mode", "fixed"), ("side", "16"), ("diameter", "63"), ("spread", "16"), ("most", "3")] {
            assert!(set(key, value), "{key}");
        }
        for parameter in &parameters {
            assert!(set(&parameter.name, "auto"), "{}", parameter.name);
        }
        assert_eq!(config, CausticMapConfig::default(), "`auto` gives every parameter back");
        let wrong: [fn(&mut CausticMapConfig); 4] = [
            |config| config.side = Some(8),
            |config| config.diameter = f32::NAN,
            |config| config.spread = -1.0,
            |config| config.most = 100.0,
        ];
        for change in wrong {
            let mut config = CausticMapConfig::default();
            change(&mut config);
            assert!(config.check().unwrap_err().to_string().contains("is needed"), "{config:?}");
        }
    }

    #[test]
    fn maps_fit_the_buffers() {
        let side = |mode, side, views| CausticMapConfig { mode, side, ..CausticMapConfig::default() }.side(views, BUFFER);
        let (one, four) = (SplatSize::Differential, SplatSize::MultiResolution);
        assert_eq!((side(one, None, 6).unwrap(), side(one, None, 1).unwrap(), side(four, None, 1).unwrap()), (512, 512, 512));
        // 128 MiB / (24 · 13 · 4 B) = 327².
        assert_eq!((side(four, None, 6).unwrap(), side(four, None, 24).unwrap()), (512, 320));
        assert!(side(four, None, 256).unwrap() >= 96, "the most views there can be");
        assert_eq!(side(one, Some(800), 6).unwrap(), 800);
        let error = side(one, Some(1024), 6).unwrap_err().to_string();
        assert!(error.contains("`side`") && error.contains("1024") && error.contains("lower it"), "{error}");
    }
}
