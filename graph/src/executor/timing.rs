//! GPU time per pass.

use super::{gate::Gate, readback::Mapped};
use crate::error::GraphError;

/// Where pass times come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum TimingSource {
    /// Nothing is timed.
    #[default]
    None,
    /// The GPU's timestamps at the beginning and end of each pass.
    Timestamps,
    /// The CPU's clock around a submission and a wait per pass: for Mesa's lavapipe before version 23, whose
    /// compute timestamps are wrong where compute and raster passes mix. Includes the cost of a submission.
    CpuPerPass,
}

impl TimingSource {
    /// The best this device has.
    pub(super) fn best(device: &wgpu::Device) -> Self {
        if old_lavapipe(&device.adapter_info()) { Self::CpuPerPass } else { Self::Timestamps.served_by(device) }
    }

    /// Itself, or `None` where the device cannot serve it.
    pub(super) fn served_by(self, device: &wgpu::Device) -> Self {
        match self {
            Self::Timestamps if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) => Self::None,
            source => source,
        }
    }
}

/// Mesa's software Vulkan driver before version 23.
fn old_lavapipe(info: &wgpu::AdapterInfo) -> bool {
    let text = format!("{} {}", info.name, info.driver).to_lowercase();
    (text.contains("llvmpipe") || text.contains("lavapipe")) && mesa_major(&info.driver_info).is_none_or(|major| major < 23)
}

/// 22 of "Mesa 22.3.6 (LLVM 15.0.6)".
fn mesa_major(driver_info: &str) -> Option<u32> {
    let version = driver_info.split("Mesa ").nth(1)?;
    version.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

/// Passes per query set; wgpu allows 4096 queries in a set.
const PASSES: usize = 2048;

/// Timestamp queries of one frame. Steps take queries in the order they are recorded, so that no query between the first
/// and the last is left unwritten: resolving such a one is undefined.
#[derive(Debug)]
pub(super) struct Queries {
    sets: Vec<wgpu::QuerySet>,
    /// Per query pair in the order taken: the position of the pass it times.
    positions: Vec<usize>,
    passes: usize,
    inside_encoders: bool,
    resolved: Option<wgpu::Buffer>,
}

/// The two queries of a step.
#[derive(Clone, Debug)]
pub(super) struct Query {
    set: wgpu::QuerySet,
    first: u32,
}

impl Query {
    pub(super) fn compute(&self) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.set,
            beginning_of_pass_write_index: Some(self.first),
            end_of_pass_write_index: Some(self.first + 1),
        }
    }

    pub(super) fn raster(&self) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.set,
            beginning_of_pass_write_index: Some(self.first),
            end_of_pass_write_index: Some(self.first + 1),
        }
    }

    /// Begins (`end` false) or ends the time of a step made of bare commands.
    pub(super) fn mark(&self, encoder: &mut wgpu::CommandEncoder, end: bool) {
        encoder.write_timestamp(&self.set, self.first + u32::from(end));
    }
}

impl Queries {
    /// Queries for `steps`, in a frame of `passes`.
    pub(super) fn new(device: &wgpu::Device, steps: usize, passes: usize) -> Self {
        let sets = (0..steps.div_ceil(PASSES))
            .map(|set| {
                device.create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("pass times"),
                    ty: wgpu::QueryType::Timestamp,
                    count: ((steps - set * PASSES).min(PASSES) * 2) as u32,
                })
            })
            .collect();
        let inside_encoders = device.features().contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);
        Self { sets, positions: Vec::with_capacity(steps), passes, inside_encoders, resolved: None }
    }

    /// The queries of the step that begins with the pass at `position`.
    pub(super) fn take(&mut self, position: usize) -> Option<Query> {
        let ordinal = self.positions.len();
        let set = self.sets.get(ordinal / PASSES)?.clone();
        self.positions.push(position);
        Some(Query { set, first: (ordinal % PASSES * 2) as u32 })
    }

    /// As [`Queries::take`] for a step made of bare commands, which not every device can time.
    pub(super) fn take_bare(&mut self, position: usize) -> Option<Query> {
        if self.inside_encoders { self.take(position) } else { None }
    }

    /// Copies the results to where the CPU can read them; record it after the last pass.
    pub(super) fn resolve(&mut self, device: &wgpu::Device, encoder: &mut wgpu::CommandEncoder) {
        let taken = self.positions.len();
        if taken == 0 {
            return;
        }
        let bytes = (taken * 16) as u64;
        let describe =
            |label, usage| wgpu::BufferDescriptor { label: Some(label), size: bytes, usage, mapped_at_creation: false };
        let resolve =
            device.create_buffer(&describe("pass times", wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC));
        let read =
            device.create_buffer(&describe("pass times, read", wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST));
        for (index, set) in self.sets.iter().enumerate().take(taken.div_ceil(PASSES)) {
            let first = index * PASSES;
            let passes = (taken - first).min(PASSES);
            encoder.resolve_query_set(set, 0..(passes * 2) as u32, &resolve, (first * 16) as u64);
        }
        encoder.copy_buffer_to_buffer(&resolve, 0, &read, 0, bytes);
        self.resolved = Some(read);
    }

    /// The times on their way; call when the resolve has been submitted.
    pub(super) fn begin(self) -> Option<Times> {
        let mapped = Mapped::begin(self.resolved?);
        Some(Times { mapped, positions: self.positions, passes: self.passes })
    }
}

/// Times on their way to the CPU.
#[derive(Debug)]
pub(super) struct Times {
    mapped: Mapped,
    positions: Vec<usize>,
    passes: usize,
}

impl Times {
    pub(super) fn is_done(&self) -> bool {
        self.mapped.is_done()
    }

    /// Times (ms) by position. Passes that share a render pass are timed together, at the first of them.
    pub(super) fn collect(self, gate: &Gate) -> Result<Vec<Option<f64>>, GraphError> {
        let bytes = self.mapped.bytes(gate)?;
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&bytes);
        let period = f64::from(gate.queue.get_timestamp_period());
        let mut times = vec![None; self.passes];
        for (ordinal, position) in self.positions.into_iter().enumerate() {
            if let (Some(begin), Some(end)) = (ticks.get(ordinal * 2), ticks.get(ordinal * 2 + 1)) {
                times[position] = end.checked_sub(*begin).map(|ticks| ticks as f64 * period / 1e6);
            }
        }
        Ok(times)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mesa_versions_are_parsed() {
        assert_eq!(mesa_major("Mesa 22.3.6 (LLVM 15.0.6)"), Some(22));
        assert_eq!(mesa_major("Mesa 25.0.7-2~bpo12+1"), Some(25));
        assert_eq!(mesa_major("550.54"), None);
    }
}
