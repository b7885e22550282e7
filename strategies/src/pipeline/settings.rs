//! What a rendering is asked for.

use crate::StrategyError;
use lightloom_passes::{AmbientOcclusionSettings, FilterSettings, PhotonSettings, RsmSettings};

/// An image of one part of the light, or of the surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Layer {
    /// Emitted, direct and indirect light (W·m⁻²·sr⁻¹).
    Final,
    /// Emitted, and straight from a light to the visible surface (W·m⁻²·sr⁻¹).
    Direct,
    /// Scattered at one surface or more before the visible one (W·m⁻²·sr⁻¹).
    Indirect,
    /// The part of the indirect light whose earlier scatterings were all specular (W·m⁻²·sr⁻¹).
    Caustic,
    /// Base colour, linear, 0 to 1.
    Albedo,
    /// Shading normal (world, unit).
    Normal,
    /// Distance to the camera (m) in each channel.
    Depth,
}

impl Layer {
    /// All layers.
    pub const ALL: [Self; 7] =
        [Self::Final, Self::Direct, Self::Indirect, Self::Caustic, Self::Albedo, Self::Normal, Self::Depth];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Final => "final",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Caustic => "caustic",
            Self::Albedo => "albedo",
            Self::Normal => "normal",
            Self::Depth => "depth",
        }
    }

    /// It shows surfaces rather than light: one sample at the pixel's centre, without a mean.
    pub fn is_surface(self) -> bool {
        matches!(self, Self::Albedo | Self::Normal | Self::Depth)
    }
}

/// How a rendering is made, whatever the strategy.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Width and height (pixels).
    pub size: [u32; 2],
    /// Photons emitted per frame. More: less noise, in proportion more time.
    pub photons: u32,
    /// Records the photon store holds (32 or 20 B each, see [`PhotonStore`](lightloom_passes::PhotonStore)). `None`: enough for most scenes, within WebGPU's limits; what does
    /// not fit is counted in [`Rendered::photons`](crate::Rendered::photons) and warned of.
    pub photon_capacity: Option<u32>,
    /// The reflective shadow maps by which lights send photons to bright surfaces, see [`Rsm`](lightloom_passes::Rsm); each costs
    /// its texels in rays, every frame. `None`: lights send them evenly.
    pub emission_maps: Option<RsmSettings>,
    /// Surfaces that light may be scattered at before it reaches the visible point.
    pub bounces: u32,
    /// Seed of everything drawn at random; the same seed gives the same photons in the same order.
    pub seed: u32,
    /// Frames to average. One: sampled at the pixels' centres. More: each with its own photons and its own sample
    /// position inside the pixels.
    pub frames: u32,
    /// Filters the indirect light and the caustics, each frame with what the frames before it left. The image is the mean of the
    /// filtered frames, the nth with the weight n. `None`: the estimate as it is.
    pub filter: Option<FilterSettings>,
    /// Darkens the indirect light in [`Layer::Final`] where surfaces are close together, see
    /// [`AmbientOcclusion`](lightloom_passes::AmbientOcclusion). `None`: it is as the photons say.
    pub ambient_occlusion: Option<AmbientOcclusionSettings>,
    /// Sum in a fixed order, so that two runs on one adapter give the same bits.
    pub deterministic: bool,
    /// Shadow rays to emissive triangles per pixel and frame. More: calmer soft shadows.
    pub emissive_samples: u32,
    /// What to bring back. Passes that nothing needs are culled.
    pub layers: Vec<Layer>,
    /// Keep the times of each frame, in [`Rendered::profile`](crate::Rendered::profile).
    pub profile: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            size: [320, 180],
            photons: 200_000,
            photon_capacity: None,
            emission_maps: None,
            bounces: 32,
            seed: 0,
            frames: 1,
            filter: None,
            ambient_occlusion: None,
            deterministic: false,
            emissive_samples: 8,
            layers: Layer::ALL.to_vec(),
            profile: false,
        }
    }
}

impl Settings {
    /// Photon settings of frame `frame_index`.
    pub fn photon_settings(&self, frame_index: u32) -> PhotonSettings {
        let capacity = self.photon_capacity.unwrap_or_else(|| PhotonSettings::default_capacity(self.photons, self.bounces));
        PhotonSettings {
            emitted: self.photons,
            capacity,
            max_bounces: self.bounces,
            seed: self.frame_seed(frame_index),
            caustics_only: false,
            light_vertices: false,
            cull: None,
        }
    }

    /// Seed of frame `frame_index`; that of frame 0 is [`Self::seed`]. Frames of nearby seeds stay apart.
    pub fn frame_seed(&self, frame_index: u32) -> u32 {
        self.seed.wrapping_add(frame_index.wrapping_mul(0x9e37_79b9))
    }

    /// The seed of frame 0 where that of frame `frame_index` is `seed`: one for all frames of an image.
    pub(crate) fn first_seed(seed: u32, frame_index: u32) -> u32 {
        seed.wrapping_sub(frame_index.wrapping_mul(0x9e37_79b9))
    }

    /// Sample position inside the pixels of frame `frame_index`, in [0, 1)²: the centre for frame 0, then the points of the
    /// two-dimensional golden-ratio sequence (ratios 1/g and 1/g², g³ = g + 1), which cover the pixel evenly.
    pub fn jitter(&self, frame_index: u32) -> [f32; 2] {
        let n = f64::from(frame_index);
        [0.754_877_666_246_692_7, 0.569_840_290_998_053_2].map(|ratio: f64| (0.5 + n * ratio).fract().min(0.999_999) as f32)
    }

    /// Whether a layer of light is asked for.
    pub(super) fn show_light(&self) -> bool {
        self.layers.iter().any(|layer| !layer.is_surface())
    }

    /// Refuses what cannot be rendered at all. `max_side`: the largest texture the device makes (pixels).
    pub(crate) fn check(&self, max_side: u32) -> Result<(), StrategyError> {
        let refuse = |setting, value: String, expected| Err(StrategyError::BadSetting { setting, value, expected });
        if self.size.contains(&0) || self.size.iter().any(|&side| side > max_side) {
            let value = format!("{}×{}", self.size[0], self.size[1]);
            return refuse("size", value, "each side must be at least one pixel and at most what the adapter's textures hold");
        }
        if self.frames == 0 {
            return refuse("frames", "0".to_owned(), "at least one frame is needed");
        }
        if let Some(filter) = &self.filter {
            filter.check()?;
        }
        if let Some(AmbientOcclusionSettings { radius_m, rays }) = self.ambient_occlusion {
            if !(radius_m.is_finite() && radius_m > 0.0) {
                return refuse("ambient_occlusion", radius_m.to_string(), "a positive radius in metres is needed");
            }
            if rays == 0 {
                return refuse("ambient_occlusion", "0 rays".to_owned(), "at least one ray is needed");
            }
        }
        if self.photons == 0 {
            return refuse("photons", "0".to_owned(), "at least one photon is needed");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jitter_starts_at_the_centre_and_fills_the_pixel() {
        let settings = Settings::default();
        assert_eq!(settings.jitter(0).map(f32::to_bits), [0.5_f32.to_bits(); 2]);
        let mut quadrants = [0_u32; 4];
        for frame in 0..64 {
            let [x, y] = settings.jitter(frame);
            assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y), "{x} {y}");
            quadrants[usize::from(x >= 0.5) + 2 * usize::from(y >= 0.5)] += 1;
        }
        assert!(quadrants.iter().all(|&count| (14..=18).contains(&count)), "{quadrants:?}");
    }

    #[test]
    fn impossible_settings_are_refused() {
        let good = Settings::default();
        assert!(good.check(8192).is_ok());
        for bad in [
            Settings { size: [0, 4], ..good.clone() },
            Settings { size: [4, 8193], ..good.clone() },
            Settings { frames: 0, ..good.clone() },
            Settings { photons: 0, ..good.clone() },
            Settings { filter: Some(FilterSettings { history: 1.0, ..FilterSettings::default() }), ..good.clone() },
            Settings { ambient_occlusion: Some(AmbientOcclusionSettings::new(0.0)), ..good.clone() },
            Settings { ambient_occlusion: Some(AmbientOcclusionSettings { radius_m: 1.0, rays: 0 }), ..good.clone() },
        ] {
            assert!(bad.check(8192).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn frames_have_their_own_seeds() {
        let settings = Settings { seed: 7, ..Settings::default() };
        assert_eq!(settings.frame_seed(0), 7);
        assert_ne!(settings.frame_seed(1), settings.frame_seed(2));
        assert_eq!(Settings::first_seed(settings.frame_seed(5), 5), 7);
        assert_eq!(settings.photon_settings(1).seed, settings.frame_seed(1));
    }
}
