//! The radius of the density estimate's kernel: one meaning for all strategies.
//!
//! A photon's radius is `r = r_min + (r_max − r_min) √(1 − ρ)` [MML13] Eq. 4, where ρ is the a priori probability of its
//! path: `r_min` for photons that took specular paths (caustics), nearly `r_max` after diffuse bounces.
//!
//! Raising the radii trades noise for blur: variance falls as r⁻², squared bias grows as r⁴. With fixed radii the estimate
//! is biased and stays so for any number of photons. The automatic radii fall as N^(−1/6) with the number of photons, the
//! rate at which both parts of the error fall alike [Silverman86, section 4.3, d = 2], so that it is consistent: its mean squared error
//! falls as N^(−2/3).
//!
//! With `nearest` the radius follows the photons' density instead, and ρ is not used: see [`KNearest`](crate::KNearest). Radii then reach `r_min` wherever
//! photons are dense enough, so that the estimate is consistent as long as the radii are automatic.
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"
//! [Silverman86, section 4.3, d = 2]: https://doi.org/10.1201/9781315140919 "Density estimation for statistics and data analysis, Silverman, 1986"

use crate::StrategyError;
use crate::parameter::{Assignment, Parameter};
use lightloom_passes::scene::SceneInfo;
use std::num::NonZeroU32;

/// The automatic `r_max` of one photon, as a share of the scene's radius: a hundredth of it for a million photons. Wider
/// discs reach over the edges of a building's columns and vaults, where no photons lie, and lose more than 5 % of the light.
const R_MAX_SHARE: f32 = 0.1;
/// Automatic `r_min` as a share of `r_max`: caustics gather 16 times and more flux per area than their surroundings.
const R_MIN_SHARE: f32 = 0.25;
/// The automatic `r_max` is this much wider where neighbours choose the radius: few photons take it, and where they lie at a quarter of the density
/// there are as many in it.
const NEAREST_WIDENING: f32 = 2.0;

/// Radii as a user states them; `None` is automatic.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KernelRadius {
    /// Radius of photons of the most probable paths (m). Automatic: a quarter of `r_max`.
    pub r_min_m: Option<f32>,
    /// Radius of photons of the least probable paths (m).
    ///
    /// Automatic: `r_max = R/10 · N^(−1/6)`, R the radius of the scene's bounding sphere (m), N the photons emitted in the
    /// frame: R/68 for 100,000 of them, R/100 for a million.
    ///
    /// Twice that with [`Self::nearest`]; the automatic `r_min` stays.
    pub r_max_m: Option<f32>,
    /// Each photon's radius reaches to its neighbour of this number, as far as `r_min` and `r_max` allow. More: calmer, more blurred. `None`: by
    /// its path.
    pub nearest: Option<NonZeroU32>,
}

/// Radii of one frame, both positive, `r_min ≤ r_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Radii {
    /// Smallest kernel radius (m).
    pub r_min_m: f32,
    /// Largest kernel radius (m).
    pub r_max_m: f32,
}

impl KernelRadius {
    /// One radius for all photons (m).
    pub fn constant(radius_m: f32) -> Self {
        Self { r_min_m: Some(radius_m), r_max_m: Some(radius_m), nearest: None }
    }

    /// The radii for a frame of `emitted` photons.
    ///
    /// An automatic radius gives way to a stated one: a stated `r_min` above the automatic `r_max` raises that.
    pub fn resolve(&self, scene: &SceneInfo, emitted: u32) -> Result<Radii, StrategyError> {
        let automatic = R_MAX_SHARE * scene.bounds_radius * (emitted.max(1) as f32).powf(-1.0 / 6.0);
        // A scene without extent still needs a positive radius; nothing will be gathered there.
        let automatic = if automatic.is_finite() && automatic > 0.0 { automatic } else { 1.0 };
        let widening = if self.nearest.is_some() { NEAREST_WIDENING } else { 1.0 };
        let r_max_m = self.r_max_m.unwrap_or_else(|| (widening * automatic).max(self.r_min_m.unwrap_or(0.0)));
        let r_min_m = self.r_min_m.unwrap_or(R_MIN_SHARE / widening * r_max_m);
        let refuse =
            |setting, value: f32, expected| Err(StrategyError::BadSetting { setting, value: value.to_string(), expected });
        if !(r_max_m.is_finite() && r_max_m > 0.0) {
            return refuse("r_max", r_max_m, "a positive length in metres is needed");
        }
        if !(r_min_m > 0.0 && r_min_m <= r_max_m) {
            return refuse("r_min", r_min_m, "a positive length in metres, at most r_max, is needed");
        }
        Ok(Radii { r_min_m, r_max_m })
    }

    /// How far (m) from what is seen photons count, of radii that can be resolved: the largest radius; and as far again where those within it
    /// look for their neighbours.
    pub(crate) fn reach_m(&self, scene: &SceneInfo, emitted: u32) -> Option<f32> {
        let reaches = if self.nearest.is_some() { 2.0 } else { 1.0 };
        self.resolve(scene, emitted).ok().map(|radii| reaches * radii.r_max_m)
    }

    /// Sets `r_min`, `r_max`, `radius` (both) or `nearest`; `false` if the key is another.
    pub(crate) fn set(&mut self, assignment: &Assignment<'_>) -> Result<bool, StrategyError> {
        let both = match assignment.key {
            "nearest" => {
                self.nearest =
                    assignment.parse(|_| true, "a number of photons from 1 on, or `auto` (by their paths), is needed")?;
                return Ok(true);
            }
            "radius" => true,
            "r_min" | "r_max" => false,
            _ => return Ok(false),
        };
        let length = |value: &f32| value.is_finite() && *value > 0.0;
        let radius = assignment.parse(length, "a positive length in metres, or `auto`")?;
        if both || assignment.key == "r_min" {
            self.r_min_m = radius;
        }
        if both || assignment.key == "r_max" {
            self.r_max_m = radius;
        }
        Ok(true)
    }

    pub(crate) fn parameters(&self) -> Vec<Parameter> {
        vec![
            Parameter::new(
                "r_min",
                self.r_min_m,
                "kernel radius of caustic photons (m); raising it blurs caustics and calms their noise",
            ),
            Parameter::new(
                "r_max",
                self.r_max_m,
                "kernel radius of diffusely scattered photons (m); raising it blurs and calms noise",
            ),
            Parameter::new(
                "nearest",
                self.nearest,
                "each photon's radius, from r_min to r_max, reaches to its neighbour of this number; raising it blurs and calms noise; `auto` is by its path",
            ),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::unit_scene;

    #[test]
    fn automatic_radii_fall_as_the_sixth_root_of_the_photons() {
        let scene = unit_scene();
        let radius = |photons| KernelRadius::default().resolve(&scene, photons).unwrap();
        let million = radius(1_000_000);
        assert!((million.r_max_m / scene.bounds_radius - 0.01).abs() < 1e-5, "{million:?}");
        assert!((million.r_min_m - million.r_max_m / 4.0).abs() < 1e-6, "{million:?}");
        assert!((radius(1_000_000).r_max_m / radius(64_000_000).r_max_m - 2.0).abs() < 1e-4, "64 = 2⁶");
    }

    #[test]
    fn neighbours_have_more_room_and_are_kept() {
        let scene = unit_scene();
        let fixed = KernelRadius::default();
        let nearest = KernelRadius { nearest: NonZeroU32::new(20), ..fixed };
        let [a, b] = [fixed, nearest].map(|radius| radius.resolve(&scene, 1000).unwrap());
        assert!((b.r_max_m / a.r_max_m - 2.0).abs() < 1e-6 && (b.r_min_m / a.r_min_m - 1.0).abs() < 1e-6, "{a:?} {b:?}");
        assert_eq!(fixed.reach_m(&scene, 1000), Some(a.r_max_m));
        assert_eq!(nearest.reach_m(&scene, 1000), Some(2.0 * b.r_max_m));
    }

    #[test]
    fn stated_radii_win() {
        let scene = unit_scene();
        let constant = KernelRadius::constant(0.5).resolve(&scene, 10).unwrap();
        assert_eq!(constant, Radii { r_min_m: 0.5, r_max_m: 0.5 });
        let raised = KernelRadius { r_min_m: Some(1e3), ..KernelRadius::default() }.resolve(&scene, 10).unwrap();
        assert_eq!(raised, Radii { r_min_m: 1e3, r_max_m: 1e3 });
    }

    #[test]
    fn wrong_radii_are_refused() {
        let scene = unit_scene();
        for (r_min_m, r_max_m) in [(Some(2.0), Some(1.0)), (None, Some(0.0)), (None, Some(f32::NAN)), (Some(-1.0), None)] {
            let error = KernelRadius { r_min_m, r_max_m, nearest: None }.resolve(&scene, 10).unwrap_err().to_string();
            assert!(error.contains("metres"), "{error}");
        }
        let mut radius = KernelRadius::default();
        let mut set = |key, value| radius.set(&Assignment { strategy: "exact", key, value });
        let lengths = ["-1", "0", "nan", "inf", "1e99", "wide"].map(|value| ("radius", value));
        let numbers = ["-1", "0", "1.5", "4294967296", "all"].map(|value| ("nearest", value));
        for (key, value) in lengths.into_iter().chain(numbers) {
            let error = set(key, value).unwrap_err().to_string();
            assert!(error.contains(key) && error.contains(value), "{error}");
        }
        assert!(!set("colour", "1").unwrap(), "an unknown key is left to others");
        assert!(set("r_max", "0.25").unwrap() && set("r_min", "auto").unwrap());
        assert!(set("nearest", "9").unwrap());
        assert_eq!(radius, KernelRadius { r_min_m: None, r_max_m: Some(0.25), nearest: NonZeroU32::new(9) });
    }

    #[test]
    fn a_scene_without_extent_has_a_radius() {
        let scene = SceneInfo { bounds_radius: 0.0, ..unit_scene() };
        assert!(KernelRadius::default().resolve(&scene, 0).unwrap().r_max_m > 0.0);
    }
}
