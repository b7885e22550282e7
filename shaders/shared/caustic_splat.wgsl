// The splat of a photon on the maps of its light: the texels that it reaches, and its kernel there.
//
// A texel takes part if its receiver faces as the photon's does and lies within half a splat's width of its tangent plane: splats bend with
// their surface, turn no corners, and do not jump to what lies before or behind. Near an edge between a light's views they lie on both.
//
// Eight lanes share a photon. Needs bound: `params` of SplatParams, `photons`, `photon_state`, `receivers`, `places`, `place_count`.
#import "shared/caustic_places.wgsl"
#import "shared/caustic_receivers.wgsl"
#import "shared/dispatch.wgsl"
#import "shared/photon_store.wgsl"

struct SplatParams {
    side: u32,
    slack: f32,
    // 1 / flux of a mean photon (W⁻¹): the sums' unit.
    scale: f32,
    pad0: u32,
}

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

// The four kernels of a splat in a texel.
fn texel_kernels(view: CausticView, index: u32, splat: Splat, window: SplatWindow, texel: vec2u, diameters: vec4f) -> vec4f {
    return splat_kernels(splat_distance2(view, index, f32(params.side), splat, window, texel), diameters);
}

// The splat of a placed photon, and the views that it lies on.
struct PlacedSplat {
    splat: Splat,
    // In the sums' unit.
    flux: vec3f,
    first_view: u32,
    end_view: u32,
}

fn placed_splat(slot: u32) -> PlacedSplat {
    let place = places[min(slot, arrayLength(&places) - 1u)];
    let photon = photon_load(photons[place.photon], photon_state.grid);
    let splat = Splat(photon.position, octahedral_decode(photon.normal), place.diameter, params.slack);
    let first_view = place.views & 0xffffu;
    let end_view = select(first_view, first_view + (place.views >> 16u), slot < place_count);
    return PlacedSplat(splat, flux_decode(photon.flux) * params.scale, first_view, end_view);
}

// Index of a texel in the sums.
fn texel_index(view: u32, texel: vec2u) -> u32 {
    return (view * params.side + texel.y) * params.side + texel.x;
}

// Threads that share a photon, side by side along x.
const SPLAT_LANES: u32 = 8u;
var<workgroup> lane_sums: array<vec4f, 64>;

fn splat_slot(group: vec3u, workgroups: vec3u, local: u32) -> u32 {
    return linear_index(group, workgroups, 1u) * (64u / SPLAT_LANES) + local / SPLAT_LANES;
}

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

// Σ of the four kernels over the texels that take part, above 0; called by all of a workgroup of 64.
fn kernel_totals(local: u32, placed: PlacedSplat, diameters: vec4f) -> vec4f {
    let side = f32(params.side);
    var total = vec4f(0.0);
    for (var index = placed.first_view; index < placed.end_view; index += 1u) {
        let view = caustic_view(index);
        let window = splat_window(view, side, placed.splat);
        for (var y = window.lower.y; y < window.upper.y; y += 1u) {
            for (var x = window.lower.x + local % SPLAT_LANES; x < window.upper.x; x += SPLAT_LANES) {
                total += texel_kernels(view, index, placed.splat, window, vec2u(x, y), diameters);
            }
        }
    }
    return max(sum_over_lanes(local, total), vec4f(1.0e-30));
}
