//! Scene, adapter and pipelines joined: the one place that the commands render through.

mod filter;
mod inspect;
mod motion;

pub(crate) use inspect::Tapped;
use motion::Motion;

use std::collections::BTreeSet;
use std::time::Instant;

use lightloom_graph::wgpu::Features;
use lightloom_graph::{Executor, Gpu, GpuRequest, Profile};
use lightloom_passes::scene::{Bvh, Camera, Environment, GpuScene, Reflection, Scene, builtin};
use lightloom_passes::{PhotonStore, RayBackend};
use lightloom_strategies::{Composed, Layer, Pipeline, Rendered, Settings, StrategyError, by_name_with, registry};

use crate::cli::{Emission, FirstHit, Materials, SceneArgs};
use crate::progress::ProgressLine;
use crate::results::{Flux, LightPhotons, Memory, PassTime, PhotonCounts, StrategyResult};
use crate::values::{Assignment, EnvironmentArg, Shown};
use crate::{Error, Picture, cancel};

/// The reference, whose frames are its samples.
pub(crate) const REFERENCE_STRATEGY: &str = "path";
/// What stands before the name of a built-in scene.
const BUILT_IN: &str = "builtin:";

/// The names of all strategies.
pub(crate) fn strategy_names() -> Vec<&'static str> {
    registry().iter().map(|entry| entry.name).collect()
}

/// One image to render.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Job<'a> {
    /// What the progress line says.
    pub(crate) label: &'a str,
    /// One of the strategies the session was opened with.
    pub(crate) strategy: &'a str,
    /// Paths per pixel, for `path` only.
    pub(crate) samples: u32,
    /// First number of the random sequences.
    pub(crate) seed: u32,
    /// Whether to keep the times of each frame.
    pub(crate) profile: bool,
    /// Light as it is, without filter and occlusion: a reference.
    pub(crate) plain: bool,
    /// The filter remembers the image before.
    pub(crate) continues: bool,
}

/// An image and what it cost.
#[derive(Debug)]
pub(crate) struct Rendering {
    /// The layer; finite everywhere.
    pub(crate) picture: Picture,
    /// Everything but the metrics and the file names.
    pub(crate) row: StrategyResult,
    /// What to know before trusting it.
    pub(crate) warnings: Vec<String>,
    /// How the times were measured.
    pub(crate) timing: String,
    /// Times of each frame, if they were asked for.
    pub(crate) profile: Profile,
}

/// A scene on an adapter, with the pipelines that were asked for.
#[derive(Debug)]
pub(crate) struct Session {
    adapter: String,
    /// `None`: frames are planned and not run.
    executor: Option<Executor>,
    scene: GpuScene,
    camera: Camera,
    settings: Settings,
    pipelines: Vec<Pipeline>,
    /// Strategies whose shaders the driver has compiled.
    warm: BTreeSet<String>,
    /// `None`: nothing moves.
    motion: Option<Motion>,
    warnings: Vec<String>,
}

impl Session {
    /// Loads the scene, builds the pipelines and opens the adapter, in this order: what can be wrong with the command
    /// line and the file is told before a device is opened.
    pub(crate) fn open(args: &SceneArgs, strategies: &[String]) -> Result<Self, Error> {
        check_words(args)?;
        let settings = settings(args)?;
        let requested = args.trace.requested()?;
        let mut scene = load(args)?;
        let camera = scene.camera(args.camera.as_deref())?;
        let pipelines = pipelines(args, strategies)?;
        cancel::listen();
        // Strategies that blend or add atomically can be asked for 32-bit floats.
        let optional_features = Features::FLOAT32_BLENDABLE | Features::SHADER_FLOAT32_ATOMIC;
        let request = GpuRequest { max_limits: true, optional_features, ..GpuRequest::default() };
        let gpu = Gpu::new(&RayBackend::enable(requested, request))?;
        let rays = RayBackend::choose(requested, &gpu).map_err(|error| {
            let wanted = requested.map_or("auto", RayBackend::name);
            Error::Unavailable(format!("--trace {wanted}: {error}"))
        })?;
        let bvh = Bvh::build(&scene.name, &scene.triangles)?;
        let resident = GpuScene::upload_with_bvh(&gpu.device, &gpu.queue, &scene, &bvh)?.with_rays(rays)?;
        let warnings = std::mem::take(&mut scene.warnings);
        let motion = scene.animation.is_some().then(|| Motion { scene, bvh, camera: args.camera.clone() });
        Ok(Self {
            adapter: gpu.adapter_name(),
            executor: Some(Executor::new(&gpu)),
            scene: resident,
            camera,
            settings,
            pipelines,
            warm: BTreeSet::new(),
            motion,
            warnings,
        })
    }

    /// As [`Self::open`] without an adapter: frames can be declared and planned. `auto` traces by the hierarchy here.
    pub(crate) fn open_to_plan(args: &SceneArgs, strategies: &[String]) -> Result<Self, Error> {
        check_words(args)?;
        let settings = settings(args)?;
        let rays = args.trace.requested()?.unwrap_or_default();
        let scene = load(args)?;
        let camera = scene.camera(args.camera.as_deref())?;
        let pipelines = pipelines(args, strategies)?;
        let described = GpuScene::describe(&scene)?.with_rays(rays)?;
        Ok(Self {
            adapter: String::new(),
            executor: None,
            scene: described,
            camera,
            settings,
            pipelines,
            warm: BTreeSet::new(),
            motion: None,
            warnings: scene.warnings,
        })
    }

    /// The adapter's name.
    pub(crate) fn adapter(&self) -> &str {
        &self.adapter
    }

    /// What traces rays, as `--trace` calls it.
    pub(crate) fn trace(&self) -> &'static str {
        self.scene.rays().name()
    }

    /// The camera's name.
    pub(crate) fn camera_name(&self) -> &str {
        &self.camera.name
    }

    /// What the scene's file left open.
    pub(crate) fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// What shines, and how the photons of the first frame are shared.
    pub(crate) fn lights(&self) -> Vec<LightPhotons> {
        let budget = self.scene.budget();
        let photons = budget.photons(self.settings.photons, self.settings.frame_seed(0));
        let lamps = budget.lamps().iter().zip(photons);
        let told = lamps.map(|(lamp, photons)| LightPhotons {
            name: lamp.name.clone(),
            kind: lamp.kind.name().to_owned(),
            photons,
            power: lamp.power.to_array(),
        });
        told.collect()
    }

    /// Renders one image, with a progress line and until Ctrl-C.
    pub(crate) fn render(&mut self, job: &Job<'_>) -> Result<Rendering, Error> {
        cancel::check()?;
        let mut settings = Settings { seed: job.seed, ..self.settings.clone() };
        if job.strategy == REFERENCE_STRATEGY {
            settings.frames = job.samples;
        }
        settings.profile = job.profile;
        if job.plain {
            (settings.filter, settings.ambient_occlusion) = (None, None);
        }
        let line = ProgressLine::new(job.label);
        self.warm_up(job.strategy, &settings)?;
        let pipeline = find(&mut self.pipelines, job.strategy)?;
        let executor = self.executor.as_mut().ok_or_else(no_adapter)?;
        let start = Instant::now();
        if !job.continues {
            pipeline.reset();
        }
        let rendered = pipeline.render_next(executor, &self.scene, &self.camera, &settings, &mut |progress| {
            let total = progress.total.max(1) as u64;
            let done = u64::from(progress.frame) * total + progress.done as u64;
            line.update(done, u64::from(progress.frames) * total, progress.pass);
            cancel::flow()
        })?;
        let wall_ms = start.elapsed().as_secs_f64() * 1e3;
        drop(line);
        let profile = rendered.profile.clone();
        let mut rendering = rendering(job.strategy, &settings, rendered, wall_ms)?;
        rendering.profile = Profile { adapter: self.adapter.clone(), frames: profile };
        Ok(rendering)
    }

    /// A strategy that chooses by what it measures does so first, at full size. Drivers compile a pipeline at its first dispatch, for up to
    /// seconds on a software adapter: a thumbnail comes first, so that the times are those of the work. llvmpipe compiles apart for sides
    /// that are powers of two.
    fn warm_up(&mut self, strategy: &str, settings: &Settings) -> Result<(), Error> {
        if !self.warm.insert(strategy.to_owned()) {
            return Ok(());
        }
        let size = settings.size.map(|side| if side.is_power_of_two() { side.min(8) } else { side.min(9) });
        // Sides of textures that hold photons follow the store.
        let photon_capacity = Some(settings.photon_settings(0).capacity);
        let frames = settings.frames.min(2);
        let thumbnail = Settings { size, photons: 64, photon_capacity, frames, profile: false, ..settings.clone() };
        let pipeline = find(&mut self.pipelines, strategy)?;
        let executor = self.executor.as_mut().ok_or_else(no_adapter)?;
        pipeline.measure(executor, &self.scene, &self.camera, settings, &mut |_| cancel::flow())?;
        pipeline.render(executor, &self.scene, &self.camera, &thumbnail, &mut |_| cancel::flow())?;
        Ok(())
    }
}

/// Refuses words that do not go together.
fn check_words(args: &SceneArgs) -> Result<(), Error> {
    if args.first_hit == FirstHit::Map && args.emission == Emission::Lights {
        return Err(Error::Usage(
            "--first-hit map: photons follow no map with `--emission lights`; say `--emission maps`".to_owned(),
        ));
    }
    Ok(())
}

fn load(args: &SceneArgs) -> Result<Scene, Error> {
    let mut scene = match args.scene.to_str().and_then(|name| name.strip_prefix(BUILT_IN)) {
        Some(name) => builtin::by_name(name).ok_or_else(|| {
            Error::Usage(format!("no built-in scene is called `{name}`; there are: {}", builtin::names().join(", ")))
        })?,
        None => Scene::load(&args.scene)?,
    };
    match &args.environment {
        Some(EnvironmentArg::Constant(radiance)) => scene.set_environment(Environment::constant((*radiance).into())?),
        Some(EnvironmentArg::Map(path, degrees)) => {
            scene.set_environment(Environment::load(path)?.with_rotation(degrees.to_radians()));
        }
        None => {}
    }
    for given in &args.light_photons {
        scene.set_photon_weight(&given.name, given.weight)?;
    }
    match args.materials {
        Materials::Gltf => {}
        Materials::Lambert => scene.make_lambert(),
        Materials::Phong => scene.reflection = Reflection::BlinnPhong,
    }
    match (args.time, scene.duration()) {
        (Some(time), Some(_)) => scene.pose(time)?,
        (Some(_), None) => {
            let scene = args.scene.display();
            return Err(Error::Usage(format!("`{scene}` has no animation: leave out --time and --animate")));
        }
        (None, Some(seconds)) => {
            scene
                .warnings
                .push(format!("the scene moves for {seconds} s and is shown at rest; --time S shows it after S seconds"));
        }
        (None, None) => {}
    }
    Ok(scene)
}

fn settings(args: &SceneArgs) -> Result<Settings, Error> {
    Ok(Settings {
        size: args.size.0,
        photons: args.photons,
        emission_maps: args.emission.maps(args.first_hit),
        bounces: args.bounces,
        seed: args.seed,
        frames: args.frames,
        filter: filter::filter(args)?,
        ambient_occlusion: filter::ambient_occlusion(args),
        deterministic: args.deterministic,
        layers: vec![match &args.layer {
            Shown::Layer(layer) => *layer,
            Shown::Pass(_) => Layer::Final,
        }],
        ..Settings::default()
    })
}

/// One pipeline per strategy, with its parameters set.
fn pipelines(args: &SceneArgs, strategies: &[String]) -> Result<Vec<Pipeline>, Error> {
    let mut pipelines = Vec::new();
    let shaders = PhotonStore::from(args.photon_store).shaders();
    for name in strategies {
        pipelines.push(Pipeline::with_shaders(by_name_with(name, &shaders)?, &shaders)?);
    }
    if let Some(radius) = args.radius.filter(|_| pipelines.iter().any(|pipeline| pipeline.strategy().uses_photons())) {
        assign(&mut pipelines, &Assignment { strategy: None, key: "radius".to_owned(), value: radius.to_string() })?;
    }
    for assignment in args.assignments.iter().filter(|assignment| !filter::is_for_filter(assignment)) {
        assign(&mut pipelines, assignment)?;
    }
    Ok(pipelines)
}

/// Sets a parameter of the strategy named, alone and as a part of another, or of all that have it; one of them must.
fn assign(pipelines: &mut [Pipeline], assignment: &Assignment) -> Result<(), Error> {
    let Assignment { strategy: wanted, key, value } = assignment;
    let mut unknown = None;
    let mut set = false;
    for pipeline in pipelines {
        let strategy = pipeline.strategy_mut();
        let outcome = match wanted.as_deref() {
            Some(name) if name == strategy.name() => strategy.set(key, value),
            Some(name) if strategy.name().split(Composed::JOINT).any(|part| part == name) => {
                strategy.set(&format!("{name}.{key}"), value)
            }
            Some(_) => continue,
            None => strategy.set(key, value),
        };
        match outcome {
            Ok(()) => set = true,
            Err(error @ StrategyError::UnknownParameter { .. }) => unknown = unknown.or(Some(error)),
            Err(error) => return Err(error.into()),
        }
    }
    match (set, unknown) {
        (true, _) => Ok(()),
        (false, Some(error)) => Err(error.into()),
        (false, None) => {
            let name = wanted.as_deref().unwrap_or_default();
            Err(Error::Usage(format!("--set {name}.{key}={value}: strategy `{name}` is not among those rendered here")))
        }
    }
}

fn find<'a>(pipelines: &'a mut [Pipeline], strategy: &str) -> Result<&'a mut Pipeline, Error> {
    let found = pipelines.iter_mut().find(|pipeline| pipeline.strategy().name() == strategy);
    found.ok_or_else(|| Error::Unavailable(format!("strategy `{strategy}` was not prepared")))
}

fn no_adapter() -> Error {
    Error::Unavailable("no adapter was opened".to_owned())
}

fn no_layer(strategy: &str, layer: Layer) -> Error {
    Error::Unavailable(format!(
        "strategy `{strategy}` does not tell the layer `{}` apart; choose another layer or strategy",
        layer.name()
    ))
}

/// The requested layer and the numbers, in the words of `results.json`.
fn rendering(strategy: &str, settings: &Settings, rendered: Rendered, wall_ms: f64) -> Result<Rendering, Error> {
    let layer = settings.layers.first().copied().unwrap_or(Layer::Final);
    let frames = f64::from(settings.frames);
    let gpu_ms = rendered.gpu_ms().map(|ms| ms / frames);
    let photons = rendered.photons.unwrap_or_default();
    let Rendered { size, layers, passes, timing, memory, choice, mut warnings, .. } = rendered;
    let image = layers.into_iter().find(|image| image.layer == layer).ok_or_else(|| no_layer(strategy, layer))?;
    let picture = Picture::new(size, image.pixels);
    let nonfinite_pixels = picture.nonfinite_pixels();
    if nonfinite_pixels > 0 {
        warnings.push(format!("strategy `{strategy}`: {nonfinite_pixels} pixels are NaN or infinite; they count as black"));
    }
    let row = StrategyResult {
        name: strategy.to_owned(),
        gpu_ms,
        passes: passes.into_iter().map(|pass| PassTime { name: pass.name, gpu_ms: pass.gpu_ms.map(|ms| ms / frames) }).collect(),
        bytes: memory.allocated_bytes,
        memory: Memory {
            unshared_bytes: memory.unshared_bytes,
            peak_live_bytes: memory.peak_live_bytes,
            pooled_bytes: memory.pooled_bytes,
        },
        photons: PhotonCounts {
            emitted: photons.emitted,
            stored: photons.stored,
            dropped: photons.dropped,
            culled: photons.culled,
            capacity: photons.capacity.into(),
        },
        flux: Flux {
            emitted: photons.flux.emitted,
            absorbed: photons.flux.absorbed,
            escaped: photons.flux.escaped,
            terminated: photons.flux.terminated,
        },
        choice,
        wall_ms,
        nonfinite_pixels,
        ..StrategyResult::default()
    };
    Ok(Rendering {
        picture: picture.with_finite_values(),
        row,
        warnings,
        timing: timing.describe().to_owned(),
        profile: Profile::default(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightloom_strategies::by_name;

    fn prepared(names: &[&str]) -> Vec<Pipeline> {
        names.iter().map(|name| Pipeline::new(by_name(name).unwrap()).unwrap()).collect()
    }

    fn value(pipelines: &[Pipeline], strategy: &str, key: &str) -> String {
        let pipeline = pipelines.iter().find(|pipeline| pipeline.strategy().name() == strategy);
        let parameters = pipeline.unwrap().strategy().parameters();
        parameters.into_iter().find(|parameter| parameter.name == key).unwrap().value
    }

    #[test]
    fn an_assignment_reaches_all_that_have_the_key_or_the_one_named() {
        let mut pipelines = prepared(&["tiled", "hash-grid", "path"]);
        assign(&mut pipelines, &"r_max=0.5".parse().unwrap()).unwrap();
        assign(&mut pipelines, &"hash-grid.r_max=0.25".parse().unwrap()).unwrap();
        assert_eq!(value(&pipelines, "tiled", "r_max"), "0.5");
        assert_eq!(value(&pipelines, "hash-grid", "r_max"), "0.25");
    }

    #[test]
    fn an_assignment_reaches_parts() {
        let mut pipelines = prepared(&["tiled", "tiled+screen-space"]);
        for assignment in ["screen-space.denoiser=none", "tiled.r_max=0.5", "tiled+screen-space.r_min=0.25"] {
            assign(&mut pipelines, &assignment.parse().unwrap()).unwrap();
        }
        assert_eq!(value(&pipelines, "tiled+screen-space", "screen-space.denoiser"), "none");
        assert_eq!(value(&pipelines, "tiled+screen-space", "tiled.r_max"), "0.5");
        assert_eq!(value(&pipelines, "tiled+screen-space", "tiled.r_min"), "0.25");
        assert_eq!([value(&pipelines, "tiled", "r_max"), value(&pipelines, "tiled", "r_min")], ["0.5", "auto"]);
        let error = assign(&mut pipelines, &"exact.r_max=1".parse().unwrap()).unwrap_err().to_string();
        assert!(error.contains("`exact` is not among those rendered here"), "{error}");
    }

    #[test]
    fn a_radius_is_for_those_that_have_one() {
        let radius = || "radius=0.5".parse().unwrap();
        let mut pipelines = prepared(&["tiled", "screen-space", "path"]);
        assign(&mut pipelines, &radius()).unwrap();
        assert_eq!(value(&pipelines, "tiled", "r_max"), "0.5");
        let error = assign(&mut prepared(&["screen-space"]), &radius()).unwrap_err();
        assert!(error.exit_status() == 2 && error.to_string().contains("`radius`"), "{error}");
    }

    #[test]
    fn assignments_to_nobody_are_wrong_usage() {
        let mut pipelines = prepared(&["tiled"]);
        for wrong in ["colour=red", "path.light_paths=5", "r_max=wide"] {
            let error = assign(&mut pipelines, &wrong.parse().unwrap()).unwrap_err();
            assert_eq!(error.exit_status(), 2, "{wrong}: {error}");
        }
    }

    #[test]
    fn nonfinite_pixels_are_warned_of_and_black() {
        let layers = vec![lightloom_strategies::LayerImage {
            layer: Layer::Final,
            pixels: vec![[f32::NAN; 3], [1.0; 3]],
            standard_error: None,
        }];
        let rendered = Rendered { size: [2, 1], frames: 1, layers, ..Rendered::default() };
        let settings = Settings { size: [2, 1], layers: vec![Layer::Final], ..Settings::default() };
        let rendering = rendering("tiled", &settings, rendered, 1.0).unwrap();
        assert_eq!(rendering.row.nonfinite_pixels, 1);
        assert_eq!(rendering.picture.pixels(), [[0.0; 3], [1.0; 3]]);
        assert!(rendering.warnings[0].contains("tiled"), "{:?}", rendering.warnings);
    }

    #[test]
    fn a_layer_the_strategy_lacks_is_named() {
        let settings = Settings { layers: vec![Layer::Caustic], ..Settings::default() };
        let error = rendering("tiled", &settings, Rendered::default(), 1.0).unwrap_err().to_string();
        assert!(error.contains("caustic") && error.contains("tiled"), "{error}");
    }
}
