// What each lit pixel that is not near gives to others, as screen_space_guided_shares.wgsl does. A thread per pixel.
#import "shared/screen_space_bilateral.wgsl"

@group(0) @binding(3) var light: texture_2d<f32>;
// S (W·m⁻²).
@group(0) @binding(4) var shares: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn screen_space_bilateral_shares(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let pixel = vec2i(id.xy);
    let given = textureLoad(light, pixel, 0).rgb;
    var share = vec3f(0.0);
    if any(given > vec3f(0.0)) {
        let source = guide_at(pixel);
        if !is_near(pixel, source) {
            let width_m = kernel_width(source.position, 1);
            let first = max(pixel - params.width, vec2i(0));
            let last = min(pixel + params.width, vec2i(params.size) - 1);
            var sum = 0.0;
            for (var y = first.y; y <= last.y; y += 1) {
                for (var x = first.x; x <= last.x; x += 1) {
                    let to = guide_at(vec2i(x, y));
                    sum += to.area * image_weight(vec2f(vec2i(x, y) - pixel)) * surface_weight(source, to, width_m);
                }
            }
            share = given * (source.area / sum);
        }
    }
    textureStore(shares, pixel, vec4f(share, 0.0));
}
