// Counter-based random numbers.
//
// pcg4d of [JarzynskiOlano20], "Hash Functions for GPU Rendering", JCGT 9(3): a bijection of four words that passes
// BigCrush in every output. A stream is named by (seed, stream, index); numbers are drawn by counting, so that the same
// names always give the same numbers, in whatever order threads run.

struct Rng {
    key: vec3u,
    counter: u32,
}

fn pcg4d(input: vec4u) -> vec4u {
    var v = input * 1664525u + 1013904223u;
    v += v.yzxy * v.wxyz;
    v ^= v >> vec4u(16u);
    v += v.yzxy * v.wxyz;
    return v;
}

fn rng_new(seed: u32, stream: u32, index: u32) -> Rng {
    return Rng(vec3u(seed, stream, index), 0u);
}

// Uniform in [0, 1), 24 bits.
fn unit_float(bits: u32) -> f32 {
    return f32(bits >> 8u) * 5.9604644775390625e-8;
}

// Four independent uniform numbers in [0, 1).
fn rng_next4(rng: ptr<function, Rng>) -> vec4f {
    let counter = (*rng).counter;
    (*rng).counter = counter + 1u;
    let bits = pcg4d(vec4u((*rng).key, counter));
    return vec4f(unit_float(bits.x), unit_float(bits.y), unit_float(bits.z), unit_float(bits.w));
}

// Point `index` of a four-dimensional Kronecker sequence with the ratios of the generalised golden section
// (φ⁵ = φ + 1), shifted by a random vector of the seed [CranleyPatterson76]. In integers, so that it keeps all its bits.
fn kronecker4(index: u32, seed: u32) -> vec4f {
    let ratios = vec4u(3679390609u, 3152041523u, 2700274806u, 2313257605u);
    let shift = pcg4d(vec4u(seed, 0x4b524f4eu, 0u, 0u));
    let bits = ratios * (index + 1u) + shift;
    return vec4f(unit_float(bits.x), unit_float(bits.y), unit_float(bits.z), unit_float(bits.w));
}
