//! Writes a scene's buffers and textures in chunks, so that nothing large is in memory twice.

use super::environment::Map;
use super::pages::{MOST_TEXELS, Pages, Strip};
use super::{SceneError, TextureData};
use crate::RayBackend;
use lightloom_graph::{BufferDesc, ShaderStruct, TextureDesc, wgpu};

/// Bytes converted and written at once.
const CHUNK_BYTES: usize = 4 << 20;
/// Bytes written before the queue is drained, which frees its staging memory.
const DRAIN_BYTES: usize = 64 << 20;

/// A buffer and its description.
#[derive(Clone, Debug)]
pub(super) struct Resident {
    /// Name of the WGSL variable.
    pub(super) name: &'static str,
    /// `None`: described only.
    pub(super) buffer: Option<wgpu::Buffer>,
    pub(super) desc: BufferDesc,
}

/// Creates and fills resources of one scene.
pub(super) struct Writer<'a> {
    /// `None`: everything is described and nothing created.
    gpu: Option<(&'a wgpu::Device, &'a wgpu::Queue)>,
    scene: &'a str,
    pending: usize,
}

impl<'a> Writer<'a> {
    /// `scene` names the scene in errors.
    pub(super) fn new(gpu: Option<(&'a wgpu::Device, &'a wgpu::Queue)>, scene: &'a str) -> Self {
        Self { gpu, scene, pending: 0 }
    }

    /// `old`, where it is of that size, or a new buffer.
    fn buffer(&self, name: &'static str, desc: BufferDesc, old: Option<&Resident>) -> Result<Resident, SceneError> {
        if let Some(old) = old.filter(|old| old.desc == desc) {
            return Ok(old.clone());
        }
        let Some((device, _)) = self.gpu else { return Ok(Resident { name, buffer: None, desc }) };
        let limits = device.limits();
        let binding = limits.max_storage_buffer_binding_size;
        self.allow(name, desc.size, "bytes", binding, "max_storage_buffer_binding_size")?;
        self.allow(name, desc.size, "bytes", limits.max_buffer_size, "max_buffer_size")?;
        let mut usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        if device.features().contains(RayBackend::RayQuery.features()) {
            // `bvh_triangles` may become the geometry of an acceleration structure.
            usage |= wgpu::BufferUsages::BLAS_INPUT;
        }
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(name),
            size: desc.size,
            usage,
            mapped_at_creation: false,
        });
        Ok(Resident { name, buffer: Some(buffer), desc })
    }

    /// A buffer of structs, converted and written chunk by chunk, in the place of `old` where it has the same size.
    pub(super) fn array<T: ShaderStruct>(
        &mut self,
        name: &'static str,
        old: Option<&Resident>,
        elements: impl ExactSizeIterator<Item = T>,
    ) -> Result<Resident, SceneError> {
        let resident = self.buffer(name, BufferDesc::array_of::<T>(elements.len() as u64), old)?;
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

    /// The array texture of all images.
    pub(super) fn texels(
        &mut self,
        textures: &[TextureData],
        pages: &Pages,
    ) -> Result<(Option<wgpu::Texture>, TextureDesc), SceneError> {
        let [width, height, layers] = pages.size();
        let format = wgpu::TextureFormat::Rgba8Unorm;
        let srgb = wgpu::TextureFormat::Rgba8UnormSrgb;
        let desc = TextureDesc::new_2d([width, height], format).layers(layers).view_format(srgb);
        let Some((device, queue)) = self.gpu else { return Ok((None, desc)) };
        let limits = device.limits();
        self.allow("texels", pages.total(), "texels", MOST_TEXELS, "32-bit indices")?;
        let most_layers = limits.max_texture_array_layers;
        self.allow("texels", layers.into(), "layers", most_layers.into(), "max_texture_array_layers")?;
        let most = limits.max_texture_dimension_2d;
        self.allow("texels", width.into(), "texels across", most.into(), "max_texture_dimension_2d")?;
        let texture = device.create_texture(&wgpu::TextureDescriptor {
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
        pages.write(textures, rows, |strip, bytes| self.write_strip(queue, &texture, strip, bytes));
        Ok((Some(texture), desc))
    }

    /// The environment's map.
    pub(super) fn environment(&mut self, map: &Map) -> Result<(Option<wgpu::Texture>, TextureDesc), SceneError> {
        let [width, height] = map.size;
        let format = wgpu::TextureFormat::Rgba32Float;
        let desc = TextureDesc::new_2d(map.size, format);
        let Some((device, queue)) = self.gpu else { return Ok((None, desc)) };
        let most = device.limits().max_texture_dimension_2d;
        self.allow("environment", width.max(height).into(), "texels across or down", most.into(), "max_texture_dimension_2d")?;
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("environment"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let row_bytes = width * 16;
        let rows = (CHUNK_BYTES as u32 / row_bytes).max(1);
        for (index, chunk) in map.texels.chunks((rows * width) as usize).enumerate() {
            let mut target = texture.as_image_copy();
            target.origin.y = index as u32 * rows;
            let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row_bytes), rows_per_image: None };
            let size = wgpu::Extent3d { width, height: chunk.len() as u32 / width, depth_or_array_layers: 1 };
            queue.write_texture(target, bytemuck::cast_slice(chunk), layout, size);
            self.count(chunk.len() * 16);
        }
        Ok((Some(texture), desc))
    }

    fn write_strip(&mut self, queue: &wgpu::Queue, texture: &wgpu::Texture, strip: &Strip, bytes: &[u8]) {
        let mut target = texture.as_image_copy();
        target.origin = wgpu::Origin3d { x: 0, y: strip.row, z: strip.layer };
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(strip.width * 4), rows_per_image: None };
        let size = wgpu::Extent3d { width: strip.width, height: strip.rows, depth_or_array_layers: 1 };
        queue.write_texture(target, bytes, layout, size);
        self.count(bytes.len());
    }

    fn write(&mut self, resident: &Resident, offset: u64, bytes: &[u8]) {
        if let (Some((_, queue)), Some(buffer)) = (self.gpu, &resident.buffer) {
            queue.write_buffer(buffer, offset, bytes);
        }
        self.count(bytes.len());
    }

    fn count(&mut self, bytes: usize) {
        self.pending += bytes;
        if self.pending >= DRAIN_BYTES {
            self.drain();
        }
    }

    /// Waits until everything is written.
    pub(super) fn drain(&mut self) {
        self.pending = 0;
        if let Some((device, queue)) = self.gpu {
            queue.submit([]);
            // A lost device shows at the next submission, with a better message than here.
            let _ = device.poll(wgpu::PollType::wait_indefinitely());
        }
    }

    /// [`SceneError::DeviceLimit`] unless what `resource` needs is within the device's limit.
    pub(super) fn allow(
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
