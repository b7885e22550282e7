//! Records prepared steps into encoders, on one thread or on several.
//!
//! ```text
//!   items      a b c d e f   closure   g h i j
//!   recorded  [a b c][d e f] [closure] [g h][i j]     brackets: command buffers, in this order in one submission
//! ```
//!
//! Only closures, which belong to the caller's thread, are recorded there; what lies between them is cut into chunks.
//! The order of the commands, and which error is told when there are several, do not depend on the threads.

use super::{
    Frame, Physical,
    gate::Gate,
    pipelines,
    readback::{self, Staged},
    timing::Query,
};
use crate::{
    TextureDesc,
    closure::{ClosureContext, Record},
    declaration::{PassDecl, ResourceKind},
    error::GraphError,
    indirect::Draw,
};
use std::{ops::Range, sync::Arc};

/// One step of a plan, ready to be recorded.
pub(super) enum Item<'d, 'f> {
    Plain(Plain<'d>),
    Closure(ClosureItem<'d, 'f>),
    /// Commands recorded already: memory that changes hands.
    Commands(wgpu::CommandBuffer),
    /// wgpu is told of the textures that begin their life at this position.
    Begins(usize),
    /// Textures whose life ends at one of these positions go home.
    Ends(Range<usize>),
}

/// A step that any thread can record.
pub(super) struct Plain<'d> {
    pub(super) label: &'d str,
    pub(super) work: Work,
    pub(super) query: Option<Query>,
}

/// A closure pass.
pub(super) struct ClosureItem<'d, 'f> {
    pub(super) decl: &'d PassDecl,
    pub(super) record: Record<'f>,
    pub(super) query: Option<Query>,
}

/// What a plain step does.
pub(super) enum Work {
    Compute(Compute),
    Raster(Box<Raster>),
    Command(Box<Command>),
}

/// A dispatch.
pub(super) struct Compute {
    pub(super) pipeline: Arc<pipelines::Compute>,
    pub(super) groups: Arc<super::bindings::Groups>,
    pub(super) dispatch: Dispatch,
}

/// How many workgroups.
pub(super) enum Dispatch {
    Groups([u32; 3]),
    Indirect(wgpu::Buffer, u64),
}

/// A render pass.
pub(super) struct Raster {
    pub(super) colors: Vec<Option<(wgpu::TextureView, wgpu::Operations<wgpu::Color>)>>,
    /// View, operations, and whether it has a stencil.
    pub(super) depth: Option<(wgpu::TextureView, wgpu::Operations<f32>, bool)>,
    pub(super) draws: Vec<DrawCall>,
}

/// One draw of a render pass.
pub(super) struct DrawCall {
    /// Index of its pass.
    pub(super) pass: usize,
    pub(super) pipeline: Arc<pipelines::Raster>,
    pub(super) groups: Arc<super::bindings::Groups>,
    pub(super) draw: Draw,
    pub(super) indirect: Option<(wgpu::Buffer, u64)>,
}

/// A bare command. Buffers come with the range that is meant.
pub(super) enum Command {
    ClearBuffer((wgpu::Buffer, Range<u64>)),
    CopyBuffer((wgpu::Buffer, Range<u64>), (wgpu::Buffer, Range<u64>)),
    CopyTexture { from: wgpu::Texture, to: wgpu::Texture, desc: TextureDesc },
    Readback { source: Physical, kind: ResourceKind, staged: Staged },
}

/// Items that are worth a thread of their own: about what starting the thread costs.
const WORTH_A_THREAD: usize = 64;

/// What recording gives: command buffers in order, and the readbacks on their way.
#[derive(Default)]
pub(super) struct Recorded {
    pub(super) commands: Vec<wgpu::CommandBuffer>,
    pub(super) staged: Vec<Staged>,
}

/// What recording needs of the executor.
#[derive(Clone, Copy)]
pub(super) struct Recorder<'a> {
    pub(super) gate: &'a Gate,
    pub(super) frame: &'a Frame<'a>,
    pub(super) threads: usize,
}

impl Recorder<'_> {
    /// Records all items, in order.
    pub(super) fn record(self, items: Vec<Item<'_, '_>>) -> Result<Recorded, GraphError> {
        let mut recorded = Recorded::default();
        let mut open: Option<wgpu::CommandEncoder> = None;
        let mut plain: Vec<Plain<'_>> = Vec::with_capacity(items.len());
        for item in items {
            match item {
                Item::Plain(one) => plain.push(one),
                Item::Closure(closure) => {
                    self.plain(std::mem::take(&mut plain), &mut open, &mut recorded)?;
                    let encoder = open.get_or_insert_with(|| self.encoder());
                    recorded.commands.extend(self.closure(closure, encoder)?);
                }
                Item::Commands(commands) => {
                    self.plain(std::mem::take(&mut plain), &mut open, &mut recorded)?;
                    recorded.commands.extend(open.take().map(wgpu::CommandEncoder::finish));
                    recorded.commands.push(commands);
                }
                Item::Begins(position) => {
                    self.plain(std::mem::take(&mut plain), &mut open, &mut recorded)?;
                    if let Some(layout) = &self.frame.layout {
                        layout.begin(position, open.get_or_insert_with(|| self.encoder()));
                    }
                }
                Item::Ends(positions) => {
                    self.plain(std::mem::take(&mut plain), &mut open, &mut recorded)?;
                    if let Some(layout) = &self.frame.layout {
                        let encoder = open.get_or_insert_with(|| self.encoder());
                        positions.for_each(|position| layout.end(position, encoder));
                    }
                }
            }
        }
        self.plain(plain, &mut open, &mut recorded)?;
        recorded.commands.extend(open.map(wgpu::CommandEncoder::finish));
        Ok(recorded)
    }

    pub(super) fn encoder(self) -> wgpu::CommandEncoder {
        let label = Some(self.frame.declaration.name.as_str());
        self.gate.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label })
    }

    /// Records items without closures, on several threads where there are enough of them.
    fn plain(
        self,
        items: Vec<Plain<'_>>,
        open: &mut Option<wgpu::CommandEncoder>,
        recorded: &mut Recorded,
    ) -> Result<(), GraphError> {
        if items.is_empty() {
            return Ok(());
        }
        let threads = self.threads.min(items.len() / WORTH_A_THREAD);
        if threads <= 1 {
            self.all(&items, open.get_or_insert_with(|| self.encoder()));
        } else {
            recorded.commands.extend(open.take().map(wgpu::CommandEncoder::finish));
            let length = items.len().div_ceil(threads);
            let commands: Vec<Result<wgpu::CommandBuffer, GraphError>> = std::thread::scope(|scope| {
                let workers: Vec<_> = items.chunks(length).map(|chunk| scope.spawn(move || self.chunk(chunk))).collect();
                let lost = || GraphError::Gpu { during: "recording".to_owned(), message: "a thread panicked".to_owned() };
                workers.into_iter().map(|worker| worker.join().unwrap_or_else(|_| Err(lost()))).collect()
            });
            for command in commands {
                recorded.commands.push(command?);
            }
        }
        recorded.staged.extend(items.into_iter().filter_map(|item| match item.work {
            Work::Command(command) => match *command {
                Command::Readback { staged, .. } => Some(staged),
                _ => None,
            },
            _ => None,
        }));
        Ok(())
    }

    /// Error scopes belong to a thread, so each has its own.
    fn chunk(self, items: &[Plain<'_>]) -> Result<wgpu::CommandBuffer, GraphError> {
        self.gate.scoped(&format!("frame `{}`", self.frame.declaration.name), 0, || {
            let mut encoder = self.encoder();
            self.all(items, &mut encoder);
            Ok(encoder.finish())
        })
    }

    fn all(self, items: &[Plain<'_>], encoder: &mut wgpu::CommandEncoder) {
        let joins = |a: &Plain<'_>, b: &Plain<'_>| a.is_untimed_compute() && b.is_untimed_compute();
        for run in items.chunk_by(joins) {
            match &run[0].work {
                Work::Compute(_) => compute(run, encoder),
                Work::Raster(raster) => self.raster(raster, &run[0], encoder),
                Work::Command(command) => {
                    let item = &run[0];
                    if let Some(query) = &item.query {
                        query.mark(encoder, false);
                    }
                    encoder.push_debug_group(item.label);
                    command.record(encoder);
                    encoder.pop_debug_group();
                    if let Some(query) = &item.query {
                        query.mark(encoder, true);
                    }
                }
            }
        }
    }

    fn raster(self, raster: &Raster, item: &Plain<'_>, encoder: &mut wgpu::CommandEncoder) {
        let attachments: Vec<_> = raster
            .colors
            .iter()
            .map(|color| {
                color.as_ref().map(|(view, ops)| wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: *ops,
                })
            })
            .collect();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(item.label),
            color_attachments: &attachments,
            depth_stencil_attachment: raster.depth.as_ref().map(|(view, ops, stencil)| wgpu::RenderPassDepthStencilAttachment {
                view,
                depth_ops: Some(*ops),
                stencil_ops: stencil.then_some(wgpu::Operations { load: wgpu::LoadOp::Clear(0), store: ops.store }),
            }),
            timestamp_writes: item.query.as_ref().map(Query::raster),
            occlusion_query_set: None,
            multiview_mask: None,
        });
        let several = raster.draws.len() > 1;
        for draw in &raster.draws {
            if several {
                pass.push_debug_group(&self.frame.declaration.passes[draw.pass].name);
            }
            pass.set_pipeline(&draw.pipeline.pipeline);
            for (group, bind_group) in draw.groups.iter() {
                pass.set_bind_group(*group, bind_group, &[]);
            }
            match (&draw.indirect, draw.draw) {
                (Some((buffer, offset)), _) => pass.draw_indirect(buffer, *offset),
                (None, Draw::Given { vertices, instances }) => pass.draw(0..vertices, 0..instances),
                (None, Draw::Indirect(_)) => {}
            }
            if several {
                pass.pop_debug_group();
            }
        }
    }

    /// Records into `encoder`; gives the command buffers that go before what it holds in the end.
    fn closure(
        self,
        item: ClosureItem<'_, '_>,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<Vec<wgpu::CommandBuffer>, GraphError> {
        if let Some(query) = &item.query {
            query.mark(encoder, false);
        }
        encoder.push_debug_group(&item.decl.name);
        let (mut buffers, mut textures, mut structures) = (Vec::new(), Vec::new(), Vec::new());
        for access in &item.decl.accesses {
            let name = &*self.frame.declaration.resources[access.resource].name;
            match &self.frame.physical[access.resource] {
                Physical::Buffer { buffer, .. } => buffers.push((name, buffer)),
                Physical::Texture(texture) => textures.push((name, texture)),
                Physical::Tlas(tlas) => structures.push((name, tlas)),
                Physical::None => {}
            }
        }
        let (device, queue) = (&self.gate.device, &self.gate.queue);
        let (label, before) = (&*item.decl.name, Vec::new());
        let mut context = ClosureContext { device, queue, encoder, before, label, buffers, textures, structures };
        let at = || item.decl.place();
        (item.record.0)(&mut context).map_err(|message| GraphError::Closure { at: at(), message })?;
        let before = context.before;
        encoder.pop_debug_group();
        if let Some(query) = &item.query {
            query.mark(encoder, true);
        }
        Ok(before)
    }
}

impl Plain<'_> {
    fn is_untimed_compute(&self) -> bool {
        self.query.is_none() && matches!(self.work, Work::Compute(_))
    }
}

/// Records dispatches in one compute pass: wgpu puts the same barriers between its dispatches as between passes, and a
/// pass costs the CPU about as much as what is in it. A pass that is timed stands alone.
fn compute(run: &[Plain<'_>], encoder: &mut wgpu::CommandEncoder) {
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some(run[0].label),
        timestamp_writes: run[0].query.as_ref().map(Query::compute),
    });
    let mut last: Option<&Arc<pipelines::Compute>> = None;
    for item in run {
        let Work::Compute(compute) = &item.work else { continue };
        if run.len() > 1 {
            pass.insert_debug_marker(item.label);
        }
        if last.is_none_or(|last| !Arc::ptr_eq(last, &compute.pipeline)) {
            pass.set_pipeline(&compute.pipeline.pipeline);
            last = Some(&compute.pipeline);
        }
        for (group, bind_group) in compute.groups.iter() {
            pass.set_bind_group(*group, bind_group, &[]);
        }
        match &compute.dispatch {
            Dispatch::Groups([x, y, z]) => pass.dispatch_workgroups(*x, *y, *z),
            Dispatch::Indirect(buffer, offset) => pass.dispatch_workgroups_indirect(buffer, *offset),
        }
    }
}

impl Command {
    fn record(&self, encoder: &mut wgpu::CommandEncoder) {
        match self {
            Self::ClearBuffer((buffer, range)) => encoder.clear_buffer(buffer, range.start, Some(range.end - range.start)),
            Self::CopyBuffer((from, source), (to, target)) => {
                encoder.copy_buffer_to_buffer(from, source.start, to, target.start, target.end - target.start);
            }
            Self::CopyTexture { from, to, desc } => copy_texture(encoder, from, to, desc),
            Self::Readback { source, kind, staged } => readback::copy(encoder, source, kind, staged),
        }
    }
}

/// Copies all mips and layers. One layer at a time: wgpu 30 panics where a copy's layers are in more than two states.
fn copy_texture(encoder: &mut wgpu::CommandEncoder, from: &wgpu::Texture, to: &wgpu::Texture, desc: &TextureDesc) {
    let layers = if desc.dimension == wgpu::TextureDimension::D3 { 1 } else { desc.size[2] };
    for mip in 0..desc.mip_level_count {
        let mut extent = desc.extent().mip_level_size(mip, desc.dimension).physical_size(desc.format);
        if desc.dimension != wgpu::TextureDimension::D3 {
            extent.depth_or_array_layers = 1;
        }
        for z in 0..layers {
            let part = |texture| wgpu::TexelCopyTextureInfo {
                texture,
                mip_level: mip,
                origin: wgpu::Origin3d { x: 0, y: 0, z },
                aspect: wgpu::TextureAspect::All,
            };
            encoder.copy_texture_to_texture(part(from), part(to), extent);
        }
    }
}
