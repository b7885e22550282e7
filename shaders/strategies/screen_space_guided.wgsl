// What each pixel takes of the light around it: Σ S k. A thread per pixel.
#import "shared/screen_space_guided.wgsl"

@group(0) @binding(2) var shares: texture_2d<f32>;
// E (W·m⁻²).
@group(0) @binding(3) var denoised: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn screen_space_guided(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let place = textureLoad(points, id.xy, 0);
    var sum = vec3f(0.0);
    if place.w > 0.0 {
        let first = max(vec2i(id.xy) - params.reach, vec2i(0));
        let last = min(vec2i(id.xy) + params.reach, vec2i(params.size) - 1);
        for (var y = first.y; y <= last.y; y += 1) {
            for (var x = first.x; x <= last.x; x += 1) {
                let share = textureLoad(shares, vec2i(x, y), 0);
                if share.a > 0.0 {
                    sum += share.rgb * guided_weight(place.xyz, textureLoad(points, vec2i(x, y), 0).xyz, share.a);
                }
            }
        }
    }
    textureStore(denoised, id.xy, vec4f(sum, 0.0));
}
