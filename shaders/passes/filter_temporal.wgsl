// Ẽ_i = (1 − α) E_i + α Ẽ_{i−1} [SA19, Eq. 12], the history fetched where the point was, from texels that show its surface.
//
// History is the mean over a pixel's area: motion, not the sample's position inside the pixel, says where it is read, so that a still
// view is not resampled and frames of different sample positions average to the pixel. Depths are of samples: that of a texel is
// carried along its plane to the point's own place before the two are compared.
#import "shared/filter.wgsl"

struct TemporalParams {
    size: vec2u,
    // Sample positions inside the pixels.
    jitter: vec2f,
    previous_jitter: vec2f,
    // Height of a pixel at a distance of 1 m (m), in the previous image.
    pixel_angle: f32,
    sigma_z: f32,
    sigma_n: f32,
    // α at most.
    history: f32,
    // 1: there is a previous frame; 0: there is none.
    continues: f32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: TemporalParams;
@group(0) @binding(1) var value: texture_2d<f32>;
@group(0) @binding(2) var motion: texture_2d<f32>;
@group(0) @binding(3) var guide: texture_2d<u32>;
@group(0) @binding(4) var previous_guide: texture_2d<u32>;
// Light; w is for the filter over pixels.
@group(0) @binding(5) var previous: texture_2d<f32>;
// Frames in it, and the variance between them, the sum of the channels'.
@group(0) @binding(6) var previous_scatter: texture_2d<f32>;
@group(0) @binding(7) var accumulated: texture_storage_2d<rgba32float, write>;
@group(0) @binding(8) var scatter: texture_storage_2d<rg32float, write>;

struct History {
    // Sums over texels: of weights, of their squares over those of the footprint alone, of frames.
    weight: f32,
    similarity: f32,
    frames: f32,
    light: vec3f,
    scatter: f32,
    // Sum of the weights per channel.
    known: vec3f,
}

// Adds the texel `q`, of weight `share` in the footprint, as far as it shows what lies at `film` of the previous image, at depth `z`.
fn add_texel(sum: ptr<function, History>, q: vec2i, share: f32, film: vec2f, z: f32, normal: vec3f) {
    let inside = all(q >= vec2i(0)) && all(q < vec2i(params.size));
    let texel = clamp(q, vec2i(0), vec2i(params.size) - 1);
    let point = filter_point(textureLoad(previous_guide, texel, 0), 2u);
    let light = textureLoad(previous, texel, 0);
    let statistics = textureLoad(previous_scatter, texel, 0);
    let footprint = point.z * params.pixel_angle;
    let pixels = film - (vec2f(texel) + params.previous_jitter);
    // 1/z is linear in the image.
    let carried = point.z / max(1.0 - params.pixel_angle * dot(point.slope, pixels), 0.1);
    let w = depth_weight(z - carried, point.slope, pixels, max(footprint, 1.0e-20), params.sigma_z)
        * normal_weight(normal, point.normal, params.sigma_n);
    let weight = select(0.0, share * w, inside && point.z > 0.0 && statistics.x > 0.0);
    let has = select(vec3f(0.0), vec3f(weight), known(light.rgb));
    (*sum).weight += weight;
    (*sum).similarity += weight * w;
    (*sum).frames += weight * statistics.x;
    (*sum).known += has;
    (*sum).light += select(vec3f(0.0), light.rgb * has, known(light.rgb));
    (*sum).scatter += weight * statistics.y;
}

// Shares of the footprint below this are rounding, or a corner of it.
const MIN_SHARE: f32 = 0.05;

@compute @workgroup_size(8, 8)
fn filter_temporal(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.size) {
        return;
    }
    let light = textureLoad(value, pixel.xy, 0).rgb;
    let point = filter_point(textureLoad(guide, pixel.xy, 0), 2u);
    let moved = textureLoad(motion, pixel.xy, 0);
    let at = vec2f(pixel.xy) + moved.xy;
    let film = at + params.jitter;
    var sum: History;
    if point.z > 0.0 && moved.w * params.continues > 0.0 {
        let base = floor(at);
        let f = at - base;
        let corner = vec2i(base);
        add_texel(&sum, corner, (1.0 - f.x) * (1.0 - f.y), film, moved.z, point.normal);
        add_texel(&sum, corner + vec2i(1, 0), f.x * (1.0 - f.y), film, moved.z, point.normal);
        add_texel(&sum, corner + vec2i(0, 1), (1.0 - f.x) * f.y, film, moved.z, point.normal);
        add_texel(&sum, corner + vec2i(1, 1), f.x * f.y, film, moved.z, point.normal);
        if sum.weight < MIN_SHARE {
            // At an edge the previous frame's samples may have met the other surface: its neighbours may have met this one.
            let nearest = vec2i(round(at));
            for (var i = 0; i < 9; i += 1) {
                add_texel(&sum, nearest + vec2i(i % 3 - 1, i / 3 - 1), 1.0, film, moved.z, point.normal);
            }
        }
    }
    let found = sum.weight >= MIN_SHARE;
    let weight = max(sum.weight, 1.0e-20);
    let frames = sum.frames / weight;
    // The best weight of a history of n frames is that of their plain mean; its bound is [SA19, Eq. 13]'s constant.
    let alpha = select(0.0, min(frames / (frames + 1.0), params.history) * (sum.similarity / weight), found);
    let history = sum.light / max(sum.known, vec3f(1.0e-20));
    let remembered = (sum.known > vec3f(0.0)) & vec3<bool>(found);
    let share = select(vec3f(1.0), vec3f(alpha), known(light));
    let fresh = select(history, light, known(light));
    let mean = select(light, mix(fresh, history, share), remembered);
    // Of an exponential mean [West79], "Updating Mean and Variance Estimates: An Improved Method".
    let apart = select(vec3f(0.0), fresh - history, remembered);
    let variance = alpha * (sum.scatter / weight + (1.0 - alpha) * dot(apart, apart));
    // The frames whose plain mean would vary as little: variances add by the squares of their weights.
    let count = 1.0 / ((1.0 - alpha) * (1.0 - alpha) + alpha * alpha / max(frames, 1.0));
    // Of the mean; one frame does not tell its noise, which is taken to be as large as the light.
    let own = select(vec3f(0.0), mean, known(mean));
    let noise = variance / max(count - 1.0, 1.0) + max(2.0 - count, 0.0) * dot(own, own);
    textureStore(accumulated, pixel.xy, vec4f(mean, noise));
    textureStore(scatter, pixel.xy, vec4f(select(0.0, count, point.z > 0.0), variance, 0.0, 0.0));
}
