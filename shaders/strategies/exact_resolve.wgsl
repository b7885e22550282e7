// Copies the finished sums of `exact_gather` into the images a strategy returns.

struct Params {
    size: vec2u,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> indirect_sum: array<vec4f>;
@group(0) @binding(2) var<storage, read> caustic_sum: array<vec4f>;
@group(0) @binding(3) var indirect: texture_storage_2d<rgba32float, write>;
@group(0) @binding(4) var caustic: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn exact_resolve(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let index = id.y * params.size.x + id.x;
    textureStore(indirect, id.xy, vec4f(indirect_sum[index].rgb, 1.0));
    textureStore(caustic, id.xy, vec4f(caustic_sum[index].rgb, 1.0));
}
