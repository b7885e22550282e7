//! The pipeline, its shader binding table, and the command that traces.

use super::super::shader::STAGES;
use super::{Buffer, Owned, Structure, Vulkan, alias, layout, ray_entries, scene_entries, whole};
use ash::vk;
use lightloom_graph::wgpu::{
    self, BufferUses, hal,
    hal::{CommandEncoder as _, Device as _},
    naga::back::PipelineConstants,
};
use std::sync::Arc;

/// Rays in a row. Vulkan promises room for 128 times as many, which a list may exceed.
const ROW: u32 = 1 << 16;

/// The pipeline for scenes of some traits.
#[derive(Debug)]
pub(crate) struct Pipeline {
    shaders: Owned<hal::vulkan::RayTracingPipeline>,
    layout: Owned<hal::vulkan::PipelineLayout>,
    rays_layout: Owned<hal::vulkan::BindGroupLayout>,
    _scene_layout: Owned<hal::vulkan::BindGroupLayout>,
    table: Owned<Buffer>,
    /// Where the table's groups begin, and the bytes of one.
    groups: [u64; 3],
    stride: u64,
    vulkan: Arc<Vulkan>,
}

/// What one call of the pipeline reads and writes.
#[derive(Clone, Debug)]
pub(crate) struct Batch {
    /// One `LivePaths`: how many of the rays there are.
    pub(crate) live: wgpu::Buffer,
    pub(crate) rays: wgpu::Buffer,
    pub(crate) hits: wgpu::Buffer,
    /// Rays at most.
    pub(crate) places: u32,
}

impl Pipeline {
    /// From the SPIR-V of each stage. `any_hit`: candidates are looked at.
    pub(crate) fn new(device: &wgpu::Device, spirv: &[Vec<u32>; 4], any_hit: bool) -> Result<Arc<Self>, String> {
        let vulkan = Vulkan::of(device)?;
        let (rays_layout, scene_layout) = (layout(&vulkan, &ray_entries())?, layout(&vulkan, &scene_entries())?);
        let desc = hal::PipelineLayoutDescriptor {
            label: Some("trace_rays"),
            flags: hal::PipelineLayoutFlags::empty(),
            bind_group_layouts: &[Some(&*rays_layout), Some(&*scene_layout)],
            immediate_size: 0,
        };
        // SAFETY: the groups' layouts are of this device.
        let make = |hal: &hal::vulkan::Device| unsafe { hal.create_pipeline_layout(&desc) };
        let layout = vulkan.make("pipeline layout", hal::vulkan::Device::destroy_pipeline_layout, make)?;
        let shaders = shaders(&vulkan, &layout, spirv, any_hit)?;
        let (table, groups, stride) = table(&vulkan, &shaders)?;
        Ok(Arc::new(Self { shaders, layout, rays_layout, _scene_layout: scene_layout, table, groups, stride, vulkan }))
    }

    /// The commands that trace `batch` in `scene`, with the barriers before and behind. The buffers have the use of storage and
    /// the texels that of a resource; see `transition_resources`.
    pub(crate) fn trace(self: &Arc<Self>, scene: &Arc<Structure>, batch: &Batch) -> Result<wgpu::CommandBuffer, String> {
        let group = Arc::new(self.bind(batch)?);
        let kept = (Arc::clone(self), Arc::clone(scene), Arc::clone(&group), batch.clone());
        let [generation, miss, hit] =
            self.groups.map(|offset| hal::PipelineGroupData { buffer: &*self.table, offset, stride: self.stride, count: 1 });
        let extent = [batch.places.min(ROW), batch.places.div_ceil(ROW), 1];
        let (all, traces) = (vk::PipelineStageFlags::ALL_COMMANDS, vk::PipelineStageFlags::RAY_TRACING_SHADER_KHR);
        Ok(self.vulkan.commands("trace_rays", kept, |commands| {
            // SAFETY: all objects are of this device and live until the commands have run, as `kept` holds them; the groups are
            // of the layouts that the pipeline was made with, and the structure was built in an earlier submission.
            unsafe {
                self.vulkan.barrier(commands, all, traces);
                commands.begin_ray_tracing_pass(&hal::RayTracingPassDescriptor { label: Some("trace_rays") });
                commands.set_ray_tracing_pipeline(&self.shaders);
                commands.set_bind_group(&self.layout, 0, &group, &[]);
                commands.set_bind_group(&self.layout, 1, &scene.group, &[]);
                commands.trace_rays(extent, generation, miss, hit);
                commands.end_ray_tracing_pass();
                self.vulkan.barrier(commands, traces, all);
            }
        }))
    }

    fn bind(&self, batch: &Batch) -> Result<Owned<hal::vulkan::BindGroup>, String> {
        let buffers = [&batch.live, &batch.rays, &batch.hits];
        let [a, b, c] = buffers.map(alias);
        let aliases = [a?, b?, c?];
        let [a, b, c] = [0, 1, 2].map(|i| whole(&aliases[i], buffers[i].size()));
        let desc = hal::BindGroupDescriptor {
            label: Some("trace_rays"),
            layout: &*self.rays_layout,
            buffers: &[a, b, c],
            samplers: &[],
            textures: &[],
            acceleration_structures: &[],
            external_textures: &[],
            entries: &[0, 1, 2].map(|i| hal::BindGroupEntry { binding: i, resource_index: i, count: 1 }),
        };
        let destroy = hal::vulkan::Device::destroy_bind_group;
        // SAFETY: all are of this device and outlive the group, and the entries are those of the layout in its order.
        self.vulkan.make("bind group", destroy, |hal| unsafe { hal.create_bind_group(&desc) })
    }
}

fn shaders(
    vulkan: &Vulkan,
    layout: &hal::vulkan::PipelineLayout,
    spirv: &[Vec<u32>; 4],
    any_hit: bool,
) -> Result<Owned<hal::vulkan::RayTracingPipeline>, String> {
    let mut modules = Vec::with_capacity(spirv.len());
    for words in spirv {
        // The checks of SPIR-V are those that `shader` had it written with.
        let desc =
            hal::ShaderModuleDescriptor { label: Some("trace_rays"), runtime_checks: wgpu::ShaderRuntimeChecks::default() };
        // SAFETY: naga has validated the shaders.
        modules.push(vulkan.make("shader", hal::vulkan::Device::destroy_shader_module, |hal| unsafe {
            hal.create_shader_module(&desc, hal::ShaderInput::SpirV(words))
        })?);
    }
    let constants = PipelineConstants::default();
    let stage = |i: usize| hal::ProgrammableStage {
        module: &*modules[i],
        entry_point: STAGES[i].1,
        constants: &constants,
        zero_initialize_workgroup_memory: false,
    };
    let hit = hal::RayObjectIntersectionState { closest_hit: stage(2), any_hit: any_hit.then(|| stage(3)) };
    let desc = hal::RayTracingPipelineDescriptor {
        label: Some("trace_rays"),
        layout,
        ray_generation: stage(0),
        miss: stage(1),
        intersection: &[hit],
        // Hits trace no rays.
        max_recursion_depth: 1,
        cache: None,
    };
    // SAFETY: the modules are of this device, and bind what the layout has.
    vulkan.make("pipeline", hal::vulkan::Device::destroy_ray_tracing_pipeline, |hal| unsafe {
        hal.create_ray_tracing_pipeline(&desc)
    })
}

/// The shader binding table: ray generation, miss and hit, each where a table may begin; the places and the bytes of one.
fn table(vulkan: &Vulkan, shaders: &hal::vulkan::RayTracingPipeline) -> Result<(Owned<Buffer>, [u64; 3], u64), String> {
    let stride = vulkan.group_bytes.next_multiple_of(vulkan.group_alignment);
    let apart = stride.next_multiple_of(vulkan.table_alignment);
    let uses = BufferUses::MAP_WRITE | BufferUses::RAY_TRACING_PIPELINE_SHADER_DATA;
    // Memory may begin anywhere, and hal does not say where a buffer wants to begin.
    let table = vulkan.buffer("trace_rays_table", 4 * apart, uses)?;
    // SAFETY: nothing is destroyed through the guard; table and shaders are of this device, which has buffer addresses, as hal
    // enables their extension with ray tracing, and the table has the use for it.
    let (address, handles) = unsafe {
        let hal = vulkan.device.as_hal::<super::Api>().ok_or("the device is not Vulkan's")?;
        let functions = ash::khr::buffer_device_address::Device::new(hal.shared_instance().raw_instance(), hal.raw_device());
        let info = vk::BufferDeviceAddressInfo::default().buffer(table.raw_handle());
        let handles = hal.get_raytracing_pipeline_group_data(shaders, 0..3).map_err(|error| error.to_string())?;
        (functions.get_buffer_device_address(&info), handles)
    };
    let first = address.next_multiple_of(vulkan.table_alignment) - address;
    let groups = [0, 1, 2].map(|i| first + i * apart);
    for (offset, handle) in groups.iter().zip(handles.chunks_exact(vulkan.group_bytes as usize)) {
        vulkan.write(&table, *offset, handle)?;
    }
    Ok((table, groups, stride))
}
