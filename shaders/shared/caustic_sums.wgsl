// Sums of light per texel that threads add to at once, in fixed point of 64 bits: a low and a high word a component. Needs `sums` bound:
// array<atomic<u32>>.
//
// As in shared/splat_sums.wgsl the order does not matter to the last bit, and the unit is 2⁻³⁴ of a mean photon's flux: additions are
// rounded by 3e-11 of it, sums reach 2²⁹ photons, and one that passes that is flagged in that instant.

// High words of the largest addend, and of the first sum that is too large.
const LARGEST_ADDEND: u32 = 0x40000000u;
const BEYOND: u32 = 0x80000000u;
// What a high word counts, 2³² units.
const HIGH_UNIT: f32 = 0.25;
const LOW_UNIT: f32 = 5.820766091346741e-11;
const TWO_32: f32 = 4294967296.0;

// Adds `value` ≥ 0, in means, at `word` and the next; sets bits of the word `flags` if the sum is too large.
fn add_sum(word: u32, flags: u32, value: f32) {
    let highs = min(value / HIGH_UNIT, f32(LARGEST_ADDEND));
    let whole = floor(highs);
    let low = u32(round((highs - whole) * TWO_32));
    var high = u32(whole);
    if low != 0u {
        let before = atomicAdd(&sums[word], low);
        high += select(0u, 1u, before + low < before);
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
