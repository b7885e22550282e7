// final = emitted + direct + openness · indirect (W·m⁻²·sr⁻¹).

struct ComposeParams {
    size: vec2u,
    // 1: the indirect light is occluded.
    occluded: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: ComposeParams;
@group(0) @binding(1) var direct: texture_2d<f32>;
@group(0) @binding(2) var indirect: texture_2d<f32>;
// 0 to 1 in each channel.
@group(0) @binding(3) var openness: texture_2d<f32>;
@group(0) @binding(4) var final_radiance: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn compose(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.size) {
        return;
    }
    let open = select(vec3f(1.0), textureLoad(openness, pixel.xy, 0).rgb, params.occluded == 1u);
    let sum = textureLoad(direct, pixel.xy, 0).rgb + open * textureLoad(indirect, pixel.xy, 0).rgb;
    textureStore(final_radiance, pixel.xy, vec4f(sum, 1.0));
}
