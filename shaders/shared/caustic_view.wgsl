// A light's view as a map: where a point lies on it, where in the scene its texels lie, and how much of a surface each of them holds.
//
// Views are parallel, or perspective from where the light is; `clip_from_world` says which. `q` below is a point less the view's origin.
#import "shared/math.wgsl"
#import "shared/scene_bindings.wgsl"

struct CausticView {
    // Of a perspective view where the light is; of a parallel one the middle of the near plane (world, m).
    origin: vec3f,
    parallel: bool,
    // Unit, into the picture.
    forward: vec3f,
    // Clip x and y of q are dot(·, q), over the depth in a perspective view.
    across: vec3f,
    up: vec3f,
    // Half the picture (m), at depth 1 of a perspective view.
    half_across: vec3f,
    half_up: vec3f,
}

fn caustic_view(index: u32) -> CausticView {
    let rows = transpose(light_views[index].clip_from_world);
    let parallel = all(rows[3].xyz == vec3f(0.0));
    let deep = max(length(rows[2].xyz), 1.0e-30);
    let forward = select(rows[3].xyz, -rows[2].xyz / deep, parallel);
    let half_across = rows[0].xyz / dot(rows[0].xyz, rows[0].xyz);
    let half_up = rows[1].xyz / dot(rows[1].xyz, rows[1].xyz);
    // A parallel view begins where depth is 1.
    let start = select(-rows[3].w, (rows[2].w - 1.0) / deep, parallel);
    let origin = forward * start - half_across * rows[0].w - half_up * rows[1].w;
    return CausticView(origin, parallel, forward, rows[0].xyz, rows[1].xyz, half_across, half_up);
}

// Unit, from `q` to the light.
fn to_light(view: CausticView, q: vec3f) -> vec3f {
    return select(-q * inverseSqrt(max(dot(q, q), 1.0e-30)), -view.forward, view.parallel);
}

// Where `q` lies on a map of `side` texels, its first texel's corner being (0, 0); meaningful where the depth, dot(forward, q), is positive.
fn map_film(view: CausticView, q: vec3f, side: f32) -> vec2f {
    let scale = select(1.0 / dot(view.forward, q), 1.0, view.parallel);
    return (vec2f(dot(view.across, q), dot(view.up, q)) * scale * vec2f(0.5, -0.5) + 0.5) * side;
}

// q of the point of `depth` (m) that lies at `film`.
fn map_point(view: CausticView, film: vec2f, side: f32, depth: f32) -> vec3f {
    let clip = film / side * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0);
    let offset = view.half_across * clip.x + view.half_up * clip.y;
    return select((view.forward + offset) * depth, view.forward * depth + offset, view.parallel);
}

// Edges of a texel (m), at depth 1 of a perspective view.
fn texel_edges(view: CausticView, side: f32) -> vec2f {
    return vec2f(length(view.half_across), length(view.half_up)) * (2.0 / side);
}

// Breadth of a texel that faces the light (m), at `depth`.
fn texel_width(view: CausticView, side: f32, depth: f32) -> f32 {
    let edges = texel_edges(view, side);
    return max(edges.x, edges.y) * select(depth, 1.0, view.parallel);
}

// Area (m²) of the plane through `q` with that normal that a texel around `film` holds. As in shared/pixel_area.wgsl, whose derivation
// it shares: the quadrilateral that the rays through the texel's corners cut from the plane.
fn texel_area(view: CausticView, film: vec2f, side: f32, q: vec3f, normal: vec3f) -> f32 {
    let edges = texel_edges(view, side);
    let film_area = edges.x * edges.y;
    if view.parallel {
        return film_area / max(abs(dot(normal, view.forward)), 1.0e-6);
    }
    let height = abs(dot(normal, q));
    // n·s for the rays s through the corners, one deep.
    let corner = (film - 0.5) / side * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0);
    let step = vec2f(dot(normal, view.half_across), -dot(normal, view.half_up)) * (2.0 / side);
    let first = dot(normal, view.forward + view.half_across * corner.x + view.half_up * corner.y);
    let w = vec4f(first, first + step.x, first + step.x + step.y, first + step.y) * select(1.0, -1.0, dot(normal, q) < 0.0);
    if min(min(w.x, w.y), min(w.z, w.w)) > 0.0 {
        return 0.5 * height * height * film_area * (w.y + w.w) / (w.x * w.y * w.z * w.w);
    }
    // The plane's horizon runs through the texel: the density of area at the point.
    let depth = dot(view.forward, q);
    return film_area * depth * depth * depth / max(height, 1.0e-6 * depth);
}
