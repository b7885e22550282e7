// Hierarchical warping [Clarberg05]: points of the unit square follow a map of importance, through the pyramid of its sums.
//
// [Clarberg05]: "Wavelet importance sampling: efficiently evaluating products of complex functions", SIGGRAPH 2005, §4.2.

struct Warped {
    // In the unit square.
    point: vec2f,
    // Probability per area of the unit square.
    density: f32,
    // What the map says there.
    importance: f32,
}

// Splits at `p` of the unit interval. Returns the number drawn anew from `u`, the half and its probability.
fn warp_split(u: f32, p: f32) -> vec3f {
    if u < p {
        return vec3f(u / p, 0.0, p);
    }
    return vec3f((u - p) / (1.0 - p), 1.0, 1.0 - p);
}

// The part of `a` in a + b; halves that are both without importance are equal.
fn warp_part(a: f32, b: f32) -> f32 {
    let sum = a + b;
    return select(a / max(sum, 1.0e-37), 0.5, sum <= 0.0);
}

// Carries `u` along `layer` of `pyramid`, whose last level is one texel. The density is the product of the very probabilities
// that were drawn from, so rounding in the sums does not bias. A map of zeros is a uniform one.
fn hierarchical_warp(pyramid: texture_2d_array<f32>, layer: u32, u: vec2f) -> Warped {
    var texel = vec2u(0u);
    var rest = u;
    var density = 1.0;
    var importance = 0.0;
    let levels = textureNumLevels(pyramid);
    for (var level = i32(levels) - 2; level >= 0; level -= 1) {
        let corner = texel * 2u;
        let a = textureLoad(pyramid, corner, layer, level).x;
        let b = textureLoad(pyramid, corner + vec2u(1u, 0u), layer, level).x;
        let c = textureLoad(pyramid, corner + vec2u(0u, 1u), layer, level).x;
        let d = textureLoad(pyramid, corner + vec2u(1u, 1u), layer, level).x;
        let y = warp_split(rest.y, warp_part(a + b, c + d));
        let x = warp_split(rest.x, select(warp_part(a, b), warp_part(c, d), y.y > 0.0));
        rest = vec2f(x.x, y.x);
        texel = corner + vec2u(u32(x.y), u32(y.y));
        density *= 4.0 * x.z * y.z;
        importance = select(select(a, b, x.y > 0.0), select(c, d, x.y > 0.0), y.y > 0.0);
    }
    // Divisions may round up to 1.
    let inside = min(rest, vec2f(0.99999994));
    return Warped((vec2f(texel) + inside) / f32(1u << (levels - 1u)), density, importance);
}
