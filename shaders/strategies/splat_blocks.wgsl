// Adds the splats that are not small, a workgroup to each block of them.
#import "shared/splat_block_search.wgsl"
#import "shared/splat_compute_sphere.wgsl"

const THREADS: u32 = 64u;

var<workgroup> found: u32;

@compute @workgroup_size(64)
fn splat_blocks(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = workgroup.y * workgroups.x + workgroup.x;
    if thread == 0u {
        found = block_splat(block);
    }
    let index = workgroupUniformLoad(&found);
    // Rows of workgroups may be longer than the blocks that are left.
    if block < splat_offsets[index + 1u] {
        walk_block(index, block - splat_offsets[index], thread, THREADS);
    }
}
