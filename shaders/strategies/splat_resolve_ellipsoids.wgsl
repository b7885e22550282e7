// Blended sums of ellipsoid splats, back in W·m⁻², 32 bits and the image's size.
//
// A half-sized target is enlarged by the bilinear filter over those of its texels that show the pixel's surface and no other.
#import "shared/camera.wgsl"
#import "shared/estimate.wgsl"

struct Params {
    camera: Camera,
    // One over what the sums are scaled by.
    unit: f32,
    // Largest number that a target holds.
    largest: f32,
    // Edge of a target's texel (pixels): 1 or 2.
    texel: u32,
    pad0: u32,
}

struct Sum {
    irradiance: vec3f,
    direction: vec3f,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
// Of the target's texels.
@group(0) @binding(3) var nearest: texture_2d<f32>;
@group(0) @binding(4) var farthest: texture_2d<f32>;
@group(0) @binding(5) var farthest_surface: texture_2d<u32>;
@group(0) @binding(6) var irradiance_x: texture_2d<f32>;
@group(0) @binding(7) var direction_yz: texture_2d<f32>;
@group(0) @binding(8) var irradiance: texture_storage_2d<rgba32float, write>;
@group(0) @binding(9) var direction: texture_storage_2d<rgba32float, write>;
// Pixels whose sum passed what the target holds.
@group(0) @binding(10) var<storage, read_write> overflowed: atomic<u32>;

fn sum_at(texel: vec2u) -> Sum {
    let bound = vec4f(params.largest);
    let first = clamp(textureLoad(irradiance_x, texel, 0), -bound, bound);
    let rest = clamp(textureLoad(direction_yz, texel, 0).xy, -bound.xy, bound.xy);
    return Sum(first.rgb, vec3f(first.a, rest));
}

// Whether the texel shows the surface of `point`, and that alone: within a pixel of its tangent plane, as surfaces are whose curves an image
// resolves.
fn shows(texel: vec2u, point: vec3f, normal: vec3f, tolerance: f32) -> bool {
    let code = textureLoad(farthest_surface, texel, 0);
    let far = dot(textureLoad(farthest, texel, 0).xyz - point, normal);
    let near = dot(textureLoad(nearest, texel, 0).xyz - point, normal);
    let alike = dot(octahedral_decode(code.y), normal) >= MIN_NORMAL_COSINE;
    return (code.w & SURFACE_VALID) != 0u && alike && max(abs(far), abs(near)) <= tolerance;
}

fn enlarged(pixel: vec2u, point: vec4f, normal: vec3f) -> Sum {
    let last = vec2i(textureDimensions(irradiance_x)) - 1;
    let at = (vec2f(pixel) + 0.5) / f32(params.texel) - 0.5;
    let base = floor(at);
    let sizes = 2.0 * params.camera.tan_half / vec2f(params.camera.size);
    let tolerance = point.w * max(sizes.x, sizes.y);
    var sum: Sum;
    var total = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let corner = vec2f(vec2u(i & 1u, i >> 1u));
        let texel = vec2u(clamp(vec2i(base + corner), vec2i(0), last));
        let along = 1.0 - abs(at - base - corner);
        if shows(texel, point.xyz, normal, tolerance) {
            let part = sum_at(texel);
            let weight = along.x * along.y;
            sum.irradiance += weight * part.irradiance;
            sum.direction += weight * part.direction;
            total += weight;
        }
    }
    // A surface too small for the target takes what its texel has: light that fell on all that the texel shows.
    if total == 0.0 {
        return sum_at(pixel / params.texel);
    }
    sum.irradiance /= total;
    sum.direction /= total;
    return sum;
}

@compute @workgroup_size(8, 8)
fn splat_resolve_ellipsoids(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.camera.size) {
        return;
    }
    if any(textureLoad(irradiance_x, id.xy / params.texel, 0).rgb >= vec3f(params.largest)) {
        atomicAdd(&overflowed, 1u);
    }
    let code = textureLoad(surface, id.xy, 0);
    var sum: Sum;
    if gathers(code) {
        if params.texel == 1u {
            sum = sum_at(id.xy);
        } else {
            sum = enlarged(id.xy, textureLoad(position, id.xy, 0), octahedral_decode(code.y));
        }
    }
    textureStore(irradiance, id.xy, vec4f(sum.irradiance * params.unit, 1.0));
    textureStore(direction, id.xy, vec4f(sum.direction * params.unit, 0.0));
}
