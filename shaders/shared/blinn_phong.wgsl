// The glossy lobe of [MML13, Eq. 8], (8 + s)/(8π) (h·n)ˢ, in place of GGX's D and G: h halves the angle between ω_i and ω_o.
//
// The exponent is that of the Blinn-Phong lobe which fits GGX's best, s = 2/α² − 2, α = roughness²: from 0 for the roughest surface, which it
// spreads evenly, to 2·10⁶ for MIN_ALPHA.
//
// [MML13]: "Toward Practical Real-Time Photon Mapping: Efficient GPU Density Estimation", I3D 2013.
#import "shared/math.wgsl"

fn blinn_phong_exponent(alpha: f32) -> f32 {
    return max(0.0, 2.0 / (alpha * alpha) - 2.0);
}

// ln(1 − x), 0 ≤ x ≤ 1. `log` may be off by 2⁻²¹ near 1, which exponents of 10⁶ would show.
fn log_one_minus(x: f32) -> f32 {
    // −2 artanh z, to the seventh power: z < 0.15.
    let z = x / (2.0 - x);
    let z2 = z * z;
    let series = -2.0 * z * (1.0 + z2 * (1.0 / 3.0 + z2 * (0.2 + z2 / 7.0)));
    return select(log(max(1.0 - x, 1.0e-38)), series, x < 0.25);
}

// 1 − e^(−x), x ≥ 0, without cancellation near 0.
fn one_minus_exp(x: f32) -> f32 {
    let series = x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0)))));
    return select(1.0 - exp(-x), series, x < 0.25);
}

// (h·n)ˢ for a half vector above the surface. The sine comes from the cross product: 1 − cos² in floats would be 10⁻⁷ off.
fn blinn_phong_lobe(exponent: f32, n: vec3f, h: vec3f) -> f32 {
    let across = cross(n, h);
    return exp(0.5 * exponent * log_one_minus(saturate(dot(across, across))));
}

// (8 + s)/(8π), which makes the lobe reflect about all of the light that meets it head-on, whatever s.
fn blinn_phong_scale(exponent: f32) -> f32 {
    return (8.0 + exponent) / (8.0 * PI);
}

// Half vector (local frame, z up) with the density (s + 1)/(2π) (h·n)ˢ.
fn sample_blinn_phong(exponent: f32, u: vec2f) -> vec3f {
    // cos θ = (1 − u)^(1/(s + 1)).
    let sin2 = one_minus_exp(-2.0 * log_one_minus(u.x) / (exponent + 1.0));
    let phi = 2.0 * PI * u.y;
    let sin_theta = sqrt(sin2);
    return vec3f(sin_theta * cos(phi), sin_theta * sin(phi), sqrt(max(0.0, 1.0 - sin2)));
}

// Density (sr⁻¹) of directions that such half vectors reflect ω_o to; the Jacobian of reflection is 4 (ω_o·h).
fn blinn_phong_density(exponent: f32, n: vec3f, h: vec3f, wo: vec3f) -> f32 {
    return (exponent + 1.0) / (8.0 * PI) * blinn_phong_lobe(exponent, n, h) / max(dot(wo, h), 1.0e-6);
}
