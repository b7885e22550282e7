// After a batch: moves the end of the photon store on and counts what did not fit.
#import "shared/photon.wgsl"

struct PhotonAdvanceParams {
    count: u32,
    capacity: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: PhotonAdvanceParams;
@group(0) @binding(1) var<storage, read> offsets: array<u32>;
@group(0) @binding(2) var<storage, read> ledger: array<u32>;
@group(0) @binding(3) var<storage, read_write> state: PhotonState;

@compute @workgroup_size(1)
fn photon_advance() {
    let total = state.total + offsets[params.count];
    state.total = total;
    state.stored = min(total, params.capacity);
    state.dropped = total - state.stored;
    for (var i = 0u; i < 24u; i += 1u) {
        state.ledger[i] = ledger[i];
    }
}
