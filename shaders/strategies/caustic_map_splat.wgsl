// Adds each placed photon to the texels around it, each by the share that its kernel there has of the kernel's sum: what the texels get is
// the photon's flux. Eight lanes a photon.
#import "shared/caustic_splat.wgsl"
#import "shared/caustic_sums.wgsl"

@group(0) @binding(0) var<uniform> params: SplatParams;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;
@group(0) @binding(3) var receivers: texture_2d_array<u32>;
@group(0) @binding(4) var<storage, read> places: array<CausticPlace>;
@group(0) @binding(5) var<storage, read> place_count: u32;
// Weights of the four kernels in each texel; see caustic_map_blend.wgsl.
@group(0) @binding(6) var blend: texture_2d_array<f32>;
@group(0) @binding(7) var<storage, read_write> sums: array<atomic<u32>>;

// Kernels of four breadths, blended as the texels ask; else one, of the place's diameter.
override BLENDED: bool = false;

fn diameters(splat: Splat) -> vec4f {
    return select(vec4f(splat.diameter), FOUR_DIAMETERS, BLENDED);
}

// The texel's part of the kernel, or of what texels ask of the four kernels together.
fn texel_part(view: CausticView, index: u32, splat: Splat, window: SplatWindow, texel: vec2u, total: vec4f) -> f32 {
    let shares = texel_kernels(view, index, splat, window, texel, diameters(splat)) / total;
    if BLENDED {
        return dot(shares, textureLoad(blend, texel, index, 0));
    }
    return shares.x;
}

@compute @workgroup_size(64)
fn caustic_map_splat(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let placed = placed_splat(splat_slot(group, workgroups, local));
    let lane = local % SPLAT_LANES;
    let side = f32(params.side);
    let total = kernel_totals(local, placed, diameters(placed.splat));

    // What texels ask of four kernels together is not the whole of any, so that it is divided by its sum in turn.
    var asked = 1.0;
    if BLENDED {
        asked = 0.0;
        for (var index = placed.first_view; index < placed.end_view; index += 1u) {
            let view = caustic_view(index);
            let window = splat_window(view, side, placed.splat);
            for (var y = window.lower.y; y < window.upper.y; y += 1u) {
                for (var x = window.lower.x + lane; x < window.upper.x; x += SPLAT_LANES) {
                    asked += texel_part(view, index, placed.splat, window, vec2u(x, y), total);
                }
            }
        }
        asked = max(sum_over_lanes(local, vec4f(asked)).x, 1.0e-30);
    }
    for (var index = placed.first_view; index < placed.end_view; index += 1u) {
        let view = caustic_view(index);
        let window = splat_window(view, side, placed.splat);
        for (var y = window.lower.y; y < window.upper.y; y += 1u) {
            for (var x = window.lower.x + lane; x < window.upper.x; x += SPLAT_LANES) {
                let share = texel_part(view, index, placed.splat, window, vec2u(x, y), total) / asked;
                if share > 0.0 {
                    let at = texel_index(index, vec2u(x, y)) * ONE_WORDS;
                    add_sums(at, at + 6u, placed.flux * share);
                }
            }
        }
    }
}
