// Sums one chunk of the stored photons at every visible point: [MML13] Eq. 1 with Q(X) = all of them.
//
// One workgroup of 16 × 16 pixels; the chunk passes through workgroup memory in blocks of 256. Later chunks go on
// with the sums of earlier ones; a chunk beyond the stored photons returns at once.
#import "shared/gbuffer.wgsl"
#import "shared/photon_block.wgsl"
#import "shared/photon_store.wgsl"

struct Params {
    camera_position_world: vec3f,
    // Range of photon indices of this chunk.
    first: u32,
    end: u32,
    // Kernel radii (m).
    r_min: f32,
    r_max: f32,
    pad0: u32,
    size: vec2u,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(4) var<storage, read> photon_state: PhotonState;
@group(0) @binding(5) var<storage, read_write> indirect_sum: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> caustic_sum: array<vec4f>;

@compute @workgroup_size(16, 16)
fn exact_gather(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) thread: u32) {
    let end = min(min(params.end, photon_state.stored), arrayLength(&photons));
    if params.first >= end {
        return;
    }
    let inside = all(id.xy < params.size);
    let pixel = min(id.xy, params.size - 1u);
    let point = visible_point(textureLoad(position, pixel, 0), textureLoad(surface, pixel, 0), params.camera_position_world);
    let gathers = inside && point.gatherable;

    // Goes on with the sum of the chunks before, so that the order of additions is that of the photons.
    let index = pixel.y * params.size.x + pixel.x;
    var sum: RadianceSum;
    sum.indirect = indirect_sum[index].rgb;
    sum.caustic = caustic_sum[index].rgb;
    for (var block = params.first; block < end; block += PHOTON_BLOCK) {
        let count = min(PHOTON_BLOCK, end - block);
        if thread < count {
            load_block_photon(thread, photon_load(photons[block + thread], photon_state.grid), params.r_min, params.r_max);
        }
        workgroupBarrier();
        if gathers {
            gather_run(&sum, point, vec2u(0u, count));
        }
        workgroupBarrier();
    }
    if gathers {
        indirect_sum[index] = vec4f(sum.indirect, 0.0);
        caustic_sum[index] = vec4f(sum.caustic, 0.0);
    }
}
