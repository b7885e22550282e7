//! The trait behind which every estimator stands, and what passes through it.

use crate::parameter::Assignment;
use crate::{DeviceTraits, Parameter, Requirements, StrategyError};
use lightloom_graph::{Buffer, Graph, Handle, Texture};
use lightloom_passes::scene::{SceneHandles, SceneInfo};
use lightloom_passes::{CameraUniform, GBuffer, Irradiance, Photons};

/// One way of estimating the light that leaves visible surfaces towards the eye.
///
/// Object-safe; a strategy knows the graph, the passes and its own shaders, and touches no device.
pub trait Strategy {
    /// Identifier used in labels, command lines and reports, e.g. `"hash-grid"`.
    fn name(&self) -> &str;

    /// One line for people: the method, its source, its bias.
    fn description(&self) -> &str;

    /// What it needs of a device. The default is WebGPU's guarantee.
    fn requirements(&self) -> Requirements {
        Requirements::default()
    }

    /// Whether it gathers photons; without, none are traced for it.
    fn uses_photons(&self) -> bool {
        true
    }

    /// Whether it estimates caustics and no other indirect light: its `indirect` is its `caustic`. Photons whose first scattering is not
    /// specular are then not followed. [`Composed`](crate::Composed) takes caustics from it and the rest, `indirect` less `caustic`,
    /// from another strategy.
    fn caustics_only(&self) -> bool {
        false
    }

    /// Whether photons are lights to it that send light to what is seen, rather than light that lands there: they are then stored by
    /// [`light_vertices`](lightloom_passes::PhotonSettings::light_vertices).
    fn light_vertices(&self) -> bool {
        false
    }

    /// How far (m) from what is seen a photon counts in a frame of `emitted` of them: gathered, or as a neighbour of those that are. With it the pipeline
    /// stores only photons that count; `None` keeps all.
    fn reach_m(&self, _info: &SceneInfo, _emitted: u32) -> Option<f32> {
        None
    }

    /// Declares one frame's passes; runs nothing.
    fn declare(&mut self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>) -> Result<Estimate, StrategyError>;

    /// Forgets what it kept of earlier frames; call when the camera jumps or the scene is another.
    fn reset(&mut self) {}

    /// Learns what runs its next frames.
    fn meet_device(&mut self, _device: &DeviceTraits) {}

    /// Hears the words of [`Estimate::measures`] of the frame that it declared last.
    fn observe(&mut self, _words: &[u32]) -> Result<(), StrategyError> {
        Ok(())
    }

    /// What it chose for the frame that it declared last, and why, for people; `None` if it has nothing to choose.
    fn choice(&self) -> Option<String> {
        None
    }

    /// Sets a parameter from text; `auto` lets the strategy choose.
    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        Err(Assignment { strategy: self.name(), key, value }.unknown(&self.parameters()))
    }

    /// All parameters and their present values.
    fn parameters(&self) -> Vec<Parameter> {
        Vec::new()
    }
}

/// What a strategy is given to declare a frame.
#[derive(Clone, Copy, Debug)]
pub struct FrameInputs<'a> {
    /// The scene's buffers and textures.
    pub scene: &'a SceneHandles,
    /// The scene's extent and light.
    pub info: &'a SceneInfo,
    /// What each pixel shows.
    pub gbuffer: &'a GBuffer,
    /// The photons; `Some` for strategies that use them.
    pub photons: Option<&'a Photons>,
    /// The eye.
    pub camera: &'a CameraUniform,
    /// Image size (pixels).
    pub size: [u32; 2],
    /// Frames since the start, from 0: decorrelates what is drawn at random.
    pub frame_index: u32,
    /// Seed of everything drawn at random.
    pub seed: u32,
    /// Surfaces that light may be scattered at before it reaches the visible point.
    pub max_bounces: u32,
    /// Sum in a fixed order, so that equal inputs give equal bits.
    pub deterministic: bool,
}

impl<'a> FrameInputs<'a> {
    /// The eye's position (m).
    pub fn camera_position_world(&self) -> [f32; 3] {
        self.camera.position_world()
    }

    /// The photons, or the error that names `strategy`.
    pub fn need_photons(&self, strategy: &str) -> Result<&'a Photons, StrategyError> {
        self.photons.ok_or_else(|| StrategyError::NeedsPhotons { strategy: strategy.to_owned() })
    }
}

/// What a strategy returns: images of the frame's size, rgba32float, linear RGB radiance (W·m⁻²·sr⁻¹).
#[derive(Debug)]
pub struct Estimate {
    /// Light that was scattered at one surface or more before the visible one.
    pub indirect: Handle<Texture>,
    /// The part of `indirect` whose earlier scatterings were all specular.
    pub caustic: Option<Handle<Texture>>,
    /// The light of which `indirect` is what the visible surfaces reflect, for strategies that sum light before it is reflected: filters
    /// take it in place of `indirect`, and reflect it afterwards.
    pub irradiance: Option<Irradiance>,
    /// Light emitted at the visible point or come to it straight from a light. `None`: the pipeline's own pass computes it.
    pub direct: Option<Handle<Texture>>,
    /// The images also hold the pixels whose first surface is specular. Otherwise the pipeline's own pass fills them.
    pub covers_specular: bool,
    /// Counts for the report.
    pub stats: Vec<Stats>,
    /// Counts for the strategy itself: the pipeline hands them to [`Strategy::observe`] after the frame.
    pub measures: Option<Stats>,
}

impl Estimate {
    /// An estimate of indirect light and nothing else.
    pub fn new(indirect: Handle<Texture>) -> Self {
        Self {
            indirect,
            caustic: None,
            irradiance: None,
            direct: None,
            covers_specular: false,
            stats: Vec::new(),
            measures: None,
        }
    }
}

/// Counts that a strategy keeps on the GPU and the pipeline reads back.
#[derive(Debug)]
pub struct Stats {
    /// One u32 per name.
    pub buffer: Handle<Buffer>,
    /// What the words count. A name that ends in `dropped` is light lost for want of room, and is reported as a warning, as is one in `overflowed`
    /// or `cut`, and more than a twentieth of all light in `removed_ppm`, the millionths of it that a clamp took.
    pub names: &'static [&'static str],
    /// The strategy that counts, where it is a part of the frame's.
    pub part: Option<String>,
}

impl Stats {
    /// Counts of the frame's strategy itself.
    pub fn new(buffer: Handle<Buffer>, names: &'static [&'static str]) -> Self {
        Self { buffer, names, part: None }
    }

    /// These are the counts of `strategy`, a part of the frame's.
    pub(crate) fn put_within(&mut self, strategy: &str) {
        self.part = Some(self.part.as_ref().map_or_else(|| strategy.to_owned(), |inner| format!("{strategy}.{inner}")));
    }

    /// The names, each behind that of the part that counts, such as `screen-space.photons_seen`.
    pub fn labels(&self) -> Vec<String> {
        let label = |name: &&str| self.part.as_ref().map_or_else(|| (*name).to_owned(), |part| format!("{part}.{name}"));
        self.names.iter().map(label).collect()
    }
}
