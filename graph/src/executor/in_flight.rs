//! A frame that was submitted and whose results are on their way.

use super::{FrameOutput, gate::Gate, readback::Mapping, timing::Times};
use crate::error::GraphError;
use std::{
    pin::Pin,
    task::{Context, Poll},
};

/// A submitted frame. Its output comes by [`InFlight::wait`], or by awaiting it.
///
/// ```no_run
/// # async fn frame(executor: &mut lightloom_graph::Executor, graph: lightloom_graph::Graph<'_>) -> Result<(), lightloom_graph::GraphError> {
/// let in_flight = executor.submit(graph)?;
/// // Other work while the GPU runs.
/// let output = in_flight.await?;
/// # Ok(()) }
/// ```
///
/// Dropping it forgets its readbacks; the frame still runs.
#[derive(Debug)]
#[must_use = "its readbacks come by `wait` or `await`"]
pub struct InFlight {
    pub(super) gate: Gate,
    pub(super) output: Option<FrameOutput>,
    pub(super) submission: Option<wgpu::SubmissionIndex>,
    /// Readbacks and times on their way.
    pub(super) mappings: Vec<Mapping>,
    pub(super) times: Option<Times>,
}

impl InFlight {
    /// Waits for the GPU to finish the frame.
    ///
    /// # Errors
    /// If the device is lost or a readback fails.
    pub fn wait(mut self) -> Result<FrameOutput, GraphError> {
        self.gate.wait(self.submission.take())?;
        self.collect()
    }

    /// Whether the results have arrived; never blocks.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn is_ready(&self) -> Result<bool, GraphError> {
        self.gate.poll()?;
        Ok(self.mappings.iter().all(Mapping::is_done) && self.times.as_ref().is_none_or(Times::is_done))
    }

    fn collect(&mut self) -> Result<FrameOutput, GraphError> {
        let finished = || GraphError::Gpu { during: "a readback".to_owned(), message: "polled after it was ready".to_owned() };
        let mut output = self.output.take().ok_or_else(finished)?;
        for mapping in self.mappings.drain(..) {
            let (index, bytes) = mapping.bytes(&self.gate)?;
            if let Some(slot) = output.readbacks.get_mut(index as usize) {
                *slot = bytes;
            }
        }
        if let Some(times) = self.times.take() {
            for (pass, time) in output.passes.iter_mut().zip(times.collect(&self.gate)?) {
                pass.gpu_ms = time;
            }
        }
        Ok(output)
    }
}

impl Future for InFlight {
    type Output = Result<FrameOutput, GraphError>;

    /// wgpu moves on only when polled, so the task is woken again at once until the frame is done.
    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        match self.is_ready() {
            Err(error) => Poll::Ready(Err(error)),
            Ok(true) => Poll::Ready(self.collect()),
            Ok(false) => {
                context.waker().wake_by_ref();
                Poll::Pending
            }
        }
    }
}
