// Rays that bring the triangle which they meet first.
#import "shared/hit.wgsl"
#import "shared/rays.wgsl"

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
