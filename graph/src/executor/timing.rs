//! GPU time per pass.

use super::gate::Gate;
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

/// Timestamp queries of one frame. Passes take queries in the order they are recorded, so that no query between the first
/// and the last is left unwritten: resolving such a one is undefined.
#[derive(Debug)]
pub(super) struct Queries {
    sets: Vec<wgpu::QuerySet>,
    /// Per position in the plan's order: which of the timed passes it is.
    ordinals: Vec<Option<usize>>,
    taken: usize,
    inside_encoders: bool,
    resolved: Option<wgpu::Buffer>,
}

impl Queries {
    pub(super) fn new(device: &wgpu::Device, passes: usize) -> Self {
        let sets = (0..passes.div_ceil(PASSES))
            .map(|set| {
                device.create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("pass times"),
                    ty: wgpu::QueryType::Timestamp,
                    count: ((passes - set * PASSES).min(PASSES) * 2) as u32,
                })
            })
            .collect();
        let inside_encoders = device.features().contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);
        Self { sets, ordinals: vec![None; passes], taken: 0, inside_encoders, resolved: None }
    }

    /// Query set and first query of the pass at `position`.
    fn slot(&mut self, position: usize) -> Option<(&wgpu::QuerySet, u32)> {
        let ordinal = *self.ordinals.get_mut(position)?.get_or_insert_with(|| {
            self.taken += 1;
            self.taken - 1
        });
        let set = self.sets.get(ordinal / PASSES)?;
        Some((set, (ordinal % PASSES * 2) as u32))
    }

    pub(super) fn compute(&mut self, position: usize) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let (query_set, first) = self.slot(position)?;
        Some(wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    pub(super) fn raster(&mut self, position: usize) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        let (query_set, first) = self.slot(position)?;
        Some(wgpu::RenderPassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    /// Begins (`end` false) or ends the time of a pass made of bare commands, where the device can.
    pub(super) fn mark(&mut self, encoder: &mut wgpu::CommandEncoder, position: usize, end: bool) {
        if self.inside_encoders
            && let Some((set, first)) = self.slot(position)
        {
            encoder.write_timestamp(set, first + u32::from(end));
        }
    }

    /// Copies the results to where the CPU can read them; record it after the last pass.
    pub(super) fn resolve(&mut self, device: &wgpu::Device, encoder: &mut wgpu::CommandEncoder) {
        if self.taken == 0 {
            return;
        }
        let bytes = (self.taken * 16) as u64;
        let describe =
            |label, usage| wgpu::BufferDescriptor { label: Some(label), size: bytes, usage, mapped_at_creation: false };
        let resolve =
            device.create_buffer(&describe("pass times", wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC));
        let read =
            device.create_buffer(&describe("pass times, read", wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST));
        for (index, set) in self.sets.iter().enumerate().take(self.taken.div_ceil(PASSES)) {
            let first = index * PASSES;
            let passes = (self.taken - first).min(PASSES);
            encoder.resolve_query_set(set, 0..(passes * 2) as u32, &resolve, (first * 16) as u64);
        }
        encoder.copy_buffer_to_buffer(&resolve, 0, &read, 0, bytes);
        self.resolved = Some(read);
    }

    /// Times (ms) by position; call when the GPU is done.
    pub(super) fn times(&self, gate: &Gate) -> Result<Vec<Option<f64>>, GraphError> {
        let Some(buffer) = &self.resolved else { return Ok(vec![None; self.ordinals.len()]) };
        let bytes = super::readback::map(gate, buffer)?;
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&bytes);
        let period = f64::from(gate.queue.get_timestamp_period());
        let time = |ordinal: usize| {
            let (begin, end) = (ticks.get(ordinal * 2)?, ticks.get(ordinal * 2 + 1)?);
            Some(end.checked_sub(*begin)? as f64 * period / 1e6)
        };
        Ok(self.ordinals.iter().map(|ordinal| ordinal.and_then(time)).collect())
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
