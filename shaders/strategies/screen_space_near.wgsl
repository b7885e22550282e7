// The map for near surfaces: in each texel the light of the near pixels below it, over the sum of the weights of those that will take it. A thread
// per texel.
#import "shared/screen_space_bilateral.wgsl"

@group(0) @binding(3) var light: texture_2d<f32>;
// S (W·m⁻²).
@group(0) @binding(4) var near_shares: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn screen_space_near(@builtin(global_invocation_id) id: vec3u) {
    let texel = vec2i(id.xy);
    let texels = (vec2i(params.size) + NEAR_TEXEL - 1) / NEAR_TEXEL;
    if any(texel >= texels) {
        return;
    }
    let limit = vec2i(params.size) - 1;
    let corner = min(texel * NEAR_TEXEL + NEAR_TEXEL - 1, limit);
    var flux = vec3f(0.0);
    for (var y = texel.y * NEAR_TEXEL; y <= corner.y; y += 1) {
        for (var x = texel.x * NEAR_TEXEL; x <= corner.x; x += 1) {
            let given = textureLoad(light, vec2i(x, y), 0).rgb;
            if any(given > vec3f(0.0)) {
                let guide = guide_at(vec2i(x, y));
                if is_near(vec2i(x, y), guide) {
                    flux += given * guide.area;
                }
            }
        }
    }
    var share = vec3f(0.0);
    if any(flux > vec3f(0.0)) {
        let middle = near_pixel(texel);
        let source = guide_at(middle);
        let width_m = kernel_width(source.position, NEAR_TEXEL);
        let first = max((texel - params.width) * NEAR_TEXEL, vec2i(0));
        let last = min((texel + params.width + 1) * NEAR_TEXEL - 1, limit);
        var sum = 0.0;
        for (var y = first.y; y <= last.y; y += 1) {
            for (var x = first.x; x <= last.x; x += 1) {
                let to = guide_at(vec2i(x, y));
                sum += to.area * image_weight(vec2f(vec2i(x, y) - middle) / f32(NEAR_TEXEL)) * surface_weight(source, to, width_m);
            }
        }
        share = flux / sum;
    }
    textureStore(near_shares, texel, vec4f(share, 0.0));
}
