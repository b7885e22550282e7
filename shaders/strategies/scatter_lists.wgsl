// Writes the index of each photon into its list.
#import "shared/dispatch.wgsl"
#import "shared/photon.wgsl"

@group(0) @binding(0) var<storage, read> photon_state: PhotonState;
// List of each photon and its rank there.
@group(0) @binding(1) var<storage, read> photon_places: array<vec2u>;
@group(0) @binding(2) var<storage, read> offsets: array<u32>;
@group(0) @binding(3) var<storage, read_write> entries: array<u32>;

@compute @workgroup_size(64)
fn scatter_lists(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let index = linear_index(id, workgroups, 64u);
    if index >= min(photon_state.stored, arrayLength(&photon_places)) {
        return;
    }
    let place = photon_places[index];
    entries[offsets[place.x] + place.y] = index;
}
