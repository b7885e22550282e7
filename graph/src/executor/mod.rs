//! Runs plans on a device.

mod bindings;
mod cache;
mod encode;
#[cfg(test)]
mod endurance;
mod gate;
mod heap;
mod history;
mod in_flight;
mod limits;
mod output;
mod pipelines;
mod placing;
mod plans;
mod pool;
mod prepare;
mod readback;
mod record;
mod timing;
mod zeros;

use crate::{
    Gpu, Graph, PassOrder, Sharing,
    declaration::{Declaration, ResourceKind},
    error::GraphError,
    plan::{Plan, PlanOptions},
};
use gate::Gate;
use heap::Heaps;
pub use in_flight::InFlight;
pub use output::{FrameOutput, PassTime, Progress};
pub use plans::{PlanCache, Planned};
pub(crate) use readback::texture_bytes;
use std::{
    ops::{ControlFlow, Range},
    sync::Arc,
    time::Instant,
};
pub use timing::TimingSource;

/// Runs frames on one device, and keeps what lives between them: plans, pipelines, pooled memory, history.
///
/// Frames may come from graphs of different names; each name has its own history. The executor takes the device's
/// lost-device callback, so that a lost device is an error and not a silent stop.
#[derive(Debug)]
pub struct Executor {
    gate: Gate,
    sharing: Sharing,
    timing: bool,
    source: TimingSource,
    limits: wgpu::Limits,
    /// Whether the adapter has memory for attachments that never leave their render pass.
    transient_attachments: bool,
    threads: usize,
    order: PassOrder,
    plans: PlanCache,
    replanned: String,
    pool: pool::Pool,
    /// Shared memory, or why there is none; `None` until it is first asked for.
    heaps: Option<Result<Heaps, String>>,
    history: history::Histories,
    pipelines: pipelines::Pipelines,
    zeros: zeros::Zeros,
    params: Option<wgpu::Buffer>,
    frame: u64,
    last_submission: Option<wgpu::SubmissionIndex>,
}

/// A frame on its way through the executor.
struct Frame<'f> {
    declaration: Declaration,
    plan: Arc<Plan>,
    objects: &'f [crate::graph::Object],
    initials: &'f [(usize, Arc<[u8]>)],
    params: &'f [u8],
    /// Per resource: the wgpu object, if a pass that runs uses it.
    physical: Vec<Physical>,
    /// Objects in shared memory, if the plan has such.
    layout: Option<Arc<heap::Layout>>,
}

/// The wgpu object behind a resource.
#[derive(Clone, Debug, Default, PartialEq)]
enum Physical {
    #[default]
    None,
    Texture(wgpu::Texture),
    /// A range of a buffer (bytes).
    Buffer {
        buffer: wgpu::Buffer,
        offset: u64,
        size: u64,
    },
    Tlas(wgpu::Tlas),
}

impl Physical {
    /// The range of the buffer that is meant.
    fn range(&self) -> Option<(wgpu::Buffer, Range<u64>)> {
        match self {
            Self::Buffer { buffer, offset, size } => Some((buffer.clone(), *offset..offset + size)),
            Self::None | Self::Texture(_) | Self::Tlas(_) => None,
        }
    }
}

type Observer<'a> = Option<&'a mut dyn FnMut(Progress<'_>) -> ControlFlow<()>>;

impl Executor {
    /// An executor on the device of `gpu`.
    pub fn new(gpu: &Gpu) -> Self {
        Self::from_device(gpu.device.clone(), gpu.queue.clone())
    }

    /// An executor on the caller's device. It replaces the device's lost-device callback.
    pub fn from_device(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let source = TimingSource::best(&device);
        let transient_attachments = device.adapter_info().transient_saves_memory == Some(true);
        Self {
            limits: device.limits(),
            transient_attachments,
            gate: Gate::new(device, queue),
            sharing: Sharing::default(),
            timing: true,
            source,
            threads: 1,
            order: PassOrder::default(),
            plans: PlanCache::new(),
            replanned: String::new(),
            pool: pool::Pool::default(),
            heaps: None,
            history: history::Histories::default(),
            pipelines: pipelines::Pipelines::default(),
            zeros: zeros::Zeros::default(),
            params: None,
            frame: 0,
            last_submission: None,
        }
    }

    /// How transient resources share memory from the next frame on.
    pub fn set_sharing(&mut self, sharing: Sharing) {
        self.sharing = sharing;
    }

    /// How passes are put in order from the next frame on.
    pub fn set_order(&mut self, order: PassOrder) {
        self.order = order;
    }

    /// Whether attachments that never leave their render pass get transient memory. At first, where the adapter says that
    /// this saves memory.
    pub fn set_transient_attachments(&mut self, transient: bool) {
        self.transient_attachments = transient;
    }

    /// Threads that record passes; 1 at first. Only frames of hundreds of passes can gain, where the driver leaves cores idle.
    pub fn set_threads(&mut self, threads: usize) {
        self.threads = threads.max(1);
    }

    /// Why the plan of the last frame was made anew: what changed since the frame before of that name. Empty if it came
    /// from the cache.
    pub fn why_replanned(&self) -> &str {
        &self.replanned
    }

    /// Whether passes are timed; on at first. A timed frame ends by a wait for the GPU.
    pub fn set_timing(&mut self, timing: bool) {
        self.timing = timing;
    }

    /// Takes times from `source` in place of the best for this device. A source it cannot serve gives no times.
    pub fn set_timing_source(&mut self, source: TimingSource) {
        self.source = source.served_by(self.device());
    }

    /// The device.
    pub fn device(&self) -> &wgpu::Device {
        &self.gate.device
    }

    /// The queue.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.gate.queue
    }

    /// Forgets all history: every `previous` is zero in the next frame.
    pub fn reset_history(&mut self) {
        self.history.clear();
    }

    /// Plans the frame, or finds its plan, and runs it. Waits for the GPU only if there is something to bring back:
    /// readbacks, or times.
    ///
    /// # Errors
    /// The declaration's mistakes, limits of the device, and what goes wrong on the GPU.
    pub fn execute(&mut self, graph: Graph<'_>) -> Result<FrameOutput, GraphError> {
        self.finish(graph, None)
    }

    /// As [`Executor::execute`]; `observer` is called after every pass marked heavy and at the end of the frame, each
    /// time with the GPU idle, and stops the frame by `Break`.
    ///
    /// # Errors
    /// As [`Executor::execute`], and [`GraphError::Cancelled`]. A cancelled frame leaves all history as it was.
    pub fn execute_observed(
        &mut self,
        graph: Graph<'_>,
        observer: &mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
    ) -> Result<FrameOutput, GraphError> {
        self.finish(graph, Some(observer))
    }

    /// As [`Executor::execute`], without waiting: the output comes later.
    ///
    /// # Errors
    /// As [`Executor::execute`], up to the submission.
    pub fn submit(&mut self, graph: Graph<'_>) -> Result<InFlight, GraphError> {
        self.run(graph, None)
    }

    fn finish(&mut self, graph: Graph<'_>, observer: Observer<'_>) -> Result<FrameOutput, GraphError> {
        let previous = self.last_submission.clone();
        let mut in_flight = self.run(graph, observer)?;
        if in_flight.mappings.is_empty() && in_flight.times.is_none() {
            // At most one frame runs behind the CPU, so that a loop of frames does not pile up.
            in_flight.submission = previous.or(in_flight.submission);
        }
        in_flight.wait()
    }

    fn run(&mut self, mut graph: Graph<'_>, mut observer: Observer<'_>) -> Result<InFlight, GraphError> {
        self.gate.alive()?;
        graph.check()?;
        let started = Instant::now();
        let options = PlanOptions {
            sharing: self.sharing,
            order: self.order,
            transient_attachments: self.transient_attachments,
            only_own_bytes: true,
        };
        let mut planned = self.plan(&graph.declaration, options)?;
        self.replanned.clone_from(&planned.reason);
        let plan_us = started.elapsed().as_secs_f64() * 1e6;
        let mut state = self.plans.take_state();
        let work: Vec<_> = std::mem::take(&mut graph.work).into_iter().map(Some).collect();
        let declaration = std::mem::take(&mut graph.declaration);
        let physical = vec![Physical::None; declaration.resources.len()];
        let mut frame = Frame {
            declaration,
            plan: Arc::clone(&planned.plan),
            objects: &graph.objects,
            initials: &graph.initials,
            params: &graph.params,
            physical,
            layout: None,
        };
        let ran = self.start(&mut frame, work, &mut planned, &mut state, &mut observer);
        self.plans.put_state(state);
        let (run, source) = ran?;
        let total = frame.plan.order.len();
        let name = |position: usize| &frame.declaration.passes[frame.plan.order[position]].name;
        if observer.is_some() {
            self.gate.wait(None)?;
            encode::observe(&mut observer, total, total, total.checked_sub(1).map_or("", |last| name(last)))?;
        }
        self.history.commit(&frame);
        let passes =
            run.times.iter().enumerate().map(|(position, &gpu_ms)| PassTime { name: name(position).clone(), gpu_ms }).collect();
        self.pool.evict(self.frame);
        if let Some(Ok(heaps)) = &mut self.heaps {
            heaps.commit(self.frame);
        }
        self.pipelines.evict(self.frame);
        self.plans.evict(self.frame);
        let output = FrameOutput {
            passes,
            culled: frame.plan.culled.clone(),
            memory: frame.plan.memory,
            live_bytes: frame.plan.live_bytes.clone(),
            sharing: planned.sharing,
            sharing_note: planned.note,
            pool_objects: self.pool.objects() + self.heaps().map_or(0, Heaps::objects),
            held_bytes: self.held_bytes(),
            plan_us,
            record_us: started.elapsed().as_secs_f64() * 1e6 - plan_us,
            cached_plan: planned.cached,
            plan_reason: planned.reason,
            timing_source: source,
            graph: graph.id,
            readbacks: vec![Vec::new(); graph.readbacks as usize],
        };
        let (staged, queries) = (run.staged, run.queries);
        let (mappings, times) = self.gate.scoped("a readback", 0, || {
            let mappings = staged.into_iter().map(readback::Mapping::begin).collect();
            Ok((mappings, queries.and_then(timing::Queries::begin)))
        })?;
        let (gate, submission) = (self.gate.clone(), self.last_submission.clone());
        Ok(InFlight { gate, output: Some(output), submission, mappings, times })
    }

    /// Checks the frame against the device, finds its objects, and submits it.
    fn start(
        &mut self,
        frame: &mut Frame<'_>,
        work: Vec<Option<crate::graph::Work<'_>>>,
        planned: &mut Planned,
        state: &mut plans::State,
        observer: &mut Observer<'_>,
    ) -> Result<(encode::Run, TimingSource), GraphError> {
        if !state.checked {
            limits::resources(&self.limits, self.gate.device.features(), frame)?;
            state.checked = true;
        }
        limits::work(&self.limits, self.gate.device.features(), &self.pipelines, frame, &work)?;
        self.frame += 1;
        let held = self.held_bytes();
        if self.place(frame, planned)? {
            // Another plan, whose state is another too.
            *state = plans::State::default();
        }
        let gate = self.gate.clone();
        let allocated = gate.scoped("allocation", held, || {
            self.allocate(frame, &mut state.acquired);
            Ok(())
        });
        if let Err(error) = allocated {
            self.pool.forget(self.frame);
            self.history.forget(self.frame);
            return Err(error);
        }
        let source = if self.timing { self.source } else { TimingSource::None };
        let during = format!("frame `{}`", frame.declaration.name);
        let run = gate.scoped(&during, held, || self.encode(frame, work, source, &mut state.cache, observer))?;
        self.gate.alive()?;
        Ok((run, source))
    }

    /// Finds the object of every resource in use.
    fn allocate(&mut self, frame: &mut Frame<'_>, acquired: &mut pool::Acquired) {
        let device = &self.gate.device;
        self.pool.acquire(device, frame, acquired, self.frame);
        self.history.acquire(device, &self.gate.queue, frame, self.frame);
        for (index, object) in frame.objects.iter().enumerate() {
            if frame.plan.lifetimes[index].is_some() {
                match object {
                    crate::graph::Object::Texture(texture) => frame.physical[index] = Physical::Texture(texture.clone()),
                    crate::graph::Object::Buffer(buffer) => {
                        let size = match &frame.declaration.resources[index].kind {
                            ResourceKind::Buffer(desc) => desc.padded(),
                            ResourceKind::Texture(_) | ResourceKind::Tlas => 0,
                        };
                        frame.physical[index] = Physical::Buffer { buffer: buffer.clone(), offset: 0, size };
                    }
                    crate::graph::Object::Tlas(tlas) => frame.physical[index] = Physical::Tlas(tlas.clone()),
                    crate::graph::Object::None => {}
                }
            }
        }
    }
}

/// Creates the object of a description, with the given wgpu usage bits.
fn create(device: &wgpu::Device, label: &str, kind: &ResourceKind, usage: u32) -> Physical {
    match kind {
        ResourceKind::Texture(desc) => Physical::Texture(device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: desc.extent(),
            mip_level_count: desc.mip_level_count,
            sample_count: desc.sample_count,
            dimension: desc.dimension,
            format: desc.format,
            usage: wgpu::TextureUsages::from_bits_truncate(usage),
            view_formats: &desc.view_formats,
        })),
        ResourceKind::Buffer(desc) => {
            let size = desc.padded();
            let usage = wgpu::BufferUsages::from_bits_truncate(usage);
            let buffer =
                device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false });
            Physical::Buffer { buffer, offset: 0, size }
        }
        // Always the caller's.
        ResourceKind::Tlas => Physical::None,
    }
}
