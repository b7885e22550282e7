// Photons begin their way. Needs `rays`, `paths` and `live` of shared/photon_path.wgsl bound for writing.
#import "shared/emission.wgsl"
#import "shared/photon_path.wgsl"

// States how many paths there are; whether `thread` has one. The last block is filled up with no rays.
fn begin_batch(thread: u32, count: u32) -> bool {
    if thread == 0u {
        live = LivePaths((count + PATH_BLOCK - 1u) / PATH_BLOCK, 1u, 1u, count);
    }
    if thread >= count {
        rays[thread].t_max = -1.0;
    }
    return thread < count;
}

// Photon `index` of the frame leaves its light. What its source knows of the way: the part `expected` of its flux that the first
// scattering will keep, and the triangle `seen` there (see `Ray`); 0: nothing.
fn begin_path(thread: u32, index: u32, photon: Emitted, expected: f32, seen: u32, info: LightInfo) {
    let beam = differential_start(photon.direction, photon.beam_area / (info.bounds_radius * info.bounds_radius), photon.beam_solid_angle);
    let flags = PHOTON_CAUSTIC | select(0u, PHOTON_DELTA, photon.delta) | (pack2x16float(vec2f(expected, 0.0)) << 16u);
    rays[thread] = Ray(photon.origin, INFINITY, photon.direction, seen);
    paths[thread] = PhotonPath(photon.flux, index, differential_pack(beam), 1.0, flags);
}
