// Inserts each photon into the lists of the chunks it may light, which it finds in the rows of buckets around it.
//
// Run twice, as `tiled_insert`: counting is inserting into lists that have no room.
#import "shared/dispatch.wgsl"
#import "shared/estimate.wgsl"
#import "shared/photon_store.wgsl"
#import "shared/point_bounds.wgsl"
#import "shared/sorted_grid.wgsl"

struct Params {
    grid: SortedGrid,
    // Kernel radii (m).
    r_min: f32,
    r_max: f32,
    // Beyond this there is no point (m).
    reach: f32,
    // Entries there is room for; 0 while counting.
    entry_capacity: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;
@group(0) @binding(3) var<storage, read> chunk_offsets: array<u32>;
@group(0) @binding(4) var<storage, read> chunk_bounds: array<PointBounds>;
@group(0) @binding(5) var<storage, read> list_offsets: array<u32>;
// A word per chunk, and the last: photons that a driver did not let test all their chunks.
@group(0) @binding(6) var<storage, read_write> list_counts: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> entries: array<u32>;

@compute @workgroup_size(64)
fn view_grid_insert(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let index = linear_index(id, workgroups, 64u);
    if index >= min(photon_state.stored, arrayLength(&photons)) {
        return;
    }
    let photon = photon_load(photons[index], photon_state.grid);
    // The kernel is 0 at its edge; the slack covers the rounding of the distance there.
    let radius = min(photon_radius(photon, params.r_min, params.r_max) * 1.00001, params.reach);
    let first = vec2i(floor(cell_place(params.grid, photon.position - radius).yz));
    let last = vec2i(floor(cell_place(params.grid, photon.position + radius).yz));
    let span = vec2u(last - first) + 1u;
    var untested = 0u;
    var rows = 0u;
    for (var z = first.y; z <= last.y; z++) {
        for (var y = first.x; y <= last.x; y++) {
            let buckets = row_buckets(params.grid, vec2i(y, z), photon.position, photon.position, radius);
            let end = chunk_offsets[buckets.y];
            rows += 1u;
            untested += end - chunk_offsets[buckets.x];
            for (var chunk = chunk_offsets[buckets.x]; chunk < end; chunk++) {
                untested -= 1u;
                if photon_meets_points(chunk_bounds[chunk], photon, radius) {
                    let entry = list_offsets[chunk] + atomicAdd(&list_counts[chunk], 1u);
                    if entry < params.entry_capacity {
                        entries[entry] = index;
                    }
                }
            }
        }
    }
    if untested != 0u || rows != span.x * span.y {
        atomicAdd(&list_counts[arrayLength(&list_counts) - 1u], 1u);
    }
}
