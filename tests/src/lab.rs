//! An adapter, the passes, and one call for each experiment.

use crate::image::Accumulator;
use crate::{Image, Pixels};
use lightloom_graph::wgpu::{Features, TextureFormat};
use lightloom_graph::{Executor, FrameOutput, Gpu, Graph, Handle, Memory, Readback, Texture, TextureDesc, WgslSources};
use lightloom_passes::scene::{Camera, Emission, GpuScene, Scene, SceneHandles};
use lightloom_passes::{
    CameraUniform, DirectLight, DirectSettings, GBuffer, GBufferPass, PathSettings, PathTrace, Photon, PhotonSettings,
    PhotonState, PhotonTracing, Photons, Ray, RayBackend, RayHit, Rsm, RsmSettings, TraceRays, Visibility, radiance_desc,
    shaders,
};
use lightloom_strategies::{Exact, FrameInputs, HashGrid, SortedGrid, SplatCompute, Strategy, Tiled, ViewGrid};

/// A device with the passes ready to be declared.
#[derive(Debug)]
pub struct Lab {
    /// The device.
    pub gpu: Gpu,
    /// The shaders.
    pub sources: WgslSources,
    /// Runs the frames.
    pub executor: Executor,
    /// Frames that came before those that are estimated.
    pub frame_index: u32,
    visibility: Visibility,
    gbuffer: GBufferPass,
    direct: DirectLight,
    path: PathTrace,
    /// Traces the photons.
    pub tracing: PhotonTracing,
    rays: TraceRays,
}

/// A camera over an image.
#[derive(Clone, Debug)]
pub struct View {
    /// Where it stands.
    pub camera: Camera,
    /// Width and height (pixels).
    pub size: [u32; 2],
    /// Sample position inside the pixels, in [0, 1)².
    pub jitter: [f32; 2],
}

impl View {
    /// Samples at the pixels' centres.
    pub fn new(camera: Camera, size: [u32; 2]) -> Self {
        Self { camera, size, jitter: [0.5; 2] }
    }
}

/// What the path tracer's eye receives (W·m⁻²·sr⁻¹).
#[derive(Clone, Debug)]
pub struct PathImages {
    /// Emitted, and straight from the lights.
    pub direct: Pixels,
    /// All other.
    pub indirect: Pixels,
}

/// Photons read back.
#[derive(Clone, Debug)]
pub struct Traced {
    /// The stored records.
    pub records: Vec<Photon>,
    /// Counts and ledger.
    pub state: PhotonState,
}

/// How a frame of estimates is made.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// The photons.
    pub photons: PhotonSettings,
    /// The reflective shadow maps that they follow, if any.
    pub maps: Option<RsmSettings>,
    /// Sum in a fixed order.
    pub deterministic: bool,
}

/// One frame's estimates from one set of photons.
#[derive(Clone, Debug)]
pub struct Estimates {
    /// World position (m) and distance to the camera (m, 0 where nothing is) per pixel.
    pub positions: Vec<[f32; 4]>,
    /// The photons.
    pub traced: Traced,
    /// Indirect light and its caustic part per strategy, in the order they were given (W·m⁻²·sr⁻¹). The latter is black for a strategy that
    /// does not tell it apart.
    pub layers: Vec<[Image; 2]>,
    /// Transient memory of the frame.
    pub memory: Memory,
}

/// `exact`, `tiled`, `hash-grid`, `sorted-grid`, `view-grid` and `splat-compute` with the shaders of `sources` and these kernel radii (m).
///
/// # Panics
/// If a strategy refuses its shaders or radii.
pub fn strategies(sources: &WgslSources, r_min: f32, r_max: f32) -> Vec<Box<dyn Strategy>> {
    let all: [Box<dyn Strategy>; 6] = [
        Box::new(Exact::new(sources).expect("exact builds")),
        Box::new(Tiled::new(sources).expect("tiled builds")),
        Box::new(HashGrid::new(sources).expect("hash-grid builds")),
        Box::new(SortedGrid::new(sources).expect("sorted-grid builds")),
        Box::new(ViewGrid::new(sources).expect("view-grid builds")),
        Box::new(SplatCompute::new(sources).expect("splat-compute builds")),
    ];
    let with_radii = |mut strategy: Box<dyn Strategy>| {
        strategy.set("r_max", &r_max.to_string()).expect("r_max is a parameter");
        strategy.set("r_min", &r_min.to_string()).expect("r_min is a parameter");
        strategy
    };
    all.into_iter().map(with_radii).collect()
}

impl Lab {
    /// The lab on the test adapter; `None`, with a message, where there is none.
    ///
    /// # Panics
    /// If a shader is invalid.
    pub fn open() -> Option<Self> {
        Some(Self::on(Gpu::for_tests()?))
    }

    /// As [`Self::open`], on a device that blends 32-bit floats where the adapter can.
    ///
    /// # Panics
    /// As [`Self::open`].
    pub fn open_blending() -> Option<Self> {
        Gpu::for_tests_with(Features::FLOAT32_BLENDABLE).or_else(Gpu::for_tests).map(Self::on)
    }

    /// As [`Self::open`], on an adapter that has what `backend` needs, and a device that has no more.
    ///
    /// # Panics
    /// As [`Self::open`].
    pub fn open_with(backend: RayBackend) -> Option<Self> {
        if !backend.is_built() {
            println!("SKIPPED: built without the feature `{}`", backend.name());
            return None;
        }
        Some(Self::on(Gpu::for_tests_with(backend.features())?))
    }

    /// The lab once for each backend that traces by what the device has.
    ///
    /// # Panics
    /// As [`Self::open`].
    pub fn open_with_each() -> Vec<(Self, RayBackend)> {
        let open = |backend| Some((Self::open_with(backend)?, backend));
        [RayBackend::RayQuery, RayBackend::Pipeline].into_iter().filter_map(open).collect()
    }

    fn on(gpu: Gpu) -> Self {
        let sources = shaders();
        Self {
            executor: Executor::new(&gpu),
            frame_index: 0,
            visibility: Visibility::new(&sources).expect("visibility.wgsl is valid"),
            gbuffer: GBufferPass::new(&sources).expect("gbuffer.wgsl is valid"),
            direct: DirectLight::new(&sources).expect("direct.wgsl is valid"),
            path: PathTrace::new(&sources).expect("path_trace.wgsl is valid"),
            tracing: PhotonTracing::new(&sources).expect("the photon shaders are valid"),
            rays: TraceRays::new(&sources).expect("trace_rays.wgsl is valid"),
            gpu,
            sources,
        }
    }

    /// The scene in GPU memory.
    ///
    /// # Panics
    /// If the device cannot hold it.
    pub fn upload(&self, scene: &Scene) -> GpuScene {
        GpuScene::upload(&self.gpu.device, &self.gpu.queue, scene).expect("the scene fits the device")
    }

    /// Runs a frame.
    ///
    /// # Panics
    /// If the graph refuses it.
    pub fn run(&mut self, graph: Graph<'_>) -> FrameOutput {
        self.executor.execute(graph).unwrap_or_else(|error| panic!("the frame runs: {error}"))
    }

    /// Path-traces `samples` paths per pixel, each scattered at up to `bounces` surfaces before the visible one. Without
    /// light tracing: for scenes without caustics of punctual lights.
    pub fn path(&mut self, scene: &GpuScene, view: &View, samples: u32, seed: u32, bounces: u32) -> PathImages {
        let camera = uniform(scene, view);
        let (mut direct, mut indirect) = (Accumulator::default(), Accumulator::default());
        for frame in 0..samples {
            let mut graph = Graph::new("path");
            let handles = scene.declare(&mut graph);
            let settings = PathSettings { seed, frame, max_bounces: bounces };
            let layers = self.path.add(&mut graph, &handles, &scene.info(), &camera, None, settings);
            let reads = [graph.readback_texture(&layers.direct), graph.readback_texture(&layers.indirect)];
            let output = self.run(graph);
            direct.add(&image(&output, view.size, reads[0]));
            indirect.add(&image(&output, view.size, reads[1]));
        }
        PathImages { direct: direct.finish(), indirect: indirect.finish() }
    }

    /// Emitted and direct light at the G-buffer's points, with `emissive_samples` shadow rays to area lights, and where
    /// something is seen.
    pub fn direct(&mut self, scene: &GpuScene, view: &View, seed: u32, emissive_samples: u32) -> (Image, Vec<[f32; 4]>) {
        let camera = uniform(scene, view);
        let mut graph = Graph::new("direct");
        let handles = scene.declare(&mut graph);
        let gbuffer = self.gbuffer(&mut graph, scene, &handles, &camera);
        let settings = DirectSettings { seed, frame: 0, emissive_samples };
        let direct = self.direct.add(&mut graph, &handles, &scene.info(), &camera, &gbuffer, settings);
        let (radiance, position) = (graph.readback_texture(&direct), graph.readback_texture(&gbuffer.position));
        let output = self.run(graph);
        (image(&output, view.size, radiance), output.cast(position))
    }

    /// Traces photons and reads them back.
    pub fn photons(&mut self, scene: &GpuScene, settings: &PhotonSettings) -> Traced {
        self.photons_by(Emission::Uniform, scene, settings)
    }

    /// Traces photons that leave the lights by `emission` and reads them back.
    pub fn photons_by(&mut self, emission: Emission, scene: &GpuScene, settings: &PhotonSettings) -> Traced {
        let mut graph = Graph::new("photons");
        let handles = scene.declare(&mut graph);
        let photons = self.tracing.add(&mut graph, &handles, &scene.info().with_emission(emission), settings);
        let reads = read_photons(&mut graph, &photons);
        let output = self.run(graph);
        traced(&output, reads)
    }

    /// Traces photons that follow reflective shadow maps and reads them back.
    pub fn photons_by_maps(&mut self, scene: &GpuScene, settings: &PhotonSettings, maps: RsmSettings) -> Traced {
        let mut graph = Graph::new("photons");
        let handles = scene.declare(&mut graph);
        let photons = self.trace_by_maps(&mut graph, scene, &handles, settings, maps);
        let reads = read_photons(&mut graph, &photons);
        let output = self.run(graph);
        traced(&output, reads)
    }

    fn trace_by_maps(
        &self,
        graph: &mut Graph<'_>,
        scene: &GpuScene,
        handles: &SceneHandles,
        settings: &PhotonSettings,
        maps: RsmSettings,
    ) -> Photons {
        let rsm = Rsm::new(&self.sources).expect("the maps' shaders are valid");
        let maps = rsm.add(graph, handles, &scene.info(), maps);
        self.tracing.add_from(graph, handles, &scene.info(), settings, &rsm.source(&maps))
    }

    /// One frame: a G-buffer, one set of photons, and what each strategy makes of them.
    ///
    /// # Panics
    /// If a strategy refuses the frame.
    pub fn estimate(&mut self, scene: &GpuScene, view: &View, frame: Frame, strategies: &mut [Box<dyn Strategy>]) -> Estimates {
        self.estimate_by(Emission::Uniform, scene, view, frame, strategies)
    }

    /// As [`Self::estimate`], from photons that leave the lights by `emission`; without maps.
    ///
    /// # Panics
    /// As [`Self::estimate`].
    pub fn estimate_by(
        &mut self,
        emission: Emission,
        scene: &GpuScene,
        view: &View,
        frame: Frame,
        strategies: &mut [Box<dyn Strategy>],
    ) -> Estimates {
        let camera = uniform(scene, view);
        let mut graph = Graph::new("estimate");
        let handles = scene.declare(&mut graph);
        let gbuffer = self.gbuffer(&mut graph, scene, &handles, &camera);
        let photons = match frame.maps {
            None => self.tracing.add(&mut graph, &handles, &scene.info().with_emission(emission), &frame.photons),
            Some(maps) => self.trace_by_maps(&mut graph, scene, &handles, &frame.photons, maps),
        };
        self.gather(graph, scene, &handles, &camera, (&gbuffer, &photons), frame, strategies)
    }

    /// As [`Self::estimate`], from a G-buffer and photons that the caller imported.
    ///
    /// # Panics
    /// If a strategy refuses the frame.
    #[expect(clippy::too_many_arguments, reason = "a frame's parts, each a different thing")]
    pub fn gather(
        &mut self,
        mut graph: Graph<'_>,
        scene: &GpuScene,
        handles: &SceneHandles,
        camera: &CameraUniform,
        (gbuffer, photons): (&GBuffer, &Photons),
        frame: Frame,
        strategies: &mut [Box<dyn Strategy>],
    ) -> Estimates {
        let info = scene.info();
        let inputs = FrameInputs {
            scene: handles,
            info: &info,
            gbuffer,
            photons: Some(photons),
            camera,
            size: camera.size,
            frame_index: self.frame_index,
            seed: frame.photons.seed,
            max_bounces: frame.photons.max_bounces,
            deterministic: frame.deterministic,
        };
        let mut reads = Vec::new();
        for strategy in strategies {
            let estimate = strategy.declare(&mut graph, &inputs).expect("the strategy takes the frame");
            let caustic = estimate.caustic.map(|caustic| graph.readback_texture(&caustic));
            reads.push((graph.readback_texture(&estimate.indirect), caustic));
        }
        let records = read_photons(&mut graph, photons);
        let position = graph.readback_texture(&gbuffer.position);
        let output = self.run(graph);
        let layers = |&(indirect, caustic): &(Readback, Option<Readback>)| {
            let indirect = image(&output, camera.size, indirect);
            let black = Image { size: camera.size, pixels: vec![[0.0; 3]; indirect.pixels.len()] };
            [indirect, caustic.map_or(black, |read| image(&output, camera.size, read))]
        };
        Estimates {
            positions: output.cast(position),
            traced: traced(&output, records),
            layers: reads.iter().map(layers).collect(),
            memory: output.memory,
        }
    }

    /// Nearest hits of rays.
    pub fn rays(&mut self, scene: &GpuScene, rays: &[Ray]) -> Vec<RayHit> {
        let mut graph = Graph::new("rays");
        let handles = scene.declare(&mut graph);
        let buffer = crate::synthetic::buffer(&self.gpu, "rays", rays);
        let desc = lightloom_graph::BufferDesc::array_of::<Ray>(rays.len() as u64);
        let rays_handle = graph.import_buffer("rays", desc, buffer);
        let hits = self.rays.add(&mut graph, &handles, &rays_handle, rays.len() as u32);
        let read = graph.readback_buffer(&hits);
        self.run(graph).cast(read)
    }

    fn gbuffer(&self, graph: &mut Graph<'_>, scene: &GpuScene, handles: &SceneHandles, camera: &CameraUniform) -> GBuffer {
        let visibility = self.visibility.add(graph, handles, camera, scene.info().triangle_count);
        self.gbuffer.add(graph, handles, camera, &visibility)
    }
}

/// The view as shaders see it.
fn uniform(scene: &GpuScene, view: &View) -> CameraUniform {
    CameraUniform::new(&view.camera, view.size, view.jitter, scene.info().bounds_radius)
}

fn image(output: &FrameOutput, size: [u32; 2], read: Readback) -> Image {
    Image::from_rgba(size, &output.cast::<[f32; 4]>(read))
}

fn read_photons(graph: &mut Graph<'_>, photons: &Photons) -> [Readback; 2] {
    [graph.readback_buffer(&photons.records), graph.readback_buffer(&photons.state)]
}

fn traced(output: &FrameOutput, [records, state]: [Readback; 2]) -> Traced {
    let state = output.cast::<PhotonState>(state)[0];
    let mut records = output.cast::<Photon>(records);
    records.truncate(state.stored as usize);
    Traced { records, state }
}

/// Description of each texture of a G-buffer of `size`: position, surface, emission.
pub(crate) fn gbuffer_descs(size: [u32; 2]) -> [TextureDesc; 3] {
    [radiance_desc(size), TextureDesc::new_2d(size, TextureFormat::Rgba32Uint), radiance_desc(size)]
}

/// The three textures as a G-buffer.
pub(crate) fn gbuffer_of([position, surface, emission]: [Handle<Texture>; 3]) -> GBuffer {
    GBuffer { position, surface, emission, motion: None }
}
