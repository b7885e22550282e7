// World-space box and normal cone of the visible points of each tile that gather photons; one workgroup per tile.
//
// The paper culls a photon against the depth range of a tile; the box culls in all three axes, and the box of a flat
// surface seen at a grazing angle is much smaller than its frustum slab. The cone culls what arrives at the other side of a
// wall, or at the next wall of a corner.
#import "shared/estimate.wgsl"
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
// Cosines that the estimate computes and those of the bounds differ by their rounding only.
const COSINE_SLACK: f32 = 1.0e-4;

var<workgroup> lower: array<vec3f, THREADS>;
var<workgroup> upper: array<vec3f, THREADS>;
var<workgroup> normals: array<vec3f, THREADS>;
var<workgroup> cosines: array<f32, THREADS>;
var<workgroup> points: atomic<u32>;

// cos(θ + b), at most π, of angles in [0, π] given by their cosines.
fn cos_of_sum(cos_a: f32, cos_b: f32) -> f32 {
    let sines = sqrt((1.0 - cos_a * cos_a) * (1.0 - cos_b * cos_b));
    return select(-1.0, cos_a * cos_b - sines, cos_a > -cos_b);
}

@compute @workgroup_size(8, 8)
fn tiled_bounds(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let pixel = min(id.xy, params.size - 1u);
    let point = visible_point(textureLoad(position, pixel, 0), textureLoad(surface, pixel, 0), params.camera_position_world);
    let gathers = all(id.xy < params.size) && point.gatherable;
    lower[thread] = select(vec3f(INFINITY), point.position, gathers);
    upper[thread] = select(vec3f(-INFINITY), point.position, gathers);
    normals[thread] = select(vec3f(0.0), point.normal_geometric, gathers);
    atomicAdd(&points, select(0u, 1u, gathers));
    workgroupBarrier();
    for (var half = THREADS / 2u; half > 0u; half /= 2u) {
        if thread < half {
            lower[thread] = min(lower[thread], lower[thread + half]);
            upper[thread] = max(upper[thread], upper[thread + half]);
            normals[thread] += normals[thread + half];
        }
        workgroupBarrier();
    }
    // Normals that cancel have no axis: any will do, for then the cone is wide.
    let sum = normals[0];
    let axis = select(vec3f(0.0, 0.0, 1.0), normalize(sum), dot(sum, sum) > 1.0e-6);
    cosines[thread] = select(1.0, dot(axis, point.normal_geometric), gathers);
    workgroupBarrier();
    for (var half = THREADS / 2u; half > 0u; half /= 2u) {
        if thread < half {
            cosines[thread] = min(cosines[thread], cosines[thread + half]);
        }
        workgroupBarrier();
    }
    if thread == 0u {
        let widest = clamp(cosines[0], -1.0, 1.0);
        tile_bounds[tile.y * params.tiles_x + tile.x] = TileBounds(
            lower[0], atomicLoad(&points), upper[0], cos_of_sum(widest, MIN_NORMAL_COSINE) - COSINE_SLACK,
            axis, cos_of_sum(widest, 0.0) - COSINE_SLACK
        );
    }
}
