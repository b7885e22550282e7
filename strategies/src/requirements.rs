//! What a strategy needs of a device, checked before anything is built.

use lightloom_graph::wgpu;

/// Features and limits without which a strategy does not run.
///
/// The default is what WebGPU guarantees everywhere: no feature, and its default limits.
#[derive(Clone, Debug, Default)]
pub struct Requirements {
    /// Features the device must have been created with.
    pub features: wgpu::Features,
    /// Limits the device must reach.
    pub limits: wgpu::Limits,
}

impl Requirements {
    /// What a device with these features and limits lacks, one line for each lack; empty if it can run the strategy.
    pub fn missing(&self, features: wgpu::Features, limits: &wgpu::Limits) -> Vec<String> {
        let mut missing: Vec<String> =
            (self.features - features).iter_names().map(|(name, _)| format!("no feature {name}")).collect();
        self.limits.check_limits_with_fail_fn(limits, false, |name, wanted, allowed| {
            missing.push(format!("{name} is {allowed}, must be {wanted}"));
        });
        missing
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lacks_are_named() {
        let default = Requirements::default();
        assert!(default.missing(wgpu::Features::empty(), &wgpu::Limits::default()).is_empty(), "WebGPU is enough");

        let limits = wgpu::Limits { max_storage_buffers_per_shader_stage: 4, ..wgpu::Limits::default() };
        let greedy = Requirements { features: wgpu::Features::TIMESTAMP_QUERY, ..Requirements::default() };
        let missing = greedy.missing(wgpu::Features::empty(), &limits);
        assert_eq!(missing.len(), 2, "{missing:?}");
        assert!(
            missing[0].contains("TIMESTAMP_QUERY") && missing[1].contains("max_storage_buffers_per_shader_stage"),
            "{missing:?}"
        );
    }
}
