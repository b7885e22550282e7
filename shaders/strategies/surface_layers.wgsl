// Unpacks the G-buffer into images for people and filters: base colour, shading normal, distance.
#import "shared/gbuffer.wgsl"

struct Params {
    camera_position_world: vec3f,
    pad0: u32,
    size: vec2u,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
// Linear, 0 to 1.
@group(0) @binding(3) var albedo: texture_storage_2d<rgba32float, write>;
// World, unit; 0 where nothing is.
@group(0) @binding(4) var normal: texture_storage_2d<rgba32float, write>;
// Distance to the camera (m); 0 where nothing is.
@group(0) @binding(5) var depth: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn surface_layers(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let point = visible_point(textureLoad(position, id.xy, 0), textureLoad(surface, id.xy, 0), params.camera_position_world);
    let there = select(0.0, 1.0, point.valid);
    textureStore(albedo, id.xy, vec4f(point.brdf.base_color * there, there));
    textureStore(normal, id.xy, vec4f(point.brdf.normal * there, there));
    textureStore(depth, id.xy, vec4f(vec3f(point.depth * there), there));
}
