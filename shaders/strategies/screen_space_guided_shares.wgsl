// What each lit pixel gives to others under its kernel: S = E a_p / Σ k a over all pixels that will take from it, so that together they take just
// what it has. A thread per pixel.
#import "shared/screen_space_guided.wgsl"

@group(0) @binding(2) var light: texture_2d<f32>;
// S (W·m⁻²); squared radius of the kernel (m²).
@group(0) @binding(3) var shares: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn screen_space_guided_shares(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let own = textureLoad(light, id.xy, 0);
    var share = vec4f(0.0);
    if any(own.rgb > vec3f(0.0)) {
        let place = textureLoad(points, id.xy, 0);
        let radius2 = guided_radius2(place.xyz, own.a);
        let first = max(vec2i(id.xy) - params.reach, vec2i(0));
        let last = min(vec2i(id.xy) + params.reach, vec2i(params.size) - 1);
        var sum = 0.0;
        for (var y = first.y; y <= last.y; y += 1) {
            for (var x = first.x; x <= last.x; x += 1) {
                let to = textureLoad(points, vec2i(x, y), 0);
                sum += to.w * guided_weight(to.xyz, place.xyz, radius2);
            }
        }
        share = vec4f(own.rgb * (place.w / sum), radius2);
    }
    textureStore(shares, id.xy, share);
}
