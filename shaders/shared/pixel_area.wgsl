// The piece of a surface that a pixel shows.
#import "shared/camera.wgsl"

// Area (m²) of the quadrilateral that the pixel's four corners cut from the tangent plane at its visible point.
//
// With the eye at height h over the plane and corner rays s_i that reach the film, one metre away, the corners lie at (h / w_i) s_i, w_i = n·s_i.
// A triangle of corners a, b, c spans a tetrahedron with the eye: its area is h² |det(s_a, s_b, s_c)| / (2 |w_a w_b w_c|), and the two of a pixel
// have |det| = A, the pixel's area on the film. Together h² A (w_1 + w_3) / (2 w_0 w_1 w_2 w_3), without cancellation however small the pixel.
fn pixel_area(camera: Camera, pixel: vec2u, position: vec3f, normal: vec3f) -> f32 {
    let n = (vec4f(normal, 0.0) * camera.world_from_view).xyz;
    let at = (camera.view_from_world * vec4f(position, 1.0)).xyz;
    let height = abs(dot(n, at));
    let edge = 2.0 * camera.tan_half / vec2f(camera.size);
    let film_area = edge.x * edge.y;
    // w at the corner (0, 0) and its steps to the right and down.
    let corner = (vec2f(pixel) / vec2f(camera.size) * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0)) * camera.tan_half;
    let step = n.xy * edge * vec2f(1.0, -1.0);
    let first = dot(n, vec3f(corner, -1.0));
    // Seen from above or from below: one sign.
    let w = vec4f(first, first + step.x, first + step.x + step.y, first + step.y) * select(1.0, -1.0, dot(n, at) < 0.0);
    if min(min(w.x, w.y), min(w.z, w.w)) > 0.0 {
        return 0.5 * height * height * film_area * (w.y + w.w) / (w.x * w.y * w.z * w.w);
    }
    // The plane's horizon runs through the pixel: the density of area at the visible point, h² A / w³, w = h / z there.
    let depth = -at.z;
    return film_area * depth * depth * depth / max(height, 1.0e-6 * depth);
}
