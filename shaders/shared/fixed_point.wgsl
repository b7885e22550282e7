// Fixed point of 64 bits for sums of light that threads add to at once, the same in every order: pairs of words (low, high) in two's complement.
// The unit is 2⁻³⁴, where 1 is the mean of what is summed: each addend is rounded by half a unit at the most, 3e-11 of the mean, and sums reach 2²⁹
// means. The high word is touched by carries and by addends of a quarter of the mean and more.

// High words of the largest addend, and of the first number that is none.
const LARGEST_ADDEND: u32 = 0x40000000u;
const BEYOND: u32 = 0x80000000u;
// What a high word counts: 2³² units.
const HIGH_UNIT: f32 = 0.25;
const LOW_UNIT: f32 = 5.820766091346741e-11;
const TWO_32: f32 = 4294967296.0;

fn negated(fixed: vec2u) -> vec2u {
    return vec2u(~fixed.x + 1u, ~fixed.y + select(0u, 1u, fixed.x == 0u));
}

fn to_fixed(value: f32) -> vec2u {
    // Everything but the last rounding is exact: powers of two, and a difference that needs no more bits than the value had.
    let highs = min(abs(value) / HIGH_UNIT, f32(LARGEST_ADDEND));
    let high = floor(highs);
    let fixed = vec2u(u32(round((highs - high) * TWO_32)), u32(high));
    return select(fixed, negated(fixed), value < 0.0);
}

fn from_fixed(fixed: vec2u) -> f32 {
    let negative = fixed.y >= BEYOND;
    let size = select(fixed, negated(fixed), negative);
    let value = f32(size.y) * HIGH_UNIT + f32(size.x) * LOW_UNIT;
    return select(value, -value, negative);
}
