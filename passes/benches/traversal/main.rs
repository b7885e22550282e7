//! Rays per second of the WGSL traversal beside the device's ray queries and ray-tracing pipelines, where it has any, beside the same
//! hierarchy traversed on the CPU by its own crate, and beside Embree, where its Python package is installed, in one run.
//!
//! `cargo bench -p lightloom-passes --bench traversal [--features ray-pipeline] [-- SCENE.glb]`; without a scene, a built-in one. Coherent rays are a camera's, diffuse
//! ones leave their hits with a cosine distribution. GPU time is the pass's own; the first dispatch, which includes the
//! driver's compilation, is not counted. The CPU's two use every core and trace ray by ray. Rounds alternate between the
//! five, and the best of each counts. Agreement is the share of rays that met the same triangle as in WGSL; where surfaces
//! coincide, several are right.

mod embree;

use embree::Embree;
use glam::Vec3;
use lightloom_graph::{BufferDesc, Executor, Gpu, GpuRequest, Graph};
use lightloom_passes::scene::{Alpha, Bvh, GpuScene, Scene, builtin};
use lightloom_passes::{Ray, RayBackend, RayHit, TraceRays};
use std::error::Error;
use std::path::Path;
use std::time::Instant;

const WIDTH: u32 = 1024;
const HEIGHT: u32 = 512;
const REPEATS: u32 = 3;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    let mut scene = match &path {
        Some(path) => Scene::load(Path::new(path))?,
        None => builtin::caustics(),
    };
    // The CPU knows no alpha: both sides meet whole triangles.
    for material in &mut scene.materials {
        material.alpha = Alpha::Opaque;
    }
    let gpu = Gpu::new(&RayBackend::enable(None, GpuRequest::default()))?;
    let bvh = Bvh::build(&scene.name, &scene.triangles)?;
    let upload = || GpuScene::upload_with_bvh(&gpu.device, &gpu.queue, &scene, &bvh);
    let by = |backend| RayBackend::choose(Some(backend), &gpu).ok().map(|backend| upload()?.with_rays(backend)).transpose();
    let (queried, pipelined) = (by(RayBackend::RayQuery)?, by(RayBackend::Pipeline)?);
    let stats = bvh.stats();
    println!(
        "{}: {} triangles, {} nodes, built in {:.0} ms; {}",
        scene.name,
        stats.triangles,
        stats.nodes,
        stats.build_time.as_secs_f64() * 1e3,
        gpu.adapter_name()
    );

    let coherent = camera_rays(&scene)?;
    let pass = TraceRays::new(&lightloom_passes::shaders())?;
    let embree = Embree::start(&scene.triangles)?;
    if embree.is_none() {
        println!("Embree: none; `{}` brings it", embree::INSTALL);
    }
    let mut bench = Bench { executor: Executor::new(&gpu), pass, traversed: upload()?, queried, pipelined, embree };
    let [query, pipeline, cpu, embree] = ["ray query", "ray pipeline", "CPU (obvhs)", "Embree"];
    println!("{:<10} {:>8} {query:>27} {pipeline:>27} {cpu:>27} {embree:>27}", "Mray/s", "WGSL");
    let hits = bench.compare("coherent", &bvh, &coherent)?;
    let diffuse = bounce_rays(&scene, &coherent, &hits);
    bench.compare("diffuse", &bvh, &diffuse)?;
    Ok(())
}

struct Bench {
    executor: Executor,
    pass: TraceRays,
    traversed: GpuScene,
    /// `None`: the adapter has no ray queries.
    queried: Option<GpuScene>,
    /// `None`: the adapter or this build has no ray-tracing pipelines.
    pipelined: Option<GpuScene>,
    /// `None`: it is not installed.
    embree: Option<Embree>,
}

impl Bench {
    fn compare(&mut self, name: &str, bvh: &Bvh, rays: &[Ray]) -> Result<Vec<RayHit>, Box<dyn Error>> {
        let [mut wgsl, mut query, mut pipeline] = <[Best<RayHit>; 3]>::default();
        let [mut cpu, mut embree] = <[Best<u32>; 2]>::default();
        for repeat in 0..=REPEATS {
            let counts = repeat > 0;
            wgsl.take(counts, trace(&mut self.executor, &self.pass, &self.traversed, rays)?);
            if let Some(queried) = &self.queried {
                query.take(counts, trace(&mut self.executor, &self.pass, queried, rays)?);
            }
            if let Some(pipelined) = &self.pipelined {
                pipeline.take(counts, trace(&mut self.executor, &self.pass, pipelined, rays)?);
            }
            let start = Instant::now();
            let hits = trace_on_cpu(bvh, rays);
            cpu.take(counts, (hits, start.elapsed().as_secs_f64() * 1e3));
            if let Some(process) = &mut self.embree {
                embree.take(counts, process.trace(rays)?);
            }
        }
        let rate = |ms: f64| rays.len() as f64 / ms / 1e3;
        let column = |ids: Vec<u32>, ms: f64| {
            if ids.is_empty() {
                return "none".to_owned();
            }
            let agree = ids.iter().zip(&wgsl.hits).filter(|(id, hit)| **id == hit.triangle).count();
            format!("{:.2} (WGSL {:.2}×, {:.2}%)", rate(ms), ms / wgsl.ms, 100.0 * agree as f64 / rays.len() as f64)
        };
        let met = |hits: &[RayHit]| hits.iter().map(|hit| hit.triangle).collect();
        println!(
            "{name:<10} {:>8.2} {:>27} {:>27} {:>27} {:>27}",
            rate(wgsl.ms),
            column(met(&query.hits), query.ms),
            column(met(&pipeline.hits), pipeline.ms),
            column(cpu.hits, cpu.ms),
            column(embree.hits, embree.ms),
        );
        Ok(wgsl.hits)
    }
}

/// The latest hits, and the least time of all (ms).
struct Best<T> {
    hits: Vec<T>,
    ms: f64,
}

impl<T> Default for Best<T> {
    fn default() -> Self {
        Self { hits: Vec::new(), ms: f64::INFINITY }
    }
}

impl<T> Best<T> {
    fn take(&mut self, counts: bool, (hits, ms): (Vec<T>, f64)) {
        self.hits = hits;
        if counts {
            self.ms = self.ms.min(ms);
        }
    }
}

/// The hits, and the time of the pass (ms).
fn trace(
    executor: &mut Executor,
    pass: &TraceRays,
    scene: &GpuScene,
    rays: &[Ray],
) -> Result<(Vec<RayHit>, f64), Box<dyn Error>> {
    let device = executor.device();
    let buffer = lightloom_graph::wgpu::util::DeviceExt::create_buffer_init(
        device,
        &lightloom_graph::wgpu::util::BufferInitDescriptor {
            label: Some("rays"),
            contents: bytemuck::cast_slice(rays),
            usage: lightloom_graph::wgpu::BufferUsages::STORAGE,
        },
    );
    let mut graph = Graph::new("traversal");
    let handles = scene.declare(&mut graph);
    let handle = graph.import_buffer("rays", BufferDesc::array_of::<Ray>(rays.len() as u64), buffer);
    let hits = pass.add(&mut graph, &handles, &handle, rays.len() as u32);
    let readback = graph.readback_buffer(&hits);
    let output = executor.execute(graph)?;
    let ms = output
        .passes
        .iter()
        .find(|pass| &*pass.name == "trace_rays")
        .and_then(|pass| pass.gpu_ms)
        .ok_or("the adapter has no timestamps")?;
    Ok((output.cast(readback), ms))
}

fn camera_rays(scene: &Scene) -> Result<Vec<Ray>, Box<dyn Error>> {
    let camera = scene.camera(None)?;
    let tan = (0.5 * camera.yfov).tan();
    let aspect = WIDTH as f32 / HEIGHT as f32;
    let ray = |i: u32| {
        // Tiles of 8 × 8 pixels, as a renderer would launch them.
        let (tile, inside) = (i / 64, i % 64);
        let tiles_x = WIDTH / 8;
        let (x, y) = ((tile % tiles_x) * 8 + inside % 8, (tile / tiles_x) * 8 + inside / 8);
        let ndc = [(x as f32 + 0.5) / WIDTH as f32 * 2.0 - 1.0, 1.0 - (y as f32 + 0.5) / HEIGHT as f32 * 2.0];
        let view = Vec3::new(ndc[0] * tan * aspect, ndc[1] * tan, -1.0);
        let direction = camera.world_from_view.transform_vector3(view).normalize();
        Ray { origin: camera.position_world().to_array(), t_max: f32::MAX, direction: direction.to_array(), seen: 0 }
    };
    Ok((0..WIDTH * HEIGHT).map(ray).collect())
}

/// Where the rays hit, on with a cosine distribution (a hash of the index is random enough to scatter them).
fn bounce_rays(scene: &Scene, rays: &[Ray], hits: &[RayHit]) -> Vec<Ray> {
    let mut state = 0x9e37_79b9_u32;
    let mut random = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        (state >> 8) as f32 / 16_777_216.0
    };
    rays.iter()
        .zip(hits)
        .filter(|(_, hit)| hit.triangle != RayHit::NONE)
        .map(|(ray, hit)| {
            let (origin, direction) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
            let normal = scene.triangles[hit.triangle as usize].normal_world();
            let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
            let sphere = {
                let z = 1.0 - 2.0 * random();
                let phi = std::f32::consts::TAU * random();
                let r = (1.0 - z * z).max(0.0).sqrt();
                Vec3::new(r * phi.cos(), r * phi.sin(), z)
            };
            let on = (normal + 0.9999 * sphere).normalize();
            let from = origin + direction * hit.t + normal * 1e-3;
            Ray { origin: from.to_array(), t_max: f32::MAX, direction: on.to_array(), seen: 0 }
        })
        .collect()
}

fn trace_on_cpu(bvh: &Bvh, rays: &[Ray]) -> Vec<u32> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let chunk = rays.len().div_ceil(threads).max(1);
    let trace = |ray: &Ray| {
        bvh.closest_hit(ray.origin.into(), ray.direction.into(), 0.0, ray.t_max).map_or(RayHit::NONE, |hit| hit.triangle)
    };
    std::thread::scope(|scope| {
        let parts: Vec<_> =
            rays.chunks(chunk).map(|part| scope.spawn(move || part.iter().map(trace).collect::<Vec<_>>())).collect();
        parts.into_iter().flat_map(|part| part.join().unwrap_or_default()).collect()
    })
}
