//! The acceleration structure of a scene, as `scene/acceleration.rs` makes it for ray queries: one geometry, one instance of it.
//!
//! The vertices are a copy of `bvh_triangles` that lives while the structure is built: wgpu would refuse the original the use.

use super::{Api, Buffer, Owned, Vulkan, alias, layout, scene_entries, whole};
use crate::ray_pipeline::SceneParts;
use crate::scene::gpu_types::CORNER_BYTES;
use ash::vk;
use lightloom_graph::wgpu::{
    self, BufferUses, TextureUses, hal,
    hal::{CommandEncoder as _, Device as _},
};
use std::sync::Arc;

const FLAGS: hal::AccelerationStructureBuildFlags = hal::AccelerationStructureBuildFlags::PREFER_FAST_TRACE;

type Level = Owned<hal::vulkan::AccelerationStructure>;

/// Both levels, and the bind group of the scene.
#[derive(Debug)]
pub(crate) struct Structure {
    pub(super) group: Owned<hal::vulkan::BindGroup>,
    _views: [Owned<hal::vulkan::TextureView>; 2],
    _layout: Owned<hal::vulkan::BindGroupLayout>,
    top: Level,
    bottom: Level,
    instances: Owned<Buffer>,
    scratch_bytes: u64,
    opaque: bool,
    parts: SceneParts,
    vulkan: Arc<Vulkan>,
}

impl Structure {
    /// Room for the triangles of `parts`. `opaque`: every hit counts, and no shader need look at it.
    pub(crate) fn new(device: &wgpu::Device, parts: SceneParts, opaque: bool) -> Result<Arc<Self>, String> {
        let vulkan = Vulkan::of(device)?;
        let triangles = geometry(None, vertices(&parts), opaque);
        let (bottom, bottom_scratch) = level(&vulkan, &triangles, hal::AccelerationStructureFormat::BottomLevel)?;
        let (top, top_scratch) = level(&vulkan, &instance(None), hal::AccelerationStructureFormat::TopLevel)?;
        let instances = place(&vulkan, &bottom)?;
        let layout = layout(&vulkan, &scene_entries())?;
        let views = [view(&vulkan, &parts, false)?, view(&vulkan, &parts, true)?];
        let group = bind(&vulkan, &parts, &layout, &views, &top)?;
        let scratch_bytes = bottom_scratch.max(top_scratch);
        Ok(Arc::new(Self { group, _views: views, _layout: layout, top, bottom, instances, scratch_bytes, opaque, parts, vulkan }))
    }

    /// What it was made from.
    pub(crate) fn parts(&self) -> &SceneParts {
        &self.parts
    }

    /// Builds it over the triangles as they are when the queue comes to it; again in the same memory when they have moved. The
    /// submission is one of its own, behind the frames submitted before it.
    pub(crate) fn build(self: &Arc<Self>, queue: &wgpu::Queue) -> Result<(), String> {
        let count = vertices(&self.parts);
        let bytes = u64::from(count) * CORNER_BYTES;
        let uses = BufferUses::COPY_DST | BufferUses::BOTTOM_LEVEL_ACCELERATION_STRUCTURE_INPUT;
        // hal names the vertex behind the last as the largest index.
        let copy = self.vulkan.buffer("ray_pipeline_vertices", bytes + CORNER_BYTES, uses)?;
        let scratch =
            self.vulkan.buffer("ray_pipeline_scratch", self.scratch_bytes.max(1), BufferUses::ACCELERATION_STRUCTURE_SCRATCH)?;
        let (copy, scratch) = (Arc::new(copy), Arc::new(scratch));
        let source = alias(&self.parts.bvh_triangles)?;
        let kept = (Arc::clone(self), Arc::clone(&copy), Arc::clone(&scratch));
        let triangles = geometry(Some(&copy), count, self.opaque);
        let instances = instance(Some(&self.instances));
        let whole = wgpu::BufferSize::new(bytes).map(|size| hal::BufferCopy { src_offset: 0, dst_offset: 0, size });
        let (all, builds) = (vk::PipelineStageFlags::ALL_COMMANDS, vk::PipelineStageFlags::ACCELERATION_STRUCTURE_BUILD_KHR);
        let commands = self.vulkan.commands("ray_pipeline_scene", kept, |commands| {
            // SAFETY: all objects are of this device and live until the commands have run, as `kept` holds them; each command's
            // input was written before the barrier in front of it; the sizes are those that the levels were made for.
            unsafe {
                self.vulkan.barrier(commands, all, all);
                commands.copy_buffer_to_buffer(&source, &copy, whole.into_iter());
                self.vulkan.barrier(commands, all, builds);
                commands.build_acceleration_structures(1, [build(&triangles, &self.bottom, &scratch)]);
                self.vulkan.barrier(commands, builds, builds);
                commands.build_acceleration_structures(1, [build(&instances, &self.top, &scratch)]);
                self.vulkan.barrier(commands, builds, all);
            }
        });
        queue.submit([commands]);
        Ok(())
    }
}

fn vertices(parts: &SceneParts) -> u32 {
    (parts.bvh_triangles.size() / CORNER_BYTES) as u32
}

type Entries<'a> = hal::AccelerationStructureEntries<'a, Buffer>;

fn geometry(vertices: Option<&Buffer>, count: u32, opaque: bool) -> Entries<'_> {
    hal::AccelerationStructureEntries::Triangles(vec![hal::AccelerationStructureTriangles {
        vertex_buffer: vertices,
        vertex_format: wgpu::VertexFormat::Float32x3,
        first_vertex: 0,
        vertex_count: count,
        vertex_stride: CORNER_BYTES,
        indices: None,
        transform: None,
        flags: if opaque {
            hal::AccelerationStructureGeometryFlags::OPAQUE
        } else {
            hal::AccelerationStructureGeometryFlags::empty()
        },
    }])
}

fn instance(buffer: Option<&Buffer>) -> Entries<'_> {
    hal::AccelerationStructureEntries::Instances(hal::AccelerationStructureInstances { buffer, offset: 0, count: 1 })
}

/// How `destination` is built from `entries`.
fn build<'a>(
    entries: &'a Entries<'a>,
    destination: &'a hal::vulkan::AccelerationStructure,
    scratch_buffer: &'a Buffer,
) -> hal::BuildAccelerationStructureDescriptor<'a, Buffer, hal::vulkan::AccelerationStructure> {
    hal::BuildAccelerationStructureDescriptor {
        entries,
        mode: hal::AccelerationStructureBuildMode::Build,
        flags: FLAGS,
        source_acceleration_structure: None,
        destination_acceleration_structure: destination,
        scratch_buffer,
        scratch_buffer_offset: 0,
    }
}

/// A level that holds `entries`, and the bytes that building it takes.
fn level(vulkan: &Vulkan, entries: &Entries<'_>, format: hal::AccelerationStructureFormat) -> Result<(Level, u64), String> {
    let mut scratch = 0;
    let destroy = hal::vulkan::Device::destroy_acceleration_structure;
    let level = vulkan.make("acceleration structure", destroy, |hal| {
        let desc = hal::GetAccelerationStructureBuildSizesDescriptor { entries, flags: FLAGS };
        // SAFETY: the device was opened with acceleration structures.
        let sizes = unsafe { hal.get_acceleration_structure_build_sizes(&desc) };
        scratch = sizes.build_scratch_size;
        let size = sizes.acceleration_structure_size;
        let desc =
            hal::AccelerationStructureDescriptor { label: Some("ray_pipeline_scene"), size, format, allow_compaction: false };
        // SAFETY: the size is what the device said.
        unsafe { hal.create_acceleration_structure(&desc) }
    })?;
    Ok((level, scratch))
}

/// The instance: the bottom level where it stands.
fn place(vulkan: &Vulkan, bottom: &Level) -> Result<Owned<Buffer>, String> {
    // SAFETY: nothing is destroyed through the guard, and the level is of this device.
    let bytes = unsafe {
        let hal = vulkan.device.as_hal::<Api>().ok_or("the device is not Vulkan's")?;
        hal.tlas_instance_to_bytes(hal::TlasInstance {
            transform: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            custom_data: 0,
            mask: 0xff,
            blas_address: hal.get_acceleration_structure_device_address(bottom),
            pipeline_intersection_data_offset: 0,
        })
    };
    let uses = BufferUses::MAP_WRITE | BufferUses::TOP_LEVEL_ACCELERATION_STRUCTURE_INPUT;
    let buffer = vulkan.buffer("ray_pipeline_instance", bytes.len() as u64, uses)?;
    vulkan.write(&buffer, 0, &bytes)?;
    Ok(buffer)
}

/// All texels, as they are or as sRGB.
fn view(vulkan: &Vulkan, parts: &SceneParts, srgb: bool) -> Result<Owned<hal::vulkan::TextureView>, String> {
    let format = parts.texels.format();
    let desc = hal::TextureViewDescriptor {
        label: Some("ray_pipeline_texels"),
        format: if srgb { format.add_srgb_suffix() } else { format },
        dimension: wgpu::TextureViewDimension::D2Array,
        usage: TextureUses::RESOURCE,
        range: wgpu::ImageSubresourceRange::default(),
    };
    // SAFETY: the texture is of this device, was made to be viewed so, and outlives the view, as `parts` holds it.
    unsafe {
        let texture = parts.texels.as_hal::<Api>().ok_or("the texels are not Vulkan's, or were destroyed")?;
        vulkan.make("texels", hal::vulkan::Device::destroy_texture_view, |hal| hal.create_texture_view(&texture, &desc))
    }
}

fn bind(
    vulkan: &Vulkan,
    parts: &SceneParts,
    layout: &hal::vulkan::BindGroupLayout,
    views: &[Owned<hal::vulkan::TextureView>; 2],
    top: &Level,
) -> Result<Owned<hal::vulkan::BindGroup>, String> {
    let buffers = [&parts.bvh_triangles, &parts.triangles, &parts.materials];
    let [a, b, c] = buffers.map(alias);
    let aliases = [a?, b?, c?];
    let [a, b, c] = [0, 1, 2].map(|i| whole(&aliases[i], buffers[i].size()));
    let textures = [0, 1].map(|i| hal::TextureBinding { view: &*views[i], usage: TextureUses::RESOURCE });
    let entry = |(binding, resource_index)| hal::BindGroupEntry { binding, resource_index, count: 1 };
    let desc = hal::BindGroupDescriptor {
        label: Some("ray_pipeline_scene"),
        layout,
        buffers: &[a, b, c],
        samplers: &[],
        textures: &textures,
        acceleration_structures: &[&**top],
        external_textures: &[],
        entries: &[(1, 0), (2, 1), (3, 2), (5, 0), (6, 1), (8, 0)].map(entry),
    };
    // SAFETY: all are of this device and outlive the group, and the entries are those of the layout in its order.
    vulkan.make("bind group", hal::vulkan::Device::destroy_bind_group, |hal| unsafe { hal.create_bind_group(&desc) })
}
