// The bounds of the visible points of a workgroup of 64 threads.
//
// The box culls in all three axes: that of a flat surface seen at a grazing angle is much smaller than a slab of depths. The cone
// culls what arrives at the other side of a wall, or at the next wall of a corner.
#import "shared/estimate.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/point_bounds.wgsl"

const BOUND_THREADS: u32 = 64u;
// Cosines that the estimate computes and those of the bounds differ by their rounding only.
const COSINE_SLACK: f32 = 1.0e-4;

var<workgroup> bound_lower: array<vec3f, BOUND_THREADS>;
var<workgroup> bound_upper: array<vec3f, BOUND_THREADS>;
var<workgroup> bound_normals: array<vec3f, BOUND_THREADS>;
var<workgroup> bound_cosines: array<f32, BOUND_THREADS>;
var<workgroup> bound_count: atomic<u32>;

// cos(θ + b), at most π, of angles in [0, π] given by their cosines.
fn cos_of_sum(cos_a: f32, cos_b: f32) -> f32 {
    let sines = sqrt((1.0 - cos_a * cos_a) * (1.0 - cos_b * cos_b));
    return select(-1.0, cos_a * cos_b - sines, cos_a > -cos_b);
}

// Bounds of the points of those threads that gather. The whole workgroup calls it, once; what it returns holds for thread 0.
fn bound_points(thread: u32, point: VisiblePoint, gathers: bool) -> PointBounds {
    bound_lower[thread] = select(vec3f(INFINITY), point.position, gathers);
    bound_upper[thread] = select(vec3f(-INFINITY), point.position, gathers);
    bound_normals[thread] = select(vec3f(0.0), point.normal_geometric, gathers);
    atomicAdd(&bound_count, select(0u, 1u, gathers));
    workgroupBarrier();
    for (var half = BOUND_THREADS / 2u; half > 0u; half /= 2u) {
        if thread < half {
            bound_lower[thread] = min(bound_lower[thread], bound_lower[thread + half]);
            bound_upper[thread] = max(bound_upper[thread], bound_upper[thread + half]);
            bound_normals[thread] += bound_normals[thread + half];
        }
        workgroupBarrier();
    }
    // Normals that cancel have no axis: any will do, for then the cone is wide.
    let sum = bound_normals[0];
    let axis = select(vec3f(0.0, 0.0, 1.0), normalize(sum), dot(sum, sum) > 1.0e-6);
    bound_cosines[thread] = select(1.0, dot(axis, point.normal_geometric), gathers);
    workgroupBarrier();
    for (var half = BOUND_THREADS / 2u; half > 0u; half /= 2u) {
        if thread < half {
            bound_cosines[thread] = min(bound_cosines[thread], bound_cosines[thread + half]);
        }
        workgroupBarrier();
    }
    let widest = clamp(bound_cosines[0], -1.0, 1.0);
    return PointBounds(
        bound_lower[0], atomicLoad(&bound_count), bound_upper[0], cos_of_sum(widest, MIN_NORMAL_COSINE) - COSINE_SLACK,
        axis, cos_of_sum(widest, 0.0) - COSINE_SLACK
    );
}
