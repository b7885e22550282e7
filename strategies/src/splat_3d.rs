//! Photons as polyhedra around them, drawn one instance each.
//!
//! ```text
//! for each photon P:                           # one instance; culled where it cannot be seen
//!     for each pixel (x, y) covered by the back faces of a hull about the kernel of P, with visible point X:
//!         image[x, y] += contribution of P at X, where the kernel holds X
//! ```
//!
//! [SA19] section 24.3.2, and the "photon volumes" of [MML13] section 2.2.1. The hull is circumscribed, an icosahedron about a sphere and a
//! hexagonal prism about an ellipsoid's kernel, 20 triangles either way. The fragment stage tests the kernel itself, so that the hull's
//! shape costs time and no light.
//!
//! With `shape=sphere` it sums the photons `exact` sums, in the order of the store. Biased for any radius above 0; consistent as radii shrink and
//! photons grow. With `shape=ellipsoid` the light of a pixel is also reflected as if it all came from its mean direction, a bias of its
//! own where surfaces are not Lambertian.
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"
//! [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems chapter 24, 2019"

use crate::parameter::Assignment;
use crate::splat::{Outline, Splat, SplatGeometry};
use crate::{Estimate, FrameInputs, Parameter, Requirements, SplatConfig, SplatShape, Strategy, StrategyError};
use lightloom_graph::wgpu::Face;
use lightloom_graph::{Graph, WgslSources};
use lightloom_passes::scene::SceneInfo;

/// 20 triangles.
const HULL_VERTICES: u32 = 60;

/// The strategy `splat-3d`.
#[derive(Debug)]
pub struct Splat3d {
    /// Parameters; may change between frames.
    pub config: SplatConfig,
    splat: Splat,
}

impl Splat3d {
    /// Its name in the registry.
    pub const NAME: &'static str = "splat-3d";

    /// The strategy with default parameters, ellipsoids; `sources` holds its shaders, see [`lightloom_passes::shaders`].
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        // Back faces: there is always one behind a visible point inside.
        let splat = Splat::new(sources, &SplatGeometry { stem: "splat_3d", cull: Some(Face::Front) })?;
        Ok(Self { config: SplatConfig::new(SplatShape::Ellipsoid), splat })
    }
}

impl Strategy for Splat3d {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        "a hull around each photon, drawn and blended [SA19], [MML13]; biased by its kernels and mean directions, consistent for Lambertians"
    }

    fn requirements(&self) -> Requirements {
        self.config.requirements()
    }

    fn reach_m(&self, info: &SceneInfo, emitted: u32) -> Option<f32> {
        self.config.kernels.reach_m(info, emitted)
    }

    fn declare(&mut self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>) -> Result<Estimate, StrategyError> {
        self.splat.declare(graph, Self::NAME, frame, &self.config, Outline { vertices: HULL_VERTICES, corners: 0 })
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        let assignment = Assignment { strategy: Self::NAME, key, value };
        if self.config.set(&assignment)? { Ok(()) } else { Err(assignment.unknown(&self.parameters())) }
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.config.parameters()
    }
}
