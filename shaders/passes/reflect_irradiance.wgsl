// L = E f(ω, eye) min((ω·n_s) / (ω·n_g), s_max), ω the mean direction of the light [SA19, Eq. 20] (W·m⁻²·sr⁻¹).
//
// [SA19]: Smal and Aizenshtein, "Real-time global illumination with photon mapping", Ray Tracing Gems chapter 24, 2019.
#import "shared/gbuffer.wgsl"
#import "shared/shading_normal.wgsl"

struct ReflectParams {
    camera_position_world: vec3f,
    pad0: u32,
    size: vec2u,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: ReflectParams;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var irradiance: texture_2d<f32>;
@group(0) @binding(4) var direction: texture_2d<f32>;
@group(0) @binding(5) var radiance: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn reflect_irradiance(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.size) {
        return;
    }
    let point = visible_point(
        textureLoad(position, pixel.xy, 0), textureLoad(surface, pixel.xy, 0), params.camera_position_world
    );
    let sum = textureLoad(direction, pixel.xy, 0).xyz;
    var reflected = vec3f(0.0);
    if point.gatherable && dot(sum, sum) > 0.0 {
        let incident = normalize(sum);
        let correction = shading_correction(incident, point.brdf.normal, dot(incident, point.normal_geometric));
        reflected = textureLoad(irradiance, pixel.xy, 0).rgb * brdf_eval(point.brdf, incident, point.to_eye) * correction;
    }
    textureStore(radiance, pixel.xy, vec4f(reflected, 1.0));
}
