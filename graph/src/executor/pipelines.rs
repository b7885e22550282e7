//! Pipelines by shader, compiled when first needed.

use super::gate::Gate;
use crate::{
    ComputeShader, RasterShader, Sampler,
    error::GraphError,
    hash::FoldedMap,
    reflect::{Binding, BindingKind},
    shader::ShaderCore,
};
use std::{collections::HashMap, sync::Arc};

/// Pipelines kept however old they are; beyond that, those idle for [`IDLE_FRAMES`] go.
const KEPT: usize = 256;
const IDLE_FRAMES: u64 = 64;

/// Compiled pipelines and samplers.
#[derive(Debug, Default)]
pub(super) struct Pipelines {
    compute: HashMap<Arc<ShaderCore>, (Arc<Compute>, u64)>,
    raster: FoldedMap<RasterKey, (Arc<Raster>, u64)>,
    samplers: HashMap<Sampler, wgpu::Sampler>,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct RasterKey {
    core: Arc<ShaderCore>,
    cull: Option<wgpu::Face>,
    blend: Option<wgpu::BlendState>,
    depth_compare: wgpu::CompareFunction,
    formats: Formats,
}

/// Formats of the attachments and their samples.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Formats {
    pub(super) colors: Vec<Option<wgpu::TextureFormat>>,
    pub(super) depth: Option<wgpu::TextureFormat>,
    pub(super) samples: u32,
}

#[derive(Debug)]
pub(super) struct Compute {
    pub(super) pipeline: wgpu::ComputePipeline,
    pub(super) layouts: Vec<Option<wgpu::BindGroupLayout>>,
}

#[derive(Debug)]
pub(super) struct Raster {
    pub(super) pipeline: wgpu::RenderPipeline,
    pub(super) layouts: Vec<Option<wgpu::BindGroupLayout>>,
}

impl Pipelines {
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.compute.len() + self.raster.len()
    }

    /// Whether the shader is compiled.
    pub(super) fn has_compute(&self, shader: &ComputeShader) -> bool {
        self.compute.contains_key(&shader.core)
    }

    pub(super) fn compute(&mut self, gate: &Gate, shader: &ComputeShader, frame: u64) -> Result<Arc<Compute>, GraphError> {
        if let Some((found, last)) = self.compute.get_mut(&shader.core) {
            *last = frame;
            return Ok(Arc::clone(found));
        }
        let core = &shader.core;
        let made = gate.scoped(&format!("compiling `{}`", core.label), 0, || {
            let device = &gate.device;
            let (layouts, layout, module) = prepare(device, core);
            let constants = core.constants();
            let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(&core.label),
                layout: Some(&layout),
                module: &module,
                entry_point: Some(&core.label),
                compilation_options: wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() },
                cache: None,
            });
            Ok(Arc::new(Compute { pipeline, layouts }))
        })?;
        self.compute.insert(Arc::clone(core), (Arc::clone(&made), frame));
        Ok(made)
    }

    pub(super) fn raster(
        &mut self,
        gate: &Gate,
        shader: &RasterShader,
        formats: Formats,
        frame: u64,
    ) -> Result<Arc<Raster>, GraphError> {
        let key = RasterKey {
            core: Arc::clone(&shader.core),
            cull: shader.cull,
            blend: shader.blend,
            depth_compare: shader.depth_compare,
            formats,
        };
        if let Some((found, last)) = self.raster.get_mut(&key) {
            *last = frame;
            return Ok(Arc::clone(found));
        }
        let core = &shader.core;
        let made = gate.scoped(&format!("compiling `{}`", core.label), 0, || {
            let device = &gate.device;
            let (layouts, layout, module) = prepare(device, core);
            let constants = core.constants();
            let options = || wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
            let targets: Vec<Option<wgpu::ColorTargetState>> = key
                .formats
                .colors
                .iter()
                .map(|format| {
                    format.map(|format| wgpu::ColorTargetState {
                        format,
                        blend: shader.blend,
                        write_mask: wgpu::ColorWrites::ALL,
                    })
                })
                .collect();
            let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(&core.label),
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some(&shader.vertex),
                    compilation_options: options(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState { cull_mode: shader.cull, ..Default::default() },
                depth_stencil: key.formats.depth.map(|format| wgpu::DepthStencilState {
                    format,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(shader.depth_compare),
                    stencil: wgpu::StencilState::default(),
                    bias: wgpu::DepthBiasState::default(),
                }),
                multisample: wgpu::MultisampleState { count: key.formats.samples, ..Default::default() },
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(&shader.fragment),
                    compilation_options: options(),
                    targets: &targets,
                }),
                multiview_mask: None,
                cache: None,
            });
            Ok(Arc::new(Raster { pipeline, layouts }))
        })?;
        self.raster.insert(key, (Arc::clone(&made), frame));
        Ok(made)
    }

    pub(super) fn sampler(&mut self, device: &wgpu::Device, sampler: Sampler) -> wgpu::Sampler {
        let create = || {
            device.create_sampler(&wgpu::SamplerDescriptor {
                address_mode_u: sampler.wrap,
                address_mode_v: sampler.wrap,
                address_mode_w: sampler.wrap,
                mag_filter: sampler.filter,
                min_filter: sampler.filter,
                mipmap_filter: match sampler.filter {
                    wgpu::FilterMode::Nearest => wgpu::MipmapFilterMode::Nearest,
                    wgpu::FilterMode::Linear => wgpu::MipmapFilterMode::Linear,
                },
                ..Default::default()
            })
        };
        self.samplers.entry(sampler).or_insert_with(create).clone()
    }

    /// Drops pipelines idle for long, where there are many.
    pub(super) fn evict(&mut self, frame: u64) {
        if self.compute.len() + self.raster.len() > KEPT {
            self.compute.retain(|_, (_, last)| *last + IDLE_FRAMES > frame);
            self.raster.retain(|_, (_, last)| *last + IDLE_FRAMES > frame);
        }
    }
}

type Prepared = (Vec<Option<wgpu::BindGroupLayout>>, wgpu::PipelineLayout, wgpu::ShaderModule);

fn prepare(device: &wgpu::Device, core: &ShaderCore) -> Prepared {
    let groups = core.bindings.iter().map(|binding| binding.group as usize + 1).max().unwrap_or(0);
    let layouts: Vec<Option<wgpu::BindGroupLayout>> = (0..groups)
        .map(|group| {
            let entries: Vec<_> =
                core.bindings.iter().filter(|binding| binding.group as usize == group).map(layout_entry).collect();
            (!entries.is_empty()).then(|| {
                device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(&core.label), entries: &entries })
            })
        })
        .collect();
    let references: Vec<_> = layouts.iter().map(Option::as_ref).collect();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(&core.label),
        bind_group_layouts: &references,
        immediate_size: 0,
    });
    let source = wgpu::ShaderSource::Wgsl(core.source.flat.source().into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(&core.label), source });
    (layouts, layout, module)
}

fn layout_entry(binding: &Binding) -> wgpu::BindGroupLayoutEntry {
    let buffer =
        |ty, size| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: wgpu::BufferSize::new(size) };
    let ty = match &binding.kind {
        BindingKind::Uniform { size, .. } => buffer(wgpu::BufferBindingType::Uniform, *size),
        BindingKind::Storage { read_only, size, .. } => buffer(wgpu::BufferBindingType::Storage { read_only: *read_only }, *size),
        BindingKind::Texture { sample, view, multisampled } => {
            wgpu::BindingType::Texture { sample_type: *sample, view_dimension: *view, multisampled: *multisampled }
        }
        BindingKind::StorageTexture { format, access, view } => {
            wgpu::BindingType::StorageTexture { access: *access, format: *format, view_dimension: *view }
        }
        BindingKind::Sampler => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
        BindingKind::AccelerationStructure => wgpu::BindingType::AccelerationStructure { vertex_return: false },
    };
    wgpu::BindGroupLayoutEntry { binding: binding.number, visibility: binding.stages, ty, count: None }
}
