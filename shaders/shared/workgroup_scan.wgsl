// Exclusive prefix sums between the 256 threads of a workgroup [HillisSteele86].

const SCAN_WIDTH: u32 = 256u;

var<workgroup> scan_sums: array<u32, SCAN_WIDTH>;

// Sum of `value` over the threads before this one. The whole workgroup calls it.
fn exclusive_scan(thread: u32, value: u32) -> u32 {
    scan_sums[thread] = value;
    workgroupBarrier();
    for (var step = 1u; step < SCAN_WIDTH; step *= 2u) {
        var left = 0u;
        if thread >= step {
            left = scan_sums[thread - step];
        }
        workgroupBarrier();
        scan_sums[thread] += left;
        workgroupBarrier();
    }
    return scan_sums[thread] - value;
}
