// Rasterises what a light sees in one of its views: the nearest triangle at each texel's centre.
#import "shared/hit.wgsl"

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
    let index = vertex / 3u;
    let corner = vertex % 3u;
    let triangle = bvh_triangles[index];
    let bary = vec2f(select(0.0, 1.0, corner == 1u), select(0.0, 1.0, corner == 2u));
    let world = select(select(triangle.v0, triangle.v1, corner == 1u), triangle.v2, corner == 2u);
    return Varyings(light_views[params.view].clip_from_world * vec4f(world, 1.0), bary, index);
}

@fragment
fn rsm_view_fragment(in: Varyings) -> Targets {
    let triangle = bvh_triangles[in.index];
    if SCENE_ALPHA && (triangle.id & ALPHA_TESTED) != 0u {
        if alpha_passes(triangle.id & ~ALPHA_TESTED, in.bary, in.clip.xyz) {
            discard;
        }
    }
    return Targets(in.index + 1u);
}
