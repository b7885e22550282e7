//! Turns the steps of a plan into what can be recorded without looking anything up: pipelines compiled, bind groups and
//! views found or made.

use super::{
    Executor, Frame, Physical,
    bindings::{Groups, Source, attachment_view},
    cache::{Cache, Key},
    pipelines::Formats,
    readback,
    record::{ClosureItem, Command, Compute, Dispatch, DrawCall, Item, Plain, Raster},
    timing::Queries,
};
use crate::{
    TextureDesc,
    declaration::{Origin, ResourceKind},
    error::GraphError,
    graph::{Cleared, Work},
    indirect::{Draw, Groups as Workgroups},
    raster::{Target, Targets},
    shader::ShaderCore,
    verify::{Bound, ParamsRange},
};
use std::sync::Arc;

/// What preparing the steps of a frame shares.
pub(super) struct Preparation<'a> {
    pub(super) queries: Option<&'a mut Queries>,
    pub(super) cache: &'a mut Cache,
}

impl Executor {
    /// Prepares the step of this number; takes its passes' work.
    pub(super) fn prepare<'d, 'f>(
        &mut self,
        frame: &'d Frame<'_>,
        work: &mut [Option<Work<'f>>],
        number: usize,
        shared: &mut Preparation<'_>,
    ) -> Result<Option<Item<'d, 'f>>, GraphError> {
        let step = frame.plan.steps[number].clone();
        let first = frame.plan.order[step.start];
        let decl = &frame.declaration.passes[first];
        let query = |shared: &mut Preparation<'_>| shared.queries.as_mut().and_then(|queries| queries.take(step.start));
        let bare = |shared: &mut Preparation<'_>| shared.queries.as_mut().and_then(|queries| queries.take_bare(step.start));
        match work[first].as_ref() {
            None => Ok(None),
            Some(Work::Raster { .. } | Work::ClearTexture { .. }) => {
                let raster = self.raster(frame, work, number, shared)?;
                let query = query(shared);
                Ok(raster.map(|raster| {
                    Item::Plain(Plain { label: &decl.name, work: super::record::Work::Raster(Box::new(raster)), query })
                }))
            }
            Some(_) => match work[first].take() {
                Some(Work::Compute { shader, bound, params, groups }) => {
                    let pipeline = self.pipelines.compute(&self.gate, &shader, self.frame)?;
                    let bind_groups =
                        self.bind_groups(frame, step.start, (&shader.core, &bound, params.as_ref()), &pipeline.layouts, shared);
                    let dispatch = match groups {
                        Workgroups::Given(groups) => Dispatch::Groups(groups),
                        Workgroups::Indirect(source) => match &frame.physical[source.resource] {
                            Physical::Buffer { buffer, offset, .. } => Dispatch::Indirect(buffer.clone(), offset + source.offset),
                            _ => return Ok(None),
                        },
                    };
                    let work = super::record::Work::Compute(Compute { pipeline, groups: bind_groups, dispatch });
                    Ok(Some(Item::Plain(Plain { label: &decl.name, work, query: query(shared) })))
                }
                Some(Work::Closure(record)) => Ok(Some(Item::Closure(ClosureItem { decl, record, query: bare(shared) }))),
                Some(other) => Ok(command(self.device(), frame, &other).map(|command| {
                    let work = super::record::Work::Command(Box::new(command));
                    Item::Plain(Plain { label: &decl.name, work, query: bare(shared) })
                })),
                None => Ok(None),
            },
        }
    }

    fn bind_groups(
        &mut self,
        frame: &Frame<'_>,
        position: usize,
        (core, bound, params): (&ShaderCore, &[Bound], Option<&ParamsRange>),
        layouts: &[Option<wgpu::BindGroupLayout>],
        shared: &mut Preparation<'_>,
    ) -> Arc<Groups> {
        let params_object = self.params.as_ref().zip(params).map(|(buffer, range)| Physical::Buffer {
            buffer: buffer.clone(),
            offset: range.start,
            size: range.end - range.start,
        });
        let objects = bound.iter().filter_map(|bound| match bound {
            Bound::Buffer { resource } | Bound::Texture { resource, .. } | Bound::Tlas { resource } => {
                Some(&frame.physical[*resource])
            }
            Bound::Params => params_object.as_ref(),
            Bound::Zeros | Bound::Sampler(_) => None,
        });
        let source = Source {
            device: &self.gate.device,
            declaration: &frame.declaration,
            physical: &frame.physical,
            params: self.params.as_ref(),
        };
        let key = Key { position, core, bound };
        let made = (&mut self.pipelines, &mut self.zeros);
        shared.cache.groups(&key, objects, || source.groups(core, layouts, bound, params, made))
    }

    /// A render pass of all draws and clears of a step.
    fn raster(
        &mut self,
        frame: &Frame<'_>,
        work: &mut [Option<Work<'_>>],
        number: usize,
        shared: &mut Preparation<'_>,
    ) -> Result<Option<Raster>, GraphError> {
        let step = frame.plan.steps[number].clone();
        let mut clears: Vec<Cleared> = Vec::new();
        let mut targets: Option<Targets> = None;
        let mut draws = Vec::new();
        for position in step.clone() {
            let pass = frame.plan.order[position];
            match work[pass].take() {
                Some(Work::ClearTexture { target }) => clears.push(target),
                Some(Work::Raster { shader, bound, params, targets: its, draw }) => {
                    let formats = formats(frame, &its);
                    let pipeline = self.pipelines.raster(&self.gate, &shader, formats, self.frame)?;
                    let groups =
                        self.bind_groups(frame, position, (&shader.core, &bound, params.as_ref()), &pipeline.layouts, shared);
                    let indirect = match draw {
                        Draw::Given { .. } => None,
                        Draw::Indirect(source) => match &frame.physical[source.resource] {
                            Physical::Buffer { buffer, offset, .. } => Some((buffer.clone(), offset + source.offset)),
                            _ => return Ok(None),
                        },
                    };
                    draws.push(DrawCall { pass, pipeline, groups, draw, indirect });
                    targets.get_or_insert(its);
                }
                _ => {}
            }
        }
        // A step of nothing but a clear is a render pass without draws.
        let targets = targets.unwrap_or_else(|| match clears.first() {
            Some(Cleared::Color(target)) => Targets { colors: vec![Some(*target)], depth: None, samples: 1 },
            Some(Cleared::Depth(target)) => Targets { colors: Vec::new(), depth: Some(*target), samples: 1 },
            None => Targets::default(),
        });
        Ok(attachments(frame, &targets, &clears, &step, shared.cache).map(|(colors, depth)| Raster { colors, depth, draws }))
    }
}

fn formats(frame: &Frame<'_>, targets: &Targets) -> Formats {
    let format = |resource: usize| texture(frame, resource).map(|desc| desc.format);
    Formats {
        colors: targets.colors.iter().map(|color| color.and_then(|target| format(target.resource))).collect(),
        depth: targets.depth.and_then(|target| format(target.resource)),
        samples: targets.samples,
    }
}

fn texture<'a>(frame: &'a Frame<'_>, resource: usize) -> Option<&'a TextureDesc> {
    match &frame.declaration.resources[resource].kind {
        ResourceKind::Texture(desc) => Some(desc),
        ResourceKind::Buffer(_) | ResourceKind::Tlas => None,
    }
}

type Colors = Vec<Option<(wgpu::TextureView, wgpu::Operations<wgpu::Color>)>>;
type Depth = Option<(wgpu::TextureView, wgpu::Operations<f32>, bool)>;

/// Views and operations. What nothing needs after the step is discarded; what a folded clear filled is cleared.
fn attachments(
    frame: &Frame<'_>,
    targets: &Targets,
    clears: &[Cleared],
    step: &std::ops::Range<usize>,
    cache: &mut Cache,
) -> Option<(Colors, Depth)> {
    let used = |resource: usize, part| Some((resource, part, texture(frame, resource)?, &frame.physical[resource]));
    let mut list = Vec::with_capacity(targets.colors.len() + 1);
    for target in targets.colors.iter().flatten() {
        list.push(used(target.resource, target.part)?);
    }
    if let Some(target) = &targets.depth {
        list.push(used(target.resource, target.part)?);
    }
    let objects: Vec<Physical> = list.iter().map(|(.., object)| (*object).clone()).collect();
    let views = cache.views(step.start, &objects, || {
        let view = |&(_, part, desc, object): &(usize, _, &TextureDesc, &Physical)| match object {
            Physical::Texture(texture) => Some(attachment_view(texture, desc, part)),
            _ => None,
        };
        list.iter().filter_map(view).collect()
    });
    let mut views = views.iter().cloned();
    let store = |resource: usize| {
        let ends = frame.plan.lifetimes[resource].is_some_and(|lifetime| lifetime.last < step.end);
        let decl = &frame.declaration.resources[resource];
        // wgpu wants to clear what was discarded before most other uses, and cannot clear a texture made outside of it.
        let attached = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TRANSIENT_ATTACHMENT;
        let clearable = frame.layout.is_none() || frame.plan.usages[resource] & !attached.bits() == 0;
        let discards = ends && decl.origin == Origin::Transient && !decl.keep && clearable;
        if discards { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store }
    };
    let mut colors = Vec::with_capacity(targets.colors.len());
    for target in &targets.colors {
        colors.push(match target {
            None => None,
            Some(target) => {
                let cleared = clears.iter().find_map(|clear| match clear {
                    Cleared::Color(clear) if same_place(clear, target) => Some(clear.load),
                    _ => None,
                });
                let load = cleared.unwrap_or(target.load);
                Some((views.next()?, wgpu::Operations { load, store: store(target.resource) }))
            }
        });
    }
    let depth = match &targets.depth {
        None => None,
        Some(target) => {
            let cleared = clears.iter().find_map(|clear| match clear {
                Cleared::Depth(clear) if same_place(clear, target) => Some(clear.load),
                _ => None,
            });
            let stencil = texture(frame, target.resource)?.format.has_stencil_aspect();
            let operations = wgpu::Operations { load: cleared.unwrap_or(target.load), store: store(target.resource) };
            Some((views.next()?, operations, stencil))
        }
    };
    Some((colors, depth))
}

fn same_place<V>(a: &Target<V>, b: &Target<V>) -> bool {
    a.resource == b.resource && a.part == b.part
}

/// A pass made of bare commands.
fn command(device: &wgpu::Device, frame: &Frame<'_>, work: &Work<'_>) -> Option<Command> {
    let kind = |resource: usize| &frame.declaration.resources[resource].kind;
    let physical = |resource: usize| frame.physical[resource].clone();
    match *work {
        Work::ClearBuffer { buffer } => Some(Command::ClearBuffer(physical(buffer).range()?)),
        Work::CopyBuffer { from, to } => Some(Command::CopyBuffer(physical(from).range()?, physical(to).range()?)),
        Work::CopyTexture { from, to } => match (physical(from), physical(to), kind(to)) {
            (Physical::Texture(from), Physical::Texture(to), ResourceKind::Texture(desc)) => {
                Some(Command::CopyTexture { from, to, desc: desc.clone() })
            }
            _ => None,
        },
        Work::Readback { resource, index } => {
            let source = physical(resource);
            let staged = readback::Staged::new(device, index, kind(resource));
            Some(Command::Readback { source, kind: kind(resource).clone(), staged })
        }
        Work::Compute { .. } | Work::Raster { .. } | Work::ClearTexture { .. } | Work::Closure(_) => None,
    }
}
