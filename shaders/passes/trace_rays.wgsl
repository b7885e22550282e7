// Any list of rays against the scene: nearest hits.
#import "shared/bvh.wgsl"
#import "shared/dispatch.wgsl"
#import "shared/hit_seen.wgsl"

struct TraceRaysParams {
    count: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: TraceRaysParams;
@group(0) @binding(1) var<storage, read> rays: array<Ray>;
@group(0) @binding(2) var<storage, read_write> hits: array<RayHit>;

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
