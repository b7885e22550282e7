// What the filters compare of two pixels, four words each: depth along the view, its slope along the surface, and both normals.
#import "shared/camera.wgsl"
#import "shared/gbuffer.wgsl"

struct GuideParams {
    camera: Camera,
}

@group(0) @binding(0) var<uniform> params: GuideParams;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var guide: texture_storage_2d<rgba32uint, write>;

// Slopes beyond this are those of surfaces seen edge on.
const MAX_SLOPE: f32 = 1.0e4;

@compute @workgroup_size(8, 8)
fn filter_guide(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.camera.size) {
        return;
    }
    let words = textureLoad(surface, pixel.xy, 0);
    let view = params.camera.view_from_world * vec4f(textureLoad(position, pixel.xy, 0).xyz, 1.0);
    let z = -view.z;
    if !gathers(words) || z <= 0.0 {
        textureStore(guide, pixel.xy, vec4u(0u));
        return;
    }
    // On the plane n·X = k points of the ray (u, v, −1) are at z = k / (n·(u, v, −1)), hence ∂z/∂u = −z² n.x / k.
    let n = (params.camera.view_from_world * vec4f(octahedral_decode(words.y), 0.0)).xyz;
    let k = -max(abs(dot(n, view.xyz)), z / MAX_SLOPE);
    let per_pixel = params.camera.tan_half / vec2f(params.camera.size);
    let slope = vec2f(-n.x, n.y) * (z / k) * vec2f(per_pixel.x / per_pixel.y, 1.0);
    textureStore(guide, pixel.xy, vec4u(bitcast<u32>(z), pack2x16float(clamp(slope, vec2f(-MAX_SLOPE), vec2f(MAX_SLOPE))), words.yx));
}
