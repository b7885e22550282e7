//! Filters of light, for any strategy: over frames where the surface was, then over neighbouring pixels of the same surface.
//!
//! ```text
//!  scene, both cameras ─▶ motion ─┐                      frame before: guide, light
//!  G-buffer ──────────▶ guide ────┤                              │
//!  irradiance, direction ──────── ▼                              ▼
//!  radiance ─▶ ÷ reflectance ─▶ light ──────────────────▶ temporal ─▶ à-trous, n levels ─▶ light ─▶ × reflectance ─▶ radiance
//! ```
//!
//! [SA19] §24.4. Filtered is light that arrives, not light that leaves, so that textures stay sharp: of a strategy that returns an
//! [`Irradiance`] both images, which [`ReflectIrradiance`](crate::ReflectIrradiance) reflects afterwards by the mean direction
//! (the correction for shading normals, Eq. 20); of one that returns radiance that over the surface's reflectance, which is never
//! 0: a channel that a surface does not reflect is taken from no pixel ([`Modulate`]).
//!
//! Pixels whose first surface is a mirror or transmits, and the background, pass through unfiltered.
//!
//! **Early frames.** A plain exponential mean of constant α would be a fifth old noise after 30 frames. The weight of the history is
//! that of a plain mean, n / (n + 1), until it reaches 0.95, that is for 19 frames, times `w_z w_n`.
//!
//! **Ghosts.** Light that changed without any surface changing is not seen to have changed: of the light before, a share of
//! 0.95ᵏ is left after k frames (a hundredth after 90). Surfaces that come to sight have no history, and show none.
//!
//! [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems chapter 24, 2019"

mod atrous;
mod guide;
mod modulate;
mod motion;
mod settings;
mod temporal;

pub use settings::{FilterError, FilterParameter, FilterSettings};

use crate::scene::{SceneHandles, SceneInfo};
use crate::{CameraUniform, GBuffer, Irradiance};
use atrous::Atrous;
use guide::{Guide, GuidePass};
use lightloom_graph::{Graph, Handle, ShaderError, Texture, WgslSources};
use modulate::Modulate;
use motion::MotionPass;
use temporal::Temporal;

/// All passes of the filters.
#[derive(Clone, Debug)]
pub struct Filter {
    motion: MotionPass,
    guide: GuidePass,
    temporal: Temporal,
    atrous: Atrous,
    modulate: Modulate,
}

/// What the filters of a frame are declared from.
#[derive(Debug)]
pub struct FilterInputs<'a> {
    /// The scene in this frame's graph.
    pub scene: &'a SceneHandles,
    /// Its extent.
    pub info: &'a SceneInfo,
    /// The eye.
    pub camera: &'a CameraUniform,
    /// The eye of the frame before, of a graph of the same name; `None`: none was, or what it left is to be forgotten.
    pub previous: Option<&'a CameraUniform>,
    /// What each pixel shows.
    pub gbuffer: &'a GBuffer,
    /// What [`Visibility`](crate::Visibility) wrote, by which moving triangles are followed; `None`: surfaces are taken to stand still.
    pub visibility: Option<&'a Handle<Texture>>,
}

/// What the filters of a frame share.
#[derive(Debug)]
pub struct FilterFrame<'a> {
    settings: FilterSettings,
    camera: &'a CameraUniform,
    previous: Option<&'a CameraUniform>,
    gbuffer: &'a GBuffer,
    /// Motion vectors, where the G-buffer has none.
    computed: Handle<Texture>,
    guide: Guide,
}

impl FilterFrame<'_> {
    fn motion(&self) -> &Handle<Texture> {
        self.gbuffer.motion.as_ref().unwrap_or(&self.computed)
    }
}

/// Which normals must agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Normals {
    /// Of light that does not depend on the shading normal.
    Geometric,
    /// Of light that does.
    Shading,
}

impl Filter {
    /// Parses the shaders.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self {
            motion: MotionPass::new(sources)?,
            guide: GuidePass::new(sources)?,
            temporal: Temporal::new(sources)?,
            atrous: Atrous::new(sources)?,
            modulate: Modulate::new(sources)?,
        })
    }

    /// Declares what all filters of a frame share, once per frame.
    pub fn begin<'a>(&self, graph: &mut Graph<'_>, settings: FilterSettings, inputs: &FilterInputs<'a>) -> FilterFrame<'a> {
        let guide = self.guide.add(graph, inputs.camera, inputs.gbuffer);
        let computed = self.motion.add(graph, inputs);
        let FilterInputs { camera, previous, gbuffer, .. } = *inputs;
        FilterFrame { settings, camera, previous, gbuffer, computed, guide }
    }

    /// Filters radiance (W·m⁻²·sr⁻¹) that leaves the visible surfaces. `name` names its history.
    pub fn radiance(
        &self,
        graph: &mut Graph<'_>,
        frame: &FilterFrame<'_>,
        name: &str,
        radiance: &Handle<Texture>,
    ) -> Handle<Texture> {
        let light = self.modulate.divide(graph, frame.camera, frame.gbuffer, radiance);
        let light = self.light(graph, frame, name, &light, Normals::Shading, 0.0);
        self.modulate.multiply(graph, frame.camera, frame.gbuffer, &light, radiance)
    }

    /// Filters light that arrives at the visible surfaces, to be reflected afterwards. `name` names its history.
    pub fn irradiance(&self, graph: &mut Graph<'_>, frame: &FilterFrame<'_>, name: &str, light: &Irradiance) -> Irradiance {
        let direction = format!("{name}_direction");
        Irradiance {
            irradiance: self.light(graph, frame, name, &light.irradiance, Normals::Geometric, 0.0),
            direction: self.light(graph, frame, &direction, &light.direction, Normals::Geometric, f32::MIN),
        }
    }

    /// Filters any image of three channels, 0 and above: an occlusion, say. `name` names its history.
    pub fn image(&self, graph: &mut Graph<'_>, frame: &FilterFrame<'_>, name: &str, image: &Handle<Texture>) -> Handle<Texture> {
        self.light(graph, frame, name, image, Normals::Geometric, 0.0)
    }

    fn light(
        &self,
        graph: &mut Graph<'_>,
        frame: &FilterFrame<'_>,
        name: &str,
        light: &Handle<Texture>,
        normals: Normals,
        least: f32,
    ) -> Handle<Texture> {
        let accumulated = self.temporal.add(graph, frame, name, light);
        self.atrous.add(graph, frame, accumulated, normals, least)
    }
}
