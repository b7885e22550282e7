// Exclusive prefix sums, last of three passes: scans each block from its offset. `sums[count]` is the total.
#import "shared/workgroup_scan.wgsl"

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
@group(0) @binding(2) var<storage, read> block_sums: array<u32>;
@group(0) @binding(3) var<storage, read_write> sums: array<u32>;

@compute @workgroup_size(256)
fn prefix_sum_apply(@builtin(workgroup_id) workgroup: vec3u, @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let block = workgroup.y * workgroups.x + workgroup.x;
    let first = min(block * BLOCK + local * PER_THREAD, params.count);
    let end = min(first + PER_THREAD, params.count);
    var sum = 0u;
    for (var i = first; i < end; i += 1u) {
        sum += counts[i];
    }
    let before = exclusive_scan(local, sum);
    if block >= params.blocks {
        return;
    }
    var offset = block_sums[block] + before;
    for (var i = first; i < end; i += 1u) {
        sums[i] = offset;
        offset += counts[i];
    }
    if end == params.count && first < end {
        sums[params.count] = offset;
    }
}
