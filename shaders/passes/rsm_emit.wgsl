// A batch of photons leaves the lights, one thread each; those of lights that have a map follow it.
#import "shared/dispatch.wgsl"
#import "shared/light_groups.wgsl"
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
    // Groups of lights, each of which has a map.
    maps: u32,
    // 1: photons start at what their maps hold.
    first_hits: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: RsmEmitParams;
@group(0) @binding(1) var importance: texture_2d_array<f32>;
@group(0) @binding(2) var<storage, read_write> rays: array<Ray>;
@group(0) @binding(3) var<storage, read_write> paths: array<PhotonPath>;
@group(0) @binding(4) var<storage, read_write> live: LivePaths;
@group(0) @binding(5) var held: texture_2d_array<u32>;

@compute @workgroup_size(64)
fn rsm_emit(@builtin(global_invocation_id) global_id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let thread = linear_index(global_id, workgroups, PATH_BLOCK);
    if !begin_batch(thread, params.count) {
        return;
    }
    let index = params.first + thread;
    let light_index = photon_light(index, params.emitted, photon_shift(params.seed), params.lights);
    let light = lights[light_index];
    let u = kronecker4(index, params.seed);
    let share = 1.0 / (f32(params.emitted) * light.photon_probability[params.lights.emission]);
    let map = group_of(light_index, params.maps);
    if map == NO_GROUP {
        begin_path(thread, index, emit_from_light(light, u, share, params.lights), 0.0, 0u, params.lights);
        return;
    }
    let group = light_groups[map];
    let warped = hierarchical_warp(importance, map, u.xy);
    let photon = emit_from_group(group, light, warped.point, u.zw, share / warped.density, params.lights);
    // Importance is that of a photon which stands for all of the group's flux. Chance has paid for the albedo here: to play roulette
    // against it again would throw away what the map brings.
    let expected = warped.importance / (f32(params.emitted) * group.photon_probability * warped.density);
    let kept = clamp(expected / max(luminance(photon.flux), 1.0e-37), 0.0, 1.0);
    let seen = textureLoad(held, vec2u(warped.point * vec2f(textureDimensions(held))), map, 0).x * params.first_hits;
    begin_path(thread, index, photon, kept, seen, params.lights);
}
