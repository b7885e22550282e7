// The flux ledger in fixed point. Each change of flux is added in integers, so that emitted = absorbed + escaped + terminated
// holds to the last bit. Needs `tally: PhotonTally` bound for writing, and the whole workgroup at `ledger_publish`.
#import "shared/photon_path.wgsl"

const EMITTED: u32 = 0u;
const ABSORBED: u32 = 1u;
const ESCAPED: u32 = 2u;
const TERMINATED: u32 = 3u;

// Sums of the workgroup: low 16 bits and the signed rest apart, so that neither can overflow.
var<workgroup> tally_low: array<atomic<u32>, 12>;
var<workgroup> tally_high: array<atomic<i32>, 12>;

// `scale`: fixed-point units per watt.
fn to_fixed(flux: vec3f, scale: f32) -> vec3i {
    return vec3i(round(min(flux * scale, vec3f(1.0e9))));
}

fn ledger_add_one(slot: u32, value: i32) {
    if value != 0 {
        atomicAdd(&tally_low[slot], u32(value) & 0xffffu);
        atomicAdd(&tally_high[slot], value >> 16u);
    }
}

fn ledger_add(kind: u32, value: vec3i) {
    ledger_add_one(kind * 3u, value.x);
    ledger_add_one(kind * 3u + 1u, value.y);
    ledger_add_one(kind * 3u + 2u, value.z);
}

// Adds the workgroup's sums to the 64-bit totals; `local` is the thread's number in its workgroup.
fn ledger_publish(local: u32) {
    workgroupBarrier();
    if local >= 12u {
        return;
    }
    let low = atomicLoad(&tally_low[local]);
    let high = atomicLoad(&tally_high[local]);
    let shifted = bitcast<u32>(high) << 16u;
    let word = shifted + low;
    var upper = bitcast<u32>(high >> 16u) + select(0u, 1u, word < shifted);
    let before = atomicAdd(&tally.ledger[2u * local], word);
    upper += select(0u, 1u, before + word < before);
    if upper != 0u {
        atomicAdd(&tally.ledger[2u * local + 1u], upper);
    }
}
