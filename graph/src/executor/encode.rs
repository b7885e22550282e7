//! Records a plan's passes and submits them.
//!
//! ```text
//!   passes      a  b  c(heavy)  d
//!   submits    [a  b][c]  wait  [d]     (times by the CPU's clock: one submission and one wait for each)
//!   placed     [▲a, ▲b][▲c]  wait  [d]  (▲: memory changes hands, in a command buffer of its own)
//! ```

use super::{
    Executor, Frame, Observer, PassTime, Physical, Progress,
    bindings::{ParamsRange, Source},
    pipelines::Formats,
    readback::{self, Staged},
    timing::{Queries, TimingSource},
};
use crate::{
    closure::ClosureContext,
    declaration::{PassDecl, ResourceKind},
    error::GraphError,
    graph::Work,
};
use std::time::Instant;

/// What running a plan gives.
pub(super) struct Run {
    pub(super) times: Vec<PassTime>,
    pub(super) readbacks: Vec<Vec<u8>>,
}

/// Uniform offsets are multiples of this (bytes), the largest any device asks for.
const UNIFORM_ALIGN: u64 = 256;

impl Executor {
    /// Runs the frame's plan.
    pub(super) fn encode(
        &mut self,
        frame: &mut Frame<'_>,
        source: TimingSource,
        mut observer: Observer<'_>,
    ) -> Result<Run, GraphError> {
        let total = frame.plan.order.len();
        let params = self.upload_params(frame);
        let mut queries = (source == TimingSource::Timestamps).then(|| Queries::new(self.device(), total));
        let mut times: Vec<Option<f64>> = vec![None; total];
        let mut staged: Vec<Staged> = Vec::new();
        let mut encoder: Option<wgpu::CommandEncoder> = None;
        // Finished command buffers, to be submitted with the encoder's.
        let mut ready: Vec<wgpu::CommandBuffer> = Vec::new();
        let layout = frame.layout.clone();
        let plan = std::sync::Arc::clone(&frame.plan);
        for (position, &pass) in plan.order.iter().enumerate() {
            let own = source == TimingSource::CpuPerPass || frame.declaration.passes[pass].heavy;
            if own {
                self.submit(&mut ready, encoder.take());
                if source == TimingSource::CpuPerPass {
                    self.wait()?;
                }
            }
            let hand_over = layout.as_ref().and_then(|layout| layout.hand_over(self.device(), position));
            if let Some(hand_over) = hand_over {
                ready.extend(encoder.take().map(wgpu::CommandEncoder::finish));
                ready.push(hand_over);
            }
            let mut current = encoder.take().unwrap_or_else(|| {
                self.device().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(&frame.declaration.name) })
            });
            if let Some(layout) = &layout {
                layout.begin(position, &mut current);
            }
            self.pass(frame, position, &params, queries.as_mut(), &mut current, &mut staged)?;
            if let Some(layout) = &layout {
                layout.end(position, &mut current);
            }
            if !own {
                encoder = Some(current);
                continue;
            }
            let started = Instant::now();
            self.submit(&mut ready, Some(current));
            self.wait()?;
            if source == TimingSource::CpuPerPass {
                times[position] = Some(started.elapsed().as_secs_f64() * 1e3);
            }
            let decl = &frame.declaration.passes[pass];
            if decl.heavy && position + 1 < total {
                observe(&mut observer, position + 1, total, &decl.name)?;
            }
        }
        if let Some(queries) = &mut queries {
            let mut current = encoder
                .take()
                .unwrap_or_else(|| self.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default()));
            queries.resolve(self.device(), &mut current);
            encoder = Some(current);
        }
        let previous = self.last_submission.clone();
        self.submit(&mut ready, encoder.take());
        if queries.is_some() || !staged.is_empty() || observer.is_some() {
            self.wait()?;
        } else {
            // At most one frame runs behind the CPU, so that a loop of frames does not pile up.
            self.gate.wait(previous.or_else(|| self.last_submission.clone()))?;
        }
        if let Some(queries) = &queries {
            times = queries.times(&self.gate)?;
        }
        let mut readbacks = vec![Vec::new(); frame.readbacks as usize];
        for staged in &staged {
            if let Some(slot) = readbacks.get_mut(staged.index as usize) {
                *slot = staged.bytes(&self.gate)?;
            }
        }
        let name = |position: usize| &frame.declaration.passes[frame.plan.order[position]].name;
        observe(&mut observer, total, total, total.checked_sub(1).map_or("", |last| name(last)))?;
        let times =
            times.into_iter().enumerate().map(|(position, gpu_ms)| PassTime { name: name(position).clone(), gpu_ms }).collect();
        Ok(Run { times, readbacks })
    }

    /// Submits what is ready and then the encoder's commands, if there are any, in one go.
    fn submit(&mut self, ready: &mut Vec<wgpu::CommandBuffer>, encoder: Option<wgpu::CommandEncoder>) {
        ready.extend(encoder.map(wgpu::CommandEncoder::finish));
        if !ready.is_empty() {
            self.last_submission = Some(self.gate.queue.submit(ready.drain(..)));
        }
    }

    fn wait(&self) -> Result<(), GraphError> {
        self.gate.wait(None)
    }

    /// Puts the params of all passes into one uniform buffer; returns each pass's range, by position.
    fn upload_params(&mut self, frame: &Frame<'_>) -> Vec<ParamsRange> {
        let mut bytes: Vec<u8> = Vec::new();
        let ranges: Vec<ParamsRange> = frame
            .plan
            .order
            .iter()
            .map(|&pass| {
                let Some(Work::Compute { params: Some(params), .. } | Work::Raster { params: Some(params), .. }) =
                    &frame.work[pass]
                else {
                    return None;
                };
                let start = bytes.len() as u64;
                bytes.extend(params);
                bytes.resize(bytes.len().next_multiple_of(UNIFORM_ALIGN as usize), 0);
                Some(start..start + params.len() as u64)
            })
            .collect();
        if bytes.is_empty() {
            return ranges;
        }
        let needed = bytes.len() as u64;
        let device = &self.gate.device;
        let buffer = match self.params.take() {
            Some(buffer) if buffer.size() >= needed => buffer,
            _ => device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("params"),
                size: needed.next_power_of_two(),
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
        };
        self.gate.queue.write_buffer(&buffer, 0, &bytes);
        self.params = Some(buffer);
        ranges
    }

    /// Records one pass.
    fn pass(
        &mut self,
        frame: &mut Frame<'_>,
        position: usize,
        params: &[ParamsRange],
        mut queries: Option<&mut Queries>,
        encoder: &mut wgpu::CommandEncoder,
        staged: &mut Vec<Staged>,
    ) -> Result<(), GraphError> {
        let index = frame.plan.order[position];
        let Some(work) = frame.work[index].take() else { return Ok(()) };
        let frame = &*frame;
        let decl = &frame.declaration.passes[index];
        let device = self.gate.device.clone();
        let buffer = self.params.clone();
        let source =
            Source { device: &device, declaration: &frame.declaration, physical: &frame.physical, params: buffer.as_ref() };
        match work {
            Work::Compute { shader, bound, groups, .. } => {
                let compute = self.pipelines.compute(&self.gate, &shader, self.frame)?;
                let bind_groups = source.groups(&shader.core, &compute.layouts, &bound, &params[position], &mut self.pipelines);
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                    label: Some(&decl.name),
                    timestamp_writes: queries.as_mut().and_then(|queries| queries.compute(position)),
                });
                pass.set_pipeline(&compute.pipeline);
                for (group, bind_group) in &bind_groups {
                    pass.set_bind_group(*group, bind_group, &[]);
                }
                pass.dispatch_workgroups(groups[0], groups[1], groups[2]);
            }
            Work::Raster { shader, bound, targets, vertices, instances, .. } => {
                let format = |resource: usize| match &frame.declaration.resources[resource].kind {
                    ResourceKind::Texture(desc) => Some(desc.format),
                    ResourceKind::Buffer(_) => None,
                };
                let formats = Formats {
                    colors: targets.colors.iter().map(|color| color.and_then(|(resource, _)| format(resource))).collect(),
                    depth: targets.depth.and_then(|(resource, _)| format(resource)),
                    samples: targets.samples,
                };
                let raster = self.pipelines.raster(&self.gate, &shader, formats, self.frame)?;
                let bind_groups = source.groups(&shader.core, &raster.layouts, &bound, &params[position], &mut self.pipelines);
                let view = |resource: usize| match &frame.physical[resource] {
                    Physical::Texture(texture) => Some(texture.create_view(&wgpu::TextureViewDescriptor {
                        usage: Some(wgpu::TextureUsages::RENDER_ATTACHMENT),
                        ..Default::default()
                    })),
                    _ => None,
                };
                let colors: Vec<_> =
                    targets.colors.iter().map(|color| color.and_then(|(resource, load)| Some((view(resource)?, load)))).collect();
                let depth = targets.depth.and_then(|(resource, load)| Some((view(resource)?, load, format(resource)?)));
                let attachments: Vec<_> = colors
                    .iter()
                    .map(|color| {
                        color.as_ref().map(|(view, load)| wgpu::RenderPassColorAttachment {
                            view,
                            depth_slice: None,
                            resolve_target: None,
                            ops: wgpu::Operations { load: *load, store: wgpu::StoreOp::Store },
                        })
                    })
                    .collect();
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some(&decl.name),
                    color_attachments: &attachments,
                    depth_stencil_attachment: depth.as_ref().map(|(view, load, format)| wgpu::RenderPassDepthStencilAttachment {
                        view,
                        depth_ops: Some(wgpu::Operations { load: *load, store: wgpu::StoreOp::Store }),
                        stencil_ops: format
                            .has_stencil_aspect()
                            .then_some(wgpu::Operations { load: wgpu::LoadOp::Clear(0), store: wgpu::StoreOp::Store }),
                    }),
                    timestamp_writes: queries.as_mut().and_then(|queries| queries.raster(position)),
                    occlusion_query_set: None,
                    multiview_mask: None,
                });
                pass.set_pipeline(&raster.pipeline);
                for (group, bind_group) in &bind_groups {
                    pass.set_bind_group(*group, bind_group, &[]);
                }
                pass.draw(0..vertices, 0..instances);
            }
            other => {
                if let Some(queries) = queries.as_mut() {
                    queries.mark(encoder, position, false);
                }
                encoder.push_debug_group(&decl.name);
                self.commands(frame, decl, other, encoder, staged)?;
                encoder.pop_debug_group();
                if let Some(queries) = queries.as_mut() {
                    queries.mark(encoder, position, true);
                }
            }
        }
        Ok(())
    }

    /// Records a pass made of bare commands.
    fn commands(
        &self,
        frame: &Frame<'_>,
        decl: &PassDecl,
        work: Work<'_>,
        encoder: &mut wgpu::CommandEncoder,
        staged: &mut Vec<Staged>,
    ) -> Result<(), GraphError> {
        let kind = |resource: usize| &frame.declaration.resources[resource].kind;
        match work {
            Work::ClearBuffer { buffer } => {
                if let (Physical::Buffer(object), ResourceKind::Buffer(desc)) = (&frame.physical[buffer], kind(buffer)) {
                    encoder.clear_buffer(object, 0, Some(desc.padded()));
                }
            }
            Work::CopyBuffer { from, to } => {
                if let (Physical::Buffer(from), Physical::Buffer(target), ResourceKind::Buffer(desc)) =
                    (&frame.physical[from], &frame.physical[to], kind(to))
                {
                    encoder.copy_buffer_to_buffer(from, 0, target, 0, desc.padded());
                }
            }
            Work::CopyTexture { from, to } => {
                if let (Physical::Texture(from), Physical::Texture(target), ResourceKind::Texture(desc)) =
                    (&frame.physical[from], &frame.physical[to], kind(to))
                {
                    copy_texture(encoder, from, target, desc);
                }
            }
            Work::Readback { resource, index } => {
                staged.extend(readback::stage(self.device(), encoder, index, kind(resource), &frame.physical[resource]));
            }
            Work::Closure(record) => {
                let (mut buffers, mut textures) = (Vec::new(), Vec::new());
                for access in &decl.accesses {
                    let name = frame.declaration.resources[access.resource].name.as_str();
                    match &frame.physical[access.resource] {
                        Physical::Buffer(buffer) => buffers.push((name, buffer)),
                        Physical::Texture(texture) => textures.push((name, texture)),
                        Physical::None => {}
                    }
                }
                let mut context = ClosureContext { device: self.device(), queue: self.queue(), encoder, buffers, textures };
                (record.0)(&mut context).map_err(|message| GraphError::Closure { at: decl.place(), message })?;
            }
            Work::Compute { .. } | Work::Raster { .. } => {}
        }
        Ok(())
    }
}

/// Copies all mips and layers.
fn copy_texture(encoder: &mut wgpu::CommandEncoder, from: &wgpu::Texture, to: &wgpu::Texture, desc: &crate::TextureDesc) {
    for mip in 0..desc.mip_level_count {
        let part = |texture| wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: mip,
            origin: wgpu::Origin3d::ZERO,
            aspect: wgpu::TextureAspect::All,
        };
        let extent = desc.extent().mip_level_size(mip, desc.dimension).physical_size(desc.format);
        encoder.copy_texture_to_texture(part(from), part(to), extent);
    }
}

fn observe(observer: &mut Observer<'_>, done: usize, total: usize, pass: &str) -> Result<(), GraphError> {
    let Some(observe) = observer else { return Ok(()) };
    if observe(Progress { done, total, pass }).is_break() { Err(GraphError::Cancelled { done, total }) } else { Ok(()) }
}
