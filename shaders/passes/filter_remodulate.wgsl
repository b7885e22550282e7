// Filtered light times what the surface reflects of it (W·m⁻²·sr⁻¹); where nothing was filtered, the radiance as it was.
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
@group(0) @binding(4) var light: texture_2d<f32>;
@group(0) @binding(5) var filtered: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn filter_remodulate(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.size) {
        return;
    }
    let point = visible_point(
        textureLoad(position, pixel.xy, 0), textureLoad(surface, pixel.xy, 0), params.camera_position_world
    );
    let there = textureLoad(light, pixel.xy, 0).rgb;
    let reflected = select(vec3f(0.0), there * reflectance(point.brdf, point.to_eye), known(there));
    let result = select(textureLoad(radiance, pixel.xy, 0).rgb, reflected, point.gatherable);
    textureStore(filtered, pixel.xy, vec4f(result, 1.0));
}
