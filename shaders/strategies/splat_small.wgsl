// Adds small splats, a thread each, and counts the blocks of the others.
#import "shared/dispatch.wgsl"
#import "shared/splat_compute_sphere.wgsl"

// A word per record of the store.
@group(0) @binding(6) var<storage, read_write> splat_counts: array<u32>;

@compute @workgroup_size(64)
fn splat_small(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let index = linear_index(id, workgroups, 64u);
    if index >= arrayLength(&photons) {
        return;
    }
    var blocks = 0u;
    if index < photon_state.stored {
        blocks = walk_small_splat(index);
    }
    splat_counts[index] = blocks;
}
