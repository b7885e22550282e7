// Counts the photons of each bucket; the count that a photon finds is its rank there.
#import "shared/dispatch.wgsl"
#import "shared/photon_store.wgsl"
#import "shared/sorted_grid.wgsl"

struct Params {
    grid: SortedGrid,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;
@group(0) @binding(3) var<storage, read_write> bucket_counts: array<atomic<u32>>;
// Bucket of each photon and its rank there.
@group(0) @binding(4) var<storage, read_write> photon_places: array<vec2u>;

@compute @workgroup_size(64)
fn sorted_grid_count(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let index = linear_index(id, workgroups, 64u);
    if index >= min(photon_state.stored, arrayLength(&photons)) {
        return;
    }
    let place = cell_place(params.grid, photon_position(photons[index], photon_state.grid));
    let bucket = row_begin(params.grid, vec2i(floor(place.yz))) + row_cell(params.grid, place.x);
    photon_places[index] = vec2u(bucket, atomicAdd(&bucket_counts[bucket], 1u));
}
