// Copies the photons into the order of the buckets, split into what every candidate needs and what only summands need.
//
// Either part is one 16-byte load. Stores are decoded and radii computed here, once per photon, and not once per pixel that tests it.
#import "shared/dispatch.wgsl"
#import "shared/estimate.wgsl"
#import "shared/photon_store.wgsl"
#import "shared/sorted_grid.wgsl"

struct Params {
    // Kernel radii (m).
    r_min: f32,
    r_max: f32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;
@group(0) @binding(3) var<storage, read> bucket_entries: array<u32>;
// Position (m) and kernel radius (m).
@group(0) @binding(4) var sorted_spheres: texture_storage_2d<rgba32float, write>;
// Flux, direction, normal, bounce and flags, as in Photon.
@group(0) @binding(5) var sorted_light: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(64)
fn sorted_grid_pack(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let index = linear_index(id, workgroups, 64u);
    if index >= min(photon_state.stored, arrayLength(&photons)) {
        return;
    }
    let photon = photon_load(photons[bucket_entries[index]], photon_state.grid);
    let texel = sorted_texel(index);
    textureStore(sorted_spheres, texel, vec4f(photon.position, photon_radius(photon, params.r_min, params.r_max)));
    textureStore(sorted_light, texel, vec4u(photon.flux, photon.direction, photon.normal, photon.bounce_flags));
}
