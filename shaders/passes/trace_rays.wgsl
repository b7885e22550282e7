// Any list of rays against the scene: nearest hits.
#import "shared/bvh.wgsl"
#import "shared/dispatch.wgsl"
#import "shared/rays.wgsl"

struct TraceRaysParams {
    count: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: TraceRaysParams;
@group(0) @binding(1) var<storage, read> rays: array<Ray>;
@group(0) @binding(2) var<storage, read_write> hits: array<RayHit>;

// The hit on the triangle that is taken to be the first; NO_HIT where the ray does not meet it.
fn hit_seen(ray: Ray) -> Hit {
    let none = Hit(ray.t_max, NO_HIT, vec2f(0.0));
    if ray.seen == 0u {
        return none;
    }
    let triangle = bvh_triangles[ray.seen - 1u];
    let tuv = intersect_triangle(triangle, ray.origin, ray_axes(ray.direction));
    if tuv.x <= 0.0 || tuv.x >= ray.t_max {
        return none;
    }
    if SCENE_ALPHA && (triangle.id & ALPHA_TESTED) != 0u && alpha_passes(triangle.id & ~ALPHA_TESTED, tuv.yz, ray.direction) {
        return none;
    }
    return Hit(tuv.x, ray.seen - 1u, tuv.yz);
}

@compute @workgroup_size(64)
fn trace_rays(@builtin(global_invocation_id) global_id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let i = linear_index(global_id, workgroups, 64u);
    if i >= params.count {
        return;
    }
    if rays[i].t_max <= 0.0 {
        hits[i] = RayHit(0.0, NO_HIT, vec2f(0.0));
        return;
    }
    var hit = hit_seen(rays[i]);
    if hit.index == NO_HIT {
        hit = trace_ray(rays[i].origin, rays[i].direction, rays[i].t_max, false);
    }
    var id = NO_HIT;
    if hit.index != NO_HIT {
        id = bvh_triangles[hit.index].id & ~ALPHA_TESTED;
    }
    hits[i] = RayHit(hit.t, id, hit.uv);
}
