// World-space box and normal cone of the visible points of each tile that gather photons; one workgroup per tile.
//
// The paper culls a photon against the depth range of a tile; box and cone leave fewer.
#import "shared/bound_points.wgsl"
#import "shared/gbuffer.wgsl"

struct Params {
    camera_position_world: vec3f,
    tiles_x: u32,
    size: vec2u,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var<storage, read_write> tile_bounds: array<PointBounds>;

@compute @workgroup_size(8, 8)
fn tiled_bounds(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let pixel = min(id.xy, params.size - 1u);
    let point = visible_point(textureLoad(position, pixel, 0), textureLoad(surface, pixel, 0), params.camera_position_world);
    let gathers = all(id.xy < params.size) && point.gatherable;
    let bounds = bound_points(thread, point, gathers);
    if thread == 0u {
        tile_bounds[tile.y * params.tiles_x + tile.x] = bounds;
    }
}
