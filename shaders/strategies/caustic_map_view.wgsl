// Rasterises what a light would see in one of its views if nothing refracted and nothing mirrored: the surfaces that caustics fall on.
#import "shared/caustic_view.wgsl"
#import "shared/pulled_triangle.wgsl"
#import "shared/surface.wgsl"

struct CausticViewParams {
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
    // Less the view's origin (m).
    @location(2) point: vec3f,
}

struct Targets {
    // Depth (m, bits of a float; 0: nothing), geometric normal towards the light (octahedral).
    @location(0) receivers: vec2u,
}

@group(0) @binding(0) var<uniform> params: CausticViewParams;

@vertex
fn caustic_map_view_vertex(@builtin(vertex_index) vertex: u32) -> Varyings {
    let pulled = pulled_vertex(vertex);
    let clip = light_views[params.view].clip_from_world * vec4f(pulled.position, 1.0);
    return Varyings(clip, pulled.bary, pulled.index, pulled.position - caustic_view(params.view).origin);
}

@fragment
fn caustic_map_view_fragment(in: Varyings) -> Targets {
    if fragment_passes(in.index, in.bary, in.clip.xyz) {
        discard;
    }
    let view = caustic_view(params.view);
    let surface = surface_at(Hit(0.0, in.index, in.bary), -to_light(view, in.point));
    if !surface_gatherable(surface) {
        discard;
    }
    return Targets(vec2u(bitcast<u32>(dot(view.forward, in.point)), octahedral_encode(surface.normal_geometric)));
}
