// The joint bilateral denoiser of [Kim19, section 30.3.2]: a bell (1 − d²/w²)² over the image that keeps to surfaces, and for near ones, of which a
// pixel shows too little to meet many photons, over a map of a quarter of the resolution each way.
//
// [Kim19]: Kim, "Caustics using screen-space photon mapping", Ray Tracing Gems chapter 30, 2019.
#import "shared/math.wgsl"

struct BilateralParams {
    // World (m).
    eye: vec3f,
    // Pixels, or texels of the near map, that a kernel reaches each way.
    width: i32,
    size: vec2u,
    // Pixels nearer than this (m) give their light to the near map.
    near_m: f32,
    // Height of a pixel at a distance of 1 m (m).
    pixel_angle: f32,
    // Distance from the tangent plane at which the weight has fallen to 1/e, to the kernel's width.
    sigma_z: f32,
    // Power of the normals' cosine.
    sigma_n: f32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: BilateralParams;
// See screen_space_resolve.wgsl.
@group(0) @binding(1) var points: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;

// Pixels along a texel of the near map.
const NEAR_TEXEL: i32 = 4;

struct Guide {
    position: vec3f,
    // m², 0: no light is gathered here.
    area: f32,
    normal: vec3f,
}

fn guide_at(pixel: vec2i) -> Guide {
    let place = textureLoad(points, pixel, 0);
    return Guide(place.xyz, place.w, octahedral_decode(textureLoad(surface, pixel, 0).y));
}

// Width of a kernel (m) about `position` whose steps are `texel` pixels.
fn kernel_width(position: vec3f, texel: i32) -> f32 {
    return f32(params.width * texel) * params.pixel_angle * distance(position, params.eye);
}

// How much `to` is of the surface of `source`, whose kernel is `width_m` wide.
fn surface_weight(source: Guide, to: Guide, width_m: f32) -> f32 {
    let off_plane = abs(dot(source.normal, to.position - source.position));
    return exp(-off_plane / (params.sigma_z * width_m)) * pow(max(0.0, dot(source.normal, to.normal)), params.sigma_n);
}

// The bell, 0 from just beyond the width on; `apart` in pixels or texels.
fn image_weight(apart: vec2f) -> f32 {
    let edge = f32(params.width) + 0.5;
    let inside = max(0.0, 1.0 - dot(apart, apart) / (edge * edge));
    return inside * inside;
}

// The pixel that stands for a texel of the near map.
fn near_pixel(texel: vec2i) -> vec2i {
    return min(texel * NEAR_TEXEL + NEAR_TEXEL / 2, vec2i(params.size) - 1);
}

// Whether a pixel gives its light to the near map: it is near, and of the same surface as the pixel that stands for its texel.
fn is_near(pixel: vec2i, guide: Guide) -> bool {
    let center = guide_at(near_pixel(pixel / NEAR_TEXEL));
    let near = max(distance(guide.position, params.eye), distance(center.position, params.eye)) < params.near_m;
    return near && center.area > 0.0 && surface_weight(center, guide, kernel_width(center.position, NEAR_TEXEL)) > 0.5;
}
