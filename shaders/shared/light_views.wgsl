// What lights see, rasterised (passes/rsm_view.wgsl): which triangle lies first along a ray of theirs, as far as texels can tell. Needs
// `seen` bound: texture_2d_array<u32>, a layer for each of `light_views`.
#import "shared/light_groups.wgsl"

// What no view shows.
const NOT_SEEN: u32 = 0xffffffffu;

// Index into `bvh_triangles` + 1 of what the light saw along a ray that leaves it, 0: nothing. NOT_SEEN: none of its views,
// `views` at most, shows the ray. `side`: texels across and down.
fn seen_along(group: LightGroup, origin: vec3f, direction: vec3f, side: u32, views: u32) -> u32 {
    for (var view = group.first_view; view < group.first_view + min(group.view_count, views); view += 1u) {
        // A perspective view looks from the origin, a parallel one along the direction: every point of the ray is in one place.
        let clip = light_views[view].clip_from_world * vec4f(origin + direction, 1.0);
        if clip.w > 0.0 && all(abs(clip.xy) <= vec2f(clip.w)) {
            let film = (clip.xy / clip.w * vec2f(0.5, -0.5) + 0.5) * f32(side);
            return textureLoad(seen, min(vec2u(film), vec2u(side - 1u)), view, 0).x;
        }
    }
    return NOT_SEEN;
}
