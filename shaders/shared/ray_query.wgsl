// Rays against the scene by the device's ray queries: the functions of `shared/bvh.wgsl` over another structure.
//
// The structure holds the triangles in the order of `bvh_triangles`, so that a primitive's index is the index of a hit.
// A file of `passes/ray_query/` imports this in place of the other, and enables the extension.
#import "shared/hit.wgsl"

@group(1) @binding(8) var ray_query_scene: acceleration_structure;

// The hit on a triangle that the device has chosen, as `shared/bvh.wgsl` computes it: images are the same whatever traces
// their rays, to the bit where the triangles are. A device whose rounding differs may choose the neighbour at an edge: there its own
// numbers stand.
fn refined_hit(t: f32, index: u32, bary: vec2f, origin: vec3f, axes: mat3x3f) -> Hit {
    let tuv = intersect_triangle(bvh_triangles[index], origin, axes);
    if tuv.x > 0.0 {
        return Hit(tuv.x, index, tuv.yz);
    }
    return Hit(t, index, bary);
}

// Nearest hit of the ray in (0, t_max). With `any`, one hit in that range, not always the nearest: for shadow rays.
fn trace_ray(origin: vec3f, direction: vec3f, t_max: f32, any: bool) -> Hit {
    let axes = ray_axes(direction);
    let flags = select(RAY_FLAG_NONE, RAY_FLAG_TERMINATE_ON_FIRST_HIT, any);
    var query: ray_query;
    rayQueryInitialize(&query, ray_query_scene, RayDesc(flags, 0xffu, 0.0, t_max, origin, direction));
    // In a scene without alpha every triangle is opaque to the device, and no candidate comes up here.
    while rayQueryProceed(&query) {
        let candidate = rayQueryGetCandidateIntersection(&query);
        let id = bvh_triangles[candidate.primitive_index].id;
        if SCENE_ALPHA && (id & ALPHA_TESTED) != 0u {
            let hit = refined_hit(candidate.t, candidate.primitive_index, candidate.barycentrics, origin, axes);
            if alpha_passes(id & ~ALPHA_TESTED, hit.uv, direction) {
                continue;
            }
        }
        rayQueryConfirmIntersection(&query);
    }
    let found = rayQueryGetCommittedIntersection(&query);
    if found.kind == RAY_QUERY_INTERSECTION_NONE {
        return Hit(t_max, NO_HIT, vec2f(0.0));
    }
    return refined_hit(found.t, found.primitive_index, found.barycentrics, origin, axes);
}

// Whether nothing stands between `origin` and `origin + direction * t_max`.
fn unoccluded(origin: vec3f, direction: vec3f, t_max: f32) -> bool {
    return trace_ray(origin, direction, t_max, true).index == NO_HIT;
}
