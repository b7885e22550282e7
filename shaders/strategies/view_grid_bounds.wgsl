// World-space box and normal cone of the visible points of each chunk; one workgroup per chunk.
#import "shared/bound_points.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/view_points.wgsl"

struct Params {
    camera_position_world: vec3f,
    tiles_x: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var<storage, read> points: array<u32>;
// Empty past the last chunk.
@group(0) @binding(4) var<storage, read> chunks: array<vec2u>;
@group(0) @binding(5) var<storage, read_write> chunk_bounds: array<PointBounds>;

@compute @workgroup_size(64)
fn view_grid_bounds(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let index = workgroup.y * workgroups.x + workgroup.x;
    let chunk = chunks[min(index, arrayLength(&chunks) - 1u)];
    if index >= arrayLength(&chunks) || chunk.x == chunk.y {
        return;
    }
    let pixel = point_pixel(points[min(chunk.x + thread, chunk.y - 1u)], params.tiles_x);
    let point = visible_point(textureLoad(position, pixel, 0), textureLoad(surface, pixel, 0), params.camera_position_world);
    let bounds = bound_points(thread, point, chunk.x + thread < chunk.y);
    if thread == 0u {
        chunk_bounds[index] = bounds;
    }
}
