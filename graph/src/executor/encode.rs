//! Submits a plan's steps.
//!
//! ```text
//!   steps       a  b  c(heavy)  d
//!   submits    [a  b][c]  wait  [d]     (times by the CPU's clock: one submission and one wait for each)
//!   placed     [▲a, ▲b][▲c]  wait  [d]  (▲: memory changes hands, in a command buffer of its own)
//! ```

use super::{
    Executor, Frame, Observer, Progress,
    cache::Cache,
    prepare::Preparation,
    readback::Staged,
    record::{Item, Recorder},
    timing::{Queries, TimingSource},
};
use crate::{error::GraphError, graph::Work};
use std::time::Instant;

/// What is on its way after a plan was submitted.
pub(super) struct Run {
    /// Times (ms) by position, as far as the CPU's clock took them.
    pub(super) times: Vec<Option<f64>>,
    pub(super) queries: Option<Queries>,
    pub(super) staged: Vec<Staged>,
}

impl Executor {
    /// Runs the frame's plan, up to its last submission.
    pub(super) fn encode(
        &mut self,
        frame: &Frame<'_>,
        mut work: Vec<Option<Work<'_>>>,
        source: TimingSource,
        cache: &mut Cache,
        observer: &mut Observer<'_>,
    ) -> Result<Run, GraphError> {
        let total = frame.plan.order.len();
        self.upload_params(frame.params);
        let mut queries =
            (source == TimingSource::Timestamps).then(|| Queries::new(self.device(), frame.plan.steps.len(), total));
        let mut times: Vec<Option<f64>> = vec![None; total];
        let mut staged: Vec<Staged> = Vec::new();
        let mut batch: Vec<Item<'_, '_>> = Vec::with_capacity(frame.plan.steps.len());
        cache.begin(total, self.frame);
        let mut shared = Preparation { queries: queries.as_mut(), cache };
        for (number, step) in frame.plan.steps.iter().enumerate() {
            let decl = &frame.declaration.passes[frame.plan.order[step.start]];
            let own = source == TimingSource::CpuPerPass || decl.heavy;
            if own {
                self.flush(frame, &mut batch, &mut staged, None)?;
                if source == TimingSource::CpuPerPass {
                    self.wait()?;
                }
            }
            if let Some(layout) = &frame.layout
                && let Some(hand_over) = layout.hand_over(self.device(), step.start)
            {
                batch.push(Item::Commands(hand_over));
                batch.push(Item::Begins(step.start));
            }
            batch.extend(self.prepare(frame, &mut work, number, &mut shared)?);
            if frame.layout.as_ref().is_some_and(|layout| layout.ends(step)) {
                batch.push(Item::Ends(step.clone()));
            }
            if !own {
                continue;
            }
            let started = Instant::now();
            self.flush(frame, &mut batch, &mut staged, None)?;
            self.wait()?;
            if source == TimingSource::CpuPerPass {
                times[step.start] = Some(started.elapsed().as_secs_f64() * 1e3);
            }
            if decl.heavy && step.end < total {
                observe(observer, step.end, total, &decl.name)?;
            }
        }
        self.flush(frame, &mut batch, &mut staged, queries.as_mut())?;
        Ok(Run { times, queries, staged })
    }

    /// Records what has gathered and submits it, with the results of the queries at the end of the frame.
    fn flush(
        &mut self,
        frame: &Frame<'_>,
        batch: &mut Vec<Item<'_, '_>>,
        staged: &mut Vec<Staged>,
        queries: Option<&mut Queries>,
    ) -> Result<(), GraphError> {
        if batch.is_empty() && queries.is_none() {
            return Ok(());
        }
        let recorder = Recorder { gate: &self.gate, frame, threads: self.threads };
        let mut recorded = recorder.record(std::mem::take(batch))?;
        if let Some(queries) = queries {
            let mut encoder = recorder.encoder();
            queries.resolve(&self.gate.device, &mut encoder);
            recorded.commands.push(encoder.finish());
        }
        staged.append(&mut recorded.staged);
        self.last_submission = Some(self.gate.queue.submit(recorded.commands));
        Ok(())
    }

    fn wait(&self) -> Result<(), GraphError> {
        self.gate.wait(None)
    }

    /// Puts the params of all passes into one uniform buffer.
    fn upload_params(&mut self, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
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
        self.gate.queue.write_buffer(&buffer, 0, bytes);
        self.params = Some(buffer);
    }
}

pub(super) fn observe(observer: &mut Observer<'_>, done: usize, total: usize, pass: &str) -> Result<(), GraphError> {
    let Some(observe) = observer else { return Ok(()) };
    if observe(Progress { done, total, pass }).is_break() { Err(GraphError::Cancelled { done, total }) } else { Ok(()) }
}
