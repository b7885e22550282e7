// Copies the photons into the order of the lists: "a single array of photons, each cell corresponding to a continuous
// block" [MML13] section 2.3.1, so that a gathering pixel reads neighbouring memory.
#import "shared/dispatch.wgsl"
#import "shared/photon_store.wgsl"

@group(0) @binding(0) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(1) var<storage, read> photon_state: PhotonState;
@group(0) @binding(2) var<storage, read> slot_entries: array<u32>;
@group(0) @binding(3) var<storage, read_write> cell_photons: array<StoredPhoton>;

@compute @workgroup_size(64)
fn hash_grid_pack(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let index = linear_index(id, workgroups, 64u);
    if index < min(photon_state.stored, arrayLength(&photons)) {
        cell_photons[index] = photons[slot_entries[index]];
    }
}
