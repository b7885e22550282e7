//! The shaders of fuzzed frames. What they write is called `goal`.

use super::invariants::HELD;
use lightloom_graph::{ComputeShader, RasterShader};
use std::sync::OnceLock;

pub(super) struct Shaders {
    /// Reads a buffer and writes one.
    pub(super) words: ComputeShader,
    /// Reads and writes one buffer.
    pub(super) update: ComputeShader,
    /// Reads a buffer that may be missing and one that WGSL may write, and writes a third.
    pub(super) choose: ComputeShader,
    /// Reads a texture and writes one.
    pub(super) texels: ComputeShader,
    pub(super) draw: RasterShader,
    /// As `draw`; reads a buffer that may be missing.
    pub(super) lit: RasterShader,
    /// As `draw`; writes a buffer.
    pub(super) count: RasterShader,
}

fn compute(label: &str, wgsl: &str) -> ComputeShader {
    ComputeShader::from_wgsl(label, wgsl).unwrap()
}

/// A raster shader of these variables, whose fragment stage does this.
fn raster(label: &str, variables: &str, body: &str) -> RasterShader {
    let wgsl = format!(
        "{variables}
        struct Output {{ @location(0) color: u32 }}
        @vertex fn {label}_vertex() -> @builtin(position) vec4f {{ return vec4f(0.0); }}
        @fragment fn {label}_fragment() -> Output {{ {body} }}"
    );
    RasterShader::from_wgsl(label, &wgsl).unwrap()
}

pub(super) fn shaders() -> &'static Shaders {
    static SHADERS: OnceLock<Shaders> = OnceLock::new();
    SHADERS.get_or_init(|| Shaders {
        words: compute(
            "words",
            "@group(0) @binding(0) var<storage, read> a: array<u32>;
            @group(0) @binding(1) var<storage, read_write> goal: array<u32>;
            @compute @workgroup_size(64) fn words(@builtin(global_invocation_id) id: vec3u) { goal[id.x] = a[id.x]; }",
        ),
        update: compute(
            "update",
            "@group(0) @binding(1) var<storage, read_write> goal: array<u32>;
            @compute @workgroup_size(64) fn update(@builtin(global_invocation_id) id: vec3u) { goal[id.x] += 1u; }",
        ),
        choose: compute(
            "choose",
            &format!(
                "@group(0) @binding(0) var<storage, read> a: array<u32>;
                @group(0) @binding(1) var<storage, read_write> {HELD}: array<u32>;
                @group(0) @binding(2) var<storage, read_write> goal: array<u32>;
                @compute @workgroup_size(64) fn choose(@builtin(global_invocation_id) id: vec3u) {{
                    goal[id.x] = max(a[id.x], {HELD}[id.x]);
                }}"
            ),
        ),
        texels: compute(
            "texels",
            "@group(0) @binding(0) var a: texture_2d<u32>;
            @group(0) @binding(1) var goal: texture_storage_2d<r32uint, write>;
            @compute @workgroup_size(8, 8) fn texels(@builtin(global_invocation_id) id: vec3u) {
                textureStore(goal, id.xy, textureLoad(a, id.xy, 0));
            }",
        ),
        draw: raster("draw", "", "return Output(0u);"),
        lit: raster("lit", "@group(0) @binding(0) var<storage, read> a: array<u32>;", "return Output(a[0]);"),
        count: raster(
            "count",
            "@group(0) @binding(0) var<storage, read_write> goal: array<u32>;",
            "goal[0] = 1u; return Output(0u);",
        ),
    })
}
