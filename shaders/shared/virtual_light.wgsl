// Virtual point lights [Keller97]: vertices of light paths that send on what they reflect. A vertex of flux Φ that light reached from ω_Φ has
// the radiant intensity
//
//   I(ω) = Φ f(ω_Φ, ω) |ω·n_s| · |ω_Φ·n_s ω·n_g| / |ω_Φ·n_g ω·n_s|   (W·sr⁻¹),
//
// the very density by which shared/surface.wgsl scatters photons: on Lambertian surfaces (ρ/π) Φ max(0, n·ω).
//
// [Keller97]: "Instant Radiosity", SIGGRAPH 1997.
#import "shared/gbuffer.wgsl"
#import "shared/photon.wgsl"
#import "shared/shading_normal.wgsl"
#import "shared/surface.wgsl"

// A vertex with all that its surface is made of, 48 bytes.
struct VirtualLight {
    // World (m).
    position: vec3f,
    // W, as in Photon. 0: no light.
    flux: u32,
    // Of travel of the light that lights it; normals on the side it came from. Octahedral.
    direction: u32,
    normal: u32,
    normal_geometric: u32,
    // LIGHT_… bits.
    flags: u32,
    // Pairs of unorm16: red and green, blue and transmission, roughness and metallic.
    base_red_green: u32,
    base_blue_transmission: u32,
    roughness_metallic: u32,
    ior: f32,
}

// How many lights a frame has that wants `wanted` and stored as many vertices.
fn light_count(wanted: u32, stored: u32) -> u32 {
    return min(wanted, stored);
}

// Vertices for which each of them stands.
fn light_weight(wanted: u32, stored: u32) -> f32 {
    return f32(stored) / f32(max(light_count(wanted, stored), 1u));
}

// As in Surface.
const LIGHT_LAMBERT: u32 = 1u;
const LIGHT_FRONT: u32 = 2u;
const LIGHT_THIN: u32 = 4u;
const LIGHT_ROUGH_DIELECTRIC: u32 = 8u;

fn virtual_light(surface: Surface, flux: u32, direction: u32) -> VirtualLight {
    let flags = select(0u, LIGHT_LAMBERT, surface.brdf.lambert) | select(0u, LIGHT_FRONT, surface.front)
        | select(0u, LIGHT_THIN, surface.thickness <= 0.0) | select(0u, LIGHT_ROUGH_DIELECTRIC, surface.rough_dielectric);
    let base = surface.brdf.base_color;
    return VirtualLight(
        surface.position,
        flux,
        direction,
        octahedral_encode(surface.brdf.normal),
        octahedral_encode(surface.normal_geometric),
        flags,
        pack2x16unorm(base.rg),
        pack2x16unorm(vec2f(base.b, surface.transmission)),
        pack2x16unorm(vec2f(surface.brdf.roughness, surface.brdf.metallic)),
        surface.ior,
    );
}

fn virtual_surface(light: VirtualLight) -> Surface {
    let blue_transmission = unpack2x16unorm(light.base_blue_transmission);
    let roughness_metallic = unpack2x16unorm(light.roughness_metallic);
    let f = (light.ior - 1.0) / (light.ior + 1.0);
    var surface: Surface;
    surface.position = light.position;
    surface.normal_geometric = octahedral_decode(light.normal_geometric);
    surface.front = (light.flags & LIGHT_FRONT) != 0u;
    surface.brdf.normal = octahedral_decode(light.normal);
    surface.brdf.base_color = vec3f(unpack2x16unorm(light.base_red_green), blue_transmission.x);
    surface.brdf.roughness = roughness_metallic.x;
    surface.brdf.metallic = roughness_metallic.y;
    surface.brdf.f0 = f * f;
    surface.brdf.lambert = (light.flags & LIGHT_LAMBERT) != 0u;
    surface.brdf.phong = SCENE_PHONG && blue_transmission.y == 0.0;
    surface.transmission = blue_transmission.y;
    surface.ior = light.ior;
    surface.thickness = select(1.0, 0.0, (light.flags & LIGHT_THIN) != 0u);
    surface.rough_dielectric = (light.flags & LIGHT_ROUGH_DIELECTRIC) != 0u;
    return surface;
}

// A visible point as a surface.
fn lit_surface(point: VisiblePoint) -> Surface {
    var surface: Surface;
    surface.position = point.position;
    surface.normal_geometric = point.normal_geometric;
    surface.brdf = point.brdf;
    return surface;
}

// What a light adds to a visible point, unshadowed.
struct LitBy {
    // Radiance towards the eye (W·m⁻²·sr⁻¹).
    radiance: vec3f,
    // Luminance of what the least distance took from it.
    removed: f32,
}

// E = I(ω) cos θ_x / max(r², ε²), reflected to the eye; `least2` = ε² (m²).
fn lit_by(at: Surface, to_eye: vec3f, light: VirtualLight, least2: f32) -> LitBy {
    let apart = light.position - at.position;
    let distance2 = max(dot(apart, apart), 1.0e-12);
    let towards = apart * inverseSqrt(distance2);
    let sender = virtual_surface(light);
    let incident = -octahedral_decode(light.direction);
    let sent = surface_response(sender, -towards, incident, false).value
        * flux_correction(incident, -towards, sender.brdf.normal, sender.normal_geometric);
    let reflected = surface_response(at, towards, to_eye, true).value;
    let value = flux_decode(light.flux) * sent * reflected;
    let radiance = value / max(distance2, least2);
    return LitBy(radiance, luminance(value / distance2 - radiance));
}

// The ends of the ray between both, each off its surface on the side of the other.
struct ShadowRay {
    origin: vec3f,
    // To the other end (m).
    span: vec3f,
}

fn shadow_ray(at: Surface, light: VirtualLight) -> ShadowRay {
    let apart = light.position - at.position;
    let normal = octahedral_decode(light.normal_geometric);
    let end = offset_origin(light.position, select(normal, -normal, dot(normal, apart) > 0.0));
    let origin = surface_exit(at, apart);
    return ShadowRay(origin, end - origin);
}
