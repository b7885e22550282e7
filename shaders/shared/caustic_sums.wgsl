// Sums of light per texel that threads add to at once, in fixed point of 64 bits: a low and a high word a component. Needs `sums` bound:
// array<atomic<u32>>.
//
// The mean is a mean photon's flux. A sum that passes what it can hold, 2²⁹ of those, is flagged in that instant.
#import "shared/fixed_point.wgsl"

// Words of a texel. One sum of light: red, green and blue, two each; flags.
const ONE_WORDS: u32 = 7u;
// Four of luminance, two each; flags; photons within reach of each.
const FOUR_WORDS: u32 = 13u;

// Adds `value` ≥ 0, in means, at `word` and the next; sets bits of the word `flags` if the sum is too large.
fn add_sum(word: u32, flags: u32, value: f32) {
    let addend = to_fixed(value);
    var high = addend.y;
    if addend.x != 0u {
        let before = atomicAdd(&sums[word], addend.x);
        high += select(0u, 1u, before + addend.x < before);
    }
    if high != 0u {
        let before = atomicAdd(&sums[word + 1u], high);
        if before + high >= BEYOND || high >= LARGEST_ADDEND {
            atomicOr(&sums[flags], 1u);
        }
    }
}

fn add_sums(word: u32, flags: u32, value: vec3f) {
    add_sum(word, flags, value.r);
    add_sum(word + 2u, flags, value.g);
    add_sum(word + 4u, flags, value.b);
}

fn one_sum(word: u32) -> f32 {
    return f32(atomicLoad(&sums[word + 1u])) * HIGH_UNIT + f32(atomicLoad(&sums[word])) * LOW_UNIT;
}

fn three_sums(word: u32) -> vec3f {
    return vec3f(one_sum(word), one_sum(word + 2u), one_sum(word + 4u));
}
