//! The Vulkan objects that we make and destroy ourselves. All `unsafe` code of the graph is here.
//!
//! ```text
//!   wgpu::Texture ──► hal texture ──► drop callback ──► Bound ──► Memory ──► Vulkan
//!   (wgpu::Buffer)    destroyed when wgpu    image or     freed with its     functions
//!                     and the GPU are done   buffer       last Bound         of the device
//! ```
//!
//! A wgpu object holds its device, so every object here is gone before the device is.
#![expect(unsafe_code, reason = "memory shared between resources can only be had below wgpu's safe interface")]

use super::conv;
use crate::{BufferDesc, TextureDesc, executor::heap::HeapError, plan::Need};
use ash::vk;
use std::{
    fmt,
    sync::{
        Arc,
        atomic::{AtomicU64, AtomicUsize, Ordering},
    },
};
use wgpu::{BufferUsages, TextureUsages, TextureUses, hal, hal::api::Vulkan as Api};

/// Memory of these kinds and no other is fit for ordinary resources.
const ORDINARY: vk::MemoryPropertyFlags = vk::MemoryPropertyFlags::from_raw(
    vk::MemoryPropertyFlags::DEVICE_LOCAL.as_raw()
        | vk::MemoryPropertyFlags::HOST_VISIBLE.as_raw()
        | vk::MemoryPropertyFlags::HOST_COHERENT.as_raw()
        | vk::MemoryPropertyFlags::HOST_CACHED.as_raw(),
);

/// A device's functions, what it can do, and a count of what we hold of it.
pub(super) struct Vulkan {
    device: ash::Device,
    instance: ash::Instance,
    physical: vk::PhysicalDevice,
    memory: vk::PhysicalDeviceMemoryProperties,
    depth: conv::DepthFormats,
    /// Buffers and images side by side lie this far apart (bytes).
    granularity: u64,
    /// The largest piece of memory there is (bytes).
    largest: u64,
    /// Whether images may name the formats of their views.
    format_lists: bool,
    /// Whether the driver drops a barrier that is the first or the last command of its command buffer.
    drops_barriers: bool,
    /// Memory types that serve buffers, colours and depth alike.
    common: u32,
    bytes: AtomicU64,
    objects: AtomicUsize,
}

impl fmt::Debug for Vulkan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Vulkan").field("bytes", &self.bytes).field("objects", &self.objects).finish_non_exhaustive()
    }
}

impl Vulkan {
    /// The functions of a device.
    pub(super) fn of(device: &wgpu::Device) -> Result<Arc<Self>, String> {
        // SAFETY: nothing is destroyed through the guard, and what is copied from it are functions and handles that are
        // good for as long as the device, which every user of `Vulkan` holds.
        let hal = unsafe { device.as_hal::<Api>() }
            .ok_or_else(|| format!("placement needs Vulkan, and this device is of {:?}", device.adapter_info().backend))?;
        let (shared, physical) = (hal.shared_instance(), hal.raw_physical_device());
        let instance = shared.raw_instance().clone();
        // SAFETY: the physical device is of this instance, for both calls.
        let (memory, properties) = unsafe {
            (instance.get_physical_device_memory_properties(physical), instance.get_physical_device_properties(physical))
        };
        let version = properties.api_version.min(shared.instance_api_version());
        let mut largest = u64::MAX;
        if version >= vk::API_VERSION_1_1 {
            let mut limits = vk::PhysicalDeviceMaintenance3Properties::default();
            let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut limits);
            // SAFETY: instance and device are of version 1.1 or later, which has this function and this structure.
            unsafe { instance.get_physical_device_properties2(physical, &mut properties) };
            largest = limits.max_memory_allocation_size;
        }
        let renders = |format| {
            let wanted = vk::FormatFeatureFlags::SAMPLED_IMAGE | vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT;
            // SAFETY: the physical device is of this instance.
            let able = unsafe { instance.get_physical_device_format_properties(physical, format) };
            able.optimal_tiling_features.contains(wanted)
        };
        let mut vulkan = Self {
            device: hal.raw_device().clone(),
            depth: conv::DepthFormats {
                d24: renders(vk::Format::X8_D24_UNORM_PACK32),
                d24_s8: renders(vk::Format::D24_UNORM_S8_UINT),
                s8: renders(vk::Format::S8_UINT),
            },
            instance: instance.clone(),
            physical,
            memory,
            granularity: properties.limits.buffer_image_granularity.max(1),
            largest,
            format_lists: version >= vk::API_VERSION_1_2,
            // Mesa's software driver: it takes the end of a command buffer for a wait, which it is not. Resources of their
            // own it orders by other means, but not aliased ones. Seen in 22.3.6, by wrong images.
            drops_barriers: device.adapter_info().driver == "llvmpipe",
            common: u32::MAX,
            bytes: AtomicU64::new(0),
            objects: AtomicUsize::new(0),
        };
        vulkan.common = vulkan.common_types();
        Ok(Arc::new(vulkan))
    }

    /// Memory types that typical resources of each kind agree on; all, if they agree on none.
    fn common_types(&self) -> u32 {
        let texture = |format| {
            let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
            self.image_need(&TextureDesc::new_2d([64, 64], format), usage)
        };
        let needs = [
            self.buffer_need(&BufferDesc::bytes(4096), BufferUsages::STORAGE | BufferUsages::COPY_DST),
            texture(wgpu::TextureFormat::Rgba8Unorm),
            texture(wgpu::TextureFormat::Depth32Float),
        ];
        let common = needs.iter().flatten().fold(u32::MAX, |common, need| common & need.memory_type_bits);
        if common == 0 { u32::MAX } else { common }
    }

    /// Bytes of memory allocated now.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }

    /// Images and buffers there are now.
    pub(super) fn objects(&self) -> usize {
        self.objects.load(Ordering::Relaxed)
    }

    /// What a texture needs of a heap.
    pub(super) fn texture_need(&self, desc: &TextureDesc, usage: TextureUsages) -> Result<Need, HeapError> {
        self.need(self.image_need(desc, usage)?)
    }

    /// What a buffer needs of a heap.
    pub(super) fn storage_need(&self, desc: &BufferDesc, usage: BufferUsages) -> Result<Need, HeapError> {
        self.need(self.buffer_need(desc, usage)?)
    }

    fn need(&self, found: vk::MemoryRequirements) -> Result<Need, HeapError> {
        let types = self.memory.memory_types_as_slice();
        let fit = |bits: u32, wanted: vk::MemoryPropertyFlags| {
            types.iter().enumerate().position(|(index, kind)| {
                bits >> index & 1 == 1 && ORDINARY.contains(kind.property_flags) && kind.property_flags.contains(wanted)
            })
        };
        let bits = found.memory_type_bits;
        let local = vk::MemoryPropertyFlags::DEVICE_LOCAL;
        let class = fit(bits & self.common, local)
            .or_else(|| fit(bits, local))
            .or_else(|| fit(bits, vk::MemoryPropertyFlags::empty()))
            .ok_or_else(|| HeapError::Unsupported("the device has no memory of the kind it asks for".to_owned()))?;
        Ok(Need { bytes: found.size, align: found.alignment.max(self.granularity), class: class as u32 })
    }

    fn image_need(&self, desc: &TextureDesc, usage: TextureUsages) -> Result<vk::MemoryRequirements, HeapError> {
        let image = self.create_image(desc, usage)?;
        // SAFETY: the image was made just now, and nothing else knows it.
        unsafe {
            let need = self.device.get_image_memory_requirements(image);
            self.device.destroy_image(image, None);
            Ok(need)
        }
    }

    fn buffer_need(&self, desc: &BufferDesc, usage: BufferUsages) -> Result<vk::MemoryRequirements, HeapError> {
        let buffer = self.create_buffer(desc, usage)?;
        // SAFETY: the buffer was made just now, and nothing else knows it.
        unsafe {
            let need = self.device.get_buffer_memory_requirements(buffer);
            self.device.destroy_buffer(buffer, None);
            Ok(need)
        }
    }

    /// An image without memory, as wgpu would make it. wgpu does not check what is made outside it, so this does.
    fn create_image(&self, desc: &TextureDesc, usage: TextureUsages) -> Result<vk::Image, HeapError> {
        let refuse = |what: &str| HeapError::Unsupported(format!("{what} ({desc})"));
        let known = |format| conv::format(format, self.depth).ok_or_else(|| refuse("placement does not know the format"));
        let format = known(desc.format)?;
        let vk_usage = conv::image_usage(usage, desc.format.is_depth_stencil_format())
            .ok_or_else(|| refuse(&format!("placement does not serve the usages {usage:?}")))?;
        let flags = conv::image_flags(desc, usage);
        let is_3d = desc.dimension == wgpu::TextureDimension::D3;
        let image_type = if is_3d { vk::ImageType::TYPE_3D } else { vk::ImageType::TYPE_2D };
        let [width, height, depth] = desc.size;
        let extent = vk::Extent3D { width, height, depth: if is_3d { depth } else { 1 } };
        let layers = if is_3d { 1 } else { depth };
        let samples = vk::SampleCountFlags::from_raw(desc.sample_count);
        // SAFETY: the physical device is of this instance.
        let able = unsafe {
            let (tiling, physical) = (vk::ImageTiling::OPTIMAL, self.physical);
            self.instance.get_physical_device_image_format_properties(physical, format, image_type, tiling, vk_usage, flags)
        }
        .map_err(|error| if out_of_memory(error) { HeapError::OutOfMemory } else { refuse("Vulkan has no such image") })?;
        let most_mips = 32 - width.max(height).max(extent.depth).leading_zeros();
        let fits = width <= able.max_extent.width
            && height <= able.max_extent.height
            && extent.depth <= able.max_extent.depth
            && (1..=able.max_array_layers).contains(&layers)
            && (1..=able.max_mip_levels.min(most_mips)).contains(&desc.mip_level_count)
            && desc.sample_count.is_power_of_two()
            && able.sample_counts.contains(samples)
            && (desc.sample_count == 1 || desc.mip_level_count == 1 && !is_3d);
        let twin = |other: &wgpu::TextureFormat| other.remove_srgb_suffix() == desc.format.remove_srgb_suffix();
        if !fits || desc.is_empty() || !desc.view_formats.iter().all(twin) {
            return Err(refuse("Vulkan has no such image"));
        }
        let mut formats = vec![format];
        for other in &desc.view_formats {
            formats.push(known(*other)?);
        }
        let mut list = vk::ImageFormatListCreateInfo::default().view_formats(&formats);
        let mut info = vk::ImageCreateInfo::default()
            .flags(flags)
            .image_type(image_type)
            .format(format)
            .extent(extent)
            .mip_levels(desc.mip_level_count)
            .array_layers(layers)
            .samples(samples)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(vk_usage)
            .sharing_mode(vk::SharingMode::EXCLUSIVE)
            .initial_layout(vk::ImageLayout::UNDEFINED);
        if self.format_lists && !desc.view_formats.is_empty() {
            info = info.push_next(&mut list);
        }
        // SAFETY: the device says that it has such images, and `list` and `formats` outlive the call.
        unsafe { self.device.create_image(&info, None) }.map_err(heap_error)
    }

    /// A buffer without memory, as wgpu would make it.
    fn create_buffer(&self, desc: &BufferDesc, usage: BufferUsages) -> Result<vk::Buffer, HeapError> {
        let flags = conv::buffer_usage(usage)
            .ok_or_else(|| HeapError::Unsupported(format!("placement does not serve the usages {usage:?} ({desc})")))?;
        // An empty range at the end of a vertex buffer may be bound, so wgpu makes them longer than asked.
        let size = desc.padded().max(4).saturating_add(if usage.contains(BufferUsages::VERTEX) { 4 } else { 0 });
        let info = vk::BufferCreateInfo::default().size(size).usage(flags).sharing_mode(vk::SharingMode::EXCLUSIVE);
        // SAFETY: the size is not zero; the executor has compared it with the device's limits.
        unsafe { self.device.create_buffer(&info, None) }.map_err(heap_error)
    }
}

fn out_of_memory(error: vk::Result) -> bool {
    use vk::Result as R;
    matches!(error, R::ERROR_OUT_OF_DEVICE_MEMORY | R::ERROR_OUT_OF_HOST_MEMORY | R::ERROR_TOO_MANY_OBJECTS)
}

fn heap_error(error: vk::Result) -> HeapError {
    if out_of_memory(error) { HeapError::OutOfMemory } else { HeapError::Unsupported(format!("Vulkan refuses it: {error}")) }
}

/// One piece of device memory; freed with its last user.
#[derive(Debug)]
pub(super) struct Memory {
    vulkan: Arc<Vulkan>,
    raw: vk::DeviceMemory,
    pub(super) bytes: u64,
    pub(super) class: u32,
}

impl Memory {
    /// Allocates `bytes` of the memory type `class`.
    pub(super) fn allocate(vulkan: &Arc<Vulkan>, class: u32, bytes: u64) -> Result<Arc<Self>, HeapError> {
        let heap = vulkan.memory.memory_types_as_slice().get(class as usize).map(|kind| kind.heap_index as usize);
        let heap = heap.and_then(|heap| vulkan.memory.memory_heaps_as_slice().get(heap)).map_or(0, |heap| heap.size);
        if bytes > heap {
            return Err(HeapError::OutOfMemory);
        }
        if bytes > vulkan.largest {
            let message = format!("{bytes} bytes of shared memory where the device gives {} at once", vulkan.largest);
            return Err(HeapError::Unsupported(message));
        }
        let info = vk::MemoryAllocateInfo::default().allocation_size(bytes).memory_type_index(class);
        // SAFETY: the memory type exists, and the size is neither zero nor beyond what the device gives.
        let raw = unsafe { vulkan.device.allocate_memory(&info, None) }.map_err(heap_error)?;
        vulkan.bytes.fetch_add(bytes, Ordering::Relaxed);
        Ok(Arc::new(Self { vulkan: Arc::clone(vulkan), raw, bytes, class }))
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        // SAFETY: every object bound to it holds it and is gone; each was destroyed when the GPU was done with it.
        unsafe { self.vulkan.device.free_memory(self.raw, None) };
        self.vulkan.bytes.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

/// A Vulkan handle.
#[derive(Clone, Copy, Debug)]
enum Object {
    Image(vk::Image),
    Buffer(vk::Buffer),
}

/// An image or buffer with its memory; destroyed on drop, which wgpu's drop callback does.
#[derive(Debug)]
struct Bound {
    object: Object,
    memory: Arc<Memory>,
}

impl Bound {
    fn new(object: Object, memory: &Arc<Memory>, offset: u64) -> Result<Self, HeapError> {
        memory.vulkan.objects.fetch_add(1, Ordering::Relaxed);
        let bound = Self { object, memory: Arc::clone(memory) };
        let device = &memory.vulkan.device;
        // SAFETY: object and memory are of one device, the object has no memory yet, and the caller has checked that
        // its requirements (type, alignment, end) are met at `offset`.
        unsafe {
            match object {
                Object::Image(image) => device.bind_image_memory(image, memory.raw, offset),
                Object::Buffer(buffer) => device.bind_buffer_memory(buffer, memory.raw, offset),
            }
        }
        .map_err(heap_error)?;
        Ok(bound)
    }
}

impl Drop for Bound {
    fn drop(&mut self) {
        let vulkan = &self.memory.vulkan;
        // SAFETY: we made the object; wgpu runs the callback that drops this when neither it nor the GPU uses the
        // object any more, and if binding failed nothing ever did.
        unsafe {
            match self.object {
                Object::Image(image) => vulkan.device.destroy_image(image, None),
                Object::Buffer(buffer) => vulkan.device.destroy_buffer(buffer, None),
            }
        }
        vulkan.objects.fetch_sub(1, Ordering::Relaxed);
    }
}

/// An image that a hand-over moves home.
#[derive(Clone, Copy, Debug)]
pub(super) struct Image {
    raw: vk::Image,
    home: vk::ImageLayout,
    aspects: vk::ImageAspectFlags,
}

/// Makes a texture at `offset`, where `need` is met.
pub(super) fn texture(
    device: &wgpu::Device,
    memory: &Arc<Memory>,
    offset: u64,
    (label, desc, usage): (&str, &TextureDesc, TextureUsages),
) -> Result<(wgpu::Texture, TextureUses, Image), HeapError> {
    let vulkan = &memory.vulkan;
    let raw = vulkan.create_image(desc, usage)?;
    let bound = Bound::new(Object::Image(raw), memory, offset)?;
    let (home, layout) = conv::home(usage, desc.format.is_depth_stencil_format());
    let aspects = conv::format(desc.format, vulkan.depth).map_or(vk::ImageAspectFlags::COLOR, conv::aspects);
    let hal_desc = hal::TextureDescriptor {
        label: Some(label),
        size: desc.extent(),
        mip_level_count: desc.mip_level_count,
        sample_count: desc.sample_count,
        dimension: desc.dimension,
        format: desc.format,
        usage: home,
        memory_flags: hal::MemoryFlags::empty(),
        view_formats: desc.view_formats.clone(),
    };
    let wrapped = {
        // SAFETY: nothing is destroyed through the guard, which ends with this block.
        let hal = unsafe { device.as_hal::<Api>() }.ok_or_else(|| HeapError::Unsupported("the device is gone".to_owned()))?;
        let callback: hal::DropCallback = Box::new(move || drop(bound));
        // SAFETY: the image is of this device and as described; the callback, and nothing else, destroys it.
        unsafe { hal.texture_from_raw(raw, &hal_desc, Some(callback), hal::vulkan::TextureMemory::External) }
    };
    let descriptor = wgpu::TextureDescriptor {
        label: Some(label),
        size: hal_desc.size,
        mip_level_count: desc.mip_level_count,
        sample_count: desc.sample_count,
        dimension: desc.dimension,
        format: desc.format,
        usage,
        view_formats: &desc.view_formats,
    };
    // SAFETY: the hal texture is of this device and as described. It is at home before wgpu first uses it: its first
    // use comes after a hand-over in the order of submission.
    let texture = unsafe { device.create_texture_from_hal::<Api>(wrapped, &descriptor, home) };
    Ok((texture, home, Image { raw, home: layout, aspects }))
}

/// Makes a buffer at `offset`, where its need is met.
pub(super) fn buffer(
    device: &wgpu::Device,
    memory: &Arc<Memory>,
    offset: u64,
    (label, desc, usage): (&str, &BufferDesc, BufferUsages),
) -> Result<wgpu::Buffer, HeapError> {
    let raw = memory.vulkan.create_buffer(desc, usage)?;
    let bound = Bound::new(Object::Buffer(raw), memory, offset)?;
    // SAFETY: the callback, and nothing else, destroys the buffer, when wgpu is done with it.
    let wrapped = unsafe { hal::vulkan::Buffer::from_raw_externally_owned(raw, Box::new(move || drop(bound))) };
    let descriptor = wgpu::BufferDescriptor { label: Some(label), size: desc.padded(), usage, mapped_at_creation: false };
    // SAFETY: the hal buffer is of this device, at least as large as described, and not empty. Its contents are garbage,
    // and the planner has seen to it that no pass reads them before one has written.
    Ok(unsafe { device.create_buffer_from_hal::<Api>(wrapped, &descriptor) })
}

/// A command buffer that orders what follows after all that went before on the queue, and moves `images` home.
pub(super) fn barrier(device: &wgpu::Device, vulkan: &Vulkan, images: &[Image]) -> wgpu::CommandBuffer {
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("hand over memory") });
    let (written, all) = (vk::AccessFlags::MEMORY_WRITE, vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE);
    let memory = vk::MemoryBarrier::default().src_access_mask(written).dst_access_mask(all);
    let images: Vec<vk::ImageMemoryBarrier<'_>> = images
        .iter()
        .map(|image| {
            vk::ImageMemoryBarrier::default()
                .src_access_mask(written)
                .dst_access_mask(all)
                .old_layout(vk::ImageLayout::UNDEFINED)
                .new_layout(image.home)
                .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                .image(image.raw)
                .subresource_range(vk::ImageSubresourceRange {
                    aspect_mask: image.aspects,
                    base_mip_level: 0,
                    level_count: vk::REMAINING_MIP_LEVELS,
                    base_array_layer: 0,
                    layer_count: vk::REMAINING_ARRAY_LAYERS,
                })
        })
        .collect();
    let stages = vk::PipelineStageFlags::ALL_COMMANDS;
    let none = vk::DependencyFlags::empty();
    // SAFETY: the encoder is new, so it is in no pass and nothing else records into it; the images live, as the caller
    // holds them, and are used by wgpu's commands in the same submission, so they outlive its run.
    unsafe {
        encoder.as_hal_mut::<Api, _, _>(|hal| {
            if let Some(hal) = hal {
                let commands = hal.raw_handle();
                // A command without effect, where the driver must not see the barrier at either end.
                let pad = || {
                    if vulkan.drops_barriers {
                        vulkan.device.cmd_set_line_width(commands, 1.0);
                    }
                };
                pad();
                vulkan.device.cmd_pipeline_barrier(commands, stages, stages, none, &[memory], &[], &images);
                pad();
            }
        });
    }
    encoder.finish()
}
