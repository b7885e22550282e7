// One level of the sums of importance: each texel is the sum of a quad of the finer level.

@group(0) @binding(0) var finer: texture_2d_array<f32>;
@group(0) @binding(1) var coarser: texture_storage_2d_array<r32float, write>;

@compute @workgroup_size(8, 8)
fn rsm_pyramid(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(coarser)) {
        return;
    }
    let corner = id.xy * 2u;
    let sum = textureLoad(finer, corner, id.z, 0).x + textureLoad(finer, corner + vec2u(1u, 0u), id.z, 0).x
        + textureLoad(finer, corner + vec2u(0u, 1u), id.z, 0).x + textureLoad(finer, corner + vec2u(1u, 1u), id.z, 0).x;
    textureStore(coarser, id.xy, id.z, vec4f(sum, 0.0, 0.0, 0.0));
}
