// Splats of four breadths of each placed photon, in one pass: luminance in four sums, and how many photons reach each texel [WD08, section
// 4.1]. Eight lanes a photon.
//
// [WD08]: Wyman and Dachsbacher, "Reducing noise in image-space caustics with variable-sized splatting", 2008.
#import "shared/caustic_splat.wgsl"
#import "shared/caustic_sums.wgsl"
#import "shared/dispatch.wgsl"

struct SplatParams {
    side: u32,
    slack: f32,
    // 1 / flux of a mean photon (W⁻¹): the sums' unit.
    scale: f32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: SplatParams;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;
@group(0) @binding(3) var receivers: texture_2d_array<u32>;
@group(0) @binding(4) var<storage, read> places: array<CausticPlace>;
@group(0) @binding(5) var<storage, read> place_count: u32;
@group(0) @binding(6) var<storage, read_write> sums: array<atomic<u32>>;

// Words of a texel: luminance of each sum, two words; flags; photons within reach of each.
const WORDS: u32 = 13u;

fn kernels(view: CausticView, index: u32, splat: Splat, window: SplatWindow, texel: vec2u) -> vec4f {
    return splat_kernels(splat_distance2(view, index, f32(params.side), splat, window, texel), FOUR_DIAMETERS);
}

@compute @workgroup_size(64)
fn caustic_map_four(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let slot = linear_index(group, workgroups, 1u) * (64u / SPLAT_LANES) + local / SPLAT_LANES;
    let lane = local % SPLAT_LANES;
    let place = places[min(slot, arrayLength(&places) - 1u)];
    let photon = photon_load(photons[place.photon], photon_state.grid);
    let splat = Splat(photon.position, octahedral_decode(photon.normal), place.diameter, params.slack);
    let flux = luminance(flux_decode(photon.flux)) * params.scale;
    let side = f32(params.side);
    let first_view = place.views & 0xffffu;
    let end_view = select(first_view, first_view + (place.views >> 16u), slot < place_count);

    var total = vec4f(0.0);
    for (var index = first_view; index < end_view; index += 1u) {
        let view = caustic_view(index);
        let window = splat_window(view, side, splat);
        for (var y = window.lower.y; y < window.upper.y; y += 1u) {
            for (var x = window.lower.x + lane; x < window.upper.x; x += SPLAT_LANES) {
                total += kernels(view, index, splat, window, vec2u(x, y));
            }
        }
    }
    total = max(sum_over_lanes(local, total), vec4f(1.0e-30));
    for (var index = first_view; index < end_view; index += 1u) {
        let view = caustic_view(index);
        let window = splat_window(view, side, splat);
        for (var y = window.lower.y; y < window.upper.y; y += 1u) {
            for (var x = window.lower.x + lane; x < window.upper.x; x += SPLAT_LANES) {
                let shares = kernels(view, index, splat, window, vec2u(x, y)) / total;
                let at = ((index * params.side + y) * params.side + x) * WORDS;
                for (var i = 0u; i < 4u; i += 1u) {
                    if shares[i] > 0.0 {
                        add_sum(at + 2u * i, at + 8u, flux * shares[i]);
                        atomicAdd(&sums[at + 9u + i], 1u);
                    }
                }
            }
        }
    }
}
