//! The reference: an unbiased path tracer on the same scene, behind the same trait.
//!
//! ```text
//! for each pixel (x, y):  one path from the eye, next-event estimation at each vertex      # one per frame
//! for each light path whose first scattering is specular:                                   # from points and directions
//!     at each diffuse vertex:  connect to the eye, add to the pixel that shows it
//! image = both
//! ```
//!
//! Unbiased but for light that only paths eye – specular – diffuse – specular – point light carry, which neither half can
//! find; see [`PathTrace`]. Its noise falls as N^(−1/2) over frames.

use crate::parameter::Assignment;
use crate::{Estimate, FrameInputs, Parameter, Stats, Strategy, StrategyError};
use lightloom_graph::{Graph, WgslSources};
use lightloom_passes::{DepositCull, PathSettings, PathTrace, PhotonSettings, PhotonSplat, PhotonTracing};

/// Light paths cost less than paths from the eye, since most end at their first, non-specular hit; caustics are noisier.
const LIGHT_PATHS_PER_PIXEL: u32 = 4;

/// What a user can choose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PathConfig {
    /// Paths per frame from point, spot and directional lights, for caustics. 0: none, and the caustics of such
    /// lights are missing. Automatic: four per pixel. More: calmer caustics.
    pub light_paths: Option<u32>,
}

/// The strategy `path`.
#[derive(Debug)]
pub struct Path {
    /// Parameters; may change between frames.
    pub config: PathConfig,
    photons: PhotonTracing,
    splat: PhotonSplat,
    trace: PathTrace,
}

impl Path {
    /// Its name in the registry.
    pub const NAME: &'static str = "path";

    /// The strategy with default parameters; `sources` holds its shaders, see [`lightloom_passes::shaders`].
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            config: PathConfig::default(),
            photons: PhotonTracing::new(sources)?,
            splat: PhotonSplat::new(sources)?,
            trace: PathTrace::new(sources)?,
        })
    }
}

impl Strategy for Path {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        "path tracing with next-event estimation, and light tracing for caustics of point lights; unbiased, the reference"
    }

    fn uses_photons(&self) -> bool {
        false
    }

    fn declare(&mut self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>) -> Result<Estimate, StrategyError> {
        let automatic = frame.size[0].saturating_mul(frame.size[1]).saturating_mul(LIGHT_PATHS_PER_PIXEL);
        let emitted = self.config.light_paths.unwrap_or(automatic);
        // Only lights without area need light paths (emissive triangles are hit by paths from the eye), and only where
        // something mirrors or refracts.
        let splats = (frame.scene.traits.specular() && frame.info.punctual_count > 0 && emitted > 0 && frame.max_bounces > 0)
            .then(|| {
                let settings = PhotonSettings {
                    emitted,
                    capacity: PhotonSettings::default_capacity(emitted, frame.max_bounces),
                    max_bounces: frame.max_bounces,
                    seed: frame.seed,
                    caustics_only: true,
                    light_vertices: false,
                    cull: Some(DepositCull::new(frame.camera, 0.0)),
                };
                let photons = self.photons.add(graph, frame.scene, frame.info, &settings);
                self.splat.add(graph, frame.scene, frame.info, frame.camera, &photons, frame.seed)
            });
        let settings = PathSettings { seed: frame.seed, frame: frame.frame_index, max_bounces: frame.max_bounces };
        let layers = self.trace.add(graph, frame.scene, frame.info, frame.camera, splats.as_ref(), settings);
        let stats = splats.map(|splats| Stats::new(splats.overflowed, &["splats_overflowed"]));
        Ok(Estimate {
            stats: stats.into_iter().collect(),
            direct: Some(layers.direct),
            caustic: Some(layers.caustic),
            covers_specular: true,
            ..Estimate::new(layers.indirect)
        })
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        let assignment = Assignment { strategy: Self::NAME, key, value };
        if key != "light_paths" {
            return Err(assignment.unknown(&self.parameters()));
        }
        self.config.light_paths = assignment.parse(|_| true, "a whole number, or `auto`, is needed")?;
        Ok(())
    }

    fn parameters(&self) -> Vec<Parameter> {
        let doc = "light paths per frame for the caustics of point and directional lights; raising it calms them";
        vec![Parameter::new("light_paths", self.config.light_paths, doc)]
    }
}
