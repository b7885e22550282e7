//! Photons as polygons on the screen, drawn one instance each.
//!
//! ```text
//! for each photon P:                           # one instance; culled where it cannot be seen
//!     for each pixel (x, y) in the tightest n-gon around the projected kernel of P, with visible point X:
//!         image[x, y] += contribution of P at X, where the kernel holds X
//! ```
//!
//! The 2.5D bounds of [MML13] section 2.2.1. A sphere projects to an ellipse, and so does an ellipsoid; the n-gon of the least area around
//! an ellipse is the affine image of the regular one. The vertex stage finds the ellipse anew for each vertex; the paper's geometry stage, which found it once
//! for each photon, WebGPU does not have. Kernels that reach the plane of the eye, where outlines are no ellipses, take one around the box
//! that they cover.
//!
//! With `shape=sphere` it sums the photons `exact` sums, in the order of the store. Biased for any radius above 0; consistent as radii shrink and
//! photons grow. `shape=ellipsoid` is that of `splat-3d`.
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"

use crate::parameter::Assignment;
use crate::splat::{Outline, Splat, SplatGeometry};
use crate::{Estimate, FrameInputs, Parameter, Requirements, SplatConfig, SplatShape, Strategy, StrategyError};
use lightloom_graph::{Graph, WgslSources};
use lightloom_passes::scene::SceneInfo;
use std::ops::RangeInclusive;

/// Corners of the polygon. Automatic: six cover 10 % more than the ellipse, with four triangles. Four are a box too.
const AUTO_CORNERS: u32 = 6;
const CORNERS: RangeInclusive<u32> = 4..=32;

/// What a user can choose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splat25dConfig {
    /// Kernel and targets.
    pub splat: SplatConfig,
    /// Corners of the polygon around a photon, 4 to 32; more cover fewer pixels in vain and cost three vertices each. Automatic: 6.
    pub corners: Option<u32>,
}

/// The strategy `splat-2.5d`.
#[derive(Debug)]
pub struct Splat25d {
    /// Parameters; may change between frames.
    pub config: Splat25dConfig,
    splat: Splat,
}

impl Splat25d {
    /// Its name in the registry.
    pub const NAME: &'static str = "splat-2.5d";

    /// The strategy with default parameters, spheres; `sources` holds its shaders, see [`lightloom_passes::shaders`].
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        let splat = Splat::new(sources, &SplatGeometry { stem: "splat_25d", cull: None })?;
        Ok(Self { config: Splat25dConfig { splat: SplatConfig::new(SplatShape::Sphere), corners: None }, splat })
    }
}

impl Strategy for Splat25d {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        "the tightest polygon around each photon, drawn and blended [MML13]; biased by its radius, consistent"
    }

    fn requirements(&self) -> Requirements {
        self.config.splat.requirements()
    }

    fn reach_m(&self, info: &SceneInfo, emitted: u32) -> Option<f32> {
        self.config.splat.kernels.reach_m(info, emitted)
    }

    fn declare(&mut self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>) -> Result<Estimate, StrategyError> {
        let corners = self.config.corners.unwrap_or(AUTO_CORNERS);
        if !CORNERS.contains(&corners) {
            let (setting, value) = ("corners", corners.to_string());
            return Err(StrategyError::BadSetting { setting, value, expected: "a number from 4 to 32 is needed" });
        }
        let outline = Outline { vertices: 3 * (corners - 2), corners };
        self.splat.declare(graph, Self::NAME, frame, &self.config.splat, outline)
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        let assignment = Assignment { strategy: Self::NAME, key, value };
        if key == "corners" {
            let fits = |corners: &u32| CORNERS.contains(corners);
            self.config.corners = assignment.parse(fits, "a number from 4 to 32, or `auto`, is needed")?;
            return Ok(());
        }
        if self.config.splat.set(&assignment)? { Ok(()) } else { Err(assignment.unknown(&self.parameters())) }
    }

    fn parameters(&self) -> Vec<Parameter> {
        let doc = "corners of the polygon around a photon; more cover fewer pixels in vain and cost three vertices each";
        let mut parameters = self.config.splat.parameters();
        parameters.push(Parameter::new("corners", self.config.corners, doc));
        parameters
    }
}
