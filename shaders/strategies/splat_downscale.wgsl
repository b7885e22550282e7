// The nearest and the farthest visible point of each block of 2 × 2 pixels, of those that gather light: the G-buffer of a half-sized target
// [SA19] §24.3.2.1.
//
// [SA19]: Smal and Aizenshtein, "Real-time global illumination with photon mapping", Ray Tracing Gems chapter 24, 2019.
#import "shared/gbuffer.wgsl"

struct Params {
    size: vec2u,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var nearest: texture_storage_2d<rgba32float, write>;
@group(0) @binding(4) var farthest: texture_storage_2d<rgba32float, write>;
@group(0) @binding(5) var farthest_surface: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(8, 8)
fn splat_downscale(@builtin(global_invocation_id) texel: vec3u) {
    if any(2u * texel.xy >= params.size) {
        return;
    }
    var near = vec4f(INFINITY);
    var far = vec4f(0.0);
    // Without a point: a surface that is not valid.
    var far_surface = vec4u(0u);
    for (var i = 0u; i < 4u; i++) {
        let pixel = 2u * texel.xy + vec2u(i & 1u, i >> 1u);
        if any(pixel >= params.size) {
            continue;
        }
        let point = textureLoad(position, pixel, 0);
        let code = textureLoad(surface, pixel, 0);
        if !gathers(code) {
            continue;
        }
        if point.w < near.w {
            near = point;
        }
        if point.w > far.w {
            far = point;
            far_surface = code;
        }
    }
    textureStore(nearest, texel.xy, near);
    textureStore(farthest, texel.xy, far);
    textureStore(farthest_surface, texel.xy, far_surface);
}
