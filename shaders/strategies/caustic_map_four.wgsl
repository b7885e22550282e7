// Splats of four breadths of each placed photon, in one pass: luminance in four sums, and how many photons reach each texel [WD08, section
// 4.1]. Eight lanes a photon.
//
// [WD08]: Wyman and Dachsbacher, "Reducing noise in image-space caustics with variable-sized splatting", 2008.
#import "shared/caustic_splat.wgsl"
#import "shared/caustic_sums.wgsl"

@group(0) @binding(0) var<uniform> params: SplatParams;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;
@group(0) @binding(3) var receivers: texture_2d_array<u32>;
@group(0) @binding(4) var<storage, read> places: array<CausticPlace>;
@group(0) @binding(5) var<storage, read> place_count: u32;
@group(0) @binding(6) var<storage, read_write> sums: array<atomic<u32>>;

@compute @workgroup_size(64)
fn caustic_map_four(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let placed = placed_splat(splat_slot(group, workgroups, local));
    let flux = luminance(placed.flux);
    let side = f32(params.side);
    let total = kernel_totals(local, placed, FOUR_DIAMETERS);
    for (var index = placed.first_view; index < placed.end_view; index += 1u) {
        let view = caustic_view(index);
        let window = splat_window(view, side, placed.splat);
        for (var y = window.lower.y; y < window.upper.y; y += 1u) {
            for (var x = window.lower.x + local % SPLAT_LANES; x < window.upper.x; x += SPLAT_LANES) {
                let shares = texel_kernels(view, index, placed.splat, window, vec2u(x, y), FOUR_DIAMETERS) / total;
                let at = texel_index(index, vec2u(x, y)) * FOUR_WORDS;
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
