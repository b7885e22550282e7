// What the eye sees through each pixel, packed into three textures:
// position (rgba32float: world m; distance to the camera m, 0 where nothing is), surface (rgba32uint), emission.
//
// Points that the eye sees by way of mirrors and glass (passes/visible_points.wgsl) have the direction in which they are seen in place of the
// distance, coded as a number below 0.
#import "shared/math.wgsl"
#import "shared/brdf.wgsl"

const SURFACE_VALID: u32 = 0x10000u;
// The first surface is a mirror or transmits light.
const SURFACE_SPECULAR: u32 = 0x20000u;
const SURFACE_LAMBERT: u32 = 0x40000u;

struct VisiblePoint {
    // World (m).
    position: vec3f,
    // Distance to the camera (m); below 0: the point is seen by way of others.
    depth: f32,
    normal_geometric: vec3f,
    brdf: Brdf,
    // Unit, towards the eye.
    to_eye: vec3f,
    // See `gathers`.
    gatherable: bool,
    valid: bool,
}

// Base colour in 11, 11 and 10 bits, spaced as its square root: steps of 0.1 % of white near black.
fn base_color_encode(color: vec3f) -> u32 {
    let s = vec3u(round(sqrt(saturate(color)) * vec3f(2047.0, 2047.0, 1023.0)));
    return s.x | (s.y << 11u) | (s.z << 22u);
}

fn base_color_decode(bits: u32) -> vec3f {
    let s = vec3f(f32(bits & 2047u), f32((bits >> 11u) & 2047u), f32(bits >> 22u)) / vec3f(2047.0, 2047.0, 1023.0);
    return s * s;
}

fn surface_encode(brdf: Brdf, normal_geometric: vec3f, specular: bool) -> vec4u {
    var bits = SURFACE_VALID | u32(round(saturate(brdf.roughness) * 255.0)) | (u32(round(saturate(brdf.metallic) * 255.0)) << 8u)
        | (u32(round(saturate(brdf.f0 * 4.0) * 255.0)) << 24u);
    bits |= select(0u, SURFACE_SPECULAR, specular) | select(0u, SURFACE_LAMBERT, brdf.lambert);
    return vec4u(octahedral_encode(brdf.normal), octahedral_encode(normal_geometric), base_color_encode(brdf.base_color), bits);
}

// Whether a surface is there, and light can be gathered at it: it is neither a mirror nor does it transmit.
fn gathers(surface: vec4u) -> bool {
    return (surface.w & (SURFACE_VALID | SURFACE_SPECULAR)) == SURFACE_VALID;
}

// A unit direction as a negative number: octahedral, two components of 14 bits; error below 3e-4 rad. Bit 29 keeps it a normal number, which
// textures leave as it is.
fn to_eye_encode(direction: vec3f) -> f32 {
    let bits = bitcast<i32>(octahedral_encode(direction));
    let wide = vec2i(extractBits(bits, 0u, 16u), extractBits(bits, 16u, 16u));
    let narrow = bitcast<vec2u>(clamp((wide + 2) >> vec2u(2u), vec2i(-8191), vec2i(8191))) & vec2u(0x3fffu);
    return bitcast<f32>(0xa0000000u | narrow.x | (narrow.y << 14u));
}

fn to_eye_decode(code: f32) -> vec3f {
    let bits = bitcast<i32>(code);
    let wide = bitcast<vec2u>(vec2i(extractBits(bits, 0u, 14u), extractBits(bits, 14u, 14u)) * 4);
    return octahedral_decode((wide.x & 0xffffu) | (wide.y << 16u));
}

fn visible_point(position: vec4f, surface: vec4u, camera_position_world: vec3f) -> VisiblePoint {
    var point: VisiblePoint;
    point.position = position.xyz;
    point.depth = position.w;
    point.normal_geometric = octahedral_decode(surface.y);
    point.brdf.normal = octahedral_decode(surface.x);
    point.brdf.base_color = base_color_decode(surface.z);
    point.brdf.roughness = f32(surface.w & 0xffu) / 255.0;
    point.brdf.metallic = f32((surface.w >> 8u) & 0xffu) / 255.0;
    point.brdf.f0 = f32(surface.w >> 24u) / 1020.0;
    point.brdf.lambert = (surface.w & SURFACE_LAMBERT) != 0u;
    // Light is gathered where nothing is transmitted, as in shared/surface.wgsl.
    point.brdf.phong = SCENE_PHONG;
    point.to_eye = select(normalize(camera_position_world - position.xyz), to_eye_decode(position.w), position.w < 0.0);
    point.valid = (surface.w & SURFACE_VALID) != 0u;
    point.gatherable = gathers(surface);
    return point;
}
