// Exclusive prefix sums, second of three passes: one workgroup turns the block sums into block offsets, in place.
#import "shared/workgroup_scan.wgsl"

struct PrefixSumParams {
    count: u32,
    blocks: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: PrefixSumParams;
@group(0) @binding(1) var<storage, read_write> block_sums: array<u32>;

@compute @workgroup_size(256)
fn prefix_sum_scan(@builtin(local_invocation_index) local: u32) {
    // Each thread owns a run of blocks; the runs' sums are scanned between the threads.
    let run = (params.blocks + SCAN_WIDTH - 1u) / SCAN_WIDTH;
    let first = min(local * run, params.blocks);
    let end = min(first + run, params.blocks);
    var sum = 0u;
    for (var i = first; i < end; i += 1u) {
        sum += block_sums[i];
    }
    let before = exclusive_scan(local, sum);
    var offset = before;
    for (var i = first; i < end; i += 1u) {
        let value = block_sums[i];
        block_sums[i] = offset;
        offset += value;
    }
}
