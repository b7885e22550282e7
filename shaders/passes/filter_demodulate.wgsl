// Radiance (W·m⁻²·sr⁻¹) over what the surface reflects of even light, so that textures are not filtered with it. A channel of which the
// surface reflects nothing says nothing about the light, and is marked so: no divisor is 0.
#import "shared/filter.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/reflectance.wgsl"

struct ModulateParams {
    camera_position_world: vec3f,
    pad0: u32,
    size: vec2u,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: ModulateParams;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var radiance: texture_2d<f32>;
@group(0) @binding(4) var light: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn filter_demodulate(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.size) {
        return;
    }
    let point = visible_point(
        textureLoad(position, pixel.xy, 0), textureLoad(surface, pixel.xy, 0), params.camera_position_world
    );
    let reflected = reflectance(point.brdf, point.to_eye);
    let reflects = (reflected > vec3f(0.0)) & vec3<bool>(point.gatherable);
    let divided = textureLoad(radiance, pixel.xy, 0).rgb / select(vec3f(1.0), reflected, reflects);
    textureStore(light, pixel.xy, vec4f(select(vec3f(FILTER_UNKNOWN), divided, reflects), 0.0));
}
