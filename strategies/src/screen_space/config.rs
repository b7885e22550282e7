//! What a user can choose of the strategy `screen-space`.

use crate::parameter::{Assignment, Parameter};
use crate::{SplatSums, StrategyError};
use lightloom_passes::scene::SceneInfo;
use std::fmt;

/// What calms the map of photons. Each spreads what a pixel has over visible pixels near it, and spreads all of it: with E = π L / R the light
/// before reflection and `a_p` the area that a pixel shows, Σ E `a_p` stays as it was, to rounding; on Lambertian surfaces that is the flux. Across
/// the image's edge nothing leaves, and in edges of surfaces light gathers a little.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Denoiser {
    /// Nothing: each photon stays in its pixel.
    None,
    /// [Kim19]'s use of a denoiser for reflections: kernels as wide as the blur of what is seen in a surface of one constant `roughness` at the distance from
    /// which the photons came, clamped to a range. As in the chapter normals guide nothing; the kernel is one of distances in space, so
    /// that light does not jump to what lies before or behind, and may turn a corner within its width.
    ///
    /// [Kim19]: https://doi.org/10.1007/978-1-4842-4427-2_30 "Caustics using screen-space photon mapping, Kim, Ray Tracing Gems chapter 30, 2019"
    #[default]
    Guided,
    /// [Kim19]'s second: a bell (1 − d²/w²)² over the image, joined with weights of planes and normals, and for surfaces nearer than `near`, of which a
    /// pixel shows too little to meet many photons, over a map of 4 × 4 pixels a texel.
    ///
    /// [Kim19]: https://doi.org/10.1007/978-1-4842-4427-2_30 "Caustics using screen-space photon mapping, Kim, Ray Tracing Gems chapter 30, 2019"
    Bilateral,
}

/// What a user can choose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenSpaceConfig {
    /// What calms the map.
    pub denoiser: Denoiser,
    /// `guided`: roughness of the surface that the map is thought to be seen in, in (0, 1]. A kernel's radius is 2 √3 roughness² times the
    /// distance, within which three quarters of a GGX lobe reflect. Raising it blurs and calms everywhere. 0.07, as in the chapter.
    pub roughness: f32,
    /// `guided`: least distance (m) from the photons' last hit that counts; raising it blurs where photons come from nearby. Automatic: a quarter
    /// of the radius of the scene's bounding sphere. (The chapter has 3 m and 20 m for its scene.)
    pub distance_min_m: Option<f32>,
    /// `guided`: largest such distance (m); raising it blurs where photons come from afar. Automatic: one and a half times that radius.
    pub distance_max_m: Option<f32>,
    /// `guided`: pixels that a kernel reaches each way at the most, 1 to 16; raising it lets kernels near the camera be as wide as they are
    /// meant to be, at a cost that grows with its square. 8.
    pub reach: u32,
    /// `bilateral`: pixels, or texels of the near map, that a kernel reaches each way, 1 to 8. Raising it blurs and
    /// calms, at a cost that grows with its square. 4.
    pub width: u32,
    /// `bilateral`: distance from the camera (m) below which the near map is used; 0: nowhere. Raising it calms near surfaces and blurs them.
    /// Automatic: where a pixel is less than a thousandth of the radius of the scene's bounding sphere high.
    pub near_m: Option<f32>,
    /// `bilateral`: distance from the tangent plane, to the kernel's width, at which a weight has fallen to 1/e; positive. Raising it follows
    /// curves and leaks to other surfaces. 0.1.
    pub sigma_z: f32,
    /// `bilateral`: power of the normals' cosine, 0 to 1000; raising it keeps light from turning corners. 32.
    pub sigma_n: f32,
    /// Artistic gain, from 0 on: 2 doubles caustics, which nothing in nature does. 1: off.
    pub gain: f32,
    /// What pixels are summed in. Automatic: fixed point, for a frame is declared before its device is known. Deterministic frames are
    /// summed in fixed point in any case.
    pub sums: Option<SplatSums>,
}

impl Default for ScreenSpaceConfig {
    fn default() -> Self {
        Self {
            denoiser: Denoiser::default(),
            roughness: 0.07,
            distance_min_m: None,
            distance_max_m: None,
            reach: 8,
            width: 4,
            near_m: None,
            sigma_z: 0.1,
            sigma_n: 32.0,
            gain: 1.0,
            sums: None,
        }
    }
}

const LENGTH: &str = "a positive length in metres, or `auto`, is needed";

impl ScreenSpaceConfig {
    /// Refuses what code may have set and `--set` would not.
    pub(super) fn check(&self) -> Result<(), StrategyError> {
        let refuse = |setting, value: String, expected| Err(StrategyError::BadSetting { setting, value, expected });
        if !is_roughness(self.roughness) {
            return refuse("roughness", self.roughness.to_string(), "a number above 0, at most 1, is needed");
        }
        if !(1..=16).contains(&self.reach) {
            return refuse("reach", self.reach.to_string(), "a number of pixels from 1 to 16 is needed");
        }
        if !(1..=8).contains(&self.width) {
            return refuse("width", self.width.to_string(), "a number of pixels from 1 to 8 is needed");
        }
        if let Some(near) = self.near_m.filter(|&near| !is_amount(near)) {
            return refuse("near", near.to_string(), "a length in metres from 0 on is needed");
        }
        if !is_length(self.sigma_z) {
            return refuse("sigma_z", self.sigma_z.to_string(), "a positive number is needed");
        }
        if !is_power(self.sigma_n) {
            return refuse("sigma_n", self.sigma_n.to_string(), "a number from 0 to 1000 is needed");
        }
        if !is_amount(self.gain) {
            return refuse("gain", self.gain.to_string(), "a number from 0 on is needed");
        }
        Ok(())
    }

    /// Least and largest distance (m) from the last hit.
    pub(super) fn distances(&self, info: &SceneInfo) -> Result<[f32; 2], StrategyError> {
        let refuse =
            |setting, value: f32, expected| Err(StrategyError::BadSetting { setting, value: value.to_string(), expected });
        // A scene without extent still needs a length; nothing is deposited there.
        let radius = if is_length(info.bounds_radius) { info.bounds_radius } else { 1.0 };
        // A stated distance moves the automatic one out of its way.
        let most = self.distance_max_m.unwrap_or_else(|| (1.5 * radius).max(self.distance_min_m.unwrap_or(0.0)));
        if !is_length(most) {
            return refuse("distance_max", most, "a positive length in metres is needed");
        }
        let least = self.distance_min_m.unwrap_or_else(|| (0.25 * radius).min(most));
        if !(is_length(least) && least <= most) {
            return refuse("distance_min", least, "a positive length in metres, at most distance_max, is needed");
        }
        Ok([least, most])
    }

    /// Distance (m) below which the near map is used, `pixel_angle` the height of a pixel at 1 m (m).
    pub(super) fn near(&self, info: &SceneInfo, pixel_angle: f32) -> f32 {
        self.near_m.unwrap_or(1.0e-3 * info.bounds_radius / pixel_angle)
    }

    /// What a frame is summed in.
    pub(super) fn sums(&self, deterministic: bool) -> SplatSums {
        if deterministic { SplatSums::Fixed } else { self.sums.unwrap_or(SplatSums::Fixed) }
    }

    /// Sets the parameter of that key; `false` if the key is another.
    pub(super) fn set(&mut self, assignment: &Assignment<'_>) -> Result<bool, StrategyError> {
        let default = Self::default();
        match assignment.key {
            "denoiser" => {
                self.denoiser = match assignment.value {
                    "none" => Denoiser::None,
                    "guided" => Denoiser::Guided,
                    "bilateral" => Denoiser::Bilateral,
                    "auto" => default.denoiser,
                    _ => return Err(assignment.refuse("`none`, `guided`, `bilateral` or `auto` is needed")),
                }
            }
            "roughness" => {
                let set = assignment.parse(|&value| is_roughness(value), "a number above 0, at most 1, or `auto`, is needed")?;
                self.roughness = set.unwrap_or(default.roughness);
            }
            "distance_min" => self.distance_min_m = assignment.parse(|&value| is_length(value), LENGTH)?,
            "distance_max" => self.distance_max_m = assignment.parse(|&value| is_length(value), LENGTH)?,
            "reach" => {
                let fits = |pixels: &u32| (1..=16).contains(pixels);
                let set = assignment.parse(fits, "a number of pixels from 1 to 16, or `auto`, is needed")?;
                self.reach = set.unwrap_or(default.reach);
            }
            "width" => {
                let fits = |pixels: &u32| (1..=8).contains(pixels);
                self.width =
                    assignment.parse(fits, "a number of pixels from 1 to 8, or `auto`, is needed")?.unwrap_or(default.width);
            }
            "near" => {
                self.near_m =
                    assignment.parse(|&value| is_amount(value), "a length in metres from 0 on, or `auto`, is needed")?;
            }
            "sigma_z" => {
                self.sigma_z = assignment
                    .parse(|&value| is_length(value), "a positive number, or `auto`, is needed")?
                    .unwrap_or(default.sigma_z);
            }
            "sigma_n" => {
                let set = assignment.parse(|&value| is_power(value), "a number from 0 to 1000, or `auto`, is needed")?;
                self.sigma_n = set.unwrap_or(default.sigma_n);
            }
            "gain" => {
                self.gain = assignment
                    .parse(|&value| is_amount(value), "a number from 0 on, or `auto`, is needed")?
                    .unwrap_or(default.gain);
            }
            "sums" => {
                self.sums = match assignment.value {
                    "fixed" => Some(SplatSums::Fixed),
                    "float" => Some(SplatSums::Float),
                    "auto" => None,
                    _ => return Err(assignment.refuse("`fixed`, `float` or `auto` is needed")),
                }
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    pub(super) fn parameters(&self) -> Vec<Parameter> {
        let denoiser = "what calms the map: `none`, `guided` by the distance that photons came, or `bilateral`";
        let roughness = "guided: roughness of the surface the map is thought to be seen in; raising it blurs and calms";
        let least = "guided: least distance from the photons' last hit that counts (m); raising it blurs what comes from nearby";
        let most = "guided: largest such distance (m); raising it blurs what comes from afar";
        let reach = "guided: pixels a kernel reaches at the most; raising it blurs near the camera, and costs its square";
        let width = "bilateral: pixels a kernel reaches; raising it blurs and calms, and costs its square";
        let near = "bilateral: distance from the camera below which a coarser map is used (m); raising it blurs and calms";
        let sigma_z =
            "bilateral: distance from the plane, to a kernel's width, that still counts; raising it leaks to other surfaces";
        let sigma_n = "bilateral: power of the normals' cosine; raising it keeps light from turning corners";
        let gain = "artistic gain; 1 is what nature does";
        let sums = "what pixels are summed in: `fixed` point, the same in every order, or `float` where the device adds floats atomically; `auto` is `fixed`";
        vec![
            Parameter::new("denoiser", Some(self.denoiser), denoiser),
            Parameter::new("roughness", Some(self.roughness), roughness),
            Parameter::new("distance_min", self.distance_min_m, least),
            Parameter::new("distance_max", self.distance_max_m, most),
            Parameter::new("reach", Some(self.reach), reach),
            Parameter::new("width", Some(self.width), width),
            Parameter::new("near", self.near_m, near),
            Parameter::new("sigma_z", Some(self.sigma_z), sigma_z),
            Parameter::new("sigma_n", Some(self.sigma_n), sigma_n),
            Parameter::new("gain", Some(self.gain), gain),
            Parameter::new("sums", self.sums, sums),
        ]
    }
}

impl fmt::Display for Denoiser {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::None => "none",
            Self::Guided => "guided",
            Self::Bilateral => "bilateral",
        })
    }
}

fn is_length(value: f32) -> bool {
    value.is_finite() && value > 0.0
}

fn is_amount(value: f32) -> bool {
    value.is_finite() && value >= 0.0
}

fn is_roughness(value: f32) -> bool {
    value > 0.0 && value <= 1.0
}

fn is_power(value: f32) -> bool {
    (0.0..=1000.0).contains(&value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::unit_scene;

    #[test]
    fn values_out_of_range_are_refused() {
        let refused = [
            ("denoiser", "median"),
            ("roughness", "0"),
            ("roughness", "1.1"),
            ("distance_min", "-1"),
            ("distance_max", "inf"),
            ("reach", "17"),
            ("reach", "0"),
            ("width", "9"),
            ("near", "-0.1"),
            ("sigma_z", "0"),
            ("sigma_n", "1001"),
            ("gain", "-1"),
            ("gain", "nan"),
            ("sums", "double"),
        ];
        let mut config = ScreenSpaceConfig::default();
        for (key, value) in refused {
            let error = config.set(&Assignment { strategy: "screen-space", key, value }).unwrap_err().to_string();
            assert!(error.contains(key) && error.contains(value) && error.contains("is needed"), "{error}");
        }
        assert_eq!(config, ScreenSpaceConfig::default(), "what is refused changes nothing");
        let parameters = config.parameters();
        let mut set = |key, value| config.set(&Assignment { strategy: "screen-space", key, value }).unwrap();
        assert!(!set("radius", "1"), "an unknown key is left to others");
        for (key, value) in
            [("denoiser", "none"), ("roughness", "1"), ("reach", "16"), ("width", "1"), ("near", "0"), ("gain", "3")]
        {
            assert!(set(key, value), "{key}");
        }
        for parameter in &parameters {
            assert!(set(&parameter.name, "auto"), "{}", parameter.name);
        }
        assert_eq!(config, ScreenSpaceConfig::default(), "`auto` gives every parameter back");
        let wrong: [fn(&mut ScreenSpaceConfig); 7] = [
            |config| config.roughness = f32::NAN,
            |config| config.reach = 0,
            |config| config.width = 9,
            |config| config.near_m = Some(f32::INFINITY),
            |config| config.sigma_z = 0.0,
            |config| config.sigma_n = -1.0,
            |config| config.gain = -1.0,
        ];
        for change in wrong {
            let mut config = ScreenSpaceConfig::default();
            change(&mut config);
            assert!(config.check().unwrap_err().to_string().contains("is needed"), "{config:?}");
        }
    }

    #[test]
    fn distances_follow_the_scene_and_make_room_for_each_other() {
        let scene = unit_scene();
        let distances = |least, most| {
            let config = ScreenSpaceConfig { distance_min_m: least, distance_max_m: most, ..ScreenSpaceConfig::default() };
            config.distances(&scene).map(|distances| distances.map(f32::to_bits))
        };
        let radius = scene.bounds_radius;
        assert_eq!(distances(None, None).unwrap(), [0.25 * radius, 1.5 * radius].map(f32::to_bits));
        assert_eq!(distances(Some(100.0), None).unwrap(), [100.0_f32; 2].map(f32::to_bits));
        assert_eq!(distances(None, Some(0.01)).unwrap(), [0.01_f32; 2].map(f32::to_bits));
        assert!(distances(Some(2.0), Some(1.0)).unwrap_err().to_string().contains("distance_min"));
    }
}
