// Any list of rays against the scene: nearest hits.
#import "shared/bvh.wgsl"
#import "shared/dispatch.wgsl"

struct TraceRaysParams {
    count: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

struct Ray {
    // World (m).
    origin: vec3f,
    // Length in units of `direction`.
    t_max: f32,
    direction: vec3f,
    pad0: u32,
}

struct RayHit {
    t: f32,
    // Triangle of the scene, 0xffffffff: none.
    triangle: u32,
    // Barycentric weights of the second and third corner.
    bary: vec2f,
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
    let hit = trace_ray(rays[i].origin, rays[i].direction, rays[i].t_max, false);
    var id = NO_HIT;
    if hit.index != NO_HIT {
        id = bvh_triangles[hit.index].id & ~ALPHA_TESTED;
    }
    hits[i] = RayHit(hit.t, id, hit.uv);
}
