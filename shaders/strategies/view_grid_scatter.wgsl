// Writes the number of each visible point into its bucket, and cuts the buckets into chunks.
#import "shared/dispatch.wgsl"
#import "shared/view_points.wgsl"

// Bucket of each point and its rank there.
@group(0) @binding(0) var<storage, read> point_places: array<vec2u>;
@group(0) @binding(1) var<storage, read> point_offsets: array<u32>;
@group(0) @binding(2) var<storage, read> chunk_offsets: array<u32>;
@group(0) @binding(3) var<storage, read_write> points: array<u32>;
// First and end of each chunk's points.
@group(0) @binding(4) var<storage, read_write> chunks: array<vec2u>;

@compute @workgroup_size(64)
fn view_grid_scatter(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let number = linear_index(id, workgroups, 64u);
    if number >= arrayLength(&point_places) {
        return;
    }
    let place = point_places[number];
    if place.x == NO_BUCKET {
        return;
    }
    let slot = point_offsets[place.x] + place.y;
    points[slot] = number;
    if place.y % TILE_POINTS == 0u {
        let end = min(slot + TILE_POINTS, point_offsets[place.x + 1u]);
        chunks[chunk_offsets[place.x] + place.y / TILE_POINTS] = vec2u(slot, end);
    }
}
