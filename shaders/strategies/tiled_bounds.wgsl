// World-space box of the visible points of each tile that gather photons; one workgroup per tile.
//
// The paper culls a photon against the depth range of a tile; the box culls in all three axes, and the box of a flat
// surface seen at a grazing angle is much smaller than its frustum slab.
#import "shared/gbuffer.wgsl"
#import "shared/tiles.wgsl"

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
@group(0) @binding(3) var<storage, read_write> tile_bounds: array<TileBounds>;

const THREADS: u32 = 64u;
var<workgroup> lower: array<vec3f, THREADS>;
var<workgroup> upper: array<vec3f, THREADS>;
var<workgroup> points: atomic<u32>;

@compute @workgroup_size(8, 8)
fn tiled_bounds(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    lower[thread] = vec3f(INFINITY);
    upper[thread] = vec3f(-INFINITY);
    if all(id.xy < params.size) {
        let point = visible_point(textureLoad(position, id.xy, 0), textureLoad(surface, id.xy, 0), params.camera_position_world);
        if point.gatherable {
            lower[thread] = point.position;
            upper[thread] = point.position;
            atomicAdd(&points, 1u);
        }
    }
    workgroupBarrier();
    for (var half = THREADS / 2u; half > 0u; half /= 2u) {
        if thread < half {
            lower[thread] = min(lower[thread], lower[thread + half]);
            upper[thread] = max(upper[thread], upper[thread + half]);
        }
        workgroupBarrier();
    }
    if thread == 0u {
        tile_bounds[tile.y * params.tiles_x + tile.x] = TileBounds(lower[0], atomicLoad(&points), upper[0], 0u);
    }
}
