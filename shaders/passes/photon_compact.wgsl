// Packs a bounce's records behind the earlier ones and its live paths for the next bounce, both in the order of the paths.
#import "shared/dispatch.wgsl"
#import "shared/photon_path.wgsl"
#import "shared/photon_store.wgsl"

struct PhotonCompactParams {
    grid: PhotonGrid,
    capacity: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: PhotonCompactParams;
@group(0) @binding(1) var<storage, read> rays: array<Ray>;
@group(0) @binding(2) var<storage, read> paths: array<PhotonPath>;
@group(0) @binding(3) var<storage, read> staging: array<Photon>;
@group(0) @binding(4) var<storage, read_write> tally: PhotonTally;
@group(0) @binding(5) var<storage, read_write> next_rays: array<Ray>;
@group(0) @binding(6) var<storage, read_write> next_paths: array<PhotonPath>;
@group(0) @binding(7) var<storage, read_write> records: array<StoredPhoton>;

// One bit for each path of the block.
var<workgroup> stored_bits: array<atomic<u32>, 2>;
var<workgroup> alive_bits: array<atomic<u32>, 2>;

fn bits_before(low: u32, high: u32, local: u32) -> u32 {
    let in_low = extractBits(low, 0u, min(local, 32u));
    let in_high = extractBits(high, 0u, max(local, 32u) - 32u);
    return countOneBits(in_low) + countOneBits(in_high);
}

@compute @workgroup_size(64)
fn photon_compact(@builtin(global_invocation_id) global_id: vec3u, @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let i = linear_index(global_id, workgroups, PATH_BLOCK);
    let ray = rays[i];
    let alive = ray.t_max > 0.0;
    let stored = staging[i].bounce_flags != NO_RECORD;
    if alive {
        atomicOr(&alive_bits[local / 32u], 1u << (local % 32u));
    }
    if stored {
        atomicOr(&stored_bits[local / 32u], 1u << (local % 32u));
    }
    workgroupBarrier();
    let block = i / PATH_BLOCK;
    if stored {
        let at = tally.first_record + tally.stored[block]
            + bits_before(atomicLoad(&stored_bits[0]), atomicLoad(&stored_bits[1]), local);
        if at < params.capacity {
            records[at] = photon_store(staging[i], params.grid);
        }
    }
    if alive {
        let at = tally.alive[block] + bits_before(atomicLoad(&alive_bits[0]), atomicLoad(&alive_bits[1]), local);
        next_rays[at] = ray;
        next_paths[at] = paths[i];
    }
    // The last block is filled up with no rays.
    let total = tally.alive_total;
    if i >= total && i < (total + PATH_BLOCK - 1u) / PATH_BLOCK * PATH_BLOCK {
        next_rays[i].t_max = -1.0;
    }
}
