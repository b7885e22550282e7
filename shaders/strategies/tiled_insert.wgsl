// Inserts each photon into the lists of the tiles its sphere of effect reaches: both loops over photons of [MML13] listing 5.
//
// The counting pass and the copy pass of the listing are this one shader run twice, so that both decide alike to the last
// bit: counting is inserting into lists that have no room. The second run starts from counts of zero again and finds in
// `tile_offsets` where each list begins. Lists hold photon indices; the paper's lists hold the photons themselves, at
// eight times the memory.
#import "shared/dispatch.wgsl"
#import "shared/estimate.wgsl"
#import "shared/photon_store.wgsl"
#import "shared/point_bounds.wgsl"
#import "shared/tiles.wgsl"

struct Params {
    camera: Camera,
    tiles: vec2u,
    tile_size: u32,
    // Entries there is room for; 0 while counting.
    entry_capacity: u32,
    // Kernel radii (m).
    r_min: f32,
    r_max: f32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;
@group(0) @binding(3) var<storage, read> tile_bounds: array<PointBounds>;
@group(0) @binding(4) var<storage, read> tile_offsets: array<u32>;
@group(0) @binding(5) var<storage, read_write> tile_counts: array<atomic<u32>>;
@group(0) @binding(6) var<storage, read_write> tile_entries: array<u32>;

@compute @workgroup_size(64)
fn tiled_insert(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let index = linear_index(id, workgroups, 64u);
    if index >= min(photon_state.stored, arrayLength(&photons)) {
        return;
    }
    let photon = photon_load(photons[index], photon_state.grid);
    // The kernel is 0 at its edge; the slack covers the rounding of the distance there.
    let radius = photon_radius(photon, params.r_min, params.r_max) * 1.00001;
    let range = sphere_tiles(params.camera, photon.position, radius, params.tile_size, params.tiles);
    for (var y = range.first.y; y < range.end.y; y++) {
        for (var x = range.first.x; x < range.end.x; x++) {
            let tile = y * params.tiles.x + x;
            if photon_meets_points(tile_bounds[tile], photon, radius) {
                let entry = tile_offsets[tile] + atomicAdd(&tile_counts[tile], 1u);
                if entry < params.entry_capacity {
                    tile_entries[entry] = index;
                }
            }
        }
    }
}
