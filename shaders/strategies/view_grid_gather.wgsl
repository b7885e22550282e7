// Sums the photons of a chunk at each of its points; one workgroup per chunk, as `tiled_gather` per tile.
#import "shared/gather_sampling.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/photon_block.wgsl"
#import "shared/photon_store.wgsl"
#import "shared/view_points.wgsl"

struct Params {
    camera_position_world: vec3f,
    tiles_x: u32,
    // Kernel radii (m).
    r_min: f32,
    r_max: f32,
    entry_capacity: u32,
    pad0: u32,
    sampling: GatherSampling,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(4) var<storage, read> photon_state: PhotonState;
@group(0) @binding(5) var<storage, read> points: array<u32>;
// Empty past the last chunk.
@group(0) @binding(6) var<storage, read> chunks: array<vec2u>;
@group(0) @binding(7) var<storage, read> list_offsets: array<u32>;
// The last word: photons whose insertion was cut.
@group(0) @binding(8) var<storage, read> list_counts: array<u32>;
@group(0) @binding(9) var<storage, read> entries: array<u32>;
@group(0) @binding(10) var indirect: texture_storage_2d<rgba32float, write>;
@group(0) @binding(11) var caustic: texture_storage_2d<rgba32float, write>;
// Word 4: pixels whose sum was cut, and photons that were.
@group(0) @binding(12) var<storage, read_write> stats: array<atomic<u32>>;

const THREADS: u32 = 64u;

@compute @workgroup_size(64)
fn view_grid_gather(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let index = workgroup.y * workgroups.x + workgroup.x;
    if index == 0u && thread == 0u {
        atomicAdd(&stats[4], list_counts[arrayLength(&list_counts) - 1u]);
    }
    let chunk = chunks[min(index, arrayLength(&chunks) - 1u)];
    if index >= arrayLength(&chunks) || chunk.x == chunk.y {
        return;
    }
    let gathers = chunk.x + thread < chunk.y;
    let pixel = point_pixel(points[min(chunk.x + thread, chunk.y - 1u)], params.tiles_x);
    let point = visible_point(textureLoad(position, pixel, 0), textureLoad(surface, pixel, 0), params.camera_position_world);

    let end = min(list_offsets[index + 1u], params.entry_capacity);
    let begin = min(list_offsets[index], end);
    var sum: RadianceSum;
    var picker = photon_picker(params.sampling, pixel);
    for (var block = begin; block < end; block += PHOTON_BLOCK) {
        let count = min(PHOTON_BLOCK, end - block);
        for (var i = thread; i < count; i += THREADS) {
            let photon = photon_load(photons[entries[block + i]], photon_state.grid);
            load_block_photon(i, photon, params.r_min, params.r_max);
        }
        workgroupBarrier();
        if gathers {
            gather(&sum, &picker, point, vec2u(0u, count));
        }
        workgroupBarrier();
    }
    if !gathers {
        return;
    }
    finish_sum(&sum, params.sampling);
    if sum_is_cut(sum, end - begin) {
        atomicAdd(&stats[4], 1u);
    }
    textureStore(indirect, pixel, vec4f(sum.indirect, 1.0));
    textureStore(caustic, pixel, vec4f(sum.caustic, 1.0));
}
