// Exclusive prefix sums, first of three passes: the sum of each block of 2,048 counts.
const BLOCK: u32 = 2048u;
const PER_THREAD: u32 = 8u;

struct PrefixSumParams {
    count: u32,
    blocks: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: PrefixSumParams;
@group(0) @binding(1) var<storage, read> counts: array<u32>;
@group(0) @binding(2) var<storage, read_write> block_sums: array<u32>;

var<workgroup> total: atomic<u32>;

@compute @workgroup_size(256)
fn prefix_sum_blocks(@builtin(workgroup_id) workgroup: vec3u, @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let block = workgroup.y * workgroups.x + workgroup.x;
    let first = block * BLOCK + local * PER_THREAD;
    var sum = 0u;
    for (var i = first; i < min(first + PER_THREAD, params.count); i += 1u) {
        sum += counts[i];
    }
    atomicAdd(&total, sum);
    workgroupBarrier();
    if local == 0u && block < params.blocks {
        block_sums[block] = atomicLoad(&total);
    }
}
