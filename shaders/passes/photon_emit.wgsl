// A batch of photons leaves the lights, one thread each.
#import "shared/dispatch.wgsl"
#import "shared/photon_start.wgsl"

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
    if !begin_batch(thread, params.count) {
        return;
    }
    let index = params.first + thread;
    let photon = emit_photon(index, params.emitted, params.seed, params.lights);
    begin_path(thread, index, photon, 0.0, 0u, params.lights);
}
