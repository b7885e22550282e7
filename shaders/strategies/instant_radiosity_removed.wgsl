// How much light the least distance took: its part of the whole in millionths. One workgroup; each thread sums a share of the pixels, in a
// fixed order.
#import "shared/math.wgsl"

struct RemovedParams {
    size: vec2u,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: RemovedParams;
// What is left (W·m⁻²·sr⁻¹), and the luminance of what was taken.
@group(0) @binding(1) var sum: texture_2d<f32>;
@group(0) @binding(2) var<storage, read_write> stats: array<u32>;

const WIDTH: u32 = 256u;
// The word of `stats`.
const REMOVED: u32 = 3u;

// Left and taken.
var<workgroup> sums: array<vec2f, WIDTH>;

@compute @workgroup_size(256)
fn instant_radiosity_removed(@builtin(local_invocation_index) thread: u32) {
    var own = vec2f(0.0);
    for (var i = thread; i < params.size.x * params.size.y; i += WIDTH) {
        let pixel = textureLoad(sum, vec2u(i % params.size.x, i / params.size.x), 0);
        own += vec2f(luminance(pixel.rgb), pixel.a);
    }
    sums[thread] = own;
    for (var width = WIDTH / 2u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if thread < width {
            sums[thread] += sums[thread + width];
        }
    }
    if thread == 0u {
        let whole = sums[0].x + sums[0].y;
        stats[REMOVED] = u32(round(1.0e6 * select(0.0, sums[0].y / whole, whole > 0.0)));
    }
}
