// `passes/trace_rays.wgsl` as a ray-tracing pipeline: an invocation per ray, and the device calls the others.
//
// The structure holds the triangles in the order of `bvh_triangles`, so that a primitive's index is the index of a hit. It is built
// outside wgpu, as is the pipeline; see `ray_pipeline` in `lightloom-passes`.
enable wgpu_ray_tracing_pipeline;
enable primitive_index;
#import "shared/hit_seen.wgsl"

@group(0) @binding(0) var<storage, read> live: LivePaths;
@group(0) @binding(1) var<storage, read> rays: array<Ray>;
@group(0) @binding(2) var<storage, read_write> hits: array<RayHit>;
@group(1) @binding(8) var ray_pipeline_scene: acceleration_structure;

// What the device found.
struct Found {
    // In units of the ray's direction.
    t: f32,
    // Index into `bvh_triangles`, or NO_HIT.
    index: u32,
}

var<ray_payload> asked: Found;
var<incoming_ray_payload> found: Found;

// The hit on a triangle that the device has chosen, as `shared/bvh.wgsl` computes it. A device whose rounding differs may choose the
// neighbour at an edge: there its own `t` stands, and the point of the triangle that is next to the ray.
fn refined_hit(t: f32, index: u32, origin: vec3f, axes: mat3x3f) -> Hit {
    let triangle = bvh_triangles[index];
    let tuv = intersect_triangle(triangle, origin, axes);
    if tuv.x > 0.0 {
        return Hit(tuv.x, index, tuv.yz);
    }
    // naga has no barycentric weights of the device's.
    let a = ((triangle.v0 - origin) * axes).xy;
    let b = ((triangle.v1 - origin) * axes).xy;
    let c = ((triangle.v2 - origin) * axes).xy;
    let areas = vec3f(c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x);
    let facing = sign(areas.x + areas.y + areas.z);
    let inside = max(facing * areas, vec3f(0.0));
    let sum = inside.x + inside.y + inside.z;
    return Hit(t, index, select(vec2f(0.0), inside.yz / sum, sum > 0.0));
}

// Tells the device that the ray passes. WGSL has no word for it: this body is replaced in the SPIR-V by OpIgnoreIntersectionKHR.
fn ignore_intersection() {}

// Called for candidates that are not opaque to the device: in a scene without alpha, for none.
@any_hit @incoming_payload(found)
fn trace_rays_any_hit(
    @builtin(primitive_index) index: u32,
    @builtin(world_ray_origin) origin: vec3f,
    @builtin(world_ray_direction) direction: vec3f,
    @builtin(ray_t_current_max) t: f32,
) {
    let id = bvh_triangles[index].id;
    if SCENE_ALPHA && (id & ALPHA_TESTED) != 0u {
        let hit = refined_hit(t, index, origin, ray_axes(direction));
        if alpha_passes(id & ~ALPHA_TESTED, hit.uv, direction) {
            ignore_intersection();
        }
    }
}

@closest_hit @incoming_payload(found)
fn trace_rays_closest_hit(@builtin(primitive_index) index: u32, @builtin(ray_t_current_max) t: f32) {
    found = Found(t, index);
}

@miss @incoming_payload(found)
fn trace_rays_miss() {
    found.index = NO_HIT;
}

@ray_generation
fn trace_rays(@builtin(ray_invocation_id) id: vec3u, @builtin(num_ray_invocations) invocations: vec3u) {
    let i = id.y * invocations.x + id.x;
    if i >= arrayLength(&hits) {
        return;
    }
    // Behind the live rays lie those of earlier frames.
    if i >= live.count || rays[i].t_max <= 0.0 {
        hits[i] = RayHit(0.0, NO_HIT, vec2f(0.0));
        return;
    }
    let ray = rays[i];
    var hit = hit_seen(ray);
    if hit.index == NO_HIT {
        // Where the ray is none, naga traces nothing.
        asked = Found(ray.t_max, NO_HIT);
        traceRay(ray_pipeline_scene, RayDesc(RAY_FLAG_NONE, 0xffu, 0.0, ray.t_max, ray.origin, ray.direction), &asked);
        if asked.index == NO_HIT {
            hits[i] = RayHit(ray.t_max, NO_HIT, vec2f(0.0));
            return;
        }
        hit = refined_hit(asked.t, asked.index, ray.origin, ray_axes(ray.direction));
    }
    hits[i] = RayHit(hit.t, bvh_triangles[hit.index].id & ~ALPHA_TESTED, hit.uv);
}
