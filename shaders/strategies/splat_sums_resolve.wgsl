// The finished sums of splats, back from means of the light to its units.
#import "shared/splat_sums.wgsl"

struct Params {
    size: vec2u,
    // One over what the sums are scaled by.
    unit: f32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var first: texture_storage_2d<rgba32float, write>;
@group(0) @binding(2) var second: texture_storage_2d<rgba32float, write>;
// Word 1: pixels whose sum passed what it can hold.
@group(0) @binding(3) var<storage, read_write> stats: array<atomic<u32>>;

@compute @workgroup_size(8, 8)
fn splat_sums_resolve(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let sums = light_sums(id.y * params.size.x + id.x);
    if sums.overflowed {
        atomicAdd(&stats[1], 1u);
    }
    textureStore(first, id.xy, vec4f(sums.first * params.unit, 1.0));
    textureStore(second, id.xy, vec4f(sums.second * params.unit, 1.0));
}
