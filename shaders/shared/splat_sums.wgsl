// Two sums of light per pixel, three components each, that threads add to at once: in fixed point of 64 bits. `splat_sums_float.wgsl` stands in
// for this file where floats can be added atomically.
//
// The mean of what is summed is that of `SplatParams::scale`.
//
// The first sum is of addends that are not negative. Where it passes 2⁶³ units it is flagged in that instant: no addend is larger than half of
// that, so that a sum cannot pass by unseen.
#import "shared/fixed_point.wgsl"

// Words of pixel i: red, green and blue at 4 i, and the flags, bit c for component c.
@group(0) @binding(8) var<storage, read_write> first_low: array<atomic<u32>>;
// Words of pixel i: 3 i and the next two.
@group(0) @binding(9) var<storage, read_write> first_high: array<atomic<u32>>;
@group(0) @binding(10) var<storage, read_write> second_low: array<atomic<u32>>;
@group(0) @binding(11) var<storage, read_write> second_high: array<atomic<u32>>;

struct LightSums {
    first: vec3f,
    second: vec3f,
    // Some component of the first sum passed what it can hold, and is that; the second sum is given up.
    overflowed: bool,
}

fn add_first(pixel: u32, component: u32, value: f32) {
    let addend = to_fixed(value);
    var high = addend.y;
    if addend.x != 0u {
        let before = atomicAdd(&first_low[4u * pixel + component], addend.x);
        high += select(0u, 1u, before + addend.x < before);
    }
    if high != 0u {
        let before = atomicAdd(&first_high[3u * pixel + component], high);
        if before + high >= BEYOND || addend.y >= LARGEST_ADDEND {
            atomicOr(&first_low[4u * pixel + 3u], 1u << component);
        }
    }
}

fn add_second(pixel: u32, component: u32, value: f32) {
    let addend = to_fixed(value);
    var high = addend.y;
    if addend.x != 0u {
        let before = atomicAdd(&second_low[3u * pixel + component], addend.x);
        high += select(0u, 1u, before + addend.x < before);
    }
    if high != 0u {
        atomicAdd(&second_high[3u * pixel + component], high);
    }
}

// Adds light in means; `second` has no component larger than all of `first`.
fn add_light(pixel: u32, first: vec3f, second: vec3f) {
    add_first(pixel, 0u, first.r);
    add_first(pixel, 1u, first.g);
    add_first(pixel, 2u, first.b);
    add_second(pixel, 0u, second.x);
    add_second(pixel, 1u, second.y);
    add_second(pixel, 2u, second.z);
}

fn first_component(pixel: u32, component: u32) -> f32 {
    return from_fixed(vec2u(atomicLoad(&first_low[4u * pixel + component]), atomicLoad(&first_high[3u * pixel + component])));
}

fn second_component(pixel: u32, component: u32) -> f32 {
    return from_fixed(vec2u(atomicLoad(&second_low[3u * pixel + component]), atomicLoad(&second_high[3u * pixel + component])));
}

fn light_sums(pixel: u32) -> LightSums {
    let flags = atomicLoad(&first_low[4u * pixel + 3u]);
    let overflowed = vec3<bool>((vec3u(flags) & vec3u(1u, 2u, 4u)) != vec3u(0u));
    let first = vec3f(first_component(pixel, 0u), first_component(pixel, 1u), first_component(pixel, 2u));
    let second = vec3f(second_component(pixel, 0u), second_component(pixel, 1u), second_component(pixel, 2u));
    return LightSums(
        select(first, vec3f(f32(BEYOND) * HIGH_UNIT), overflowed), select(second, vec3f(0.0), flags != 0u), flags != 0u
    );
}
