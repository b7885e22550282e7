//! What a user can choose of the strategy `instant-radiosity`.

use crate::StrategyError;
use crate::parameter::{Assignment, Parameter};
use std::fmt;

/// How lights are spent on pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum InstantRadiosityMode {
    /// Every light of a frame at every pixel, with a shadow ray each; frames have lights of their own, so that a thousand frames of a thousand lights
    /// are an image of a million.
    #[default]
    Progressive,
    /// One shadow ray a pixel and frame, to a light chosen among many by what it would bring unshadowed. The mean over frames is the same.
    Realtime,
}

/// What a user can choose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstantRadiosityConfig {
    /// How lights are spent on pixels.
    pub mode: InstantRadiosityMode,
    /// Lights of a frame, 1 to 16,384. Raising it calms the image; each costs a shadow ray a pixel, or in `realtime` the look at a candidate.
    /// Automatic: 64, and in `realtime` 256.
    pub lights: Option<u32>,
    /// Least distance ε (m), from 0 on, that a light is taken to have from what it lights: E ∝ 1 / max(r², ε²). Raising it takes bright spots away, and
    /// light from corners: it only ever darkens, and what it took is reported. 0: nothing is taken, and the mean is unbiased.
    pub clamp_m: f32,
    /// `realtime`: edge of a tile (pixels), 1 to 8, whose pixels share out the lights of a frame, each in its turn. Raising it saves the looks at
    /// candidates, as its square, and adds noise. 1.
    pub tile: u32,
    /// `realtime`: frames, 0 to 64, that the light chosen before may stand for beside this frame's candidates. Raising it calms the first
    /// frames of a view; as frames are averaged it gives way to the mean. 8.
    pub history: u32,
}

impl Default for InstantRadiosityConfig {
    fn default() -> Self {
        Self { mode: InstantRadiosityMode::default(), lights: None, clamp_m: 0.0, tile: 1, history: 8 }
    }
}

/// Lights of a frame at most.
const MOST_LIGHTS: u32 = 1 << 14;
/// Edge of a tile at most (pixels).
const MOST_TILE: u32 = 8;
/// Frames of history at most.
const MOST_HISTORY: u32 = 64;

impl InstantRadiosityConfig {
    /// Refuses what code may have set and `--set` would not.
    pub(super) fn check(&self) -> Result<(), StrategyError> {
        let refuse = |setting, value: String, expected| Err(StrategyError::BadSetting { setting, value, expected });
        if let Some(lights) = self.lights.filter(|&lights| !is_count(lights)) {
            return refuse("lights", lights.to_string(), "a number from 1 to 16384 is needed");
        }
        if !is_distance(self.clamp_m) {
            return refuse("clamp", self.clamp_m.to_string(), "a length in metres from 0 on is needed");
        }
        if !is_tile(self.tile) {
            return refuse("tile", self.tile.to_string(), "a number of pixels from 1 to 8 is needed");
        }
        if self.history > MOST_HISTORY {
            return refuse("history", self.history.to_string(), "a number of frames from 0 to 64 is needed");
        }
        Ok(())
    }

    /// Lights of a frame.
    pub(super) fn lights(&self) -> u32 {
        let automatic = match self.mode {
            InstantRadiosityMode::Progressive => 64,
            InstantRadiosityMode::Realtime => 256,
        };
        self.lights.unwrap_or(automatic)
    }

    /// Sets the parameter of that key; `false` if the key is another.
    pub(super) fn set(&mut self, assignment: &Assignment<'_>) -> Result<bool, StrategyError> {
        let default = Self::default();
        match assignment.key {
            "mode" => {
                self.mode = match assignment.value {
                    "progressive" => InstantRadiosityMode::Progressive,
                    "realtime" => InstantRadiosityMode::Realtime,
                    "auto" => default.mode,
                    _ => return Err(assignment.refuse("`progressive`, `realtime` or `auto` is needed")),
                }
            }
            "lights" => {
                self.lights = assignment.parse(|&value| is_count(value), "a number from 1 to 16384, or `auto`, is needed")?;
            }
            "clamp" => {
                let set = assignment.parse(|&value| is_distance(value), "a length in metres from 0 on, or `auto`, is needed")?;
                self.clamp_m = set.unwrap_or(default.clamp_m);
            }
            "tile" => {
                let set = assignment.parse(|&value| is_tile(value), "a number of pixels from 1 to 8, or `auto`, is needed")?;
                self.tile = set.unwrap_or(default.tile);
            }
            "history" => {
                let fits = |&frames: &u32| frames <= MOST_HISTORY;
                let set = assignment.parse(fits, "a number of frames from 0 to 64, or `auto`, is needed")?;
                self.history = set.unwrap_or(default.history);
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    pub(super) fn parameters(&self) -> Vec<Parameter> {
        let mode = "`progressive`: every light at every pixel; `realtime`: one shadow ray a pixel, to a light chosen among many";
        let lights =
            "lights of a frame; raising it calms the image, and costs a shadow ray a pixel each, or in `realtime` a look";
        let clamp = "least distance that a light is taken to have from what it lights (m); raising it takes bright spots and light from corners; 0: off";
        let tile = "realtime: edge of a tile whose pixels share out the lights (pixels); raising it is faster, and adds noise";
        let history =
            "realtime: frames that the light chosen before may stand for; raising it calms a view's first frames, 0: off";
        vec![
            Parameter::new("mode", Some(self.mode), mode),
            Parameter::new("lights", self.lights, lights),
            Parameter::new("clamp", Some(self.clamp_m), clamp),
            Parameter::new("tile", Some(self.tile), tile),
            Parameter::new("history", Some(self.history), history),
        ]
    }
}

impl fmt::Display for InstantRadiosityMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Progressive => "progressive",
            Self::Realtime => "realtime",
        })
    }
}

fn is_count(value: u32) -> bool {
    (1..=MOST_LIGHTS).contains(&value)
}

fn is_distance(value: f32) -> bool {
    value.is_finite() && value >= 0.0
}

fn is_tile(value: u32) -> bool {
    (1..=MOST_TILE).contains(&value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_out_of_range_are_refused() {
        let refused = [
            ("mode", "fast"),
            ("lights", "0"),
            ("lights", "16385"),
            ("clamp", "-0.1"),
            ("clamp", "inf"),
            ("tile", "0"),
            ("tile", "9"),
            ("history", "65"),
        ];
        let mut config = InstantRadiosityConfig::default();
        for (key, value) in refused {
            let error = config.set(&Assignment { strategy: "instant-radiosity", key, value }).unwrap_err().to_string();
            assert!(error.contains(key) && error.contains(value) && error.contains("is needed"), "{error}");
        }
        assert_eq!(config, InstantRadiosityConfig::default(), "what is refused changes nothing");
        let parameters = config.parameters();
        let mut set = |key, value| config.set(&Assignment { strategy: "instant-radiosity", key, value }).unwrap();
        assert!(!set("radius", "1"), "an unknown key is left to others");
        for (key, value) in [("mode", "realtime"), ("lights", "16384"), ("clamp", "0.5"), ("tile", "8"), ("history", "0")] {
            assert!(set(key, value), "{key}");
        }
        for parameter in &parameters {
            assert!(set(&parameter.name, "auto"), "{}", parameter.name);
        }
        assert_eq!(config, InstantRadiosityConfig::default(), "`auto` gives every parameter back");
        let wrong: [fn(&mut InstantRadiosityConfig); 4] = [
            |config| config.lights = Some(0),
            |config| config.clamp_m = f32::NAN,
            |config| config.tile = 9,
            |config| config.history = 65,
        ];
        for change in wrong {
            let mut config = InstantRadiosityConfig::default();
            change(&mut config);
            assert!(config.check().unwrap_err().to_string().contains("is needed"), "{config:?}");
        }
    }
}
