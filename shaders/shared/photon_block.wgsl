// A block of photons in workgroup memory, summed by each of the workgroup's pixels: the inner loop of [MML13] listing 6.
//
// [MML13]: "Toward practical real-time photon mapping", Mara, McGuire and Luebke, I3D 2013.
//
// 256 photons of 32 bytes and their spheres take 12 KiB, within WebGPU's 16 KiB.
#import "shared/radiance_sum.wgsl"

const PHOTON_BLOCK: u32 = 256u;

var<workgroup> photon_block: array<Photon, PHOTON_BLOCK>;
// Position (m) and radius (m) together: all that most pairs of pixel and photon need.
var<workgroup> sphere_block: array<vec4f, PHOTON_BLOCK>;

// Puts a photon into the block; a barrier must follow before the block is gathered.
fn load_block_photon(place: u32, photon: Photon, r_min: f32, r_max: f32) {
    photon_block[place] = photon;
    sphere_block[place] = vec4f(photon.position, photon_radius(photon, r_min, r_max));
}

// Bit `i` where the sphere of the block's photon `first + i` holds `position`.
fn reach_bit(first: u32, i: u32, position: vec3f) -> u32 {
    let sphere = sphere_block[first + i];
    let offset = sphere.xyz - position;
    return select(0u, 1u << i, dot(offset, offset) < sphere.w * sphere.w);
}

// Adds the first `count` photons of the block to `sum`, in their order.
//
// Threads run in lockstep, and most photons of a block are too far from any one pixel: the pixels test 32 photons first
// and then each sums those near it, so that a contribution costs once per photon that counts, not once per candidate.
// Eight tests to a turn of the loop: drivers that count turns allow lists eight times as long.
fn gather_block(sum: ptr<function, RadianceSum>, point: VisiblePoint, count: u32) {
    for (var first = 0u; first < count; first += 32u) {
        var near = 0u;
        for (var i = 0u; i < 32u; i += 8u) {
            near |= reach_bit(first, i, point.position) | reach_bit(first, i + 1u, point.position)
                | reach_bit(first, i + 2u, point.position) | reach_bit(first, i + 3u, point.position)
                | reach_bit(first, i + 4u, point.position) | reach_bit(first, i + 5u, point.position)
                | reach_bit(first, i + 6u, point.position) | reach_bit(first, i + 7u, point.position);
        }
        let batch = min(32u, count - first);
        // What lies in the block past `count` is of an earlier block.
        near &= 0xffffffffu >> (32u - batch);
        (*sum).tested += batch;
        (*sum).pending += countOneBits(near);
        while near != 0u {
            let i = first + firstTrailingBit(near);
            near &= near - 1u;
            add_photon(sum, point, photon_block[i], sphere_block[i].w);
        }
    }
}
