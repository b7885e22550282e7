// The light that each pixel chose, with its shadow ray: f(y) V W. A thread per pixel.
#import "shared/bvh.wgsl"
#import "shared/light_reservoir.wgsl"
#import "shared/virtual_light.wgsl"

struct ShadeParams {
    camera_position_world: vec3f,
    // ε² (m²).
    least2: f32,
    size: vec2u,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: ShadeParams;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var<storage, read> lights_kept: array<VirtualLight>;
@group(0) @binding(4) var<storage, read> reservoirs: array<LightReservoir>;
// Radiance towards the eye (W·m⁻²·sr⁻¹), and the luminance that the least distance took.
@group(0) @binding(5) var indirect: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn instant_radiosity_shade(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.size) {
        return;
    }
    let index = pixel.y * params.size.x + pixel.x;
    let weight = reservoirs[index].weight;
    var radiance = vec4f(0.0);
    if weight > 0.0 {
        let point = visible_point(
            textureLoad(position, pixel.xy, 0), textureLoad(surface, pixel.xy, 0), params.camera_position_world
        );
        let at = lit_surface(point);
        let light = lights_kept[index];
        let lit = lit_by(at, point.to_eye, light, params.least2);
        let ray = shadow_ray(at, light);
        if unoccluded(ray.origin, ray.span, 0.9999) {
            radiance = vec4f(lit.radiance, lit.removed) * weight;
        }
    }
    textureStore(indirect, pixel.xy, radiance);
}
