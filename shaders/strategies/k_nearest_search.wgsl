// Finds the kernel of each photon that holds its k nearest neighbours on the same surface: see k_nearest.rs.
//
// The nearest found so far are kept as a bucket queue: how many of them lie at each level of radius. It needs no room for k of
// them, and what it holds in the end does not depend on the order in which they came.
#import "shared/dispatch.wgsl"
#import "shared/estimate.wgsl"
#import "shared/photon_store.wgsl"
#import "shared/sorted_grid.wgsl"

struct Params {
    grid: SortedGrid,
    // Kernel radii (m).
    r_min: f32,
    r_max: f32,
    // Distance (m) within which the grid finds everything.
    reach: f32,
    // Photons that the kernel is to hold, itself among them.
    wanted: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;
@group(0) @binding(3) var sorted_points: texture_2d<u32>;
@group(0) @binding(4) var<storage, read> bucket_offsets: array<u32>;
@group(0) @binding(5) var<storage, read> bucket_entries: array<u32>;
// In the order of `photons`.
@group(0) @binding(6) var<storage, read_write> nearest_photons: array<StoredPhoton>;

// Radii r_min + (r_max − r_min) j / 63, the steps of the coarser store.
const LEVELS: u32 = 64u;
// Covers the rounding of distances at a level's edge.
const SLACK: f32 = 1.00001;

struct Nearest {
    // Photons at each level, those that are among the nearest `wanted` so far.
    counts: array<u32, LEVELS>,
    found: u32,
    // Only what lies at a level below can be among them: the farthest one's level, once all are found.
    limit: u32,
}

fn add_neighbour(nearest: ptr<function, Nearest>, distance: f32) {
    let level = u32(clamp(ceil((distance - params.r_min) / (params.r_max - params.r_min) * f32(LEVELS - 1u)), 0.0, f32(LEVELS)));
    if level >= (*nearest).limit {
        return;
    }
    (*nearest).counts[level] += 1u;
    if (*nearest).found < params.wanted {
        (*nearest).found += 1u;
    } else {
        (*nearest).counts[(*nearest).limit] -= 1u;
    }
    if (*nearest).found == params.wanted {
        var last = min((*nearest).limit, LEVELS - 1u);
        while last > 0u && (*nearest).counts[last] == 0u {
            last -= 1u;
        }
        (*nearest).limit = last;
    }
}

// Distance (m) beyond which no neighbour is among the nearest.
fn search_reach(limit: u32) -> f32 {
    let share = f32(limit - 1u) / f32(LEVELS - 1u);
    return min((params.r_min + (params.r_max - params.r_min) * share) * SLACK, params.reach);
}

fn distance2(i: u32, position: vec3f) -> f32 {
    let apart = bitcast<vec3f>(textureLoad(sorted_points, sorted_texel(i), 0).xyz) - position;
    return dot(apart, apart);
}

fn reach_bit(first: u32, i: u32, last: u32, position: vec3f, reach2: f32) -> u32 {
    return select(0u, 1u << i, distance2(min(first + i, last), position) < reach2);
}

// Looks through a run of candidates. Tests 32 of them first and then adds those within reach, eight tests to a turn of the loop:
// as in gather_run.wgsl.
fn search_run(nearest: ptr<function, Nearest>, position: vec3f, normal: vec3f, run: vec2u) {
    for (var first = run.x; first < run.y && (*nearest).limit > 0u; first += 32u) {
        let reach = search_reach((*nearest).limit);
        let reach2 = reach * reach;
        var near = 0u;
        let batch = min(32u, run.y - first);
        let last = run.y - 1u;
        for (var i = 0u; i < batch; i += 8u) {
            near |= reach_bit(first, i, last, position, reach2) | reach_bit(first, i + 1u, last, position, reach2)
                | reach_bit(first, i + 2u, last, position, reach2) | reach_bit(first, i + 3u, last, position, reach2)
                | reach_bit(first, i + 4u, last, position, reach2) | reach_bit(first, i + 5u, last, position, reach2)
                | reach_bit(first, i + 6u, last, position, reach2) | reach_bit(first, i + 7u, last, position, reach2);
        }
        near &= 0xffffffffu >> (32u - batch);
        while near != 0u {
            let i = first + firstTrailingBit(near);
            near &= near - 1u;
            if dot(octahedral_decode(textureLoad(sorted_points, sorted_texel(i), 0).w), normal) >= MIN_NORMAL_COSINE {
                add_neighbour(nearest, sqrt(distance2(i, position)));
            }
        }
    }
}

@compute @workgroup_size(64)
fn k_nearest_search(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let index = linear_index(id, workgroups, 64u);
    if index >= min(photon_state.stored, arrayLength(&photons)) {
        return;
    }
    let here = textureLoad(sorted_points, sorted_texel(index), 0);
    let position = bitcast<vec3f>(here.xyz);
    let normal = octahedral_decode(here.w);
    var nearest: Nearest;
    nearest.limit = LEVELS;
    let first = vec2i(floor(cell_place(params.grid, position - params.reach).yz));
    let last = vec2i(floor(cell_place(params.grid, position + params.reach).yz));
    let span = vec2u(last - first) + 1u;
    // Its own row first: what is found there narrows the search in the others.
    let own = vec2u(vec2i(floor(cell_place(params.grid, position).yz)) - first);
    for (var z = 0u; z < span.y && nearest.limit > 0u; z++) {
        for (var y = 0u; y < span.x && nearest.limit > 0u; y++) {
            let row = first + vec2i((own + vec2u(y, z)) % span);
            let buckets = row_buckets(params.grid, row, position, position, search_reach(nearest.limit));
            search_run(&nearest, position, normal, vec2u(bucket_offsets[buckets.x], bucket_offsets[buckets.y]));
        }
    }
    let entry = bucket_entries[index];
    let level = min(nearest.limit, LEVELS - 1u);
    nearest_photons[entry] = photon_with_radius(photons[entry], f32(level) / f32(LEVELS - 1u));
}
