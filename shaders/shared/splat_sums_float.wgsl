// What `splat_sums.wgsl` is, in floats, which a device with `SHADER_FLOAT32_ATOMIC` adds atomically: a third of the memory and fewer additions,
// rounded in whatever order threads come.

// Words of pixel i: 3 i and the next two.
@group(0) @binding(8) var<storage, read_write> first_sum: array<atomic<f32>>;
@group(0) @binding(9) var<storage, read_write> second_sum: array<atomic<f32>>;

struct LightSums {
    first: vec3f,
    second: vec3f,
    // The first sum passed what it can hold, and is that; the second is given up.
    overflowed: bool,
}

const LARGEST_SUM: f32 = 3.4028234e38;

// Adds light in means; `second` has no component larger than all of `first`.
fn add_light(pixel: u32, first: vec3f, second: vec3f) {
    atomicAdd(&first_sum[3u * pixel], first.r);
    atomicAdd(&first_sum[3u * pixel + 1u], first.g);
    atomicAdd(&first_sum[3u * pixel + 2u], first.b);
    if any(second != vec3f(0.0)) {
        atomicAdd(&second_sum[3u * pixel], second.x);
        atomicAdd(&second_sum[3u * pixel + 1u], second.y);
        atomicAdd(&second_sum[3u * pixel + 2u], second.z);
    }
}

fn light_sums(pixel: u32) -> LightSums {
    let first = vec3f(atomicLoad(&first_sum[3u * pixel]), atomicLoad(&first_sum[3u * pixel + 1u]), atomicLoad(&first_sum[3u * pixel + 2u]));
    let second =
        vec3f(atomicLoad(&second_sum[3u * pixel]), atomicLoad(&second_sum[3u * pixel + 1u]), atomicLoad(&second_sum[3u * pixel + 2u]));
    let overflowed = any(first > vec3f(LARGEST_SUM));
    return LightSums(min(first, vec3f(LARGEST_SUM)), select(second, vec3f(0.0), overflowed), overflowed);
}
