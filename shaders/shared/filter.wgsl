// What the filters know of a pixel, and how much two pixels are of one surface [SA19, §24.4].
//
// [SA19]: Smal and Aizenshtein, "Real-time global illumination with photon mapping", Ray Tracing Gems chapter 24, 2019.
#import "shared/math.wgsl"

// A channel of light about which a pixel says nothing, because its surface reflects none of it: whatever is below.
const FILTER_UNKNOWN: f32 = -1.0e30;

struct FilterPoint {
    // Depth along the view (m); 0: nothing is filtered here.
    z: f32,
    // Change of z from pixel to pixel, right and down, along the surface; in footprints.
    slope: vec2f,
    // Unit.
    normal: vec3f,
}

// `normal_word`: 2 for the geometric normal, 3 for the shading normal.
fn filter_point(words: vec4u, normal_word: u32) -> FilterPoint {
    let normal = octahedral_decode(select(words.z, words.w, normal_word == 3u));
    return FilterPoint(bitcast<f32>(words.x), unpack2x16float(words.y), normal);
}

// w_z = exp(−|z_P − z_Q| / (σ_z |∇z·(P − Q)| + ε)) [SA19, Eq. 10]. ∇z = slope · footprint; ε is a footprint, the height of a pixel at the
// point's distance (m): what is nearer than that is no edge.
fn depth_weight(apart: f32, slope: vec2f, pixels: vec2f, footprint: f32, sigma_z: f32) -> f32 {
    return exp(-abs(apart) / (footprint * (sigma_z * abs(dot(slope, pixels)) + 1.0)));
}

// w_n = max(0, n_P·n_Q)^σ_n [SA19, Eq. 11].
fn normal_weight(p: vec3f, q: vec3f, sigma_n: f32) -> f32 {
    return pow(saturate(dot(p, q)), sigma_n);
}

fn known(value: vec3f) -> vec3<bool> {
    return value > vec3f(FILTER_UNKNOWN);
}
