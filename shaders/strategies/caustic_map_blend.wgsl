// How much of each of four splats a texel takes, from their sums and counts. A thread per texel.
//
// From the broadest inwards: a smaller splat takes over as the photons within its reach grow from few to enough, and only where it is brighter
// [WD08, section 4.1]. Elsewhere it would darken rims, for less of a caustic lies within it. The weight, t² (3 − 2t), is the sum of the last two
// of Bernstein's four cubics.
//
// [WD08]: Wyman and Dachsbacher, "Reducing noise in image-space caustics with variable-sized splatting", 2008.
#import "shared/caustic_sums.wgsl"

struct BlendParams {
    side: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: BlendParams;
@group(0) @binding(1) var<storage, read_write> sums: array<atomic<u32>>;
// Of the splats, the smallest first; they add up to 1.
@group(0) @binding(2) var blend: texture_storage_2d_array<rgba16float, write>;

// Photons within reach from which on a splat begins to count, and from which on it counts alone.
const FEW: f32 = 8.0;
const ENOUGH: f32 = 16.0;

@compute @workgroup_size(8, 8)
fn caustic_map_blend(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= vec2u(params.side)) {
        return;
    }
    let at = ((id.z * params.side + id.y) * params.side + id.x) * FOUR_WORDS;
    var weights = vec4f(0.0, 0.0, 0.0, 1.0);
    var light = one_sum(at + 6u);
    for (var i = 3u; i > 0u; i -= 1u) {
        let finer = one_sum(at + 2u * (i - 1u));
        let t = saturate((f32(atomicLoad(&sums[at + 8u + i])) - FEW) / (ENOUGH - FEW));
        let weight = select(0.0, t * t * (3.0 - 2.0 * t), finer > light);
        light = mix(light, finer, weight);
        weights *= 1.0 - weight;
        weights[i - 1u] = weight;
    }
    textureStore(blend, id.xy, id.z, weights);
}
