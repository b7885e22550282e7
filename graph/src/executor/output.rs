//! What a frame gives back.

use super::TimingSource;
use crate::{Memory, Readback, Sharing, plan::Culled};
use std::sync::Arc;

/// How far a frame has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Progress<'a> {
    /// Passes finished.
    pub done: usize,
    /// Passes in the plan.
    pub total: usize,
    /// The last finished pass.
    pub pass: &'a str,
}

/// GPU time of one pass.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct PassTime {
    /// Name of the pass.
    pub name: Arc<str>,
    /// Time (ms); `None` if this pass could not be timed, or timing is off.
    pub gpu_ms: Option<f64>,
}

/// What a frame gives back.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FrameOutput {
    /// The passes that ran, in order.
    pub passes: Vec<PassTime>,
    /// The passes that did not, and why.
    pub culled: Vec<Culled>,
    /// Bytes of the frame's transient resources.
    pub memory: Memory,
    /// Bytes of transient resources in use at each pass that ran.
    pub live_bytes: Vec<u64>,
    /// How its transient resources shared memory.
    pub sharing: Sharing,
    /// Why it was not the way asked for; empty if it was.
    pub sharing_note: String,
    /// Objects the executor's pool and heaps hold now, of this and recent frames.
    pub pool_objects: usize,
    /// Bytes the executor's pool, heaps and histories hold now. For heaps these are bytes of device memory, as allocated.
    pub held_bytes: u64,
    /// Time to plan, or to find the plan in the cache (µs).
    pub plan_us: f64,
    /// Time to find or make objects, record and submit (µs); waits for heavy passes included.
    pub record_us: f64,
    /// Whether the plan came from the cache.
    pub cached_plan: bool,
    /// Why the plan was made anew; empty if it came from the cache.
    pub plan_reason: String,
    /// Where the times come from.
    pub timing_source: TimingSource,
    pub(super) graph: u64,
    pub(super) readbacks: Vec<Vec<u8>>,
}

impl FrameOutput {
    /// The bytes of a readback of this frame; empty for a readback of another frame.
    ///
    /// Textures come as tightly packed rows, row 0 on top, layer after layer.
    pub fn bytes(&self, readback: Readback) -> &[u8] {
        if readback.graph != self.graph {
            return &[];
        }
        self.readbacks.get(readback.index as usize).map_or(&[], Vec::as_slice)
    }

    /// The bytes of a readback as values of `T`; a last part of one is left out.
    pub fn cast<T: bytemuck::Pod>(&self, readback: Readback) -> Vec<T> {
        let bytes = self.bytes(readback);
        let whole = bytes.len() - bytes.len() % size_of::<T>().max(1);
        if size_of::<T>() == 0 { Vec::new() } else { bytemuck::pod_collect_to_vec(&bytes[..whole]) }
    }
}
