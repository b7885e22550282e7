// Joint bilateral upsampling [Kopf07] of light that one pixel of each square has gathered.
//
// The four nearest samples count by bilinear weights, times how near they lie to the pixel's tangent plane and how alike the normals
// are. Light is carried over before reflection: Σ w L / Σ w R is the irradiance (over π) of samples of radiance L and reflectance
// R, so that textures stay sharp, and a black sample, which knows nothing of the light, counts for nothing.
//
// [Kopf07]: Kopf, Cohen, Lischinski and Uyttendaele, "Joint bilateral upsampling", SIGGRAPH 2007.
#import "shared/filter.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/reflectance.wgsl"

struct UpsampleParams {
    camera_position_world: vec3f,
    // Edge of a square (pixels).
    stride: u32,
    size: vec2u,
    // Width (m) of a square seen at a distance of 1 m.
    square_m: f32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: UpsampleParams;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var small_position: texture_2d<f32>;
@group(0) @binding(4) var small_surface: texture_2d<u32>;
@group(0) @binding(5) var small_radiance: texture_2d<f32>;
@group(0) @binding(6) var radiance: texture_storage_2d<rgba32float, write>;

// σ_n of [SA19, Eq. 11].
const SIGMA_N: f32 = 32.0;
// Weight of a sample that lies on another surface: a pixel that has no other still gets light.
const OTHER_SURFACE: f32 = 1.0e-4;

@compute @workgroup_size(8, 8)
fn upsample(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let point = visible_point(textureLoad(position, id.xy, 0), textureLoad(surface, id.xy, 0), params.camera_position_world);
    var light = vec3f(0.0);
    if point.gatherable {
        let last = textureDimensions(small_radiance) - 1u;
        // Samples stand at the middles of their squares.
        let place = (vec2f(id.xy) + 0.5) / f32(params.stride) - 0.5;
        let near = clamp(vec2i(floor(place)), vec2i(0), vec2i(last));
        let across = saturate(place - vec2f(near));
        var radiance_sum = vec3f(0.0);
        var reflectance_sum = vec3f(0.0);
        for (var corner = 0u; corner < 4u; corner++) {
            let step = vec2u(corner & 1u, corner >> 1u);
            let at = min(vec2u(near) + step, last);
            let bilinear = mix(1.0 - across, across, vec2f(step));
            let sample = visible_point(
                textureLoad(small_position, at, 0), textureLoad(small_surface, at, 0), params.camera_position_world
            );
            let off_plane = abs(dot(point.normal_geometric, sample.position - point.position));
            let alike = exp(-off_plane / (params.square_m * point.depth))
                * normal_weight(point.brdf.normal, sample.brdf.normal, SIGMA_N);
            let weight = select(0.0, bilinear.x * bilinear.y * (alike + OTHER_SURFACE), sample.gatherable);
            radiance_sum += weight * textureLoad(small_radiance, at, 0).rgb;
            reflectance_sum += weight * reflectance(sample.brdf, sample.to_eye);
        }
        light = reflectance(point.brdf, point.to_eye) * radiance_sum / max(reflectance_sum, vec3f(1.0e-20));
    }
    textureStore(radiance, id.xy, vec4f(light, 1.0));
}
