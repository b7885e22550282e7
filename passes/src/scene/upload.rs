//! The scene on the GPU: five storage buffers and one array texture, imported into each frame's graph.
//!
//! Everything is converted and written in chunks, so that a large scene is never in memory twice.

use super::gpu_types::{BvhTriangle, Light, Material, NONE, TriangleAttributes};
use super::light_list::LightList;
use super::pages::{Pages, Strip};
use super::{Bvh, BvhStats, Scene, SceneError, SceneInfo, bvh};
use lightloom_graph::{Buffer, BufferDesc, Graph, Handle, ShaderStruct, Texture, TextureDesc, wgpu};

/// Bytes converted and written at once.
const CHUNK_BYTES: usize = 4 << 20;
/// Bytes written before the queue is drained, which frees its staging memory.
const DRAIN_BYTES: usize = 64 << 20;

/// A scene in GPU memory.
#[derive(Debug)]
pub struct GpuScene {
    bvh_nodes: Resident,
    bvh_triangles: Resident,
    triangles: Resident,
    materials: Resident,
    lights: Resident,
    texels: (wgpu::Texture, TextureDesc),
    /// Bounds, counts and flux.
    pub info: SceneInfo,
    /// Size and cost of the hierarchy.
    pub bvh_stats: BvhStats,
}

/// A buffer and its description.
#[derive(Debug)]
struct Resident {
    name: &'static str,
    buffer: wgpu::Buffer,
    desc: BufferDesc,
}

/// The scene's resources in one frame's graph, named as the WGSL variables.
#[derive(Debug)]
pub struct SceneHandles {
    /// `array<vec4u>`, five per node.
    pub bvh_nodes: Handle<Buffer>,
    /// `array<BvhTriangle>` in leaf order.
    pub bvh_triangles: Handle<Buffer>,
    /// `array<TriangleAttributes>` in scene order.
    pub triangles: Handle<Buffer>,
    /// `array<Material>`.
    pub materials: Handle<Buffer>,
    /// `array<Light>`; one entry without probability when the scene has no light.
    pub lights: Handle<Buffer>,
    /// All texels, rgba8unorm; view it as rgba8unorm-srgb for `texels_srgb`.
    pub texels: Handle<Texture>,
}

impl GpuScene {
    /// Builds the hierarchy and uploads.
    ///
    /// # Errors
    /// Those of [`Bvh::build`], and [`SceneError::DeviceLimit`] for what the device cannot hold.
    pub fn upload(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
    ) -> Result<Self, SceneError> {
        let bvh = Bvh::build(&scene.name, &scene.triangles)?;
        Self::upload_with_bvh(device, queue, scene, &bvh)
    }

    /// Uploads with a hierarchy that was built from `scene.triangles`.
    ///
    /// # Errors
    /// [`SceneError::DeviceLimit`] for what the device cannot hold.
    pub fn upload_with_bvh(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
        bvh: &Bvh,
    ) -> Result<Self, SceneError> {
        let (bounds_center, bounds_radius) = scene.bounding_sphere();
        let list = LightList::new(scene, bounds_radius);
        let pages = Pages::new(&scene.textures);
        let mut to = Upload { device, queue, scene: &scene.name, pending: 0 };

        let alpha_tested: Vec<bool> =
            scene.materials.iter().map(|material| material.lets_rays_pass(&scene.textures)).collect();
        let light_of = |index: usize| list.of_triangle.get(index).copied().unwrap_or(NONE);
        let nodes = u64::from(bvh.stats().nodes) * bvh::NODE_BYTES;
        let bvh_nodes = to.buffer("bvh_nodes", BufferDesc::bytes(nodes))?;
        for (chunk, bytes) in bvh.node_bytes().chunks(CHUNK_BYTES).enumerate() {
            to.write(&bvh_nodes, (chunk * CHUNK_BYTES) as u64, bytes);
        }
        let in_leaf_order = bvh.leaf_order().iter().map(|&index| {
            let triangle = &scene.triangles[index as usize];
            let alpha = alpha_tested.get(triangle.material as usize).is_some_and(|&a| a);
            BvhTriangle::new(triangle, index, alpha, light_of(index as usize))
        });
        let bvh_triangles = to.array("bvh_triangles", in_leaf_order)?;
        let in_scene_order = scene
            .triangles
            .iter()
            .enumerate()
            .map(|(index, triangle)| TriangleAttributes::new(triangle, light_of(index)));
        let triangles = to.array("triangles", in_scene_order)?;
        let materials = scene.materials.iter().map(|material| {
            Material::new(material, |using| pages.slot(&scene.textures, using))
        });
        let materials = to.array("materials", materials)?;
        // Bindings must not be empty.
        let none = Light { material: NONE, triangle: NONE, ..Light::default() };
        let dummy = list.lights.is_empty().then_some(none);
        let count = list.lights.len() + usize::from(dummy.is_some());
        let lights = to.array("lights", Counted(list.lights.iter().copied().chain(dummy), count))?;
        let texels = to.texels(scene, &pages)?;
        to.drain();

        Ok(Self {
            bvh_nodes,
            bvh_triangles,
            triangles,
            materials,
            lights,
            texels,
            info: SceneInfo {
                bounds_center,
                bounds_radius,
                triangle_count: scene.triangles.len() as u32,
                light_count: list.lights.len() as u32,
                punctual_count: list.punctual_count,
                total_power: list.total_power,
                surface_area: scene.surface_area(),
            },
            bvh_stats: bvh.stats(),
        })
    }

    /// Imports the scene into a frame's graph.
    pub fn declare(&self, graph: &mut Graph<'_>) -> SceneHandles {
        let mut import = |resident: &Resident| {
            graph.import_buffer(resident.name, resident.desc.clone(), resident.buffer.clone())
        };
        let (bvh_nodes, bvh_triangles) = (import(&self.bvh_nodes), import(&self.bvh_triangles));
        let (triangles, materials) = (import(&self.triangles), import(&self.materials));
        let lights = import(&self.lights);
        let (texture, desc) = &self.texels;
        let texels = graph.import_texture("texels", desc.clone(), texture.clone());
        SceneHandles { bvh_nodes, bvh_triangles, triangles, materials, lights, texels }
    }

    /// Bytes that the scene takes on the GPU.
    pub fn bytes(&self) -> u64 {
        [&self.bvh_nodes, &self.bvh_triangles, &self.triangles, &self.materials, &self.lights]
            .iter()
            .map(|resident| resident.desc.size)
            .sum::<u64>()
            + self.texels.1.bytes()
    }
}

/// An iterator that knows its length although its parts do not.
struct Counted<I>(I, usize);

impl<I: Iterator> Iterator for Counted<I> {
    type Item = I::Item;

    fn next(&mut self) -> Option<I::Item> {
        self.1 = self.1.saturating_sub(1);
        self.0.next()
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.1, Some(self.1))
    }
}

impl<I: Iterator> ExactSizeIterator for Counted<I> {}

/// Creates and fills resources, and drains the queue now and then.
struct Upload<'a> {
    device: &'a wgpu::Device,
    queue: &'a wgpu::Queue,
    scene: &'a str,
    pending: usize,
}

impl Upload<'_> {
    fn buffer(&self, name: &'static str, desc: BufferDesc) -> Result<Resident, SceneError> {
        let limits = self.device.limits();
        let binding = limits.max_storage_buffer_binding_size;
        self.allow(name, desc.size, "bytes", binding, "max_storage_buffer_binding_size")?;
        self.allow(name, desc.size, "bytes", limits.max_buffer_size, "max_buffer_size")?;
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(name),
            size: desc.size,
            usage: wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_DST
                | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        Ok(Resident { name, buffer, desc })
    }

    /// A buffer of structs, converted and written chunk by chunk.
    fn array<T: ShaderStruct>(
        &mut self,
        name: &'static str,
        elements: impl ExactSizeIterator<Item = T>,
    ) -> Result<Resident, SceneError> {
        let resident = self.buffer(name, BufferDesc::array_of::<T>(elements.len() as u64))?;
        let most = (CHUNK_BYTES / size_of::<T>()).max(1);
        let mut chunk: Vec<T> = Vec::with_capacity(most.min(elements.len()));
        let mut offset = 0;
        let mut elements = elements;
        loop {
            chunk.clear();
            chunk.extend(elements.by_ref().take(most));
            if chunk.is_empty() {
                return Ok(resident);
            }
            let bytes = bytemuck::cast_slice(&chunk);
            self.write(&resident, offset, bytes);
            offset += bytes.len() as u64;
        }
    }

    fn texels(
        &mut self,
        scene: &Scene,
        pages: &Pages,
    ) -> Result<(wgpu::Texture, TextureDesc), SceneError> {
        let [width, height, layers] = pages.size();
        let limits = self.device.limits();
        self.allow("texels", pages.total(), "texels", super::pages::MOST_TEXELS, "32-bit indices")?;
        let most_layers = limits.max_texture_array_layers;
        self.allow("texels", layers.into(), "layers", most_layers.into(), "max_texture_array_layers")?;
        let most = limits.max_texture_dimension_2d;
        self.allow("texels", width.into(), "texels across", most.into(), "max_texture_dimension_2d")?;
        let format = wgpu::TextureFormat::Rgba8Unorm;
        let srgb = wgpu::TextureFormat::Rgba8UnormSrgb;
        let desc = TextureDesc::new_2d([width, height], format).layers(layers).view_format(srgb);
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("texels"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: layers },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[srgb],
        });
        let rows = (CHUNK_BYTES / (width as usize * 4)) as u32;
        pages.write(&scene.textures, rows, |strip, bytes| self.write_strip(&texture, strip, bytes));
        Ok((texture, desc))
    }

    fn write_strip(&mut self, texture: &wgpu::Texture, strip: &Strip, bytes: &[u8]) {
        let mut target = texture.as_image_copy();
        target.origin = wgpu::Origin3d { x: 0, y: strip.row, z: strip.layer };
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(strip.width * 4),
            rows_per_image: None,
        };
        let size =
            wgpu::Extent3d { width: strip.width, height: strip.rows, depth_or_array_layers: 1 };
        self.queue.write_texture(target, bytes, layout, size);
        self.count(bytes.len());
    }

    fn write(&mut self, resident: &Resident, offset: u64, bytes: &[u8]) {
        self.queue.write_buffer(&resident.buffer, offset, bytes);
        self.count(bytes.len());
    }

    fn count(&mut self, bytes: usize) {
        self.pending += bytes;
        if self.pending >= DRAIN_BYTES {
            self.drain();
        }
    }

    fn drain(&mut self) {
        self.pending = 0;
        self.queue.submit([]);
        // A lost device shows at the next submission, with a better message than here.
        let _ = self.device.poll(wgpu::PollType::wait_indefinitely());
    }

    fn allow(
        &self,
        resource: &'static str,
        needed: u64,
        unit: &'static str,
        allowed: u64,
        limit: &'static str,
    ) -> Result<(), SceneError> {
        if needed <= allowed {
            return Ok(());
        }
        let scene = self.scene.to_owned();
        Err(SceneError::DeviceLimit { scene, resource, needed, unit, allowed, limit })
    }
}
