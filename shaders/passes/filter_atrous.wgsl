// One level of the edge-avoiding à-trous transform, and the variance clipping of its details [SA19, Eq. 14 to 18].
//
// s_{i+1}(P) = Σ h w s_i / Σ h w over 5 × 5 pixels `spacing` apart; d_i = s_{i+1} − s_i. E = s_n − Σ clamp(d_i, −b_i, b_i): with
// unlimited b it is s_0, with b = 0 it is s_n.
#import "shared/filter.wgsl"

struct AtrousParams {
    size: vec2u,
    // 2^i (pixels).
    spacing: i32,
    // 3: compare shading normals; 2: geometric ones.
    normal_word: u32,
    // Height of a pixel at a distance of 1 m (m).
    pixel_angle: f32,
    sigma_z: f32,
    sigma_n: f32,
    // b_i in standard deviations.
    clip: f32,
    // Least value of E.
    least: f32,
    // 1: there are no details yet.
    first: u32,
    // 1: the details are to be taken from the result.
    last: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: AtrousParams;
@group(0) @binding(1) var guide: texture_2d<u32>;
// s_i; w, the variance of s_0 that is noise, the sum of the channels', is passed on.
@group(0) @binding(2) var light: texture_2d<f32>;
// Sum of the clipped details before this level.
@group(0) @binding(3) var details: texture_2d<f32>;
@group(0) @binding(4) var smoother: texture_storage_2d<rgba32float, write>;
@group(0) @binding(5) var more_details: texture_storage_2d<rgba32float, write>;

// h of taps at a distance: ½, ¼, ⅛.
fn tap(distance: i32) -> f32 {
    return exp2(-f32(abs(distance) + 1));
}

@compute @workgroup_size(8, 8)
fn filter_atrous(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.size) {
        return;
    }
    let centre = textureLoad(light, pixel.xy, 0);
    let p = filter_point(textureLoad(guide, pixel.xy, 0), params.normal_word);
    if p.z <= 0.0 {
        textureStore(smoother, pixel.xy, centre);
        textureStore(more_details, pixel.xy, vec4f(0.0));
        return;
    }
    let own = known(centre.rgb);
    let s = select(vec3f(0.0), centre.rgb, own);
    let footprint = p.z * params.pixel_angle;
    // Sums of differences from the centre: a constant stays what it is, to the last bit.
    var weight = vec3f(tap(0) * tap(0));
    var difference = vec3f(0.0);
    var square = vec3f(0.0);
    var noise = weight.x * centre.w;
    var noise_weight = weight.x;
    for (var y = -2; y <= 2; y += 1) {
        for (var x = -2; x <= 2; x += 1) {
            let step = vec2i(x, y) * params.spacing;
            let there = vec2i(pixel.xy) + step;
            let inside = all(there >= vec2i(0)) && all(there < vec2i(params.size)) && (x != 0 || y != 0);
            let texel = clamp(there, vec2i(0), vec2i(params.size) - 1);
            let q = filter_point(textureLoad(guide, texel, 0), params.normal_word);
            let value = textureLoad(light, texel, 0);
            let w = tap(x) * tap(y) * depth_weight(p.z - q.z, p.slope, vec2f(step), footprint, params.sigma_z)
                * normal_weight(p.normal, q.normal, params.sigma_n);
            let counts = select(0.0, w, inside && q.z > 0.0);
            let has = select(vec3f(0.0), vec3f(counts), known(value.rgb));
            let delta = select(vec3f(0.0), value.rgb - s, known(value.rgb));
            noise += counts * value.w;
            noise_weight += counts;
            weight += has;
            difference += has * delta;
            square += has * delta * delta;
        }
    }
    let detail = difference / weight;
    let variance = max(square / weight - detail * detail, vec3f(0.0));
    // The share of the neighbours' scatter that is not noise.
    let all = variance.x + variance.y + variance.z;
    let share = max(1.0 - noise / (noise_weight * max(all, 1.0e-30)), 0.0);
    let bound = params.clip * sqrt(variance * share);
    let before = select(textureLoad(details, pixel.xy, 0).rgb, vec3f(0.0), params.first == 1u);
    let sum = before + clamp(detail, -bound, bound);
    let smooth_light = s + detail;
    let result = select(smooth_light, max(smooth_light - sum, vec3f(params.least)), params.last == 1u);
    textureStore(smoother, pixel.xy, vec4f(select(centre.rgb, result, own), centre.w));
    textureStore(more_details, pixel.xy, vec4f(sum, 0.0));
}
