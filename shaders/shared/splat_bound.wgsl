// What an ellipsoid covers of the image: the ellipse it projects to, the tightest polygons around that, and the texels of small ones.
//
// The plane through the eye and a line l of the image touches the ellipsoid with centre c and half axes a_i where lᵀ (M − c cᵀ) l = 0,
// M = Σ a_i a_iᵀ: the dual of its outline. Read as a dual ellipse, that gives centre and shape. Written out, all that cancels is gone:
// M may be a millionth of c cᵀ.
#import "shared/splat_target.wgsl"
#import "shared/tiles.wgsl"

struct SplatBound {
    // Centre (pixels of the image, samples at centres).
    center: vec2f,
    // Columns are two conjugate half axes (pixels): the ellipse is center + axes · (unit circle).
    axes: mat2x2f,
    // Half the width and height of its box (pixels).
    half_size: vec2f,
    // It lies in the image, or may.
    visible: bool,
}

// Relative widening of ellipses; with the next, more than the snapping of corners takes away at any size.
const BOUND_SLACK: f32 = 1.001;
// Pixels, to be added in squares.
const BOUND_SOFTENING: f32 = 0.25;

fn no_bound() -> SplatBound {
    return SplatBound(vec2f(0.0), mat2x2f(0.0, 0.0, 0.0, 0.0), vec2f(0.0), false);
}

// An ellipse around the box of the part of the image that the sphere may cover: for what reaches the plane of the eye, where outlines are
// hyperbolas.
fn bound_of_box(center_view: vec3f, radius: f32) -> SplatBound {
    let depth = -center_view.z;
    let x = circle_tangents(center_view.x, depth, radius);
    let y = circle_tangents(center_view.y, depth, radius);
    let image = vec2f(params.camera.size);
    let margin = vec2f(2.0 * splat_slack() + 1.0);
    let lower = clamp((vec2f(x.x, -y.y) / params.camera.tan_half * 0.5 + 0.5) * image - margin, -margin, image + margin);
    let upper = clamp((vec2f(x.y, -y.x) / params.camera.tan_half * 0.5 + 0.5) * image + margin, -margin, image + margin);
    let half_size = 0.5 * (upper - lower);
    let axes = mat2x2f(1.4143 * half_size.x, 0.0, 0.0, 1.4143 * half_size.y);
    return SplatBound(0.5 * (lower + upper) + splat_shift(), axes, 1.4143 * half_size, all(half_size > vec2f(0.0)));
}

// `half_axes`: columns a_i in view space (m). `radius` (m) of a sphere around it.
fn splat_bound(center_view: vec3f, half_axes: mat3x3f, radius: f32) -> SplatBound {
    if sphere_off_screen(center_view, radius) {
        return no_bound();
    }
    // Depth as the third axis.
    let flip = vec3f(1.0, 1.0, -1.0);
    let c = center_view * flip;
    let a = mat3x3f(half_axes[0] * flip, half_axes[1] * flip, half_axes[2] * flip);
    let m = a * transpose(a);
    let scale = c.z * c.z - m[2].z;
    if c.z <= 0.0 || scale <= 0.01 * m[2].z {
        return bound_of_box(center_view, radius);
    }
    let pixels = 0.5 * vec2f(params.camera.size) / params.camera.tan_half * vec2f(1.0, -1.0);
    let center = (c.xy * c.z - m[2].xy) / scale * pixels + 0.5 * vec2f(params.camera.size) + splat_shift();
    let xx = m[0].x * c.z * c.z - 2.0 * m[2].x * c.x * c.z + m[2].z * c.x * c.x + m[2].x * m[2].x - m[0].x * m[2].z;
    let yy = m[1].y * c.z * c.z - 2.0 * m[2].y * c.y * c.z + m[2].z * c.y * c.y + m[2].y * m[2].y - m[1].y * m[2].z;
    let xy = m[0].y * c.z * c.z - m[2].x * c.y * c.z - m[2].y * c.x * c.z + m[2].z * c.x * c.y + m[2].x * m[2].y - m[0].y * m[2].z;
    let per_scale = pixels / scale;
    let softening = BOUND_SOFTENING + splat_slack();
    let square = max(vec2f(xx, yy) * per_scale * per_scale, vec2f(0.0)) * BOUND_SLACK * BOUND_SLACK + softening * softening;
    let product = xy * per_scale.x * per_scale.y * BOUND_SLACK * BOUND_SLACK;
    // Cholesky: any pair of conjugate half axes will do.
    let first = sqrt(square.x);
    let lean = product / first;
    let axes = mat2x2f(first, lean, 0.0, sqrt(max(square.y - lean * lean, softening * softening * 0.5)));
    return SplatBound(center, axes, sqrt(square), true);
}

// What a sphere of `radius` (m) covers.
fn sphere_bound(center_view: vec3f, radius: f32) -> SplatBound {
    return splat_bound(center_view, mat3x3f(radius, 0.0, 0.0, 0.0, radius, 0.0, 0.0, 0.0, radius), radius);
}

// Corner `index` of the polygon of `params.corners` around the ellipse, of all the one with the least area: the affine image of the regular
// one.
fn bound_corner(bound: SplatBound, index: u32) -> vec2f {
    let step = 2.0 * PI / f32(params.corners);
    let angle = step * f32(index);
    return bound.center + bound.axes * (vec2f(cos(angle), sin(angle)) / cos(0.5 * step));
}

// Vertex of the fan of triangles over that polygon, or over the texels of a small splat.
fn bound_vertex(bound: SplatBound, vertex: u32) -> vec4f {
    if !bound.visible {
        return NOWHERE;
    }
    if bound_is_small(bound) {
        return bound_texels(bound, vertex);
    }
    let triangle = vertex / 3u;
    let corner = vertex % 3u;
    return film_to_clip(bound_corner(bound, select(triangle + corner, 0u, corner == 0u)));
}

// Whether the splat is small enough that its texels are drawn as a box: about one texel.
fn bound_is_small(bound: SplatBound) -> bool {
    return all(bound.half_size < vec2f(f32(params.texel)));
}

// Corner `vertex` (0 to 5) of two triangles, clockwise, over the texels whose centres lie in the ellipse's box; NOWHERE for more of them and
// where there are none.
fn bound_texels(bound: SplatBound, vertex: u32) -> vec4f {
    let texel = f32(params.texel);
    let first = ceil((bound.center - bound.half_size) / texel - 0.5);
    let end = floor((bound.center + bound.half_size) / texel - 0.5) + 1.0;
    if vertex >= 6u || any(first >= end) {
        return NOWHERE;
    }
    return box_corner(first * texel, end * texel, vertex);
}
