// A batch of photons leaves the lights, one thread each.
#import "shared/dispatch.wgsl"
#import "shared/emission.wgsl"
#import "shared/photon_path.wgsl"

struct PhotonEmitParams {
    lights: LightInfo,
    // Photons in all batches together.
    emitted: u32,
    // Number of the batch's first.
    first: u32,
    // Photons of this batch.
    count: u32,
    seed: u32,
}

@group(0) @binding(0) var<uniform> params: PhotonEmitParams;
@group(0) @binding(1) var<storage, read_write> rays: array<Ray>;
@group(0) @binding(2) var<storage, read_write> paths: array<PhotonPath>;
@group(0) @binding(3) var<storage, read_write> live: LivePaths;

@compute @workgroup_size(64)
fn photon_emit(@builtin(global_invocation_id) global_id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let thread = linear_index(global_id, workgroups, PATH_BLOCK);
    if thread == 0u {
        live = LivePaths((params.count + PATH_BLOCK - 1u) / PATH_BLOCK, 1u, 1u, params.count);
    }
    if thread >= params.count {
        // The last block is filled up with no rays.
        rays[thread].t_max = -1.0;
        return;
    }
    let index = params.first + thread;
    let photon = emit_photon(index, params.emitted, params.seed, params.lights);
    let radius2 = params.lights.bounds_radius * params.lights.bounds_radius;
    let beam = differential_start(photon.direction, photon.beam_area / radius2, photon.beam_solid_angle);
    let flags = PHOTON_CAUSTIC | select(0u, PHOTON_DELTA, photon.delta);
    rays[thread] = Ray(photon.origin, INFINITY, photon.direction, 0u);
    paths[thread] = PhotonPath(photon.flux, index, differential_pack(beam), 1.0, flags);
}
