// Adds each placed photon to the texels around it, each by the share that its kernel there has of the kernel's sum: what the texels get is
// the photon's flux. Eight lanes a photon.
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
// Weights of the four kernels in each texel; see caustic_map_blend.wgsl.
@group(0) @binding(6) var blend: texture_2d_array<f32>;
@group(0) @binding(7) var<storage, read_write> sums: array<atomic<u32>>;

// Kernels of four breadths, blended as the texels ask; else one, of the place's diameter.
override BLENDED: bool = false;

// Words of a texel: red, green and blue, two each; flags.
const WORDS: u32 = 7u;

fn kernels(view: CausticView, index: u32, splat: Splat, window: SplatWindow, texel: vec2u) -> vec4f {
    let distance2 = splat_distance2(view, index, f32(params.side), splat, window, texel);
    return splat_kernels(distance2, select(vec4f(splat.diameter), FOUR_DIAMETERS, BLENDED));
}

@compute @workgroup_size(64)
fn caustic_map_splat(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let slot = linear_index(group, workgroups, 1u) * (64u / SPLAT_LANES) + local / SPLAT_LANES;
    let lane = local % SPLAT_LANES;
    let place = places[min(slot, arrayLength(&places) - 1u)];
    let photon = photon_load(photons[place.photon], photon_state.grid);
    let splat = Splat(photon.position, octahedral_decode(photon.normal), place.diameter, params.slack);
    let flux = flux_decode(photon.flux) * params.scale;
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

    // What texels ask of four kernels together is not the whole of any, so that it is divided by its sum in turn.
    var asked = 1.0;
    if BLENDED {
        asked = 0.0;
        for (var index = first_view; index < end_view; index += 1u) {
            let view = caustic_view(index);
            let window = splat_window(view, side, splat);
            for (var y = window.lower.y; y < window.upper.y; y += 1u) {
                for (var x = window.lower.x + lane; x < window.upper.x; x += SPLAT_LANES) {
                    let shares = kernels(view, index, splat, window, vec2u(x, y)) / total;
                    asked += dot(shares, textureLoad(blend, vec2u(x, y), index, 0));
                }
            }
        }
        asked = max(sum_over_lanes(local, vec4f(asked)).x, 1.0e-30);
    }
    for (var index = first_view; index < end_view; index += 1u) {
        let view = caustic_view(index);
        let window = splat_window(view, side, splat);
        for (var y = window.lower.y; y < window.upper.y; y += 1u) {
            for (var x = window.lower.x + lane; x < window.upper.x; x += SPLAT_LANES) {
                let shares = kernels(view, index, splat, window, vec2u(x, y)) / total;
                var share = shares.x;
                if BLENDED {
                    share = dot(shares, textureLoad(blend, vec2u(x, y), index, 0)) / asked;
                }
                if share > 0.0 {
                    let at = ((index * params.side + y) * params.side + x) * WORDS;
                    add_sums(at, at + 6u, flux * share);
                }
            }
        }
    }
}
