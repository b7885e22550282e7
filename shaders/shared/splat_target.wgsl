// What the draws that splat photons have in common: parameters, the photons, and where a point falls on the target.
#import "shared/camera.wgsl"
#import "shared/photon_store.wgsl"
#import "shared/splat_kernel.wgsl"

struct SplatParams {
    camera: Camera,
    kernel: SplatKernel,
    // Radii of spheres (m).
    r_min: f32,
    r_max: f32,
    // The targets hold light times this.
    scale: f32,
    // Edge of a target's texel (pixels of the image): 1 or 2.
    texel: u32,
    // Image that the target's texels cover (pixels): up to one more than the image's size.
    film_size: vec2f,
    // Corners of a polygon around a splat.
    corners: u32,
    // Photons that lack some of these flags are left out.
    flags: u32,
}

@group(0) @binding(0) var<uniform> params: SplatParams;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;

// Where nothing is drawn: corners of triangles that all lie there cover no texel.
const NOWHERE: vec4f = vec4f(2.0, 2.0, 0.0, 1.0);
// Splats are drawn wider than they are, by this much of a texel, to outweigh that corners are snapped to 1/256 of one.
const SNAP_SLACK: f32 = 1.0 / 64.0;

fn splat_photon(index: u32) -> Photon {
    return photon_load(photons[index], photon_state.grid);
}

fn left_out(photon: Photon) -> bool {
    return (params.flags & ~photon.bounce_flags) != 0u;
}

fn splat_view(position_world: vec3f) -> vec3f {
    return (params.camera.view_from_world * vec4f(position_world, 1.0)).xyz;
}

// Pixels by which a splat is drawn wider. A texel of several pixels is tested at one of them, up to half its diagonal from the centre.
fn splat_slack() -> f32 {
    return SNAP_SLACK * f32(params.texel) + f32(params.texel - 1u) * 0.75;
}

// Moves the image's sample points, at `jitter` in their pixels, to the pixels' centres, where rasterisation samples.
fn splat_shift() -> vec2f {
    return vec2f(0.5) - params.camera.jitter;
}

// Point of the image (pixels) to the target's clip space.
fn film_to_clip(film: vec2f) -> vec4f {
    return vec4f(film / params.film_size * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0), 0.0, 1.0);
}

// Corner `vertex` (0 to 5) of two triangles over the box (pixels), clockwise on the screen.
fn box_corner(lower: vec2f, upper: vec2f, vertex: u32) -> vec4f {
    // 0 1 3, 0 3 2 of the corners (left, top), (right, top), (left, bottom), (right, bottom).
    let corner = (0x230310u >> (4u * vertex)) & 3u;
    return film_to_clip(select(lower, upper, vec2<bool>((corner & 1u) != 0u, (corner & 2u) != 0u)));
}

// Point in view space to the target's clip space. Depth is 0, so that what is clipped is what lies behind the eye; the near plane of the
// camera clips nothing.
fn view_to_clip(position_view: vec3f) -> vec4f {
    let w = -position_view.z;
    let image = vec2f(params.camera.size);
    let film = (position_view.xy / params.camera.tan_half * vec2f(0.5, -0.5) + 0.5 * w) * image + splat_shift() * w;
    return vec4f(film / params.film_size * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0) * w, 0.0, w);
}

// Whether the sphere misses the view: it is behind the eye, or beyond one of the planes through it and the image's edges.
fn sphere_off_screen(center_view: vec3f, radius: f32) -> bool {
    let depth = -center_view.z;
    // Light of the pixels at the edge, jittered and coarse, comes from less than two pixels beyond.
    let tangents = params.camera.tan_half * (1.0 + 4.0 / vec2f(params.camera.size));
    let beyond = abs(center_view.xy) - tangents * depth;
    return depth < -radius || any(beyond > radius * sqrt(1.0 + tangents * tangents));
}

// World size (m) of a pixel at that depth (m).
fn pixel_size(depth: f32) -> f32 {
    let sizes = 2.0 * params.camera.tan_half / vec2f(params.camera.size);
    return max(depth, 0.0) * max(sizes.x, sizes.y);
}
