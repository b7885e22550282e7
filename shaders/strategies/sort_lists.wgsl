// Sorts every list of photon indices into ascending order, so that sums over a list always run in one order.
//
// A bitonic network of the mirrored form, all of whose comparisons put the smaller index first [Batcher68]; entries
// past the end of a list count as larger than all others and never move, so lists of any length are sorted in place. A
// workgroup takes runs of neighbouring lists in turn, passes over those with nothing to sort (nearly all slots of a hash
// table are empty), and sorts the others one list at a time, in global memory.

struct Params {
    lists: u32,
    entry_capacity: u32,
    // Neighbouring lists a workgroup looks at together, at most THREADS.
    run: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> offsets: array<u32>;
@group(0) @binding(2) var<storage, read_write> entries: array<u32>;

const THREADS: u32 = 64u;

var<workgroup> longest: atomic<u32>;
var<workgroup> run_longest: u32;

fn list_begin(list: u32) -> u32 {
    return min(offsets[list], params.entry_capacity);
}

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

// Length of the longest of the lists from `first` to before `end`; the same for the whole workgroup.
fn longest_list(first: u32, end: u32, thread: u32) -> u32 {
    if thread == 0u {
        atomicStore(&longest, 0u);
    }
    workgroupBarrier();
    if first + thread < end {
        atomicMax(&longest, list_begin(first + thread + 1u) - list_begin(first + thread));
    }
    workgroupBarrier();
    if thread == 0u {
        run_longest = atomicLoad(&longest);
    }
    return workgroupUniformLoad(&run_longest);
}

fn sort_list(begin: u32, end: u32, thread: u32) {
    let length = end - begin;
    // Sorted stretches double in length: 1, 2, 4, …
    for (var stretch = 1u; stretch < length; stretch *= 2u) {
        // Merge two neighbouring stretches: first compare mirrored places, …
        let pairs = (length + 2u * stretch - 1u) / (2u * stretch) * stretch;
        for (var pair = thread; pair < pairs; pair += THREADS) {
            let base = begin + pair / stretch * 2u * stretch;
            let place = pair % stretch;
            compare_exchange(base + place, base + 2u * stretch - 1u - place, end);
        }
        storageBarrier();
        // … then places at half of each distance.
        for (var half = stretch / 2u; half > 0u; half /= 2u) {
            for (var pair = thread; pair < pairs; pair += THREADS) {
                let low = begin + pair / half * 2u * half + pair % half;
                compare_exchange(low, low + half, end);
            }
            storageBarrier();
        }
    }
}

@compute @workgroup_size(64)
fn sort_lists(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    for (var first = workgroup.x * params.run; first < params.lists; first += workgroups.x * params.run) {
        let end = min(first + params.run, params.lists);
        if longest_list(first, end, thread) < 2u {
            continue;
        }
        for (var list = first; list < end; list++) {
            sort_list(list_begin(list), list_begin(list + 1u), thread);
        }
    }
}
