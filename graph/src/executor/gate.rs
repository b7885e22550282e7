//! The one way to the device: error scopes, waits, and knowing when it is lost.

use crate::error::GraphError;
use std::{
    hash::{DefaultHasher, Hash, Hasher},
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, Mutex, PoisonError, Weak},
};

/// Why a device was lost, if it was.
type Lost = Mutex<Option<String>>;

/// One flag per device: a device has one callback, and several executors may share a device.
static FLAGS: Mutex<Vec<(u64, Weak<Lost>)>> = Mutex::new(Vec::new());

/// The flag of `device`. An executor holds its device as long as its flag, so a hash with a live flag is that device's.
fn flag(device: &wgpu::Device) -> Arc<Lost> {
    let mut hasher = DefaultHasher::new();
    device.hash(&mut hasher);
    let hash = hasher.finish();
    let mut flags = FLAGS.lock().unwrap_or_else(PoisonError::into_inner);
    flags.retain(|(_, flag)| flag.strong_count() > 0);
    if let Some(found) = flags.iter().find(|(other, _)| *other == hash).and_then(|(_, flag)| flag.upgrade()) {
        return found;
    }
    let lost: Arc<Lost> = Arc::default();
    flags.push((hash, Arc::downgrade(&lost)));
    let weak = Arc::downgrade(&lost);
    device.set_device_lost_callback(move |reason, message| {
        if let Some(flag) = weak.upgrade() {
            *flag.lock().unwrap_or_else(PoisonError::into_inner) = Some(format!("{reason:?}: {message}"));
        }
    });
    lost
}

/// A device and its queue, with whether it was lost.
#[derive(Clone, Debug)]
pub(super) struct Gate {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    lost: Arc<Lost>,
}

impl Gate {
    pub(super) fn new(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let lost = flag(&device);
        Self { device, queue, lost }
    }

    /// Refuses a lost device.
    pub(super) fn alive(&self) -> Result<(), GraphError> {
        match self.lost.lock().unwrap_or_else(PoisonError::into_inner).clone() {
            Some(message) => Err(GraphError::DeviceLost { message }),
            None => Ok(()),
        }
    }

    /// Runs `action` with every wgpu error caught. `held`: bytes in the pool, for an out-of-memory message.
    pub(super) fn scoped<T>(
        &self,
        during: &str,
        held: u64,
        action: impl FnOnce() -> Result<T, GraphError>,
    ) -> Result<T, GraphError> {
        let scopes = [wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::Validation]
            .map(|filter| self.device.push_error_scope(filter));
        let result = action();
        let mut caught = None;
        for scope in scopes.into_iter().rev() {
            let error = pollster::block_on(scope.pop());
            // Being out of memory is the cause of what else went wrong.
            if matches!(error, Some(wgpu::Error::OutOfMemory { .. })) || caught.is_none() {
                caught = error.or(caught);
            }
        }
        if caught.is_some() {
            // A lost device refuses everything, and says that it is lost only when polled.
            self.poll()?;
        }
        self.alive()?;
        match (caught, result) {
            // Our own error is the more telling one, unless wgpu's explains it.
            (_, Err(error @ (GraphError::Cancelled { .. } | GraphError::OutOfMemory { .. } | GraphError::Gpu { .. }))) => {
                Err(error)
            }
            (Some(wgpu::Error::OutOfMemory { .. }), _) => Err(GraphError::OutOfMemory { during: during.to_owned(), bytes: held }),
            (_, Err(error)) => Err(error),
            (Some(error), Ok(_)) => Err(GraphError::Gpu { during: during.to_owned(), message: one_line(&error.to_string()) }),
            (None, Ok(value)) => Ok(value),
        }
    }

    /// Lets what has finished call back; never blocks.
    pub(super) fn poll(&self) -> Result<(), GraphError> {
        self.alive()?;
        // As for a wait: wgpu 30 panics when the device is lost meanwhile.
        let polled = catch_unwind(AssertUnwindSafe(|| self.device.poll(wgpu::PollType::Poll)));
        self.alive()?;
        match polled {
            Ok(Ok(_)) => Ok(()),
            Ok(Err(error)) => Err(GraphError::Gpu { during: "a poll".to_owned(), message: error.to_string() }),
            Err(_) => Err(GraphError::DeviceLost { message: "a poll failed".to_owned() }),
        }
    }

    /// Waits until `submission`, or all there is, has run.
    pub(super) fn wait(&self, submission: Option<wgpu::SubmissionIndex>) -> Result<(), GraphError> {
        self.alive()?;
        let one = submission.is_some();
        let poll = wgpu::PollType::Wait { submission_index: submission, timeout: None };
        // wgpu 30 panics in `poll` when the device is lost during the wait; there is no other way to wait.
        let polled = catch_unwind(AssertUnwindSafe(|| self.device.poll(poll)));
        self.alive()?;
        match polled {
            Ok(Ok(_)) => Ok(()),
            // A submission that a lost device never took; waiting for all there is says so.
            Ok(Err(_)) if one => self.wait(None),
            Ok(Err(error)) => Err(GraphError::Gpu { during: "a wait".to_owned(), message: error.to_string() }),
            Err(_) => Err(GraphError::DeviceLost { message: "a wait failed".to_owned() }),
        }
    }
}

/// wgpu's indented tree of causes as one line.
fn one_line(message: &str) -> String {
    let lines: Vec<&str> = message.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    lines.join(" ")
}
