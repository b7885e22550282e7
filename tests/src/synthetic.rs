//! Photons and G-buffers made by hand and imported, the way an engine brings its own.

use crate::lab::{gbuffer_descs, gbuffer_of};
use crate::{Estimates, Frame, Lab};
use glam::{DVec3, Vec3};
use lightloom_graph::{BufferDesc, Gpu, Graph, ShaderStruct, bytemuck, wgpu};
use lightloom_passes::scene::gpu_types::octahedral;
use lightloom_passes::scene::{Camera, GpuScene};
use lightloom_passes::{CameraUniform, Photon, PhotonSettings, PhotonState, Photons};
use lightloom_strategies::Strategy;

/// ε of PHYSICS's shading-normal factor `(ω·n_s)/(ω·n_g + ε)`: even where both normals are one, light that arrives under cos θ loses
/// ε / (cos θ + ε) of itself; light of the cosine law loses 2ε on average.
pub const SHADING_EPSILON: f64 = 1.0e-4;

/// Watts of one unit of a photon's mantissa when the flux word is made by [`flux_word`].
pub const FLUX_UNIT: f64 = 1.0 / 65_536.0;

/// A flux word of mantissas `rgb`, in units of [`FLUX_UNIT`] shifted up by `shift` bits.
pub fn flux_word(rgb: [u8; 3], shift: u32) -> u32 {
    let [r, g, b] = rgb.map(u32::from);
    // decode: m · 2^(e − 136).
    r | (g << 8) | (b << 16) | ((136 - 16 + shift) << 24)
}

/// A photon that fell straight down on the plane y = 0, through 1 m.
pub fn falling_photon(x: f64, z: f64, flux: u32) -> Photon {
    Photon {
        position: [x as f32, 0.0, z as f32],
        flux,
        direction: octahedral(Vec3::NEG_Y),
        normal: octahedral(Vec3::Y),
        // A half, 1.0, below a path probability of 0.
        length_probability: 0x3c00,
        bounce_flags: 1,
    }
}

/// A storage buffer with these contents.
pub fn buffer<T: ShaderStruct>(gpu: &Gpu, label: &str, contents: &[T]) -> wgpu::Buffer {
    let bytes: &[u8] = bytemuck::cast_slice(contents);
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.len() as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

fn texture<T: bytemuck::Pod>(gpu: &Gpu, label: &str, size: [u32; 2], format: wgpu::TextureFormat, texels: &[T]) -> wgpu::Texture {
    let extent = wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 };
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: extent,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let row = size_of::<T>() as u32 * size[0];
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
    gpu.queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(texels), layout, extent);
    texture
}

/// The plane y = 0, white, seen through the pixels' centres from `height` (m) straight above the origin; x to the right and
/// z down the image. The image shows `width` metres across.
#[derive(Clone, Copy, Debug)]
pub struct PlaneView {
    /// Width and height (pixels).
    pub size: [u32; 2],
    /// Width of what is seen (m).
    pub width: f64,
    /// Height of the eye (m).
    pub height: f64,
}

impl PlaneView {
    /// Edge of a pixel on the plane (m).
    pub fn pixel(&self) -> f64 {
        self.width / f64::from(self.size[0])
    }

    /// Where the plane is at the centre of pixel (column, row): x and z (m).
    pub fn point(&self, column: u32, row: u32) -> [f64; 2] {
        let along = |i: u32, n: u32| (f64::from(i) + 0.5 - 0.5 * f64::from(n)) * self.pixel();
        [along(column, self.size[0]), along(row, self.size[1])]
    }

    /// Irradiance (W·m⁻², RGB) that each strategy estimates at each pixel from `photons`: π L, the surface being white.
    ///
    /// # Panics
    /// If a strategy refuses the frame.
    pub fn irradiance(
        &self,
        lab: &mut Lab,
        scene: &GpuScene,
        photons: &[Photon],
        strategies: &mut [Box<dyn Strategy>],
    ) -> Estimates {
        let half_angle = (0.5 * self.pixel() * f64::from(self.size[1]) / self.height).atan();
        let eye = DVec3::new(0.0, self.height, 0.0).as_vec3();
        let camera = Camera::look_at("above", eye, Vec3::ZERO, Vec3::NEG_Z, 2.0 * half_angle as f32);
        let camera = CameraUniform::new(&camera, self.size, [0.5; 2], scene.info().bounds_radius);

        let count = photons.len() as u32;
        let settings = PhotonSettings {
            emitted: count,
            capacity: count,
            max_bounces: 1,
            seed: 0,
            caustics_only: false,
            light_vertices: false,
            cull: None,
        };
        let frame = Frame { photons: settings, maps: None, deterministic: false };
        let state = PhotonState { stored: count, total: count, ..PhotonState::default() };
        let mut graph = Graph::new("imported");
        let handles = scene.declare(&mut graph);
        let records = graph.import_buffer(
            "photons",
            BufferDesc::array_of::<Photon>(u64::from(count)),
            buffer(&lab.gpu, "photons", photons),
        );
        let state =
            graph.import_buffer("photon_state", BufferDesc::array_of::<PhotonState>(1), buffer(&lab.gpu, "state", &[state]));
        let photons = Photons { records, state, capacity: count, emitted: count };
        let textures = self.textures(&lab.gpu);
        let descs = gbuffer_descs(self.size);
        let names = ["gbuffer_position", "gbuffer_surface", "gbuffer_emission"];
        let mut parts = names.into_iter().zip(descs).zip(textures).map(|((name, desc), it)| graph.import_texture(name, desc, it));
        let parts = [(); 3].map(|()| parts.next().expect("three textures"));
        let gbuffer = gbuffer_of(parts);
        let mut estimates = lab.gather(graph, scene, &handles, &camera, (&gbuffer, &photons), frame, strategies);
        for pixel in estimates.layers.iter_mut().flatten().flat_map(|image| &mut image.pixels) {
            *pixel = pixel.map(|radiance| radiance * std::f64::consts::PI);
        }
        estimates
    }

    /// Position, surface and emission at every pixel.
    fn textures(&self, gpu: &Gpu) -> [wgpu::Texture; 3] {
        let pixels = (0..self.size[1]).flat_map(|row| (0..self.size[0]).map(move |column| (column, row)));
        let position: Vec<[f32; 4]> = pixels
            .map(|(column, row)| {
                let [x, z] = self.point(column, row);
                let depth = DVec3::new(x, self.height, z).length();
                [x as f32, 0.0, z as f32, depth as f32]
            })
            .collect();
        // White in 11, 11 and 10 bits; valid, Lambert, roughness 1.
        let (white, bits) = (2047 | (2047 << 11) | (1023 << 22), 0x1_0000 | 0x4_0000 | 0xff);
        let up = octahedral(Vec3::Y);
        let surface = vec![[up, up, white, bits]; position.len()];
        let dark = vec![[0.0_f32; 4]; position.len()];
        let [float, word] = [wgpu::TextureFormat::Rgba32Float, wgpu::TextureFormat::Rgba32Uint];
        [
            texture(gpu, "position", self.size, float, &position),
            texture(gpu, "surface", self.size, word, &surface),
            texture(gpu, "emission", self.size, float, &dark),
        ]
    }
}
