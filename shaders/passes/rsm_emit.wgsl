// A batch of photons leaves the lights, one thread each; those of lamps that have a map follow it.
#import "shared/dispatch.wgsl"
#import "shared/photon_start.wgsl"
#import "shared/warp.wgsl"

struct RsmEmitParams {
    lights: LightInfo,
    // Photons in all batches together.
    emitted: u32,
    // Number of the batch's first.
    first: u32,
    // Photons of this batch.
    count: u32,
    seed: u32,
    // Lights that have a map: the first ones.
    maps: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: RsmEmitParams;
@group(0) @binding(1) var importance: texture_2d_array<f32>;
@group(0) @binding(2) var<storage, read_write> rays: array<Ray>;
@group(0) @binding(3) var<storage, read_write> paths: array<PhotonPath>;
@group(0) @binding(4) var<storage, read_write> live: LivePaths;

@compute @workgroup_size(64)
fn rsm_emit(@builtin(global_invocation_id) global_id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let thread = linear_index(global_id, workgroups, PATH_BLOCK);
    if !begin_batch(thread, params.count) {
        return;
    }
    let index = params.first + thread;
    let light_index = photon_light(index, params.emitted, photon_shift(params.seed), params.lights);
    let light = lights[light_index];
    var u = kronecker4(index, params.seed);
    var share = 1.0 / (f32(params.emitted) * light.photon_probability[params.lights.emission]);
    var expected = 0.0;
    if light_index < params.maps {
        let warped = hierarchical_warp(importance, light_index, u.xy);
        u = vec4f(warped.point, u.zw);
        share /= warped.density;
        // Importance is that of a photon which stands for all of the light's flux.
        expected = warped.importance * share;
    }
    let photon = emit_from_light(light, u, share, params.lights);
    // Chance has paid for the albedo here: to play roulette against it again would throw away what the map brings.
    expected = clamp(expected / max(luminance(photon.flux), 1.0e-37), 0.0, 1.0);
    begin_path(thread, index, photon, expected, params.lights);
}
