//! Adapters and devices: for programs and tests that bring no device of their own.

/// Environment variable that selects an adapter by part of its name or driver.
const ADAPTER: &str = "LIGHTLOOM_ADAPTER";
/// Environment variable under which a test that cannot run fails.
const REQUIRE: &str = "LIGHTLOOM_REQUIRE";

/// An adapter with a device and its queue.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// The adapter.
    pub adapter: wgpu::Adapter,
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
}

/// What to ask of an adapter.
#[derive(Clone, Debug, Default)]
pub struct GpuRequest {
    /// Part of the adapter's name or driver, in any case. `None`: the environment variable `LIGHTLOOM_ADAPTER`, or
    /// the fastest kind there is.
    pub adapter: Option<String>,
    /// Features that must be there.
    pub required_features: wgpu::Features,
    /// Features to enable where they are there. Timestamps are always among them.
    pub optional_features: wgpu::Features,
    /// Raise the limits from `WebGPU`'s defaults to all that the adapter has.
    pub max_limits: bool,
    /// Whether wgpu's experimental features may be among those enabled, such as ray queries. wgpu does not promise that
    /// safe code stays sound with them.
    pub experimental: bool,
    /// Prefer a software adapter, for tests.
    pub prefer_software: bool,
}

/// Why there is no device.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// No adapter at all.
    #[error(
        "no GPU adapter found: install a Vulkan, Metal or Direct3D 12 driver; on Debian or Ubuntu, `apt-get install mesa-vulkan-drivers` gives a software one"
    )]
    NoAdapter,
    /// None of that name.
    #[error("no adapter matches `{wanted}`; there are: {known}")]
    NoMatch {
        /// What was asked for.
        wanted: String,
        /// Adapters there are.
        known: String,
    },
    /// The adapter lacks a feature.
    #[error("adapter `{adapter}` lacks {features}; choose another by LIGHTLOOM_ADAPTER")]
    Features {
        /// Adapter.
        adapter: String,
        /// What it lacks.
        features: String,
    },
    /// The adapter gives less than `WebGPU`'s default limits.
    #[error("adapter `{adapter}` gives no device: {message}")]
    Device {
        /// Adapter.
        adapter: String,
        /// wgpu's words.
        message: String,
    },
}

/// One adapter of this machine.
#[derive(Clone, Debug)]
pub struct AdapterSummary {
    /// Name, driver and so on.
    pub info: wgpu::AdapterInfo,
    /// Features it offers.
    pub features: wgpu::Features,
    /// Limits it offers.
    pub limits: wgpu::Limits,
}

/// wgpu's leave to enable experimental features.
#[expect(unsafe_code, reason = "wgpu hands out its experimental features through an unsafe call alone")]
fn experimental(allowed: bool) -> wgpu::ExperimentalFeatures {
    if !allowed {
        return wgpu::ExperimentalFeatures::disabled();
    }
    // SAFETY: whoever made the request has set `GpuRequest::experimental`, whose documentation says what wgpu says. The only
    // such feature the graph uses itself is the ray query, through wgpu's checked interface.
    unsafe { wgpu::ExperimentalFeatures::enabled() }
}

fn all() -> Vec<wgpu::Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    // Validation layers are a developer's choice (WGPU_VALIDATION), not something a release run should look for.
    descriptor.flags = wgpu::InstanceFlags::empty().with_env();
    descriptor.backends = wgpu::Backends::from_env().unwrap_or(wgpu::Backends::PRIMARY);
    let instance = wgpu::Instance::new(descriptor);
    pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()))
}

/// Every adapter of this machine.
pub fn adapters() -> Vec<AdapterSummary> {
    all()
        .iter()
        .map(|adapter| AdapterSummary { info: adapter.get_info(), features: adapter.features(), limits: adapter.limits() })
        .collect()
}

fn describe(info: &wgpu::AdapterInfo) -> String {
    let driver = [info.driver.as_str(), info.driver_info.as_str()].join(" ");
    format!("{} ({}, {:?})", info.name, driver.trim(), info.backend)
}

/// Smaller is better.
fn rank(info: &wgpu::AdapterInfo, prefer_software: bool) -> u32 {
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Cpu => 4,
        wgpu::DeviceType::Other => 3,
    };
    if prefer_software && kind == 4 { 0 } else { kind + 1 }
}

impl Gpu {
    /// Finds an adapter and opens a device.
    ///
    /// # Errors
    /// If no adapter suits the request.
    pub fn new(request: &GpuRequest) -> Result<Self, GpuError> {
        let mut found = all();
        let from_env = std::env::var(ADAPTER).ok().filter(|name| !name.is_empty());
        if let Some(wanted) = request.adapter.clone().or(from_env) {
            let known: Vec<String> = found.iter().map(|adapter| describe(&adapter.get_info())).collect();
            let lower = wanted.to_lowercase();
            found.retain(|adapter| describe(&adapter.get_info()).to_lowercase().contains(&lower));
            if found.is_empty() && !known.is_empty() {
                return Err(GpuError::NoMatch { wanted, known: known.join("; ") });
            }
        }
        found.sort_by_key(|adapter| rank(&adapter.get_info(), request.prefer_software));
        let adapter = found.into_iter().next().ok_or(GpuError::NoAdapter)?;
        let name = describe(&adapter.get_info());
        let missing = request.required_features - adapter.features();
        if !missing.is_empty() {
            return Err(GpuError::Features { adapter: name, features: format!("{missing:?}") });
        }
        let mut optional =
            request.optional_features | wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS;
        if !request.experimental {
            optional = optional - wgpu::Features::all_experimental_mask();
        }
        let required_features = request.required_features | (adapter.features() & optional);
        let mut required_limits = if request.max_limits { adapter.limits() } else { wgpu::Limits::default() };
        if required_features.contains(wgpu::Features::EXPERIMENTAL_RAY_QUERY) {
            // WebGPU's defaults allow none.
            required_limits = required_limits.using_acceleration_structure_values(adapter.limits());
        }
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("lightloom"),
            required_features,
            required_limits,
            experimental_features: experimental(request.experimental),
            memory_hints: wgpu::MemoryHints::Performance,
            trace: wgpu::Trace::Off,
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|error| GpuError::Device { adapter: name, message: crate::reflect::chain(&error) })?;
        // wgpu's default is to panic; every call of the graph is inside an error scope, so what comes here is a
        // caller's own, and a library may not end the process for it.
        device.on_uncaptured_error(std::sync::Arc::new(|error| eprintln!("wgpu: {error}")));
        Ok(Self { adapter, device, queue })
    }

    /// A device for tests, on a software adapter where there is one. `None` prints SKIPPED and why.
    ///
    /// # Panics
    /// If there is none and the environment variable `LIGHTLOOM_REQUIRE` is set: then a test may not be skipped.
    pub fn for_tests() -> Option<Self> {
        Self::for_tests_with(wgpu::Features::empty())
    }

    /// As [`Gpu::for_tests`], with features that the adapter must have, experimental or not.
    ///
    /// # Panics
    /// As [`Gpu::for_tests`].
    pub fn for_tests_with(required_features: wgpu::Features) -> Option<Self> {
        let experimental = required_features.intersects(wgpu::Features::all_experimental_mask());
        let request = GpuRequest { required_features, experimental, prefer_software: true, ..GpuRequest::default() };
        match Self::new(&request) {
            Ok(gpu) => Some(gpu),
            Err(error) => {
                let required = std::env::var(REQUIRE).is_ok_and(|value| !value.is_empty());
                assert!(!required, "{REQUIRE} is set, and {error}");
                println!("SKIPPED: {error}");
                None
            }
        }
    }

    /// Name and driver of the adapter.
    pub fn adapter_name(&self) -> String {
        describe(&self.adapter.get_info())
    }
}
