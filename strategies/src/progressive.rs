//! Progressive photon mapping over frames: radii shrink, and the mean over frames converges, caustics in mirrors and behind glass included.
//!
//! ```text
//! for frame n = 1, 2, …:                                        # each with its own photons and its own rays of the eye
//!     X = visible points: the eye's rays, followed through mirrors and glass
//!     L = seen + throughput · (photons within the radius rₙ of X)
//!     rₙ₊₁² = rₙ² (n + α) / (n + 1)
//! image = mean of all L                                         # the pipeline's
//! ```
//!
//! This is stochastic progressive photon mapping [HJ09] in the form of [KZ11], which needs no memory of a pixel: α of each frame's photons are kept
//! by radius in place of counting them, so that frames are independent and of equal weight, and the pipeline's mean is the estimate. [HJ09]
//! itself keeps radius, count and flux of each pixel, which adapts to how many photons it met; here that is for the radii of photons
//! (`r_min` for caustics, `nearest`), all of which shrink alike.
//!
//! **Rate.** rₙ² falls as n^(α−1). Variance of the mean of n frames falls as n^(−α), its bias, in proportion to the mean of the rᵢ², as n^(α−1) and the square
//! of it as n^(2α−2): the mean squared error falls fastest for α = ⅔, as n^(−⅔). An unbiased estimate would have n^(−1).
//! A radius of frame n is then, but for 5 %, the automatic one of all photons so far, which falls as N^(−1/6): the first frame is as good as it can be by itself.
//!
//! **Consistent**, whatever the photons of a frame: bias and variance both vanish. Left out is what no part finds: caustics of point lights that fall on
//! rough dielectrics, see [`VisiblePoints`](lightloom_passes::VisiblePoints); light beyond the limit of bounces; and at corners the photons of
//! surfaces within 60°, which count as if they lay on the same, until radii are smaller than what they reach over. Radii end at a
//! millionth of the scene's, where positions are rounded (2 · 10⁻⁷ of their size): from 10⁵ photons that takes 10²¹ frames.
//!
//! The search is that of [`SortedGrid`], unchanged. Photons are stored wherever they lie: who looks into mirrors may see any surface. Where
//! nothing is specular the points are those of the G-buffer, and the passes for it are not declared.
//!
//! Bytes moved, beside those of `sorted-grid`, for X pixels where something is specular:
//!
//! | pass | reads | writes |
//! |---|---|---|
//! | `visible_points` | 32 X, and rays of specular pixels | 64 X |
//! | `visible_points_resolve` | 64 X | 32 X |
//!
//! [HJ09]: https://doi.org/10.1145/1618452.1618487 "Stochastic progressive photon mapping, Hachisuka and Jensen, 2009"
//! [KZ11]: https://doi.org/10.1145/1966394.1966404 "Progressive photon mapping: a probabilistic approach, Knaus and Zwicker, 2011"

use crate::parameter::Assignment;
use crate::{Estimate, FrameInputs, KernelRadius, Parameter, SortedGrid, Strategy, StrategyError};
use lightloom_graph::{Graph, WgslSources};
use lightloom_passes::scene::SceneInfo;
use lightloom_passes::{PathSettings, VisiblePointsPass};

/// Where the mean squared error falls fastest.
const DEFAULT_ALPHA: f32 = 2.0 / 3.0;
/// No radius becomes smaller than this part of the scene's: five times the rounding of a position.
const MIN_RADIUS_SHARE: f32 = 1e-6;

/// What a user can choose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProgressiveConfig {
    /// Kernel radii of the first frame (m). Automatic: those of its photons.
    pub radius: KernelRadius,
    /// Part of a frame's photons that the shrinking radius keeps, α in (0, 1]. Raising it keeps radii wide: less noise, and blur that leaves more slowly; with 1
    /// it stays for ever. Automatic: ⅔.
    pub alpha: Option<f32>,
}

/// The strategy `progressive`.
#[derive(Debug)]
pub struct Progressive {
    /// Parameters; may change between frames.
    pub config: ProgressiveConfig,
    points: VisiblePointsPass,
    search: SortedGrid,
}

impl Progressive {
    /// Its name in the registry.
    pub const NAME: &'static str = "progressive";

    /// The strategy with default parameters; `sources` holds its shaders, see [`lightloom_passes::shaders`].
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            config: ProgressiveConfig::default(),
            points: VisiblePointsPass::new(sources)?,
            search: SortedGrid::new(sources)?,
        })
    }
}

impl ProgressiveConfig {
    /// The radii of frame `frame_index`, from 0.
    fn radius(&self, info: &SceneInfo, emitted: u32, frame_index: u32) -> Result<KernelRadius, StrategyError> {
        let first = self.radius.resolve(info, emitted)?;
        let scale = shrinkage(self.alpha.unwrap_or(DEFAULT_ALPHA), frame_index);
        let least = MIN_RADIUS_SHARE * info.bounds_radius;
        // Radii that begin below the floor stay what they are.
        let shrunk = |radius: f32| Some((scale * radius).max(least.min(radius)));
        Ok(KernelRadius { r_min_m: shrunk(first.r_min_m), r_max_m: shrunk(first.r_max_m), ..self.radius })
    }
}

/// Radius of frame `frame_index`, from 0, in those of the first: rₙ² = ∏ (i + α) / (i + 1), i from 1 to the index.
fn shrinkage(alpha: f32, frame_index: u32) -> f32 {
    let alpha = f64::from(alpha);
    let factor = |i: u32| (f64::from(i) + alpha) / (f64::from(i) + 1.0);
    (1..=frame_index).map(factor).product::<f64>().sqrt() as f32
}

impl Strategy for Progressive {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        "radii shrink over frames, mirrors and glass are looked through [HJ09, KZ11]: converges, caustics in mirrors and behind glass included"
    }

    fn declare(&mut self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>) -> Result<Estimate, StrategyError> {
        let photons = frame.need_photons(Self::NAME)?;
        self.search.config.radius = self.config.radius(frame.info, photons.emitted, frame.frame_index)?;
        if !frame.scene.traits.specular() {
            return self.search.declare(graph, frame);
        }
        let settings = PathSettings { seed: frame.seed, frame: frame.frame_index, max_bounces: frame.max_bounces };
        let points = self.points.add(graph, frame.scene, frame.info, frame.camera, frame.gbuffer, settings);
        let gathered = self.search.declare(graph, &FrameInputs { gbuffer: &points.gbuffer, ..*frame })?;
        let caustic = gathered.caustic.as_ref().unwrap_or(&gathered.indirect);
        let [indirect, caustic] = self.points.resolve(graph, &points, [&gathered.indirect, caustic], frame.size);
        Ok(Estimate { caustic: Some(caustic), covers_specular: true, stats: gathered.stats, ..Estimate::new(indirect) })
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        let assignment = Assignment { strategy: Self::NAME, key, value };
        if key == "alpha" {
            let fits = |alpha: &f32| *alpha > 0.0 && *alpha <= 1.0;
            self.config.alpha = assignment.parse(fits, "a number above 0, at most 1, or `auto` (2/3), is needed")?;
            return Ok(());
        }
        if self.config.radius.set(&assignment)? { Ok(()) } else { Err(assignment.unknown(&self.parameters())) }
    }

    fn parameters(&self) -> Vec<Parameter> {
        let alpha =
            "part of a frame's photons that the shrinking radius keeps; raising it calms noise and keeps blur, for ever at 1";
        let mut parameters = self.config.radius.parameters();
        parameters.push(Parameter::new("alpha", self.config.alpha, alpha));
        parameters
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::unit_scene;

    #[test]
    fn radii_shrink_as_the_sixth_root_of_the_frames() {
        let scene = unit_scene();
        let config = ProgressiveConfig::default();
        let radius = |frame| config.radius(&scene, 100_000, frame).unwrap();
        let automatic = |photons| config.radius.resolve(&scene, photons).unwrap();
        assert_eq!(radius(0).r_max_m, Some(automatic(100_000).r_max_m), "the first frame is as it is by itself");
        assert_eq!(radius(0).r_min_m, Some(automatic(100_000).r_min_m));
        // By hand: (1 + α)/2 (2 + α)/3 = 5/6 · 8/9.
        let third = radius(2).r_max_m.unwrap() / automatic(100_000).r_max_m;
        assert!((third * third - 40.0 / 54.0).abs() < 1e-6, "{third}");
        // Γ(n + α)/(n! Γ(1 + α)) tends to n^(−1/3) / Γ(5/3): radii are 1/√0.9027 of the automatic ones of as many photons.
        let late = radius(999).r_max_m.unwrap() / automatic(100_000_000).r_max_m;
        assert!((late - 1.0525).abs() < 1e-3, "{late}");
    }

    #[test]
    fn radii_stay_where_they_are_asked_to() {
        let scene = unit_scene();
        let floor = MIN_RADIUS_SHARE * scene.bounds_radius;
        let radius = |config: &ProgressiveConfig, frame| config.radius(&scene, 1, frame).unwrap().r_max_m;
        let mut config = ProgressiveConfig { radius: KernelRadius::constant(0.25), alpha: Some(1.0) };
        assert_eq!(radius(&config, 500), Some(0.25), "α = 1 shrinks nothing");
        config.alpha = Some(1e-6);
        config.radius = KernelRadius::constant(2.0 * floor);
        assert_eq!(radius(&config, 100), Some(floor), "rounding is the floor");
        config.radius = KernelRadius::constant(0.5 * floor);
        assert_eq!(radius(&config, 100), Some(0.5 * floor), "stated radii below it stay");
    }

    #[test]
    fn alpha_out_of_range_is_refused() {
        let mut strategy = Progressive::new(&lightloom_passes::shaders()).unwrap();
        for value in ["0", "-1", "1.5", "nan", "half"] {
            let error = strategy.set("alpha", value).unwrap_err().to_string();
            assert!(error.contains("`alpha`") && error.contains(value) && error.contains("above 0"), "{error}");
        }
        strategy.set("alpha", "0.5").unwrap();
        assert_eq!(strategy.config.alpha, Some(0.5));
        strategy.set("nearest", "20").unwrap();
        strategy.set("radius", "0.1").unwrap();
        assert_eq!(strategy.config.radius.r_max_m, Some(0.1));
        let error = strategy.set("rows", "2").unwrap_err().to_string();
        assert!(error.contains("`progressive`") && error.contains("`alpha`") && error.contains("`nearest`"), "{error}");
    }
}
