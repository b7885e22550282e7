// The splat of a photon on the maps of its light: the texels that it reaches, and its kernel there.
//
// A texel takes part if its receiver faces as the photon's does and lies within half a splat's width of its tangent plane: splats bend with
// their surface, turn no corners, and do not jump to what lies before or behind. Near an edge between a light's views they lie on both.
#import "shared/caustic_places.wgsl"
#import "shared/caustic_receivers.wgsl"
#import "shared/photon_store.wgsl"

struct Splat {
    // World (m).
    position: vec3f,
    normal: vec3f,
    // Texels.
    diameter: f32,
    // m.
    slack: f32,
}

// The texels of one view that a splat may reach: from `lower` on and below `upper`; where its middle is.
struct SplatWindow {
    film: vec2f,
    lower: vec2u,
    upper: vec2u,
    // Distance (m) from the tangent plane up to which a texel takes part.
    allowed: f32,
}

fn splat_window(view: CausticView, side: f32, splat: Splat) -> SplatWindow {
    let q = splat.position - view.origin;
    let depth = dot(view.forward, q);
    let film = map_film(view, q, side);
    let radius = 0.5 * splat.diameter;
    let reached = depth > 0.0 && all(film > vec2f(-radius)) && all(film < vec2f(side + radius));
    let lower = vec2u(clamp(ceil(film - radius - 0.5), vec2f(0.0), vec2f(side)));
    let upper = vec2u(clamp(floor(film + radius - 0.5) + 1.0, vec2f(0.0), vec2f(side)));
    let allowed = radius * texel_width(view, side, depth) + splat.slack;
    return SplatWindow(film, lower, select(lower, upper, reached), allowed);
}

// Squared distance (texels²) of a texel's centre from the splat's; beyond all kernels where the texel takes no part.
fn splat_distance2(view: CausticView, index: u32, side: f32, splat: Splat, window: SplatWindow, texel: vec2u) -> f32 {
    let apart = vec2f(texel) + 0.5 - window.film;
    let off = receiver_off_plane(view, texel, index, side, splat.position - view.origin, splat.normal);
    return select(INFINITY, dot(apart, apart), off <= window.allowed);
}

// Diameters (texels) of splats of four breadths [WD08].
const FOUR_DIAMETERS: vec4f = vec4f(3.0, 7.0, 11.0, 15.0);

// A bell of e⁻² at its rim, and nothing beyond; four of them at once.
fn splat_kernels(distance2: f32, diameters: vec4f) -> vec4f {
    let s = 4.0 * distance2 / (diameters * diameters);
    return select(vec4f(0.0), exp(-2.0 * s), s < vec4f(1.0));
}

// Threads that share a photon, side by side along x.
const SPLAT_LANES: u32 = 8u;
var<workgroup> lane_sums: array<vec4f, 64>;

// Σ over the threads of a photon; called by all of a workgroup of 64.
fn sum_over_lanes(local: u32, value: vec4f) -> vec4f {
    workgroupBarrier();
    lane_sums[local] = value;
    workgroupBarrier();
    var sum = vec4f(0.0);
    for (var lane = 0u; lane < SPLAT_LANES; lane += 1u) {
        sum += lane_sums[local / SPLAT_LANES * SPLAT_LANES + lane];
    }
    return sum;
}
