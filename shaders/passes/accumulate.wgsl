// Running mean and sum of squared deviations of a layer over frames [Welford62]; the standard error of the mean after n
// frames of one weight is √(deviations / (n (n − 1))).

struct AccumulateParams {
    size: vec2u,
    // The frame's weight over that of all in the mean, this one included.
    share: f32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: AccumulateParams;
@group(0) @binding(1) var value: texture_2d<f32>;
@group(0) @binding(2) var previous_mean: texture_2d<f32>;
@group(0) @binding(3) var previous_deviations: texture_2d<f32>;
@group(0) @binding(4) var mean: texture_storage_2d<rgba32float, write>;
@group(0) @binding(5) var deviations: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn accumulate(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.size) {
        return;
    }
    let x = textureLoad(value, pixel.xy, 0);
    if params.share >= 1.0 {
        textureStore(mean, pixel.xy, x);
        textureStore(deviations, pixel.xy, vec4f(0.0));
        return;
    }
    let before = textureLoad(previous_mean, pixel.xy, 0);
    let after = before + (x - before) * params.share;
    textureStore(mean, pixel.xy, after);
    textureStore(deviations, pixel.xy, textureLoad(previous_deviations, pixel.xy, 0) + (x - before) * (x - after));
}
