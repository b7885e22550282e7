// Sums the photons of a tile at each of its pixels: [MML13] listing 6.
//
// One workgroup per tile; its list passes through workgroup memory in blocks of 256, so that each photon is fetched once
// per tile rather than once per pixel.
#import "shared/gather_sampling.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/photon_block.wgsl"
#import "shared/photon_store.wgsl"

struct Params {
    camera_position_world: vec3f,
    tiles_x: u32,
    size: vec2u,
    // Kernel radii (m).
    r_min: f32,
    r_max: f32,
    entry_capacity: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
    sampling: GatherSampling,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(4) var<storage, read> tile_offsets: array<u32>;
@group(0) @binding(5) var<storage, read> tile_entries: array<u32>;
@group(0) @binding(6) var indirect: texture_storage_2d<rgba32float, write>;
@group(0) @binding(7) var caustic: texture_storage_2d<rgba32float, write>;
// Word 4: pixels whose sum was cut.
@group(0) @binding(8) var<storage, read_write> stats: array<atomic<u32>>;
@group(0) @binding(9) var<storage, read> photon_state: PhotonState;

// Of the workgroup, 8 × 8.
const THREADS: u32 = 64u;

@compute @workgroup_size(8, 8)
fn tiled_gather(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let inside = all(id.xy < params.size);
    let pixel = min(id.xy, params.size - 1u);
    let point = visible_point(textureLoad(position, pixel, 0), textureLoad(surface, pixel, 0), params.camera_position_world);
    let gathers = inside && point.gatherable;

    let tile = workgroup.y * params.tiles_x + workgroup.x;
    let end = min(tile_offsets[tile + 1u], params.entry_capacity);
    var sum: RadianceSum;
    var picker = photon_picker(params.sampling, pixel);
    for (var block = tile_offsets[tile]; block < end; block += PHOTON_BLOCK) {
        let count = min(PHOTON_BLOCK, end - block);
        for (var i = thread; i < count; i += THREADS) {
            let photon = photon_load(photons[tile_entries[block + i]], photon_state.grid);
            load_block_photon(i, photon, params.r_min, params.r_max);
        }
        workgroupBarrier();
        if gathers {
            gather(&sum, &picker, point, vec2u(0u, count));
        }
        workgroupBarrier();
    }
    finish_sum(&sum, params.sampling);
    let begin = min(tile_offsets[tile], end);
    if gathers && sum_is_cut(sum, end - begin) {
        atomicAdd(&stats[4], 1u);
    }
    if inside {
        textureStore(indirect, id.xy, vec4f(sum.indirect, 1.0));
        textureStore(caustic, id.xy, vec4f(sum.caustic, 1.0));
    }
}
