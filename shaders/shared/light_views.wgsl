// What lights see, rasterised (passes/rsm_view.wgsl): which triangle lies first along a ray of theirs, as far as texels can tell. Needs
// `seen` bound: texture_2d_array<u32>, a layer for each of `light_views`.
#import "shared/light_groups.wgsl"

// What no view shows.
const NOT_SEEN: u32 = 0xffffffffu;

// The face of a cube around the light, in the order of its views: +x, −x, +y, −y, +z, −z.
fn cube_face(direction: vec3f) -> u32 {
    let size = abs(direction);
    if size.x >= max(size.y, size.z) {
        return select(0u, 1u, direction.x < 0.0);
    }
    return select(select(4u, 5u, direction.z < 0.0), select(2u, 3u, direction.y < 0.0), size.y >= size.z);
}

// Index into `bvh_triangles` + 1 of what the light saw along a ray that leaves it, 0: nothing. NOT_SEEN: none of its views shows the
// ray. `drawn`: 1 if there are views, else 0.
fn seen_along(group: LightGroup, origin: vec3f, direction: vec3f, drawn: u32) -> u32 {
    if group.view_count * drawn == 0u {
        return NOT_SEEN;
    }
    let view = group.first_view + select(0u, cube_face(direction), group.view_count > 1u);
    // A perspective view looks from the origin, a parallel one along the direction: every point of the ray is in one place.
    let clip = light_views[view].clip_from_world * vec4f(origin + direction, 1.0);
    if clip.w <= 0.0 || any(abs(clip.xy) > vec2f(clip.w)) {
        return NOT_SEEN;
    }
    let side = textureDimensions(seen).x;
    let film = (clip.xy / clip.w * vec2f(0.5, -0.5) + 0.5) * f32(side);
    return textureLoad(seen, min(vec2u(film), vec2u(side - 1u)), view, 0).x;
}
