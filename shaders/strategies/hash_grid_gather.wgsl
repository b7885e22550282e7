// Sums at each visible point the photons of the cells its search cube touches: [MML13] listing 3.
//
// Cells are slightly wider than 2 r_max, so the cube of half-width r_max touches at most two of them per axis: eight
// look-ups. The cell of a slot is the cell of the first photon of its list.
#import "shared/gather_run.wgsl"
#import "shared/gather_sampling.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/hash_grid.wgsl"
#import "shared/photon_store.wgsl"

struct Params {
    grid: HashGrid,
    camera_position_world: vec3f,
    // Kernel radii (m).
    r_min: f32,
    r_max: f32,
    pad0: u32,
    size: vec2u,
    sampling: GatherSampling,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var<storage, read> cell_photons: array<StoredPhoton>;
@group(0) @binding(4) var<storage, read> slot_offsets: array<u32>;
@group(0) @binding(5) var indirect: texture_storage_2d<rgba32float, write>;
@group(0) @binding(6) var caustic: texture_storage_2d<rgba32float, write>;
// Word 4: pixels whose sum was cut.
@group(0) @binding(7) var<storage, read_write> stats: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read> photon_state: PhotonState;

// Range of `cell_photons` that lies in `cell`; empty if no photon does.
fn find_cell(cell: vec3i) -> vec2u {
    var slot = hash_cell(cell) & params.grid.slot_mask;
    for (var attempt = 1u; attempt <= params.grid.slot_mask; attempt++) {
        let range = vec2u(slot_offsets[slot], slot_offsets[slot + 1u]);
        if range.x == range.y || all(grid_cell(params.grid, photon_position(cell_photons[range.x], photon_state.grid)) == cell) {
            return range;
        }
        slot = next_slot(params.grid, slot, attempt);
    }
    return vec2u(0u);
}

// Whether the photon is within the largest radius of `position`.
fn in_reach(i: u32, position: vec3f) -> bool {
    let offset = photon_position(cell_photons[i], photon_state.grid) - position;
    return dot(offset, offset) < params.r_max * params.r_max;
}

fn add_candidate(sum: ptr<function, RadianceSum>, point: VisiblePoint, i: u32) {
    let photon = photon_load(cell_photons[i], photon_state.grid);
    add_photon(sum, point, photon, photon_radius(photon, params.r_min, params.r_max));
}

@compute @workgroup_size(8, 8)
fn hash_grid_gather(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let point = visible_point(textureLoad(position, id.xy, 0), textureLoad(surface, id.xy, 0), params.camera_position_world);
    var picker = photon_picker(params.sampling, id.xy);
    var sum: RadianceSum;
    var expected = 0u;
    var cells = 0u;
    var expected_cells = 0u;
    if point.gatherable {
        // The slack covers the rounding of the distance at the kernel's edge.
        let reach = params.r_max * 1.00001;
        let first = grid_cell(params.grid, point.position - reach);
        let last = grid_cell(params.grid, point.position + reach);
        let span = vec3u(last - first) + 1u;
        expected_cells = span.x * span.y * span.z;
        for (var z = first.z; z <= last.z; z++) {
            for (var y = first.y; y <= last.y; y++) {
                for (var x = first.x; x <= last.x; x++) {
                    let range = find_cell(vec3i(x, y, z));
                    cells += 1u;
                    expected += range.y - range.x;
                    gather(&sum, &picker, point, range);
                }
            }
        }
    }
    finish_sum(&sum, params.sampling);
    if sum_is_cut(sum, expected) || cells != expected_cells {
        atomicAdd(&stats[4], 1u);
    }
    textureStore(indirect, id.xy, vec4f(sum.indirect, 1.0));
    textureStore(caustic, id.xy, vec4f(sum.caustic, 1.0));
}
