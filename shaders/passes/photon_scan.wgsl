// After a bounce: where the records and the live paths of each block go, and how many there are. One workgroup.
#import "shared/photon_path.wgsl"
#import "shared/workgroup_scan.wgsl"

struct PhotonScanParams {
    grid: PhotonGrid,
    capacity: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: PhotonScanParams;
@group(0) @binding(1) var<storage, read> live: LivePaths;
@group(0) @binding(2) var<storage, read_write> tally: PhotonTally;
@group(0) @binding(3) var<storage, read_write> next_live: LivePaths;
@group(0) @binding(4) var<storage, read_write> state: PhotonState;

const BLOCKS_PER_THREAD: u32 = MAX_PATH_BLOCKS / SCAN_WIDTH;

@compute @workgroup_size(256)
fn photon_scan(@builtin(local_invocation_index) local: u32) {
    let first = local * BLOCKS_PER_THREAD;
    var stored = 0u;
    var alive = 0u;
    for (var i = 0u; i < BLOCKS_PER_THREAD; i += 1u) {
        if first + i < live.groups {
            stored += tally.stored[first + i];
            alive += tally.alive[first + i];
        }
    }
    var stored_before = exclusive_scan(local, stored);
    workgroupBarrier();
    var alive_before = exclusive_scan(local, alive);
    if local == SCAN_WIDTH - 1u {
        let count = alive_before + alive;
        tally.alive_total = count;
        next_live = LivePaths((count + PATH_BLOCK - 1u) / PATH_BLOCK, 1u, 1u, count);
        tally.first_record = state.total;
        let total = state.total + stored_before + stored;
        state.total = total;
        state.stored = min(total, params.capacity);
        state.dropped = total - state.stored;
        state.culled = atomicLoad(&tally.culled);
        state.grid = params.grid;
    }
    for (var i = 0u; i < BLOCKS_PER_THREAD; i += 1u) {
        if first + i < live.groups {
            let stored_here = tally.stored[first + i];
            let alive_here = tally.alive[first + i];
            tally.stored[first + i] = stored_before;
            tally.alive[first + i] = alive_before;
            stored_before += stored_here;
            alive_before += alive_here;
        }
    }
    if local < 24u {
        state.ledger[local] = atomicLoad(&tally.ledger[local]);
    }
}
