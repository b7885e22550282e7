// Rasterises what a light sees in one of its views: the nearest triangle at each texel's centre.
#import "shared/pulled_triangle.wgsl"

struct RsmViewParams {
    // Index into `light_views`.
    view: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) bary: vec2f,
    @location(1) @interpolate(flat, either) index: u32,
}

struct Targets {
    // Index into bvh_triangles + 1; 0: nothing.
    @location(0) seen: u32,
}

@group(0) @binding(0) var<uniform> params: RsmViewParams;

@vertex
fn rsm_view_vertex(@builtin(vertex_index) vertex: u32) -> Varyings {
    let pulled = pulled_vertex(vertex);
    return Varyings(light_views[params.view].clip_from_world * vec4f(pulled.position, 1.0), pulled.bary, pulled.index);
}

@fragment
fn rsm_view_fragment(in: Varyings) -> Targets {
    if fragment_passes(in.index, in.bary, in.clip.xyz) {
        discard;
    }
    return Targets(in.index + 1u);
}
