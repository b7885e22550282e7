// Finds the kernel of each photon that holds its k nearest neighbours on the same surface: see k_nearest.rs.
//
// What is found is counted by levels of radius, and levels beyond the k nearest are given up as they fill. That needs no room for k
// neighbours, and what it comes to does not depend on the order in which they are met.
#import "shared/dispatch.wgsl"
#import "shared/estimate.wgsl"
#import "shared/photon_store.wgsl"
#import "shared/sorted_grid.wgsl"

struct Params {
    grid: SortedGrid,
    // The radius of level j is r_min + j · step (m).
    r_min: f32,
    step: f32,
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

// As many as the coarser store has.
const LEVELS: u32 = 64u;
// Covers the rounding of distances at a level's edge.
const SLACK: f32 = 1.00001;

struct Search {
    // Photons at each level below `levels`, and in all.
    counts: array<u32, LEVELS>,
    found: u32,
    // The last of them is the radius sought, unless nearer photons are still to come.
    levels: u32,
}

fn add_neighbour(search: ptr<function, Search>, distance: f32) {
    let level = u32(clamp(ceil((distance - params.r_min) / params.step), 0.0, f32(LEVELS)));
    if level < (*search).levels {
        (*search).counts[level] += 1u;
        (*search).found += 1u;
    }
}

// Gives up levels while those below hold enough.
fn narrow(search: ptr<function, Search>) {
    while (*search).levels > 1u {
        let below = (*search).found - (*search).counts[(*search).levels - 1u];
        if below < params.wanted {
            break;
        }
        (*search).found = below;
        (*search).levels -= 1u;
    }
}

// No photon can narrow it any more.
fn is_done(search: ptr<function, Search>) -> bool {
    return (*search).levels == 1u && (*search).found >= params.wanted;
}

// Distance (m) beyond which photons do not matter.
fn search_reach(search: ptr<function, Search>) -> f32 {
    return min((params.r_min + params.step * f32((*search).levels - 1u)) * SLACK, params.reach);
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
fn search_run(search: ptr<function, Search>, position: vec3f, normal: vec3f, run: vec2u) {
    for (var first = run.x; first < run.y && !is_done(search); first += 32u) {
        let reach = search_reach(search);
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
                add_neighbour(search, sqrt(distance2(i, position)));
            }
        }
        narrow(search);
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
    var search: Search;
    search.levels = LEVELS;
    let first = vec2i(floor(cell_place(params.grid, position - params.reach).yz));
    let last = vec2i(floor(cell_place(params.grid, position + params.reach).yz));
    let span = vec2u(last - first) + 1u;
    // Its own row first: what is found there narrows the search in the others.
    let own = vec2u(vec2i(floor(cell_place(params.grid, position).yz)) - first);
    for (var z = 0u; z < span.y && !is_done(&search); z++) {
        for (var y = 0u; y < span.x && !is_done(&search); y++) {
            let row = first + vec2i((own + vec2u(y, z)) % span);
            let buckets = row_buckets(params.grid, row, position, position, search_reach(&search));
            search_run(&search, position, normal, vec2u(bucket_offsets[buckets.x], bucket_offsets[buckets.y]));
        }
    }
    let entry = bucket_entries[index];
    nearest_photons[entry] = photon_with_radius(photons[entry], f32(search.levels - 1u) / f32(LEVELS - 1u));
}
