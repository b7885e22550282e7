// Screen tiles and the spheres that reach them: the geometry of [MML13] section 2.3.1, "2D: Tiles".
#import "shared/camera.wgsl"

// First tile of the range and the one past its last, in tiles.
struct TileRange {
    first: vec2u,
    end: vec2u,
}

// Tangents of the angles under which the circle of `radius` around (side, depth) is seen from the origin, measured from
// the forward axis; ±1e30 where it reaches or crosses the plane of the eye. Needs depth > −radius.
//
//           depth
//             |    tan(φ + α), φ = atan2(side, depth),
//     tan(φ−α)|   /         o    sin α = radius / |centre|
//          \  |  /      (   c   )
//           \ | /         ⌣
//    ---------eye------------- side
fn circle_tangents(side: f32, depth: f32, radius: f32) -> vec2f {
    let tangent_squared = side * side + depth * depth - radius * radius;
    // Around the eye: everything may be covered. The slack outweighs the rounding of the difference above.
    if tangent_squared <= radius * radius * 1.0e-4 {
        return vec2f(-1.0e30, 1.0e30);
    }
    let t = sqrt(tangent_squared);
    let crosses = depth <= radius;
    var tangents = vec2f(-1.0e30, 1.0e30);
    // A circle that crosses the eye's plane does so on one side of the eye; there it reaches infinity.
    let lower_cos = depth * t + side * radius;
    if lower_cos > 0.0 && !(crosses && side < 0.0) {
        tangents.x = (side * t - depth * radius) / lower_cos;
    }
    let upper_cos = depth * t - side * radius;
    if upper_cos > 0.0 && !(crosses && side > 0.0) {
        tangents.y = (side * t + depth * radius) / upper_cos;
    }
    return tangents;
}

// Tiles whose pixels may show a point of the sphere, conservatively: one more pixel on every side, since visible points may be jittered
// inside their pixels and the projection rounds. Empty (first = end) for spheres behind the eye or off the image.
fn sphere_tiles(camera: Camera, center_world: vec3f, radius: f32, tile_size: u32, tiles: vec2u) -> TileRange {
    let center_view = (camera.view_from_world * vec4f(center_world, 1.0)).xyz;
    let depth = -center_view.z;
    if depth <= -radius {
        return TileRange(vec2u(0u), vec2u(0u));
    }
    let x = circle_tangents(center_view.x, depth, radius) / camera.tan_half.x;
    let y = circle_tangents(center_view.y, depth, radius) / camera.tan_half.y;
    // Rows run from the top: the upper tangent gives the first row.
    let size = vec2f(camera.size);
    let first = (vec2f(x.x, -y.y) * 0.5 + 0.5) * size - 1.0;
    let last = (vec2f(x.y, -y.x) * 0.5 + 0.5) * size + 1.0;
    if any(last < vec2f(0.0)) || any(first >= size) {
        return TileRange(vec2u(0u), vec2u(0u));
    }
    let inside = vec2f(tiles) - 1.0;
    let scale = 1.0 / f32(tile_size);
    let first_tile = clamp(floor(first * scale), vec2f(0.0), inside);
    let last_tile = clamp(floor(last * scale), vec2f(0.0), inside);
    return TileRange(vec2u(first_tile), vec2u(last_tile) + 1u);
}
