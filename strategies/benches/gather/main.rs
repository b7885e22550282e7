//! Milliseconds of each strategy beside a kd-tree (crate `kiddo`, f32) that gathers the same photons at the same pixels on all cores, in
//! one run; and how they grow with photons and pixels.
//!
//! `RUSTFLAGS="-C target-cpu=native" cargo bench --manifest-path strategies/benches/Cargo.toml -- SCENE.glb… [--photons 500000,…] [--sizes
//! 960x540,…] [--strategies tiled,…] [--radius M] [--table FILE.md]`; a scene may be `builtin:NAME`, and is `builtin:cornell` when not given. Surfaces
//! are Lambertian and radii constant, at their automatic value for the first number of photons, so that all sums are the same. With
//! `--table` all is also written as a table of strategies and scenes, beside what [MML13] measured. Photons and points are made once; a
//! strategy's time is that of its own passes. Rounds alternate between the strategies, and the best of each counts; the
//! first, which compiles the shaders, does not. The tree's photons are decoded beforehand; its time is build and gathering. CPU times are of all
//! cores together, and of little weight where the adapter is not a software one.
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping, Mara, McGuire and Luebke, I3D 2013"

mod kdtree;
mod table;

use clap::Parser;
use glam::Vec3;
use kdtree::{Gathered, Point};
use lightloom_graph::wgpu::{self, util::DeviceExt};
use lightloom_graph::{BufferDesc, Executor, FrameOutput, Gpu, GpuRequest, Graph, Readback, TextureDesc};
use lightloom_passes::scene::{GpuScene, Scene, builtin};
use lightloom_passes::{
    CameraUniform, DepositCull, GBuffer, GBufferPass, Photon, PhotonSettings, PhotonState, PhotonTracing, Photons, Visibility,
    shaders,
};
use lightloom_strategies::{FrameInputs, KernelRadius, Strategy, by_name};
use std::error::Error;
use std::path::{Path, PathBuf};
use table::Table;

#[derive(Parser)]
struct Args {
    /// glTF files, their paths counted from `strategies/benches`, or builtin:NAME.
    scenes: Vec<PathBuf>,
    /// Photons emitted.
    #[arg(long, value_delimiter = ',', default_value = "500000")]
    photons: Vec<u32>,
    /// Image sizes.
    #[arg(long, value_delimiter = ',', default_value = "960x540", value_parser = size)]
    sizes: Vec<[u32; 2]>,
    /// What to measure.
    #[arg(long, value_delimiter = ',', default_value = "tiled,hash-grid,sorted-grid,view-grid")]
    strategies: Vec<String>,
    /// Radius of the kernels (m).
    #[arg(long)]
    radius: Option<f32>,
    /// Surfaces that light is scattered at before the visible one.
    #[arg(long, default_value_t = 3)]
    bounces: u32,
    /// Rounds, of which the best counts.
    #[arg(long, default_value_t = 3)]
    rounds: u32,
    /// Show the passes.
    #[arg(long)]
    passes: bool,
    /// Leave the tree out.
    #[arg(long)]
    no_tree: bool,
    /// Also write a Markdown table of strategies and scenes. Paths count from `strategies/benches`.
    #[arg(long)]
    table: Option<PathBuf>,
    /// Passed by cargo.
    #[arg(long, hide = true)]
    bench: bool,
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let (width, height) = text.split_once('x').ok_or("WIDTHxHEIGHT is needed")?;
    let side = |text: &str| text.parse().map_err(|error| format!("{text}: {error}"));
    Ok([side(width)?, side(height)?])
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = Args::parse();
    if args.scenes.is_empty() {
        args.scenes.push("builtin:cornell".into());
    }
    if let Some(path) = &args.table {
        // What cannot be written is told before minutes of measuring.
        let opened = std::fs::File::options().create(true).append(true).open(path);
        opened.map_err(|error| format!("{}: {error}; cargo bench runs in the package's folder", path.display()))?;
    }
    let gpu = Gpu::new(&GpuRequest::default())?;
    let mut table = Table::new(&gpu.adapter_name());
    for path in &args.scenes {
        let mut scene = load(path)?;
        for material in &mut scene.materials {
            material.metallic = 0.0;
        }
        scene.make_lambert();
        let mut bench = Bench::new(&gpu, &scene)?;
        let radius = match args.radius {
            Some(radius) => radius,
            None => KernelRadius::default().resolve(&bench.scene.info(), args.photons[0])?.r_max_m,
        };
        println!("{}, radius {radius:.4} m, {} bounces; {}", scene.name, args.bounces, gpu.adapter_name());
        println!(
            "{:>9} {:>10} {:>9}  {:<14} {:>9} {:>9} {:>9} {:>9}",
            "photons", "size", "stored", "strategy", "ms", "CPU ms", "faster", "MiB"
        );
        for &photons in &args.photons {
            for &size in &args.sizes {
                let stored = bench.compare(&args, photons, size, radius, |strategy, ms| table.add(strategy, ms))?;
                table.finish_column(&scene.name, size, stored);
            }
        }
    }
    if let Some(path) = &args.table {
        std::fs::write(path, table.markdown()).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(())
}

fn load(path: &Path) -> Result<Scene, Box<dyn Error>> {
    match path.to_str().and_then(|path| path.strip_prefix("builtin:")) {
        Some(name) => Ok(builtin::by_name(name).ok_or_else(|| format!("{name}: there is no such built-in scene"))?),
        None => Ok(Scene::load(path)?),
    }
}

struct Bench {
    executor: Executor,
    scene: GpuScene,
    camera: lightloom_passes::scene::Camera,
    visibility: Visibility,
    gbuffer: GBufferPass,
    tracing: PhotonTracing,
}

/// What every strategy is given: photons and the points they are gathered at, on the GPU and on the CPU.
struct Inputs {
    camera: CameraUniform,
    settings: PhotonSettings,
    records: wgpu::Buffer,
    state: wgpu::Buffer,
    position: wgpu::Texture,
    surface: wgpu::Texture,
    photons: Vec<Photon>,
    points: Vec<Point>,
}

impl Bench {
    fn new(gpu: &Gpu, scene: &Scene) -> Result<Self, Box<dyn Error>> {
        let sources = shaders();
        Ok(Self {
            executor: Executor::new(gpu),
            scene: GpuScene::upload(&gpu.device, &gpu.queue, scene)?,
            camera: scene.camera(None)?,
            visibility: Visibility::new(&sources)?,
            gbuffer: GBufferPass::new(&sources)?,
            tracing: PhotonTracing::new(&sources)?,
        })
    }

    fn inputs(&mut self, args: &Args, photons: u32, size: [u32; 2], radius: f32) -> Result<Inputs, Box<dyn Error>> {
        let info = self.scene.info();
        let camera = CameraUniform::new(&self.camera, size, [0.5; 2], info.bounds_radius);
        let mut settings = PhotonSettings::new(photons, args.bounces, 7);
        settings.cull = Some(DepositCull::new(&camera, radius));

        let mut graph = Graph::new("inputs");
        let handles = self.scene.declare(&mut graph);
        let visibility = self.visibility.add(&mut graph, &handles, &camera, info.triangle_count);
        let gbuffer = self.gbuffer.add(&mut graph, &handles, &camera, &visibility);
        let photons = self.tracing.add(&mut graph, &handles, &info, &settings);
        let (records, state) = (graph.readback_buffer(&photons.records), graph.readback_buffer(&photons.state));
        let (position, surface) = (graph.readback_texture(&gbuffer.position), graph.readback_texture(&gbuffer.surface));
        let output = self.executor.execute(graph)?;

        let counts = output.cast::<PhotonState>(state)[0];
        if counts.dropped > 0 {
            println!("{} of {} photons found no room", counts.dropped, counts.total);
        }
        let mut photons = output.cast::<Photon>(records);
        photons.truncate(counts.stored as usize);
        let eye = Vec3::from(camera.position_world());
        let texels = output.cast::<[f32; 4]>(position).into_iter().zip(output.cast::<[u32; 4]>(surface));
        let points = texels.map(|(position, surface)| Point::new(position, surface, eye)).collect();
        // A store with room for what lies in it: the passes run over its capacity.
        settings.capacity = counts.stored.max(1);
        let stored = u64::from(settings.capacity) * size_of::<Photon>() as u64;
        Ok(Inputs {
            records: self.buffer(&output.bytes(records)[..stored as usize]),
            state: self.buffer(output.bytes(state)),
            position: self.texture(size, wgpu::TextureFormat::Rgba32Float, output.bytes(position)),
            surface: self.texture(size, wgpu::TextureFormat::Rgba32Uint, output.bytes(surface)),
            camera,
            settings,
            photons,
            points,
        })
    }

    fn buffer(&self, contents: &[u8]) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::STORAGE;
        let descriptor = wgpu::util::BufferInitDescriptor { label: Some("inputs"), contents, usage };
        self.executor.device().create_buffer_init(&descriptor)
    }

    fn texture(&self, [width, height]: [u32; 2], format: wgpu::TextureFormat, contents: &[u8]) -> wgpu::Texture {
        let descriptor = wgpu::TextureDescriptor {
            label: Some("inputs"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        };
        let order = wgpu::util::TextureDataOrder::LayerMajor;
        self.executor.device().create_texture_with_data(self.executor.queue(), &descriptor, order, contents)
    }

    /// One frame of `strategy` and nothing else.
    fn run(&mut self, inputs: &Inputs, strategy: &mut dyn Strategy) -> Result<(FrameOutput, Readback), Box<dyn Error>> {
        let mut graph = Graph::new(strategy.name());
        let handles = self.scene.declare(&mut graph);
        let info = self.scene.info();
        let (camera, settings) = (&inputs.camera, &inputs.settings);
        let image = |format| TextureDesc::new_2d(camera.size, format);
        let float = image(wgpu::TextureFormat::Rgba32Float);
        let surface = image(wgpu::TextureFormat::Rgba32Uint);
        let gbuffer = GBuffer {
            position: graph.import_texture("position", float.clone(), inputs.position.clone()),
            surface: graph.import_texture("surface", surface, inputs.surface.clone()),
            emission: graph.import_texture("emission", float, None),
            motion: None,
        };
        let records = BufferDesc::array_of::<Photon>(settings.capacity.into());
        let photons = Photons {
            records: graph.import_buffer("photons", records, inputs.records.clone()),
            state: graph.import_buffer("photon_state", BufferDesc::array_of::<PhotonState>(1), inputs.state.clone()),
            capacity: settings.capacity,
            emitted: settings.emitted,
        };
        let frame = FrameInputs {
            scene: &handles,
            info: &info,
            gbuffer: &gbuffer,
            photons: Some(&photons),
            camera,
            size: camera.size,
            frame_index: 0,
            seed: settings.seed,
            max_bounces: settings.max_bounces,
            deterministic: false,
        };
        let estimate = strategy.declare(&mut graph, &frame)?;
        let read = graph.readback_texture(&estimate.indirect);
        Ok((self.executor.execute(graph)?, read))
    }

    /// Prints what each took and hands it to `told`; returns how many photons were stored.
    fn compare(
        &mut self,
        args: &Args,
        photons: u32,
        size: [u32; 2],
        radius: f32,
        mut told: impl FnMut(&str, f64),
    ) -> Result<usize, Box<dyn Error>> {
        let inputs = self.inputs(args, photons, size, radius)?;
        let mut measured = Vec::new();
        for name in &args.strategies {
            let mut strategy = by_name(name)?;
            strategy.set("radius", &radius.to_string())?;
            measured.push(Measured { strategy, ms: f64::INFINITY, cpu_ms: f64::INFINITY, image: Vec::new(), bytes: 0 });
        }
        let mut tree: Option<Gathered> = None;
        for round in 0..=args.rounds {
            for Measured { strategy, ms, cpu_ms, image, bytes } in &mut measured {
                let before = process_cpu_ms();
                let (output, read) = self.run(&inputs, &mut **strategy)?;
                let cpu = process_cpu_ms() - before;
                let passes = output.passes.iter().filter(|pass| !pass.name.starts_with("readback"));
                let times = passes.map(|pass| Ok((&pass.name, pass.gpu_ms.ok_or("the adapter times no passes")?)));
                let times: Vec<_> = times.collect::<Result<_, Box<dyn Error>>>()?;
                *bytes = output.memory.allocated_bytes;
                if round == 0 {
                    *image = output.cast::<[f32; 4]>(read);
                    continue;
                }
                *ms = ms.min(times.iter().map(|(_, ms)| ms).sum());
                *cpu_ms = cpu_ms.min(cpu);
                if args.passes && round == args.rounds {
                    times.iter().for_each(|(name, ms)| println!("    {name:<24} {ms:>9.2}"));
                }
            }
            if !args.no_tree && round > 0 {
                let gathered = kdtree::gather(&inputs.photons, &inputs.points, radius)?;
                if tree.as_ref().is_none_or(|best| gathered.ms() < best.ms()) {
                    tree = Some(gathered);
                }
            }
        }
        let head = format!("{photons:>9} {:>10} {:>9}", format!("{}x{}", size[0], size[1]), inputs.photons.len());
        if let Some(tree) = &tree {
            let reach = tree.found as f64 / inputs.points.len() as f64;
            let note = format!("build {:.1} ms; {reach:.0} photons in reach of a pixel", tree.build_ms);
            println!("{head}  {:<14} {:>9.1} {:>9.1} {:>9}           {note}", "kiddo", tree.ms(), tree.cpu_ms, "1");
            told("kiddo (kd-tree, CPU)", tree.ms());
        }
        for Measured { strategy, ms, cpu_ms, image, bytes } in &measured {
            let (mut faster, mut agreement) = (String::new(), String::new());
            if let Some(tree) = &tree {
                let [mean, rms] = kdtree::compare(image, &tree.radiance);
                faster = format!("{:.2} x", tree.ms() / ms);
                agreement = format!("mean {mean:.6} of the tree's, rms difference {rms:.1e}");
            }
            let mib = *bytes as f64 / f64::from(1 << 20);
            println!("{head}  {:<14} {ms:>9.1} {cpu_ms:>9.1} {faster:>9} {mib:>9.0} {agreement}", strategy.name());
            told(strategy.name(), *ms);
        }
        Ok(inputs.photons.len())
    }
}

struct Measured {
    strategy: Box<dyn Strategy>,
    ms: f64,
    cpu_ms: f64,
    image: Vec<[f32; 4]>,
    bytes: u64,
}

/// Time that all threads of this process have run (ms): what a software adapter takes whatever else runs. Not a number where the system does not
/// tell.
fn process_cpu_ms() -> f64 {
    const MS_PER_TICK: f64 = 10.0;
    let ticks = || {
        let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
        let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
        Some(fields.next()?.parse::<f64>().ok()? + fields.next()?.parse::<f64>().ok()?)
    };
    ticks().map_or(f64::NAN, |ticks| ticks * MS_PER_TICK)
}
