//! A whole frame with one strategy in its middle, and the loop over frames.
//!
//! ```text
//! scene ─▶ visibility ─▶ G-buffer ─┬─▶ direct light ──────────────────────────────────────┐
//!   └────▶ photon tracing ─▶ photons ─▶ STRATEGY ─▶ (filter) ─▶ specular pixels ─▶ indirect ─┴─▶ compose ─▶ mean over frames
//! ```
//!
//! [`Pipeline::declare_frame`] is the frame as code, for integrators who bring their own G-buffer, graph or loop;
//! [`Pipeline::render`] runs it and brings images and measurements back. Passes whose results nobody asks for are culled by
//! the graph, so asking for one layer costs that layer.

mod filtering;
mod frame;
mod rendered;
mod settings;

pub use frame::{Frame, FrameLayers, LightLayer};
pub use rendered::{Flux, LayerImage, PassReport, PhotonReport, Rendered};
pub use settings::{Layer, Settings};

use crate::surface_layers::SurfaceLayers;
use crate::{DeviceTraits, Strategy, StrategyError};
use filtering::Filtering;
use lightloom_graph::{Executor, FrameOutput, FrameProfile, Graph, Progress, Readback, WgslSources};
use lightloom_passes::scene::{Camera, GpuScene, SceneInfo};
use lightloom_passes::{
    Accumulate, AmbientOcclusion, CameraUniform, Compose, DirectLight, GBufferPass, PhotonState, PhotonTracing, Rsm,
    SpecularPixels, Visibility,
};
use rendered::add_times;
use std::ops::ControlFlow;

/// How far a rendering has come.
#[derive(Clone, Copy, Debug)]
pub struct RenderProgress<'a> {
    /// Frame in work, from 0.
    pub frame: u32,
    /// Frames in all.
    pub frames: u32,
    /// Passes of the frame that are done.
    pub done: usize,
    /// Passes of the frame.
    pub total: usize,
    /// The pass that was done last.
    pub pass: &'a str,
}

/// A strategy with everything around it that makes an image.
pub struct Pipeline {
    strategy: Box<dyn Strategy>,
    visibility: Visibility,
    gbuffer: GBufferPass,
    direct: DirectLight,
    photons: PhotonTracing,
    specular: SpecularPixels,
    filtering: Filtering,
    compose: Compose,
    accumulate: Accumulate,
    surface: SurfaceLayers,
    /// Parsed when first asked for, as the next.
    rsm: Option<Rsm>,
    occlusion: Option<AmbientOcclusion>,
    sources: WgslSources,
}

impl std::fmt::Debug for Pipeline {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pipeline").field("strategy", &self.strategy.name()).finish_non_exhaustive()
    }
}

impl Pipeline {
    /// A pipeline around `strategy`, with Lightloom's shaders.
    pub fn new(strategy: Box<dyn Strategy>) -> Result<Self, StrategyError> {
        Self::with_shaders(strategy, &lightloom_passes::shaders())
    }

    /// A pipeline around `strategy`, with the shaders of `sources`; those that `strategy` was made from, for both must keep photons
    /// alike (see [`PhotonStore`](lightloom_passes::PhotonStore)).
    pub fn with_shaders(strategy: Box<dyn Strategy>, sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            strategy,
            visibility: Visibility::new(sources)?,
            gbuffer: GBufferPass::new(sources)?,
            direct: DirectLight::new(sources)?,
            photons: PhotonTracing::new(sources)?,
            specular: SpecularPixels::new(sources)?,
            filtering: Filtering::default(),
            compose: Compose::new(sources)?,
            accumulate: Accumulate::new(sources)?,
            surface: SurfaceLayers::new(sources)?,
            rsm: None,
            occlusion: None,
            sources: sources.clone(),
        })
    }

    /// The strategy.
    pub fn strategy(&self) -> &dyn Strategy {
        &*self.strategy
    }

    /// The strategy, to set its parameters.
    pub fn strategy_mut(&mut self) -> &mut dyn Strategy {
        &mut *self.strategy
    }

    /// Forgets what strategy and filter keep of earlier frames; call when the camera jumps or the scene is another.
    pub fn reset(&mut self) {
        self.strategy.reset();
        self.filtering.forget();
    }

    /// Renders `settings.frames` frames and brings back the mean of each layer and what was measured. The first frame begins anew.
    ///
    /// `observer` hears of each long pass; its `Break` ends the rendering with
    /// [`GraphError::Cancelled`](lightloom_graph::GraphError::Cancelled).
    pub fn render(
        &mut self,
        executor: &mut Executor,
        scene: &GpuScene,
        camera: &Camera,
        settings: &Settings,
        observer: &mut dyn FnMut(RenderProgress<'_>) -> ControlFlow<()>,
    ) -> Result<Rendered, StrategyError> {
        self.reset();
        self.render_next(executor, scene, camera, settings, observer)
    }

    /// As [`Self::render`], but strategy and filter remember the frames of the rendering before: the next image of a camera or a scene
    /// that moves. It is to have another seed, or its noise would be that of the image before.
    pub fn render_next(
        &mut self,
        executor: &mut Executor,
        scene: &GpuScene,
        camera: &Camera,
        settings: &Settings,
        observer: &mut dyn FnMut(RenderProgress<'_>) -> ControlFlow<()>,
    ) -> Result<Rendered, StrategyError> {
        self.meet(executor, settings)?;
        let info = scene.info();
        let mut rendered = Rendered { size: settings.size, frames: settings.frames, ..Rendered::default() };
        for frame in 0..settings.frames {
            let mut graph = Graph::new(self.strategy.name());
            let handles = scene.declare(&mut graph);
            let uniform = CameraUniform::new(camera, settings.size, settings.jitter(frame), info.bounds_radius);
            let request = Frame { scene: &handles, info: &info, camera: &uniform, settings, frame_index: frame };
            let layers = self.declare_frame(&mut graph, &request, None)?;
            let readbacks = FrameReadbacks::new(&mut graph, &layers, settings, frame);
            let measures = readbacks.measures;
            let frames = settings.frames;
            let output = executor.execute_observed(graph, &mut |progress: Progress<'_>| {
                let Progress { done, total, pass, .. } = progress;
                observer(RenderProgress { frame, frames, done, total, pass })
            })?;
            if settings.profile {
                rendered.profile.push(FrameProfile::new(self.strategy.name(), &output));
            }
            readbacks.collect(&output, &info, settings, &mut rendered);
            if let Some(measures) = measures {
                self.strategy.observe(&output.cast::<u32>(measures))?;
            }
        }
        rendered.choice = self.strategy.choice();
        rendered.finish(self.strategy.name());
        Ok(rendered)
    }

    /// Lets a strategy that chooses by what it measures do so before the first frame of a rendering: traces a frame's photons and runs what measures
    /// them, but renders nothing. Filters forget. For other strategies, and where such a frame was measured, this costs the declaration of a frame.
    ///
    /// `observer` as in [`Self::render`].
    pub fn measure(
        &mut self,
        executor: &mut Executor,
        scene: &GpuScene,
        camera: &Camera,
        settings: &Settings,
        observer: &mut dyn FnMut(RenderProgress<'_>) -> ControlFlow<()>,
    ) -> Result<(), StrategyError> {
        self.meet(executor, settings)?;
        let info = scene.info();
        let mut graph = Graph::new(self.strategy.name());
        let handles = scene.declare(&mut graph);
        let uniform = CameraUniform::new(camera, settings.size, settings.jitter(0), info.bounds_radius);
        // What is kept from frame to frame would be written, and so made.
        let settings = Settings { filter: None, frames: 1, ..settings.clone() };
        let request = Frame { scene: &handles, info: &info, camera: &uniform, settings: &settings, frame_index: 0 };
        let layers = self.declare_frame(&mut graph, &request, None)?;
        let Some(measures) = layers.measures.filter(|_| settings.show_light()) else { return Ok(()) };
        let readback = graph.readback_buffer(&measures.buffer);
        let output = executor.execute_observed(graph, &mut |progress: Progress<'_>| {
            let Progress { done, total, pass, .. } = progress;
            observer(RenderProgress { frame: 0, frames: 1, done, total, pass })
        })?;
        self.strategy.observe(&output.cast::<u32>(readback))
    }

    /// Whether device and settings will do; if so, the strategy knows the device.
    fn meet(&mut self, executor: &Executor, settings: &Settings) -> Result<(), StrategyError> {
        self.check(executor, settings)?;
        self.strategy.meet_device(&DeviceTraits::of(executor.device()));
        Ok(())
    }

    fn check(&self, executor: &Executor, settings: &Settings) -> Result<(), StrategyError> {
        let (features, limits) = (executor.device().features(), executor.device().limits());
        settings.check(limits.max_texture_dimension_2d)?;
        let missing = self.strategy.requirements().missing(features, &limits);
        if missing.is_empty() {
            return Ok(());
        }
        Err(StrategyError::Unsupported { strategy: self.strategy.name().to_owned(), missing: missing.join("; ") })
    }
}

/// What one frame brings back.
struct FrameReadbacks {
    surfaces: Vec<(Layer, Readback)>,
    lights: Vec<(Layer, Readback, Option<Readback>)>,
    photon_state: Option<Readback>,
    stats: Vec<(Vec<String>, Readback)>,
    measures: Option<Readback>,
}

impl FrameReadbacks {
    /// Surfaces come from the first frame, whose samples are the pixels' centres; light from the last, the mean of all.
    fn new(graph: &mut Graph<'_>, layers: &FrameLayers, settings: &Settings, frame: u32) -> Self {
        let mut readbacks =
            Self { surfaces: Vec::new(), lights: Vec::new(), photon_state: None, stats: Vec::new(), measures: None };
        // Reading counts back would keep the photons alive where only surfaces are asked for.
        if settings.show_light() {
            readbacks.photon_state = layers.photons.as_ref().map(|photons| graph.readback_buffer(&photons.state));
            readbacks.stats = layers.stats.iter().map(|stats| (stats.labels(), graph.readback_buffer(&stats.buffer))).collect();
            readbacks.measures = layers.measures.as_ref().map(|measures| graph.readback_buffer(&measures.buffer));
        }
        for &layer in &settings.layers {
            if let (Some(image), 0) = (layers.surface(layer), frame) {
                readbacks.surfaces.push((layer, graph.readback_texture(image)));
            }
            if let (Some(light), true) = (layers.light(layer), frame + 1 == settings.frames) {
                let mean = graph.readback_texture(&light.mean);
                let deviations = light.deviations.as_ref().map(|deviations| graph.readback_texture(deviations));
                readbacks.lights.push((layer, mean, deviations));
            }
        }
        readbacks
    }

    fn collect(self, output: &FrameOutput, info: &SceneInfo, settings: &Settings, rendered: &mut Rendered) {
        for (layer, readback) in self.surfaces {
            let pixels = output.cast::<[f32; 4]>(readback).into_iter().map(|[r, g, b, _]| [r, g, b]).collect();
            rendered.layers.push(LayerImage { layer, pixels, standard_error: None });
        }
        for (layer, mean, deviations) in self.lights {
            let pixels = output.cast::<[f32; 4]>(mean).into_iter().map(|[r, g, b, _]| [r, g, b]).collect();
            let n = settings.frames as f32;
            let error = |[r, g, b, _]: [f32; 4]| [r, g, b].map(|sum| (sum.max(0.0) / (n * (n - 1.0))).sqrt());
            let standard_error = deviations.map(|readback| output.cast::<[f32; 4]>(readback).into_iter().map(error).collect());
            rendered.layers.push(LayerImage { layer, pixels, standard_error });
        }
        if let Some(state) = self.photon_state.and_then(|readback| output.cast::<PhotonState>(readback).first().copied()) {
            let photons = settings.photon_settings(0);
            rendered.add_photons(settings.photons, photons.capacity, &state, 1.0 / f64::from(photons.ledger_scale(info)));
        }
        for (names, readback) in self.stats {
            rendered.add_stats(&names, &output.cast::<u32>(readback));
        }
        add_times(&mut rendered.passes, output.passes.iter().map(|pass| (&*pass.name, pass.gpu_ms)));
        if output.memory.allocated_bytes >= rendered.memory.allocated_bytes {
            rendered.memory = output.memory;
        }
        rendered.timing = output.timing_source;
    }
}
