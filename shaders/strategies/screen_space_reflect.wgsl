// The caustics that surfaces reflect: L = g E R / π, see screen_space_resolve.wgsl. A thread per pixel.
#import "shared/gbuffer.wgsl"
#import "shared/reflectance.wgsl"

struct ReflectParams {
    camera_position_world: vec3f,
    gain: f32,
    size: vec2u,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: ReflectParams;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var light: texture_2d<f32>;
// The same radiance (W·m⁻²·sr⁻¹) twice.
@group(0) @binding(4) var indirect: texture_storage_2d<rgba32float, write>;
@group(0) @binding(5) var caustic: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn screen_space_reflect(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let point = visible_point(textureLoad(position, id.xy, 0), textureLoad(surface, id.xy, 0), params.camera_position_world);
    var radiance = vec3f(0.0);
    if point.gatherable {
        radiance = textureLoad(light, id.xy, 0).rgb * reflectance(point.brdf, point.to_eye) * (params.gain / PI);
    }
    textureStore(indirect, id.xy, vec4f(radiance, 1.0));
    textureStore(caustic, id.xy, vec4f(radiance, 1.0));
}
