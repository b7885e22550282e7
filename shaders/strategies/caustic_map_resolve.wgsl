// The maps from their sums: irradiance of the receivers, flux over the area that a texel holds. A thread per texel.
#import "shared/caustic_receivers.wgsl"
#import "shared/caustic_sums.wgsl"

struct ResolveParams {
    side: u32,
    // The sums' unit (W).
    unit: f32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: ResolveParams;
@group(0) @binding(1) var receivers: texture_2d_array<u32>;
@group(0) @binding(2) var<storage, read_write> sums: array<atomic<u32>>;
// E (W·m⁻²).
@group(0) @binding(3) var map: texture_storage_2d_array<rgba32float, write>;
// Word 2: texels whose sum passed what it can hold.
@group(0) @binding(4) var<storage, read_write> stats: array<atomic<u32>>;

@compute @workgroup_size(8, 8)
fn caustic_map_resolve(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= vec2u(params.side)) {
        return;
    }
    let side = f32(params.side);
    let at = ((id.z * params.side + id.y) * params.side + id.x) * ONE_WORDS;
    if atomicLoad(&sums[at + 6u]) != 0u {
        atomicAdd(&stats[2], 1u);
    }
    let shown = receiver(id.xy, id.z);
    var irradiance = vec3f(0.0);
    if shown.depth > 0.0 {
        let view = caustic_view(id.z);
        let film = vec2f(id.xy) + 0.5;
        let area = texel_area(view, film, side, map_point(view, film, side, shown.depth), shown.normal);
        irradiance = three_sums(at) * (params.unit / area);
    }
    textureStore(map, id.xy, id.z, vec4f(irradiance, 1.0));
}
