// Sorts every list of photon indices into ascending order, so that sums over a list always run in one order.
//
// A bitonic network of the mirrored form, all of whose comparisons put the smaller index first [Batcher68]; entries
// past the end of a list count as larger than all others and never move, so lists of any length are sorted in place. One
// workgroup sorts one list at a time, in global memory, and takes every `workgroups`-th list: most lists are short or empty.

struct Params {
    lists: u32,
    entry_capacity: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> offsets: array<u32>;
@group(0) @binding(2) var<storage, read_write> entries: array<u32>;

const THREADS: u32 = 64u;

fn compare_exchange(low: u32, high: u32, end: u32) {
    if high < end {
        let a = entries[low];
        let b = entries[high];
        if a > b {
            entries[low] = b;
            entries[high] = a;
        }
    }
}

@compute @workgroup_size(64)
fn sort_lists(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    for (var list = workgroup.x; list < params.lists; list += workgroups.x) {
        let begin = min(offsets[list], params.entry_capacity);
        let end = min(offsets[list + 1u], params.entry_capacity);
        let length = end - begin;
        // Sorted runs double in length: 1, 2, 4, …
        for (var run = 1u; run < length; run *= 2u) {
            // Merge two neighbouring runs: first compare mirrored places, …
            let pairs = (length + 2u * run - 1u) / (2u * run) * run;
            for (var pair = thread; pair < pairs; pair += THREADS) {
                let base = begin + pair / run * 2u * run;
                let place = pair % run;
                compare_exchange(base + place, base + 2u * run - 1u - place, end);
            }
            storageBarrier();
            // … then places at half of each distance.
            for (var half = run / 2u; half > 0u; half /= 2u) {
                for (var pair = thread; pair < pairs; pair += THREADS) {
                    let low = begin + pair / half * 2u * half + pair % half;
                    compare_exchange(low, low + half, end);
                }
                storageBarrier();
            }
        }
    }
}
