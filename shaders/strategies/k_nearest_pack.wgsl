// Copies what tells neighbours into the order of the buckets: one 16-byte load for each candidate.
#import "shared/dispatch.wgsl"
#import "shared/photon_store.wgsl"
#import "shared/sorted_grid.wgsl"

@group(0) @binding(0) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(1) var<storage, read> photon_state: PhotonState;
@group(0) @binding(2) var<storage, read> bucket_entries: array<u32>;
// Bits of the position (m), and the normal as in Photon.
@group(0) @binding(3) var sorted_points: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(64)
fn k_nearest_pack(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let index = linear_index(id, workgroups, 64u);
    if index >= min(photon_state.stored, arrayLength(&photons)) {
        return;
    }
    let photon = photon_load(photons[bucket_entries[index]], photon_state.grid);
    textureStore(sorted_points, sorted_texel(index), vec4u(bitcast<vec3u>(photon.position), photon.normal));
}
