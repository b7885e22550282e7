//! The graph from outside: planning, refusals and execution on the software adapter.

#![allow(clippy::unwrap_used, reason = "a helper of a test fails like the test")]
#![allow(clippy::float_cmp, reason = "sums of small whole numbers are exact")]

mod acceleration;
mod execution;
mod features;
mod frames;
mod fuzzed;
#[cfg(feature = "placement")]
mod layer;
#[cfg(feature = "placement")]
mod placement;
mod planning;
mod properties;
mod random;
mod refusals;
mod reload;
mod sharing;
mod tap;
#[cfg(feature = "placement")]
mod validation;

use lightloom_graph::{ComputeShader, Executor, Gpu, shader_struct};

shader_struct! {
    /// Params of the small kernels here.
    pub struct Amount {
        /// A factor or a summand.
        pub value: f32,
        /// Number of elements.
        pub count: u32,
    }
}

/// `target_words[i] = f(source_words[i])` over f32, with `Amount` as params.
pub(crate) fn kernel(label: &str, expression: &str) -> ComputeShader {
    let wgsl = format!(
        "struct Amount {{ value: f32, count: u32 }}
        @group(0) @binding(0) var<uniform> params: Amount;
        @group(0) @binding(1) var<storage, read> source_words: array<f32>;
        @group(0) @binding(2) var<storage, read_write> target_words: array<f32>;
        @compute @workgroup_size(64) fn {label}(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) n: vec3u) {{
            let i = id.x + id.y * n.x * 64u;
            if i < params.count {{ let x = source_words[i]; target_words[i] = {expression}; }}
        }}"
    );
    ComputeShader::from_wgsl(label, &wgsl).unwrap()
}

/// `words[i] = value + i` over f32.
pub(crate) fn fill() -> ComputeShader {
    ComputeShader::from_wgsl(
        "fill",
        "struct Amount { value: f32, count: u32 }
        @group(0) @binding(0) var<uniform> params: Amount;
        @group(0) @binding(1) var<storage, read_write> words: array<f32>;
        @compute @workgroup_size(64) fn fill(@builtin(global_invocation_id) id: vec3u) {
            if id.x < params.count { words[id.x] = params.value + f32(id.x); }
        }",
    )
    .unwrap()
}

/// An executor, or `None` and SKIPPED where there is no adapter.
pub(crate) fn executor() -> Option<Executor> {
    Gpu::for_tests().map(|gpu| Executor::new(&gpu))
}
