// The surfaces that light-space maps lie on: what a light would see if nothing refracted and nothing mirrored. Needs `receivers` bound:
// texture_2d_array<u32>, a layer for each of `light_views`; depth (m, bits of a float; 0: nothing), geometric normal towards the light.
#import "shared/caustic_view.wgsl"

struct Receiver {
    // m; 0: nothing.
    depth: f32,
    normal: vec3f,
}

fn receiver(texel: vec2u, view: u32) -> Receiver {
    let words = textureLoad(receivers, texel, view, 0);
    return Receiver(bitcast<f32>(words.x), octahedral_decode(words.y));
}

// Receivers turned further away than this are another surface, as for photons in shared/estimate.wgsl.
const RECEIVER_COSINE: f32 = 0.5;

// Distance (m) of what the texel shows from the plane through `q` with that normal; a large one where it shows nothing, or another surface.
fn receiver_off_plane(view: CausticView, texel: vec2u, index: u32, side: f32, q: vec3f, normal: vec3f) -> f32 {
    let shown = receiver(texel, index);
    let point = map_point(view, vec2f(texel) + 0.5, side, shown.depth);
    return select(INFINITY, abs(dot(normal, point - q)), shown.depth > 0.0 && dot(shown.normal, normal) >= RECEIVER_COSINE);
}

// The four texels around `film`, the first of which is (x, y): x, y and the place between their centres.
struct Bilinear {
    first: vec2i,
    fraction: vec2f,
}

fn bilinear(film: vec2f) -> Bilinear {
    let at = floor(film - 0.5);
    return Bilinear(vec2i(at), film - 0.5 - at);
}

fn bilinear_texel(place: Bilinear, corner: u32, side: f32) -> vec2u {
    return vec2u(clamp(place.first + vec2i(vec2u(corner & 1u, corner >> 1u)), vec2i(0), vec2i(i32(side) - 1)));
}

// Whether the light sees `q`, on a surface of that normal: it faces the light, and one of the four texels around it shows its plane.
fn light_sees(view: CausticView, index: u32, side: f32, q: vec3f, normal: vec3f, slack: f32) -> bool {
    let depth = dot(view.forward, q);
    let film = map_film(view, q, side);
    if !(depth > 0.0 && all(film >= vec2f(0.0)) && all(film < vec2f(side)) && dot(to_light(view, q), normal) > 0.0) {
        return false;
    }
    let place = bilinear(film);
    let allowed = texel_width(view, side, depth) + slack;
    var nearest = INFINITY;
    for (var corner = 0u; corner < 4u; corner += 1u) {
        nearest = min(nearest, receiver_off_plane(view, bilinear_texel(place, corner, side), index, side, q, normal));
    }
    return nearest <= allowed;
}
