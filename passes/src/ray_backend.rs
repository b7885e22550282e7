//! What traces rays: the hierarchy in WGSL, which runs everywhere, or the device's ray queries.
//!
//! ```text
//! passes/trace_rays.wgsl ─┬─▶ shared/hit.wgsl                     what a hit is, alpha, the test of one triangle
//!                         └─▶ shared/bvh.wgsl                     trace_ray, unoccluded: the hierarchy
//! passes/ray_query/trace_rays.wgsl ─▶ shared/ray_query.wgsl       the same two, in its place
//! ```
//!
//! A scene says which one its rays take ([`GpuScene::with_rays`](crate::scene::GpuScene::with_rays)), and every pass that traces
//! follows: [`SceneShader`](crate::SceneShader) holds both versions of its kernel. Both know the triangles by the same indices, and
//! `t` and the barycentric weights are computed by one function of WGSL for both, so that an image changes with the backend only
//! where a ray meets an edge, or two surfaces at once.
//!
//! Ray-tracing pipelines are not among them: wgpu 30 has no interface to them.

use lightloom_graph::wgpu::{DeviceType, Features};
use lightloom_graph::{Gpu, GpuRequest};

/// How rays find surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum RayBackend {
    /// The compressed hierarchy of [`scene::bvh`](crate::scene::bvh), traversed in WGSL.
    #[default]
    Bvh,
    /// Ray queries: an acceleration structure that the device builds and traverses.
    RayQuery,
}

/// Why rays cannot be traced as asked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RayBackendError {
    /// The adapter has no ray queries.
    #[error(
        "adapter `{adapter}` has no ray queries (EXPERIMENTAL_RAY_QUERY): trace by `bvh`, which every adapter can, or choose \
         another adapter by LIGHTLOOM_ADAPTER"
    )]
    Lacking {
        /// The adapter.
        adapter: String,
    },
    /// The adapter may have them, and the device was opened without.
    #[error("the device was opened without ray queries: open it by a request that went through `RayBackend::enable`")]
    NotEnabled,
}

impl RayBackend {
    /// What a device must have for it.
    pub fn features(self) -> Features {
        match self {
            Self::Bvh => Features::empty(),
            Self::RayQuery => Features::EXPERIMENTAL_RAY_QUERY,
        }
    }

    /// The name on command lines and in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bvh => "bvh",
            Self::RayQuery => "ray-query",
        }
    }

    /// `request` with what [`Self::choose`] needs to have a choice. Ray queries are an experimental feature of wgpu; see
    /// [`GpuRequest::experimental`].
    #[must_use]
    pub fn enable(requested: Option<Self>, request: GpuRequest) -> GpuRequest {
        if requested == Some(Self::Bvh) {
            return request;
        }
        GpuRequest { optional_features: request.optional_features | Self::RayQuery.features(), experimental: true, ..request }
    }

    /// The backend that was asked for, or the better one of those that `gpu` has.
    ///
    /// Ray queries are better where hardware runs them. A software adapter's are not: lavapipe 25.0.7 takes five to seven times
    /// as long by ray queries as by the hierarchy (`cargo bench -p lightloom-passes --bench traversal`).
    ///
    /// # Errors
    /// [`RayBackendError`] for ray queries that the adapter has not, or that the device was opened without.
    pub fn choose(requested: Option<Self>, gpu: &Gpu) -> Result<Self, RayBackendError> {
        let enabled = gpu.device.features().contains(Self::RayQuery.features());
        match requested {
            Some(Self::RayQuery) if enabled => Ok(Self::RayQuery),
            Some(Self::RayQuery) if gpu.adapter.features().contains(Self::RayQuery.features()) => {
                Err(RayBackendError::NotEnabled)
            }
            Some(Self::RayQuery) => Err(RayBackendError::Lacking { adapter: gpu.adapter_name() }),
            None if enabled && gpu.adapter.get_info().device_type != DeviceType::Cpu => Ok(Self::RayQuery),
            Some(Self::Bvh) | None => Ok(Self::Bvh),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_for_is_chosen_or_refused_by_name() {
        let Some(plain) = Gpu::for_tests() else { return };
        assert_eq!(RayBackend::choose(Some(RayBackend::Bvh), &plain), Ok(RayBackend::Bvh));
        assert_eq!(RayBackend::choose(None, &plain), Ok(RayBackend::Bvh), "nothing else is enabled");
        let error = RayBackend::choose(Some(RayBackend::RayQuery), &plain).unwrap_err();
        let message = error.to_string();
        if plain.adapter.features().contains(RayBackend::RayQuery.features()) {
            assert_eq!(error, RayBackendError::NotEnabled);
            assert!(message.contains("RayBackend::enable"), "{message}");
        } else {
            for part in [plain.adapter_name().as_str(), "EXPERIMENTAL_RAY_QUERY", "`bvh`", "LIGHTLOOM_ADAPTER"] {
                assert!(message.contains(part), "`{message}` should say `{part}`");
            }
        }
    }

    #[test]
    fn an_adapter_that_has_ray_queries_can_be_asked_for_them() {
        let Some(probe) = Gpu::for_tests_with(RayBackend::RayQuery.features()) else { return };
        let request = GpuRequest { prefer_software: true, ..GpuRequest::default() };
        let gpu = Gpu::new(&RayBackend::enable(None, request.clone())).unwrap();
        assert_eq!(RayBackend::choose(Some(RayBackend::RayQuery), &gpu), Ok(RayBackend::RayQuery));
        let software = probe.adapter.get_info().device_type == DeviceType::Cpu;
        let better = if software { RayBackend::Bvh } else { RayBackend::RayQuery };
        assert_eq!(RayBackend::choose(None, &gpu), Ok(better), "queries in software are slower");
        let gpu = Gpu::new(&RayBackend::enable(Some(RayBackend::Bvh), request)).unwrap();
        assert!(!gpu.device.features().contains(RayBackend::RayQuery.features()), "no experiments unasked");
    }
}
