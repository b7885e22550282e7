// One strategy's indirect light with the caustics of another in place of its own (W·m⁻²·sr⁻¹). A thread per pixel.

struct Params {
    size: vec2u,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var indirect: texture_2d<f32>;
// The part of `indirect` that goes.
@group(0) @binding(2) var replaced: texture_2d<f32>;
@group(0) @binding(3) var caustic: texture_2d<f32>;
@group(0) @binding(4) var composed: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn composed_indirect(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.size) {
        return;
    }
    // Both are sums of terms that are not negative, those of one among those of the other: below 0 is rounding.
    let rest = max(textureLoad(indirect, pixel.xy, 0).rgb - textureLoad(replaced, pixel.xy, 0).rgb, vec3f(0.0));
    textureStore(composed, pixel.xy, vec4f(rest + textureLoad(caustic, pixel.xy, 0).rgb, 1.0));
}
