//! What executed frames took.

use crate::executor::{FrameOutput, PassTime, TimingSource};
use std::collections::HashMap;

/// Times of executed frames, for [`to_html`](crate::to_html) and [`to_chrome_trace`](crate::to_chrome_trace).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Profile {
    /// The adapter they ran on.
    pub adapter: String,
    /// The frames, in the order they ran.
    pub frames: Vec<FrameProfile>,
}

/// Times of one executed frame.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct FrameProfile {
    /// Name of the frame.
    pub frame: String,
    /// The passes that ran, in order.
    pub passes: Vec<PassTime>,
    /// Bytes of transient resources in use at each.
    pub live_bytes: Vec<u64>,
    /// Time to plan, or to find the plan in the cache (µs).
    pub plan_us: f64,
    /// Time to find or make objects, record and submit (µs); waits for heavy passes included.
    pub record_us: f64,
    /// Why the plan was made anew; empty if it came from the cache.
    pub plan_reason: String,
    /// Where the times come from.
    pub source: TimingSource,
}

impl Profile {
    /// A profile without frames.
    pub fn new(adapter: &str) -> Self {
        Self { adapter: adapter.to_owned(), frames: Vec::new() }
    }

    /// Adds a frame that ran.
    pub fn add(&mut self, frame: &str, output: &FrameOutput) {
        self.frames.push(FrameProfile::new(frame, output));
    }

    /// Where the times come from.
    pub fn source(&self) -> TimingSource {
        self.frames.iter().map(|frame| frame.source).find(|source| *source != TimingSource::None).unwrap_or_default()
    }

    /// Median GPU time (ms) by the pass's name, over the frames in which it was timed.
    pub fn medians(&self) -> HashMap<&str, f64> {
        let mut times: HashMap<&str, Vec<f64>> = HashMap::new();
        for pass in self.frames.iter().flat_map(|frame| &frame.passes) {
            if let Some(ms) = pass.gpu_ms.filter(|ms| ms.is_finite() && *ms >= 0.0) {
                times.entry(&pass.name).or_default().push(ms);
            }
        }
        let median = |mut times: Vec<f64>| {
            times.sort_by(f64::total_cmp);
            times[times.len() / 2]
        };
        times.into_iter().map(|(name, times)| (name, median(times))).collect()
    }
}

impl FrameProfile {
    /// What `output` says of times and memory.
    pub fn new(frame: &str, output: &FrameOutput) -> Self {
        Self {
            frame: frame.to_owned(),
            passes: output.passes.clone(),
            live_bytes: output.live_bytes.clone(),
            plan_us: output.plan_us,
            record_us: output.record_us,
            plan_reason: output.plan_reason.clone(),
            source: output.timing_source,
        }
    }
}

impl TimingSource {
    /// How the times were measured, for people.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Timestamps => "timestamps around each pass",
            Self::CpuPerPass => {
                "the CPU's clock around a submission and a wait per pass, since this driver's timestamps are wrong; includes the cost of submitting"
            }
            Self::None => "not measured: this adapter has no clock",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_leaves_out_what_was_not_timed() {
        let mut profile = Profile::new("test");
        for gpu_ms in [Some(3.0), None, Some(1.0), Some(f64::NAN), Some(2.0)] {
            let passes = vec![PassTime { name: "a".into(), gpu_ms }];
            profile.frames.push(FrameProfile { passes, ..FrameProfile::default() });
        }
        assert_eq!(profile.medians().get("a"), Some(&2.0));
        assert_eq!(profile.source(), TimingSource::None);
    }
}
