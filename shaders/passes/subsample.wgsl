// One pixel of each square of pixels: the nearest to its middle at which light is gathered, so that a square with such pixels never
// goes without; the middle itself where there is none.
#import "shared/gbuffer.wgsl"

struct SubsampleParams {
    size: vec2u,
    // Edge of a square (pixels).
    stride: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: SubsampleParams;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var small_position: texture_storage_2d<rgba32float, write>;
@group(0) @binding(4) var small_surface: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(8, 8)
fn subsample(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy * params.stride >= params.size) {
        return;
    }
    let first = id.xy * params.stride;
    let end = min(first + params.stride, params.size);
    let middle = vec2i(min(first + params.stride / 2u, params.size - 1u));
    var nearest = vec2u(middle);
    var least = 0x7fffffff;
    for (var y = first.y; y < end.y; y++) {
        for (var x = first.x; x < end.x; x++) {
            let apart = vec2i(vec2u(x, y)) - middle;
            let distance2 = apart.x * apart.x + apart.y * apart.y;
            if distance2 < least && gathers(textureLoad(surface, vec2u(x, y), 0)) {
                least = distance2;
                nearest = vec2u(x, y);
            }
        }
    }
    textureStore(small_position, id.xy, textureLoad(position, nearest, 0));
    textureStore(small_surface, id.xy, textureLoad(surface, nearest, 0));
}
