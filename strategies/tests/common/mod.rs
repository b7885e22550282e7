//! Photons and a G-buffer made on the CPU, and a run of one strategy on them.

#![allow(dead_code, reason = "each test program uses some of it")]

pub(crate) mod filter_rig;

use glam::{Mat4, Vec3};
use lightloom_graph::wgpu::{self, util::DeviceExt};
use lightloom_graph::{BufferDesc, Executor, Gpu, Graph, Handle, Texture, TextureDesc, bytemuck};
use lightloom_passes::scene::{Camera, SceneHandles, SceneInfo, SceneTraits};
use lightloom_passes::{CameraUniform, GBuffer, Photon, PhotonFlags, PhotonState, Photons, decode_flux, decode_octahedral};
use lightloom_strategies::{Estimate, FrameInputs, Strategy, by_name};

/// A sequence of uniform numbers: `SplitMix64`.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// Uniform in [0, 1).
    pub(crate) fn unit(&mut self) -> f32 {
        (self.word() >> 40) as f32 / (1 << 24) as f32
    }

    /// 64 bits.
    pub(crate) fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform over the cube [−1, 1)³.
    pub(crate) fn cube(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
}

/// Octahedral code of a unit vector, two 16-bit signed components.
pub(crate) fn encode_octahedral(v: Vec3) -> u32 {
    let mut p = v.truncate() / (v.x.abs() + v.y.abs() + v.z.abs());
    if v.z < 0.0 {
        p = glam::Vec2::new((1.0 - p.y.abs()).copysign(p.x), (1.0 - p.x.abs()).copysign(p.y));
    }
    let snorm = |x: f32| u32::from((x.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16);
    snorm(p.x) | (snorm(p.y) << 16)
}

/// Shared-exponent code of a flux (W); truncates.
pub(crate) fn encode_flux(flux: Vec3) -> u32 {
    let exponent = flux.max_element().log2().floor() as i32 + 1;
    let scale = 2.0_f32.powi(8 - exponent);
    let mantissa = |x: f32| (x * scale) as u32;
    mantissa(flux.x) | (mantissa(flux.y) << 8) | (mantissa(flux.z) << 16) | (((exponent + 128) as u32) << 24)
}

/// A photon on a surface of normal `normal`, coming from `from` (unit, away from the surface).
pub(crate) fn photon(position: Vec3, normal: Vec3, from: Vec3, flux: Vec3, probability_half: u32, caustic: bool) -> Photon {
    Photon {
        position: position.into(),
        flux: encode_flux(flux),
        direction: encode_octahedral(-from),
        normal: encode_octahedral(normal),
        length_probability: probability_half << 16,
        bounce_flags: 1 | if caustic { PhotonFlags::CAUSTIC } else { 0 },
    }
}

/// Halves of 1, ½, ¼ and 0: path probabilities.
pub(crate) const PROBABILITIES: [u32; 4] = [0x3c00, 0x3800, 0x3400, 0];

/// What the eye sees, on the CPU.
pub(crate) struct View {
    pub(crate) camera: CameraUniform,
    pub(crate) position: Vec<[f32; 4]>,
    pub(crate) surface: Vec<[u32; 4]>,
}

pub(crate) const VALID: u32 = 1 << 16;
pub(crate) const SPECULAR: u32 = 1 << 17;
pub(crate) const LAMBERT: u32 = 1 << 18;

impl View {
    /// Traces one ray per pixel: `hit` gives distance and normal of what a ray (origin, unit direction) meets.
    /// Base colour is white (Lambert); every 7th pixel is specular, and gathers nothing.
    pub(crate) fn new(camera: CameraUniform, hit: impl Fn(Vec3, Vec3) -> Option<(f32, Vec3)>) -> Self {
        let [width, height] = camera.size;
        let world_from_view = Mat4::from_cols_array_2d(&camera.world_from_view);
        let eye = world_from_view.w_axis.truncate();
        let mut view = Self { camera, position: Vec::new(), surface: Vec::new() };
        for index in 0..width * height {
            let (x, y) = ((index % width) as f32, (index / width) as f32);
            let ndc_x = (x + camera.jitter[0]) / width as f32 * 2.0 - 1.0;
            let ndc_y = 1.0 - (y + camera.jitter[1]) / height as f32 * 2.0;
            let direction = Vec3::new(ndc_x * camera.tan_half[0], ndc_y * camera.tan_half[1], -1.0);
            let direction = world_from_view.transform_vector3(direction).normalize();
            let Some((distance, normal)) = hit(eye, direction) else {
                view.position.push([0.0; 4]);
                view.surface.push([0; 4]);
                continue;
            };
            let point = eye + direction * distance;
            view.position.push([point.x, point.y, point.z, distance]);
            let code = encode_octahedral(normal);
            let specular = if index % 7 == 3 { SPECULAR } else { 0 };
            view.surface.push([code, code, u32::MAX, VALID | LAMBERT | specular | 255]);
        }
        view
    }
}

/// A camera at `eye` that looks at `target`, image of `size` pixels.
pub(crate) fn camera(eye: Vec3, target: Vec3, size: [u32; 2], jitter: [f32; 2]) -> CameraUniform {
    let back = (eye - target).normalize();
    let right = Vec3::Y.cross(back).normalize();
    let world_from_view = Mat4::from_cols(right.extend(0.0), back.cross(right).extend(0.0), back.extend(0.0), eye.extend(1.0));
    let camera = Camera { name: "test".to_owned(), world_from_view, yfov: 1.0 };
    CameraUniform::new(&camera, size, jitter, 10.0)
}

/// The floor y = 0 inside |x|, |z| < 3, and a wall z = −3 up to y = 2; elsewhere nothing.
pub(crate) fn floor_and_wall(origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
    let meets = |t: f32, normal: Vec3, inside: &dyn Fn(Vec3) -> bool| {
        (t.is_finite() && t > 1e-4 && inside(origin + direction * t)).then_some((t, normal))
    };
    let floor = meets(-origin.y / direction.y, Vec3::Y, &|p| p.x.abs() < 3.0 && p.z.abs() < 3.0);
    let wall = meets((-3.0 - origin.z) / direction.z, Vec3::Z, &|p| p.x.abs() < 3.0 && (0.0..2.0).contains(&p.y));
    [floor, wall].into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Photons on the floor and the wall, clustered and spread, some outside the view, behind the eye and around it; after the
/// first `count` follow 100 that are not stored.
pub(crate) fn photons(count: usize) -> Vec<Photon> {
    let mut random = Random(1);
    let mut all = Vec::new();
    for index in 0..count + 100 {
        let spread = if index % 3 == 0 { 0.2 } else { 3.5 };
        let p = random.cube() * spread;
        let (position, normal) = match index % 4 {
            0 => (Vec3::new(p.x, p.y.abs(), -3.0), Vec3::Z),
            _ => (Vec3::new(p.x, 0.0, p.z), Vec3::Y),
        };
        // As on curved surfaces: up to 60° from the normal of the points around, and a little further.
        let normal = (normal + 0.9 * random.cube().normalize_or(Vec3::X)).normalize();
        let from = (normal + 0.9 * random.cube().normalize_or(Vec3::X)).normalize();
        let flux = Vec3::new(1.0, 0.5 + 0.4 * random.unit(), 0.1) * (0.5 + random.unit());
        let probability = PROBABILITIES[(random.word() % 4) as usize];
        all.push(photon(position, normal, from, flux, probability, index % 5 == 0));
    }
    all
}

/// The views: from a distance; from within the photons, low over the floor; turned away from all of them.
pub(crate) fn views(size: [u32; 2]) -> [(&'static str, CameraUniform); 3] {
    [
        ("from a distance", camera(Vec3::new(0.5, 2.0, 5.0), Vec3::new(0.0, 0.5, -1.0), size, [0.5, 0.5])),
        ("within", camera(Vec3::new(0.1, 0.15, 0.2), Vec3::new(0.4, 0.0, -1.0), size, [0.97, 0.03])),
        ("turned away", camera(Vec3::new(0.0, 2.0, 4.0), Vec3::new(0.0, 2.0, 9.0), size, [0.5, 0.5])),
    ]
}

pub(crate) fn strategy(name: &str, settings: &[(&str, &str)]) -> Box<dyn Strategy> {
    let mut strategy = by_name(name).expect("the strategy exists");
    for (key, value) in settings {
        strategy.set(key, value).expect("the parameter exists");
    }
    strategy
}

/// What a pixel sums.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Terms {
    /// Of the terms.
    pub(crate) sum: [f64; 3],
    /// Of their squares.
    pub(crate) squares: [f64; 3],
}

/// [MML13] Eq. 1 for a white Lambertian, with PHYSICS' kernel, in 64-bit floats.
pub(crate) fn density_estimate(position: &[f32; 4], surface: &[u32; 4], photons: &[Photon], r_min: f64, r_max: f64) -> Terms {
    const CUT: f64 = 0.2;
    let point = Vec3::new(position[0], position[1], position[2]).as_dvec3();
    let normal = decode_octahedral(surface[1]);
    let mut terms = Terms::default();
    for photon in photons {
        let rho = [1.0, 0.5, 0.25, 0.0][PROBABILITIES.iter().position(|&p| p == photon.length_probability >> 16).unwrap_or(0)];
        let r = r_min + (r_max - r_min) * f64::sqrt(1.0 - rho);
        let s = Vec3::from(photon.position).as_dvec3().distance(point);
        let from = -decode_octahedral(photon.direction);
        if s >= r || from.dot(normal) <= 0.0 || decode_octahedral(photon.normal).dot(normal) < 0.5 {
            continue;
        }
        let integral = std::f64::consts::PI * r * r * CUT * (CUT * CUT / 3.0 - CUT + 1.0);
        let kernel = CUT.min(1.0 - s / r) / integral;
        let cosine = f64::from(from.dot(normal));
        let flux = decode_flux(photon.flux).as_dvec3().to_array();
        for (channel, flux) in flux.into_iter().enumerate() {
            // The shading-normal correction of equal normals, cos / (cos + 1e-4), is part of the shader's definition.
            let term = flux / std::f64::consts::PI * kernel * cosine / (cosine + 1e-4);
            terms.sum[channel] += term;
            terms.squares[channel] += term * term;
        }
    }
    terms
}

/// What a strategy returned.
#[derive(Debug, PartialEq)]
pub(crate) struct Images {
    pub(crate) indirect: Vec<[f32; 4]>,
    pub(crate) caustic: Vec<[f32; 4]>,
    pub(crate) stats: Vec<(&'static str, u32)>,
}

/// What a strategy that sums irradiance returned.
#[derive(Debug, PartialEq)]
pub(crate) struct IrradianceImages {
    pub(crate) irradiance: Vec<[f32; 4]>,
    pub(crate) direction: Vec<[f32; 4]>,
    pub(crate) indirect: Vec<[f32; 4]>,
}

/// A device and the tests' inputs on it.
pub(crate) struct Bench {
    pub(crate) executor: Executor,
    /// Of what is drawn at random.
    pub(crate) seed: u32,
}

impl Bench {
    /// `None`: no adapter, and that was printed.
    pub(crate) fn new() -> Option<Self> {
        Some(Self { executor: Executor::new(&Gpu::for_tests()?), seed: 0 })
    }

    /// An image of `texels` in the graph.
    pub(crate) fn image<T: bytemuck::NoUninit>(
        &self,
        graph: &mut Graph<'_>,
        name: &str,
        size: [u32; 2],
        format: wgpu::TextureFormat,
        texels: &[T],
    ) -> Handle<Texture> {
        let descriptor = wgpu::TextureDescriptor {
            label: Some(name),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        };
        let (order, contents) = (wgpu::util::TextureDataOrder::LayerMajor, bytemuck::cast_slice(texels));
        let texture = self.executor.device().create_texture_with_data(self.executor.queue(), &descriptor, order, contents);
        graph.import_texture(name, TextureDesc::new_2d(size, format), texture)
    }

    /// The view in the graph.
    pub(crate) fn gbuffer(&self, graph: &mut Graph<'_>, view: &View) -> GBuffer {
        let size = view.camera.size;
        GBuffer {
            position: self.image(graph, "position", size, POSITION, &view.position),
            surface: self.image(graph, "surface", size, SURFACE, &view.surface),
            emission: graph.import_texture("emission", TextureDesc::new_2d(size, POSITION), None),
            motion: None,
        }
    }

    /// Runs `strategy` on `stored` of `photons` (the rest is rubbish it must not read) and `view`.
    pub(crate) fn run(
        &mut self,
        strategy: &mut dyn Strategy,
        view: &View,
        photons: &[Photon],
        stored: u32,
        deterministic: bool,
    ) -> Images {
        let mut graph = Graph::new(strategy.name());
        let estimate = self.declare(&mut graph, strategy, view, photons, stored, deterministic);
        let indirect = graph.readback_texture(&estimate.indirect);
        let caustic = graph.readback_texture(estimate.caustic.as_ref().expect("the strategy tells caustics apart"));
        let stats: Vec<_> = estimate.stats.iter().map(|stats| (stats.names, graph.readback_buffer(&stats.buffer))).collect();
        let output = self.executor.execute(graph).expect("the frame runs");
        let counts = |(names, readback): (&'static [&'static str], _)| names.iter().copied().zip(output.cast::<u32>(readback));
        Images {
            indirect: output.cast(indirect),
            caustic: output.cast(caustic),
            stats: stats.into_iter().flat_map(counts).collect(),
        }
    }

    /// The same for strategies that sum irradiance.
    pub(crate) fn run_irradiance(&mut self, strategy: &mut dyn Strategy, view: &View, photons: &[Photon]) -> IrradianceImages {
        let mut graph = Graph::new(strategy.name());
        let estimate = self.declare(&mut graph, strategy, view, photons, photons.len() as u32, false);
        let light = estimate.irradiance.expect("the strategy sums irradiance");
        let images = [&light.irradiance, &light.direction, &estimate.indirect].map(|image| graph.readback_texture(image));
        let output = self.executor.execute(graph).expect("the frame runs");
        let [irradiance, direction, indirect] = images.map(|image| output.cast(image));
        IrradianceImages { irradiance, direction, indirect }
    }

    /// Declares what `strategy` makes of the same.
    pub(crate) fn declare(
        &mut self,
        graph: &mut Graph<'_>,
        strategy: &mut dyn Strategy,
        view: &View,
        photons: &[Photon],
        stored: u32,
        deterministic: bool,
    ) -> Estimate {
        let device = self.executor.device().clone();
        let size = view.camera.size;
        let gbuffer = self.gbuffer(graph, view);
        let photons = import_photons(graph, &device, photons, stored);
        let scene = no_scene(graph);
        let info = SceneInfo { bounds_center: Vec3::ZERO, bounds_radius: 10.0, ..SceneInfo::default() };
        let inputs = FrameInputs {
            scene: &scene,
            info: &info,
            gbuffer: &gbuffer,
            photons: Some(&photons),
            camera: &view.camera,
            size,
            frame_index: 0,
            seed: self.seed,
            max_bounces: 4,
            deterministic,
        };
        strategy.declare(graph, &inputs).expect("the frame is sound")
    }
}

pub(crate) const POSITION: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
const SURFACE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;

/// The first `stored` of `photons` as a frame's photons.
pub(crate) fn import_photons(graph: &mut Graph<'_>, device: &wgpu::Device, photons: &[Photon], stored: u32) -> Photons {
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    let buffer =
        |contents: &[u8]| device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some("test"), contents, usage });
    let state = PhotonState { stored, ..PhotonState::default() };
    let capacity = photons.len() as u32;
    let records = BufferDesc::array_of::<Photon>(capacity.into());
    let states = BufferDesc::array_of::<PhotonState>(1);
    Photons {
        records: graph.import_buffer("photons", records, buffer(bytemuck::cast_slice(photons))),
        state: graph.import_buffer("photon_state", states, buffer(bytemuck::bytes_of(&state))),
        capacity,
        emitted: capacity,
    }
}

/// Handles to nothing: the strategies under test trace no rays.
fn no_scene(graph: &mut Graph<'_>) -> SceneHandles {
    let mut buffer = |name| graph.import_buffer(name, BufferDesc::words(4), None);
    let (bvh_nodes, bvh_triangles, triangles) = (buffer("bvh_nodes"), buffer("bvh_triangles"), buffer("triangles"));
    let (materials, lights) = (buffer("materials"), buffer("lights"));
    let (light_groups, light_views) = (buffer("light_groups"), buffer("light_views"));
    let texels = graph.import_texture("texels", TextureDesc::new_2d([1, 1], wgpu::TextureFormat::Rgba8Unorm), None);
    let environment = graph.import_texture("environment", TextureDesc::new_2d([2, 1], POSITION), None);
    let traits = SceneTraits::default();
    SceneHandles {
        bvh_nodes,
        bvh_triangles,
        triangles,
        materials,
        lights,
        light_groups,
        light_views,
        texels,
        environment,
        ray_query_scene: None,
        ray_pipeline_scene: None,
        traits,
        moves: false,
    }
}
