//! What traces rays: the hierarchy in WGSL, which runs everywhere, the device's ray queries, or its ray-tracing pipelines.
//!
//! ```text
//! passes/trace_rays.wgsl ─┬─▶ shared/hit.wgsl                     what a hit is, alpha, the test of one triangle
//!                         └─▶ shared/bvh.wgsl                     trace_ray, unoccluded: the hierarchy
//! passes/ray_query/trace_rays.wgsl ─▶ shared/ray_query.wgsl       the same two, in its place
//! passes/ray_pipeline/trace_rays.wgsl ─▶ shared/hit.wgsl          a pipeline of its own, for lists of rays
//! ```
//!
//! A scene says which one its rays take ([`GpuScene::with_rays`](crate::scene::GpuScene::with_rays)), and every pass that traces
//! follows: [`SceneShader`](crate::SceneShader) holds both versions of its kernel. All know the triangles by the same indices, and
//! `t` and the barycentric weights are computed by one function of WGSL for all, so that an image changes with the backend only
//! where a ray meets an edge, or two surfaces at once.
//!
//! A pipeline serves [`TraceRays`](crate::TraceRays), and so the photons; kernels that trace inline keep to the hierarchy beside it.
//! wgpu 30 has no interface to pipelines: the feature `ray-pipeline` of this crate goes below it.

use crate::ray_pipeline;
use lightloom_graph::wgpu::{self, DeviceType, Features};
use lightloom_graph::{Gpu, GpuRequest};

/// How rays find surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum RayBackend {
    /// The compressed hierarchy of [`scene::bvh`](crate::scene::bvh), traversed in WGSL.
    #[default]
    Bvh,
    /// Ray queries: an acceleration structure that the device builds and traverses.
    RayQuery,
    /// A ray-tracing pipeline over such a structure, for lists of rays; other passes take the hierarchy. On Vulkan, where this crate
    /// was built with the feature `ray-pipeline`.
    Pipeline,
}

/// Why rays cannot be traced as asked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RayBackendError {
    /// This build has no code for it.
    #[error(
        "this build has no {}: build for Linux or Windows with the feature `{}`, or trace by `bvh`, which every build and adapter can",
        backend.words(), backend.name()
    )]
    NotBuilt {
        /// What was asked for.
        backend: RayBackend,
    },
    /// The adapter has none.
    #[error(
        "adapter `{adapter}` has no {} ({}): trace by `bvh`, which every adapter can, or choose another adapter by \
         LIGHTLOOM_ADAPTER",
        backend.words(), names(backend.features())
    )]
    Lacking {
        /// What was asked for.
        backend: RayBackend,
        /// The adapter.
        adapter: String,
    },
    /// The adapter may have them, and the device was opened without.
    #[error("the device was opened without {}: open it by a request that went through `RayBackend::enable`", backend.words())]
    NotEnabled {
        /// What was asked for.
        backend: RayBackend,
    },
    /// The driver does not make what it takes.
    #[error("the device refuses {}: {message}; trace by `bvh`, which every device can", backend.words())]
    Refused {
        /// What was asked for.
        backend: RayBackend,
        /// What failed, in the words of the driver's interface.
        message: String,
    },
}

/// Features as wgpu's documentation calls them.
fn names(features: Features) -> String {
    features.iter_names().map(|(name, _)| name).collect::<Vec<_>>().join(", ")
}

impl RayBackend {
    /// All there are, built or not.
    pub const ALL: [Self; 3] = [Self::Bvh, Self::RayQuery, Self::Pipeline];

    /// What a device must have for it.
    pub fn features(self) -> Features {
        match self {
            Self::Bvh => Features::empty(),
            Self::RayQuery => Features::EXPERIMENTAL_RAY_QUERY,
            Self::Pipeline => Features::EXPERIMENTAL_RAY_TRACING_PIPELINES,
        }
    }

    /// The name on command lines and in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bvh => "bvh",
            Self::RayQuery => "ray-query",
            Self::Pipeline => "ray-pipeline",
        }
    }

    /// What it is called in a sentence.
    fn words(self) -> &'static str {
        match self {
            Self::Bvh => "hierarchy",
            Self::RayQuery => "ray queries",
            Self::Pipeline => "ray-tracing pipelines",
        }
    }

    /// Whether this build has it.
    pub fn is_built(self) -> bool {
        self != Self::Pipeline || ray_pipeline::AVAILABLE
    }

    /// `request` with what [`Self::choose`] needs to have a choice. Ray queries and pipelines are experimental features of wgpu; see
    /// [`GpuRequest::experimental`].
    #[must_use]
    pub fn enable(requested: Option<Self>, request: GpuRequest) -> GpuRequest {
        let wanted = Self::ALL.into_iter().filter(|&backend| backend.is_built() && requested.is_none_or(|one| one == backend));
        let features = wanted.fold(Features::empty(), |all, backend| all | backend.features());
        let experimental = request.experimental || !features.is_empty();
        GpuRequest { optional_features: request.optional_features | features, experimental, ..request }
    }

    /// The backend that was asked for, or the best one of those that `gpu` has.
    ///
    /// Ray queries are best where hardware runs them: every pass takes them. Next come pipelines, for passes over lists of rays. A
    /// software adapter's are not better than the hierarchy: lavapipe 25.0.7 takes four to seven times as long by either
    /// (`cargo bench -p lightloom-passes --features ray-pipeline --bench traversal`).
    ///
    /// # Errors
    /// [`RayBackendError`] for what this build or the adapter has not, or that the device was opened without.
    pub fn choose(requested: Option<Self>, gpu: &Gpu) -> Result<Self, RayBackendError> {
        if let Some(backend) = requested {
            return match backend.check(&gpu.device) {
                Err(RayBackendError::NotEnabled { .. }) if !gpu.adapter.features().contains(backend.features()) => {
                    Err(RayBackendError::Lacking { backend, adapter: gpu.adapter_name() })
                }
                checked => checked.map(|()| backend),
            };
        }
        let hardware = gpu.adapter.get_info().device_type != DeviceType::Cpu;
        let better = [Self::RayQuery, Self::Pipeline].into_iter().find(|backend| backend.check(&gpu.device).is_ok());
        Ok(better.filter(|_| hardware).unwrap_or_default())
    }

    /// Whether this build has it and `device` was opened for it.
    pub(crate) fn check(self, device: &wgpu::Device) -> Result<(), RayBackendError> {
        if !self.is_built() {
            return Err(RayBackendError::NotBuilt { backend: self });
        }
        if !device.features().contains(self.features()) {
            return Err(RayBackendError::NotEnabled { backend: self });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Those that take a feature of the device.
    const EXPERIMENTAL: [RayBackend; 2] = [RayBackend::RayQuery, RayBackend::Pipeline];

    #[test]
    fn what_is_asked_for_is_chosen_or_refused_by_name() {
        let Some(plain) = Gpu::for_tests() else { return };
        assert_eq!(RayBackend::choose(Some(RayBackend::Bvh), &plain), Ok(RayBackend::Bvh));
        assert_eq!(RayBackend::choose(None, &plain), Ok(RayBackend::Bvh), "nothing else is enabled");
        for (backend, feature) in EXPERIMENTAL.into_iter().zip(["EXPERIMENTAL_RAY_QUERY", "EXPERIMENTAL_RAY_TRACING_PIPELINES"]) {
            let error = RayBackend::choose(Some(backend), &plain).unwrap_err();
            let message = error.to_string();
            if !backend.is_built() {
                assert_eq!(error, RayBackendError::NotBuilt { backend });
                assert!(message.contains("`ray-pipeline`") && message.contains("`bvh`"), "{message}");
            } else if plain.adapter.features().contains(backend.features()) {
                assert_eq!(error, RayBackendError::NotEnabled { backend });
                assert!(message.contains("RayBackend::enable"), "{message}");
            } else {
                for part in [plain.adapter_name().as_str(), feature, "`bvh`", "LIGHTLOOM_ADAPTER"] {
                    assert!(message.contains(part), "`{message}` should say `{part}`");
                }
            }
        }
    }

    #[test]
    fn what_an_adapter_has_can_be_asked_for() {
        for backend in EXPERIMENTAL.into_iter().filter(|backend| backend.is_built()) {
            let Some(probe) = Gpu::for_tests_with(backend.features()) else { continue };
            let request = GpuRequest { prefer_software: true, ..GpuRequest::default() };
            for requested in [None, Some(backend)] {
                let gpu = Gpu::new(&RayBackend::enable(requested, request.clone())).unwrap();
                assert_eq!(RayBackend::choose(Some(backend), &gpu), Ok(backend));
                let software = probe.adapter.get_info().device_type == DeviceType::Cpu;
                let best = EXPERIMENTAL.into_iter().find(|best| gpu.device.features().contains(best.features()));
                let best = best.filter(|_| !software).unwrap_or_default();
                assert_eq!(RayBackend::choose(None, &gpu), Ok(best), "in software the hierarchy is faster");
            }
            let other = EXPERIMENTAL.into_iter().find(|&other| other != backend);
            for requested in [Some(RayBackend::Bvh), other] {
                let gpu = Gpu::new(&RayBackend::enable(requested, request.clone())).unwrap();
                assert!(!gpu.device.features().contains(backend.features()), "no experiments unasked");
            }
        }
    }
}
