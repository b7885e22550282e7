// Rasterises the scene's triangles: which triangle each pixel sees, and where on it. The attributes follow in `gbuffer`,
// from the same functions that rays use, so that rasterised and traced surfaces cannot differ.
// Depth is reversed (near / distance): float precision stays relative over the whole range.
#import "shared/camera.wgsl"
#import "shared/pulled_triangle.wgsl"

struct VisibilityParams {
    camera: Camera,
}

struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) bary: vec2f,
    @location(1) @interpolate(flat, either) index: u32,
}

struct Targets {
    // Index into bvh_triangles + 1 (0: nothing), barycentric weights of the second and third corner as bits, unused.
    @location(0) visibility: vec4u,
}

@group(0) @binding(0) var<uniform> params: VisibilityParams;

@vertex
fn visibility_vertex(@builtin(vertex_index) vertex: u32) -> Varyings {
    let pulled = pulled_vertex(vertex);
    let view = (params.camera.view_from_world * vec4f(pulled.position, 1.0)).xyz;
    // Moves the sample point of the pixel's centre to `jitter`.
    let shift = (vec2f(0.5) - params.camera.jitter) / vec2f(params.camera.size) * vec2f(2.0, -2.0);
    let clip = vec4f(view.xy / params.camera.tan_half - shift * view.z, params.camera.near_m, -view.z);
    return Varyings(clip, pulled.bary, pulled.index);
}

@fragment
fn visibility_fragment(in: Varyings) -> Targets {
    if fragment_passes(in.index, in.bary, in.clip.xyz) {
        discard;
    }
    return Targets(vec4u(in.index + 1u, bitcast<vec2u>(in.bary), 0u));
}
