// Packs the records of one batch behind those of the batches before, in the order of the photons.
#import "shared/dispatch.wgsl"
#import "shared/photon.wgsl"

struct PhotonCompactParams {
    count: u32,
    max_bounces: u32,
    capacity: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: PhotonCompactParams;
@group(0) @binding(1) var<storage, read> staging: array<Photon>;
// Exclusive prefix sums of the batch's counts; the last is their total.
@group(0) @binding(2) var<storage, read> offsets: array<u32>;
@group(0) @binding(3) var<storage, read> state: PhotonState;
@group(0) @binding(4) var<storage, read_write> records: array<Photon>;

@compute @workgroup_size(64)
fn photon_compact(@builtin(global_invocation_id) global_id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let thread = linear_index(global_id, workgroups, 64u);
    if thread >= params.count {
        return;
    }
    let first = state.total + offsets[thread];
    let count = offsets[thread + 1u] - offsets[thread];
    for (var i = 0u; i < count; i += 1u) {
        if first + i < params.capacity {
            records[first + i] = staging[thread * params.max_bounces + i];
        }
    }
}
