// What the eye receives of the light that was gathered at the visible points, and of what else it sees on the way to them.

struct VisiblePointsResolveParams {
    size: vec2u,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: VisiblePointsResolveParams;
// As in passes/visible_points.wgsl.
@group(0) @binding(1) var throughput: texture_2d<f32>;
@group(0) @binding(2) var seen: texture_2d<f32>;
@group(0) @binding(3) var gathered_indirect: texture_2d<f32>;
@group(0) @binding(4) var gathered_caustic: texture_2d<f32>;
@group(0) @binding(5) var indirect: texture_storage_2d<rgba32float, write>;
@group(0) @binding(6) var caustic: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn visible_points_resolve(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.size) {
        return;
    }
    let kept = textureLoad(throughput, pixel.xy, 0);
    let gathered = textureLoad(gathered_indirect, pixel.xy, 0).rgb;
    textureStore(indirect, pixel.xy, vec4f(gathered * kept.rgb + textureLoad(seen, pixel.xy, 0).rgb, 1.0));
    // A caustic that is seen by way of another surface was scattered by the diffuse one before.
    textureStore(caustic, pixel.xy, vec4f(textureLoad(gathered_caustic, pixel.xy, 0).rgb * kept.w, 1.0));
}
