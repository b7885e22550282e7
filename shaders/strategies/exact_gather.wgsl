// Sums one chunk of the stored photons at every visible point: [MML13] Eq. 1 with Q(X) = all of them.
//
// One workgroup of 16 × 64 pixels, four below one another to a thread, so that a sphere is fetched once for the four; the chunk passes through
// workgroup memory in blocks of 256. Later chunks go on with the sums of earlier ones; a chunk beyond the stored photons returns at once.
#import "shared/gbuffer.wgsl"
#import "shared/photon_block.wgsl"
#import "shared/photon_store.wgsl"

struct Params {
    camera_position_world: vec3f,
    // Range of photon indices of this chunk.
    first: u32,
    end: u32,
    // Kernel radii (m).
    r_min: f32,
    r_max: f32,
    pad0: u32,
    size: vec2u,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(4) var<storage, read> photon_state: PhotonState;
@group(0) @binding(5) var<storage, read_write> indirect_sum: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> caustic_sum: array<vec4f>;

// Pixels below one another to a thread.
const ROWS: u32 = 4u;

struct Pixel {
    // In the sums.
    index: u32,
    point: VisiblePoint,
    gathers: bool,
    sum: RadianceSum,
}

fn pixel_at(place: vec2u) -> Pixel {
    let texel = min(place, params.size - 1u);
    var pixel: Pixel;
    pixel.index = texel.y * params.size.x + texel.x;
    pixel.point = visible_point(textureLoad(position, texel, 0), textureLoad(surface, texel, 0), params.camera_position_world);
    pixel.gathers = all(place < params.size) && pixel.point.gatherable;
    // Goes on with the sum of the chunks before, so that the order of additions is that of the photons.
    pixel.sum.indirect = indirect_sum[pixel.index].rgb;
    pixel.sum.caustic = caustic_sum[pixel.index].rgb;
    return pixel;
}

// Bit `i` where the block's photon `first + i` is in reach of one of the four.
fn reach_of_four(pixels: array<Pixel, ROWS>, first: u32, i: u32, last: u32) -> u32 {
    let sphere = sphere_block[min(first + i, last)];
    let x = vec4f(pixels[0].point.position.x, pixels[1].point.position.x, pixels[2].point.position.x, pixels[3].point.position.x) - sphere.x;
    let y = vec4f(pixels[0].point.position.y, pixels[1].point.position.y, pixels[2].point.position.y, pixels[3].point.position.y) - sphere.y;
    let z = vec4f(pixels[0].point.position.z, pixels[1].point.position.z, pixels[2].point.position.z, pixels[3].point.position.z) - sphere.z;
    return select(0u, 1u << i, any(x * x + y * y + z * z < vec4f(sphere.w * sphere.w)));
}

fn with_photon(pixel: Pixel, i: u32) -> Pixel {
    var added = pixel;
    if pixel.gathers && in_reach(i, pixel.point.position) {
        var sum = pixel.sum;
        add_candidate(&sum, pixel.point, i);
        added.sum = sum;
    }
    return added;
}

fn store_sum(pixel: Pixel) {
    if pixel.gathers {
        indirect_sum[pixel.index] = vec4f(pixel.sum.indirect, 0.0);
        caustic_sum[pixel.index] = vec4f(pixel.sum.caustic, 0.0);
    }
}

@compute @workgroup_size(16, 16)
fn exact_gather(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) thread: u32) {
    let end = min(min(params.end, photon_state.stored), arrayLength(&photons));
    if params.first >= end {
        return;
    }
    let place = vec2u(id.x, id.y * ROWS);
    var pixels = array<Pixel, ROWS>(
        pixel_at(place), pixel_at(place + vec2u(0u, 1u)), pixel_at(place + vec2u(0u, 2u)), pixel_at(place + vec2u(0u, 3u))
    );
    let gathers = pixels[0].gathers || pixels[1].gathers || pixels[2].gathers || pixels[3].gathers;
    for (var block = params.first; block < end; block += PHOTON_BLOCK) {
        let count = min(PHOTON_BLOCK, end - block);
        if thread < count {
            load_block_photon(thread, photon_load(photons[block + thread], photon_state.grid), params.r_min, params.r_max);
        }
        workgroupBarrier();
        if gathers {
            for (var first = 0u; first < count; first += 32u) {
                var near = 0u;
                let batch = min(32u, count - first);
                for (var i = 0u; i < batch; i += 4u) {
                    near |= reach_of_four(pixels, first, i, count - 1u) | reach_of_four(pixels, first, i + 1u, count - 1u)
                        | reach_of_four(pixels, first, i + 2u, count - 1u) | reach_of_four(pixels, first, i + 3u, count - 1u);
                }
                near &= 0xffffffffu >> (32u - batch);
                while near != 0u {
                    let i = first + firstTrailingBit(near);
                    near &= near - 1u;
                    pixels[0] = with_photon(pixels[0], i);
                    pixels[1] = with_photon(pixels[1], i);
                    pixels[2] = with_photon(pixels[2], i);
                    pixels[3] = with_photon(pixels[3], i);
                }
            }
        }
        workgroupBarrier();
    }
    store_sum(pixels[0]);
    store_sum(pixels[1]);
    store_sum(pixels[2]);
    store_sum(pixels[3]);
}
