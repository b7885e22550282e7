// A block of photons in workgroup memory, summed by each of the workgroup's pixels: the inner loop of [MML13] listing 6.
//
// [MML13]: "Toward practical real-time photon mapping", Mara, McGuire and Luebke, I3D 2013.
//
// 256 photons of 32 bytes and their spheres take 12 KiB, within WebGPU's 16 KiB.
#import "shared/gather_run.wgsl"

const PHOTON_BLOCK: u32 = 256u;

var<workgroup> photon_block: array<Photon, PHOTON_BLOCK>;
// Position (m) and radius (m) together: all that most pairs of pixel and photon need.
var<workgroup> sphere_block: array<vec4f, PHOTON_BLOCK>;

// Puts a photon into the block; a barrier must follow before the block is gathered.
fn load_block_photon(place: u32, photon: Photon, r_min: f32, r_max: f32) {
    photon_block[place] = photon;
    sphere_block[place] = vec4f(photon.position, photon_radius(photon, r_min, r_max));
}

// Whether the sphere of the block's photon `i` holds `position`.
fn in_reach(i: u32, position: vec3f) -> bool {
    let sphere = sphere_block[i];
    let offset = sphere.xyz - position;
    return dot(offset, offset) < sphere.w * sphere.w;
}

fn add_candidate(sum: ptr<function, RadianceSum>, point: VisiblePoint, i: u32) {
    add_photon(sum, point, photon_block[i], sphere_block[i].w);
}
