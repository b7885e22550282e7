//! What is made through hal on Vulkan, and destroyed by us. All `unsafe` code of this crate is in this folder.
//!
//! hal's functions are unsafe as they check nothing: what they ask of the caller is kept here by making each object once, from its
//! own device, and destroying it once, when whoever could use it is gone.
#![expect(unsafe_code, reason = "ray-tracing pipelines can only be had below wgpu's safe interface")]

mod pipeline;
mod structure;

pub(super) use pipeline::{Batch, Pipeline};
pub(crate) use structure::Structure;

use ash::vk;
use lightloom_graph::wgpu::{
    self, BufferUses, ShaderStages, hal,
    hal::{Device as _, api::Vulkan as Api},
    naga::{ResourceBinding, back::spv},
};
use std::{mem::ManuallyDrop, ops::Deref, sync::Arc};

type Buffer = hal::vulkan::Buffer;

/// A device, and what it asks of shader binding tables (bytes).
#[derive(Debug)]
pub(crate) struct Vulkan {
    device: wgpu::Device,
    group_bytes: u64,
    group_alignment: u64,
    table_alignment: u64,
    most_triangles: u64,
}

/// The most triangles that a structure of the device holds; `None`: the device is not Vulkan's.
pub(crate) fn most_triangles(device: &wgpu::Device) -> Option<u64> {
    Vulkan::of(device).ok().map(|vulkan| vulkan.most_triangles)
}

impl Vulkan {
    /// Of a device that was opened with ray-tracing pipelines.
    fn of(device: &wgpu::Device) -> Result<Arc<Self>, String> {
        // SAFETY: nothing is destroyed through the guard.
        let hal = unsafe { device.as_hal::<Api>() }.ok_or("ray-tracing pipelines need Vulkan, and this device is another's")?;
        let mut tables = vk::PhysicalDeviceRayTracingPipelinePropertiesKHR::default();
        let mut structures = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut tables).push_next(&mut structures);
        // SAFETY: the device was opened with the extensions of both structures, which need Vulkan 1.1, of which this function is.
        unsafe {
            let instance = hal.shared_instance().raw_instance();
            instance.get_physical_device_properties2(hal.raw_physical_device(), &mut properties);
        }
        Ok(Arc::new(Self {
            device: device.clone(),
            group_bytes: tables.shader_group_handle_size.into(),
            group_alignment: tables.shader_group_handle_alignment.max(1).into(),
            table_alignment: tables.shader_group_base_alignment.max(1).into(),
            most_triangles: structures.max_primitive_count,
        }))
    }

    /// Calls `make` with hal's device; what it makes is destroyed by `destroy`.
    fn make<T, E: std::fmt::Display>(
        &self,
        what: &str,
        destroy: unsafe fn(&hal::vulkan::Device, T),
        make: impl FnOnce(&hal::vulkan::Device) -> Result<T, E>,
    ) -> Result<Owned<T>, String> {
        // SAFETY: nothing is destroyed through the guard but by `Owned`, which made it.
        let hal = unsafe { self.device.as_hal::<Api>() }.ok_or("the device is not Vulkan's")?;
        let object = make(&hal).map_err(|error| format!("{what}: {error}"))?;
        Ok(Owned { device: self.device.clone(), object: ManuallyDrop::new(object), destroy })
    }

    fn buffer(&self, label: &str, size: u64, usage: BufferUses) -> Result<Owned<Buffer>, String> {
        let memory_flags = hal::MemoryFlags::empty();
        let desc = hal::BufferDescriptor { label: Some(label), size, usage, memory_flags };
        // SAFETY: no size here is zero.
        self.make(label, hal::vulkan::Device::destroy_buffer, |hal| unsafe { hal.create_buffer(&desc) })
    }

    /// Writes into a buffer with the use `MAP_WRITE` that no command has used yet.
    fn write(&self, buffer: &Buffer, offset: u64, bytes: &[u8]) -> Result<(), String> {
        let range = offset..offset + bytes.len() as u64;
        // SAFETY: the callers have made the buffer larger than `range`, which is not empty, and nothing else writes or reads it
        // now. The mapping is left before anything else happens.
        unsafe {
            let hal = self.device.as_hal::<Api>().ok_or("the device is not Vulkan's")?;
            let mapping = hal.map_buffer(buffer, range.clone()).map_err(|error| error.to_string())?;
            std::ptr::copy_nonoverlapping(bytes.as_ptr(), mapping.ptr.as_ptr(), bytes.len());
            if !mapping.is_coherent {
                hal.flush_mapped_ranges(buffer, std::iter::once(range));
            }
            hal.unmap_buffer(buffer);
        }
        Ok(())
    }

    /// A command buffer that `record` fills. `kept` lives until it has run.
    fn commands(
        &self,
        label: &str,
        kept: impl Send + 'static,
        record: impl FnOnce(&mut hal::vulkan::CommandEncoder),
    ) -> wgpu::CommandBuffer {
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) });
        // SAFETY: the encoder is new, so it is in no pass and nothing else records into it; it is ended by wgpu alone.
        unsafe { encoder.as_hal_mut::<Api, _, _>(|hal| hal.map(record)) };
        encoder.on_submitted_work_done(move || drop(kept));
        encoder.finish()
    }

    /// What comes before, in the stages `from`, is done and seen by what follows in the stages `to`.
    ///
    /// # Safety
    /// `commands` are of this device, recording, and in no render pass.
    unsafe fn barrier(&self, commands: &hal::vulkan::CommandEncoder, from: vk::PipelineStageFlags, to: vk::PipelineStageFlags) {
        let all = vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE;
        let memory = vk::MemoryBarrier::default().src_access_mask(vk::AccessFlags::MEMORY_WRITE).dst_access_mask(all);
        // SAFETY: as the caller says; the device has the stages, as its extensions are enabled.
        unsafe {
            let Some(hal) = self.device.as_hal::<Api>() else { return };
            let none = vk::DependencyFlags::empty();
            hal.raw_device().cmd_pipeline_barrier(commands.raw_handle(), from, to, none, &[memory], &[], &[]);
        }
    }
}

/// An object of hal's that is destroyed with this.
#[derive(Debug)]
struct Owned<T> {
    device: wgpu::Device,
    object: ManuallyDrop<T>,
    destroy: unsafe fn(&hal::vulkan::Device, T),
}

impl<T> Deref for Owned<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.object
    }
}

impl<T> Drop for Owned<T> {
    fn drop(&mut self) {
        // SAFETY: the object is taken once, here, and is of this device. Commands that use it hold what holds this.
        unsafe {
            let object = ManuallyDrop::take(&mut self.object);
            if let Some(hal) = self.device.as_hal::<Api>() {
                (self.destroy)(&hal, object);
            }
        }
    }
}

/// The same buffer for hal's functions, for as long as `buffer` lives; it is not destroyed by this. Holding one of wgpu's guards
/// would do, but not several at once.
fn alias(buffer: &wgpu::Buffer) -> Result<Buffer, String> {
    // SAFETY: the handle is not destroyed through its copy, and the callers keep the buffer.
    unsafe {
        let hal = buffer.as_hal::<Api>().ok_or("a buffer is not Vulkan's, or was destroyed")?;
        Ok(Buffer::from_raw(hal.raw_handle()))
    }
}

/// The whole of a buffer, to be bound.
fn whole(buffer: &Buffer, size: u64) -> hal::BufferBinding<'_, Buffer> {
    hal::BufferBinding::new_unchecked(buffer, 0, std::num::NonZeroU64::new(size))
}

fn storage(binding: u32, visibility: ShaderStages, read_only: bool) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BufferBindingType::Storage { read_only };
    let ty = wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

/// Group 0: the live count, the rays, the hits.
fn ray_entries() -> Vec<wgpu::BindGroupLayoutEntry> {
    let stage = ShaderStages::RAY_GENERATION;
    vec![storage(0, stage, true), storage(1, stage, true), storage(2, stage, false)]
}

/// Group 1: of `shared/scene_bindings.wgsl` what the shaders use, and the structure.
fn scene_entries() -> Vec<wgpu::BindGroupLayoutEntry> {
    // Alpha is looked at in both: where a ray brings the triangle that it has seen, it is not traced.
    let both = ShaderStages::RAY_GENERATION | ShaderStages::ANY_HIT;
    let texture = |binding| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: both,
        ty: wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2Array,
            multisampled: false,
        },
        count: None,
    };
    let structure = wgpu::BindGroupLayoutEntry {
        binding: 8,
        visibility: ShaderStages::RAY_GENERATION,
        ty: wgpu::BindingType::AccelerationStructure { vertex_return: false },
        count: None,
    };
    vec![storage(1, both, true), storage(2, both, true), storage(3, both, true), texture(5), texture(6), structure]
}

/// Where hal puts the variables of both groups: one behind the other.
pub(super) fn bindings() -> spv::BindingMap {
    let groups = [ray_entries(), scene_entries()];
    let places = groups.iter().zip(0..).flat_map(|(entries, group)| {
        entries.iter().zip(0..).map(move |(entry, binding)| {
            let info = spv::BindingInfo { descriptor_set: group, binding, binding_array_size: None };
            (ResourceBinding { group, binding: entry.binding }, info)
        })
    });
    places.collect()
}

/// The layout of a group.
fn layout(vulkan: &Vulkan, entries: &[wgpu::BindGroupLayoutEntry]) -> Result<Owned<hal::vulkan::BindGroupLayout>, String> {
    let desc = hal::BindGroupLayoutDescriptor { label: Some("ray_pipeline"), flags: hal::BindGroupLayoutFlags::empty(), entries };
    // SAFETY: the entries' binding numbers rise.
    vulkan.make("bind group layout", hal::vulkan::Device::destroy_bind_group_layout, |hal| unsafe {
        hal.create_bind_group_layout(&desc)
    })
}
