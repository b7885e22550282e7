// A block of photons in workgroup memory, summed by each of the workgroup's pixels: the inner loop of [MML13] listing 6.
//
// [MML13]: "Toward practical real-time photon mapping", Mara, McGuire and Luebke, I3D 2013.
//
// 256 photons of 32 bytes and their radii take 9 KiB, within WebGPU's 16 KiB. One thread loads one photon.
#import "shared/radiance_sum.wgsl"

const PHOTON_BLOCK: u32 = 256u;

var<workgroup> photon_block: array<Photon, PHOTON_BLOCK>;
var<workgroup> radius_block: array<f32, PHOTON_BLOCK>;

// Call in uniform control flow with a barrier after it.
fn load_block_photon(thread: u32, photon: Photon, r_min: f32, r_max: f32) {
    photon_block[thread] = photon;
    radius_block[thread] = photon_radius(photon, r_min, r_max);
}

// Adds the first `count` photons of the block to `sum`, in their order.
fn gather_block(sum: ptr<function, RadianceSum>, point: VisiblePoint, count: u32) {
    for (var i = 0u; i < count; i++) {
        let offset = photon_block[i].position - point.position;
        let radius = radius_block[i];
        if dot(offset, offset) < radius * radius {
            add_photon(sum, point, photon_block[i], radius);
        }
    }
}
