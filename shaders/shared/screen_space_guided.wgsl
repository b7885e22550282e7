// The denoiser of [Kim19, section 30.3.2]: a reflection's, to which the map is a picture seen in a surface of one roughness. Light is spread as
// far as such a surface blurs what is as far away as the photon's last hit, whatever its own normal.
//
// [Kim19]: Kim, "Caustics using screen-space photon mapping", Ray Tracing Gems chapter 30, 2019.

struct GuidedParams {
    // World (m).
    eye: vec3f,
    // Width of a kernel to the distance it stands for: twice the tangent of the angle to which the lobe's half vectors keep.
    spread: f32,
    size: vec2u,
    // Pixels that a kernel reaches each way.
    reach: i32,
    // Height of a pixel at a distance of 1 m (m).
    pixel_angle: f32,
}

@group(0) @binding(0) var<uniform> params: GuidedParams;
// See screen_space_resolve.wgsl.
@group(0) @binding(1) var points: texture_2d<f32>;

// Squared radius (m²) of the kernel of light from that distance (m) at `position`.
fn guided_radius2(position: vec3f, distance_m: f32) -> f32 {
    let reach = f32(params.reach) * params.pixel_angle * distance(position, params.eye);
    let radius = min(params.spread * distance_m, reach);
    return max(radius * radius, 1.0e-30);
}

// The kernel 1 − d²/r² between two points in space: what lies before or behind gets no light.
fn guided_weight(a: vec3f, b: vec3f, radius2: f32) -> f32 {
    let apart = a - b;
    return max(0.0, 1.0 - dot(apart, apart) / radius2);
}
