// Counts the visible points of each bucket, and the chunks of up to 64 that they make; pixels that do not gather become black here.
//
// A workgroup is a tile of 8 × 8: its points come to a bucket at one time, and mostly end in one chunk. Nothing depends on it but how
// tight the chunks are.
#import "shared/gbuffer.wgsl"
#import "shared/sorted_grid.wgsl"
#import "shared/view_points.wgsl"

struct Params {
    grid: SortedGrid,
    size: vec2u,
    tiles_x: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var<storage, read_write> point_counts: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> chunk_counts: array<atomic<u32>>;
// Bucket of each point and its rank there.
@group(0) @binding(5) var<storage, read_write> point_places: array<vec2u>;
@group(0) @binding(6) var indirect: texture_storage_2d<rgba32float, write>;
@group(0) @binding(7) var caustic: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn view_grid_count(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let inside = all(id.xy < params.size);
    let pixel = min(id.xy, params.size - 1u);
    let number = (tile.y * params.tiles_x + tile.x) * TILE_POINTS + thread;
    if !inside || !gathers(textureLoad(surface, pixel, 0)) {
        point_places[number] = vec2u(NO_BUCKET, 0u);
        if inside {
            textureStore(indirect, pixel, vec4f(0.0, 0.0, 0.0, 1.0));
            textureStore(caustic, pixel, vec4f(0.0, 0.0, 0.0, 1.0));
        }
        return;
    }
    let place = cell_place(params.grid, textureLoad(position, pixel, 0).xyz);
    let bucket = row_begin(params.grid, vec2i(floor(place.yz))) + row_cell(params.grid, place.x);
    let rank = atomicAdd(&point_counts[bucket], 1u);
    if rank % TILE_POINTS == 0u {
        atomicAdd(&chunk_counts[bucket], 1u);
    }
    point_places[number] = vec2u(bucket, rank);
}
