// Blended sums of spherical splats, back in W·m⁻²·sr⁻¹ and 32 bits.

struct Params {
    size: vec2u,
    // One over what the sums are scaled by.
    unit: f32,
    // Largest number that a target holds.
    largest: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var indirect_sum: texture_2d<f32>;
@group(0) @binding(2) var caustic_sum: texture_2d<f32>;
@group(0) @binding(3) var indirect: texture_storage_2d<rgba32float, write>;
@group(0) @binding(4) var caustic: texture_storage_2d<rgba32float, write>;
// Pixels whose sum passed what the target holds.
@group(0) @binding(5) var<storage, read_write> overflowed: atomic<u32>;

@compute @workgroup_size(8, 8)
fn splat_resolve_spheres(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let sum = textureLoad(indirect_sum, id.xy, 0).rgb;
    if any(sum >= vec3f(params.largest)) {
        atomicAdd(&overflowed, 1u);
    }
    let caustic_part = min(textureLoad(caustic_sum, id.xy, 0).rgb, vec3f(params.largest));
    textureStore(indirect, id.xy, vec4f(min(sum, vec3f(params.largest)) * params.unit, 1.0));
    textureStore(caustic, id.xy, vec4f(caustic_part * params.unit, 1.0));
}
