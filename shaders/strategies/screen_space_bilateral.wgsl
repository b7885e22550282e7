// What each pixel takes of the light around it, of pixels and of texels of the near map: Σ S k. A thread per pixel.
#import "shared/screen_space_bilateral.wgsl"

@group(0) @binding(3) var shares: texture_2d<f32>;
@group(0) @binding(4) var near_shares: texture_2d<f32>;
// E (W·m⁻²).
@group(0) @binding(5) var denoised: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn screen_space_bilateral(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let pixel = vec2i(id.xy);
    let to = guide_at(pixel);
    var sum = vec3f(0.0);
    if to.area > 0.0 {
        let first = max(pixel - params.width, vec2i(0));
        let last = min(pixel + params.width, vec2i(params.size) - 1);
        for (var y = first.y; y <= last.y; y += 1) {
            for (var x = first.x; x <= last.x; x += 1) {
                let share = textureLoad(shares, vec2i(x, y), 0).rgb;
                if any(share > vec3f(0.0)) {
                    let source = guide_at(vec2i(x, y));
                    let width_m = kernel_width(source.position, 1);
                    sum += share * (image_weight(vec2f(pixel - vec2i(x, y))) * surface_weight(source, to, width_m));
                }
            }
        }
        let texel = pixel / NEAR_TEXEL;
        let texels = (vec2i(params.size) + NEAR_TEXEL - 1) / NEAR_TEXEL;
        let near_first = max(texel - params.width, vec2i(0));
        let near_last = min(texel + params.width, texels - 1);
        for (var y = near_first.y; y <= near_last.y; y += 1) {
            for (var x = near_first.x; x <= near_last.x; x += 1) {
                let share = textureLoad(near_shares, vec2i(x, y), 0).rgb;
                if any(share > vec3f(0.0)) {
                    let middle = near_pixel(vec2i(x, y));
                    let source = guide_at(middle);
                    let width_m = kernel_width(source.position, NEAR_TEXEL);
                    sum += share * (image_weight(vec2f(pixel - middle) / f32(NEAR_TEXEL)) * surface_weight(source, to, width_m));
                }
            }
        }
    }
    textureStore(denoised, pixel, vec4f(sum, 0.0));
}
