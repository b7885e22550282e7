// Counts what the lists hold: entries asked for, entries dropped for want of room, lists in use, and the longest list. The
// gathering pass counts the pixels whose sum a driver cut short into the last word.

struct ListStats {
    entries: u32,
    dropped: u32,
    used: atomic<u32>,
    longest: atomic<u32>,
    // Counted by the gathering pass.
    cut: u32,
}

struct Params {
    lists: u32,
    entry_capacity: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> offsets: array<u32>;
@group(0) @binding(2) var<storage, read_write> stats: ListStats;

@compute @workgroup_size(64)
fn list_stats(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    var used = 0u;
    var longest = 0u;
    for (var list = id.x; list < params.lists; list += workgroups.x * 64u) {
        let length = offsets[list + 1u] - offsets[list];
        used += select(0u, 1u, length > 0u);
        longest = max(longest, length);
    }
    atomicAdd(&stats.used, used);
    atomicMax(&stats.longest, longest);
    if id.x == 0u {
        let entries = offsets[params.lists];
        stats.entries = entries;
        stats.dropped = max(entries, params.entry_capacity) - params.entry_capacity;
    }
}
