// The surface a ray met, and how it scatters: opaque reflection, mirrors, dielectrics.
//
// A share `transmission` of the light meets a dielectric, the rest is reflected by `brdf`. Mirrors and smooth dielectrics scatter into
// single directions (`Scatter.specular`): no light can be connected to them, and no density estimated there. Rough dielectrics are not
// specular: on both sides `surface_response` takes light from any direction, so paths from the eye sample lights there, with multiple
// importance sampling, and a photon ends its caustic there and leaves a record as on any diffuse surface. The record is for kernels
// that reach over from a diffuse surface beside it, and for connections to the eye (passes/photon_splat.wgsl).
//
// The G-buffer holds `brdf` alone. Pixels whose first surface is a mirror or transmits, roughly or not, are not gathered at
// (`surface_gatherable`) but path-traced (passes/specular_pixels.wgsl).
#import "shared/math.wgsl"
#import "shared/brdf.wgsl"
#import "shared/dielectric.wgsl"
#import "shared/hit.wgsl"
#import "shared/texture.wgsl"

// A metal smoother than this is a mirror.
const MIRROR_ROUGHNESS: f32 = 0.03;
// What is less of a metal than this is none.
const MIRROR_METALLIC: f32 = 0.95;
// Bit of Material.flags: Lambert whatever the factors say.
const MATERIAL_LAMBERT: u32 = 1u;
// Bit of Material.flags: emits from its back side too.
const MATERIAL_TWO_SIDED: u32 = 2u;
const NO_LIGHT: u32 = 0xffffffffu;

struct Surface {
    position: vec3f,
    // Geometric normal on the side the ray came from.
    normal_geometric: vec3f,
    // The ray met the front (counter-clockwise) side.
    front: bool,
    brdf: Brdf,
    // Emitted radiance towards the ray's origin (W·m⁻²·sr⁻¹).
    emission: vec3f,
    // Fraction of light that refraction takes in place of diffuse reflection.
    transmission: f32,
    ior: f32,
    // 0: thin-walled.
    thickness: f32,
    // σ_a of the inside (m⁻¹).
    absorption: vec3f,
    // What is transmitted passes a rough interface.
    rough_dielectric: bool,
    // Smooth metal.
    mirror: bool,
    // Index into `lights` when it emits, else NO_LIGHT.
    light: u32,
    // Edges of the triangle (m) and how its interpolated normal changes along them, on the side of `brdf.normal`.
    edge1: vec3f,
    edge2: vec3f,
    normal_edge1: vec3f,
    normal_edge2: vec3f,
}

struct Scatter {
    direction: vec3f,
    // What remains of the flux or radiance; 0 ends the path.
    weight: vec3f,
    // Per solid angle (sr⁻¹), of all draws that are not specular; 0 for a specular event.
    pdf: f32,
    specular: bool,
    // Not specular, and drawn from the glossy lobe.
    glossy: bool,
}

fn surface_at(hit: Hit, direction: vec3f) -> Surface {
    let triangle = bvh_triangles[hit.index];
    let attributes = triangles[triangle.id & ~ALPHA_TESTED];
    let material = materials[triangle.material];
    let uv = triangle_uv(attributes, hit.uv);

    var surface: Surface;
    let edge1 = triangle.v1 - triangle.v0;
    let edge2 = triangle.v2 - triangle.v0;
    surface.position = triangle.v0 + edge1 * hit.uv.x + edge2 * hit.uv.y;
    let geometric = normalize(cross(edge1, edge2));
    surface.front = dot(geometric, direction) < 0.0;
    surface.normal_geometric = select(-geometric, geometric, surface.front);

    let normal0 = octahedral_decode(attributes.normals.x);
    surface.edge1 = edge1;
    surface.edge2 = edge2;
    surface.normal_edge1 = octahedral_decode(attributes.normals.y) - normal0;
    surface.normal_edge2 = octahedral_decode(attributes.normals.z) - normal0;
    let interpolated = normal0 + surface.normal_edge1 * hit.uv.x + surface.normal_edge2 * hit.uv.y;
    var normal = normalize(interpolated);
    let to_unit = select(1.0, -1.0, dot(normal, direction) > 0.0) / length(interpolated);
    surface.normal_edge1 = (surface.normal_edge1 - normal * dot(normal, surface.normal_edge1)) * to_unit;
    surface.normal_edge2 = (surface.normal_edge2 - normal * dot(normal, surface.normal_edge2)) * to_unit;
    if SCENE_TEXTURES && material.normal_texture.first_texel != NO_TEXTURE {
        normal = mapped_normal(triangle, attributes, material, uv, normal);
    }
    // Surfaces are two-sided: the shading normal is turned to the viewer.
    normal = select(normal, -normal, dot(normal, direction) > 0.0);

    let metal_rough = sample_texture(material.metallic_roughness_texture, uv, false);
    surface.brdf.normal = normal;
    surface.brdf.base_color = material.base_color.rgb * sample_texture(material.base_color_texture, uv, true).rgb;
    surface.brdf.roughness = material.roughness * metal_rough.g;
    surface.brdf.metallic = material.metallic * metal_rough.b;
    let f = (material.ior - 1.0) / (material.ior + 1.0);
    surface.brdf.f0 = f * f;
    surface.brdf.lambert = (material.flags & MATERIAL_LAMBERT) != 0u;
    surface.brdf.phong = SCENE_PHONG && material.transmission == 0.0;

    surface.emission = vec3f(0.0);
    if (surface.front || (material.flags & MATERIAL_TWO_SIDED) != 0u) && triangle.light != NO_LIGHT {
        surface.emission = material.emissive * sample_texture(material.emissive_texture, uv, true).rgb;
    }
    surface.light = triangle.light;
    surface.transmission = material.transmission;
    surface.ior = material.ior;
    surface.thickness = material.thickness;
    surface.absorption = material.absorption;
    let facets = SCENE_ROUGH_REFRACTION && surface.brdf.roughness * surface.brdf.roughness >= MIN_ALPHA;
    let bends = material.thickness <= 0.0 || material.ior >= 1.0 + MIN_CONTRAST;
    surface.rough_dielectric = facets && bends && material.transmission > 0.0;
    surface.mirror = SCENE_GLOSSY && surface.brdf.metallic >= MIRROR_METALLIC && surface.brdf.roughness <= MIRROR_ROUGHNESS;
    return surface;
}

// Change of the interpolated normal along `step` (m, in the plane of the triangle); a normal map's own bumps are left out.
fn surface_normal_derivative(surface: Surface, step: vec3f) -> vec3f {
    let e11 = dot(surface.edge1, surface.edge1);
    let e12 = dot(surface.edge1, surface.edge2);
    let e22 = dot(surface.edge2, surface.edge2);
    let s1 = dot(step, surface.edge1);
    let s2 = dot(step, surface.edge2);
    let det = e11 * e22 - e12 * e12;
    if det <= 0.0 {
        return vec3f(0.0);
    }
    return (surface.normal_edge1 * (s1 * e22 - s2 * e12) + surface.normal_edge2 * (s2 * e11 - s1 * e12)) / det;
}

// Tangent-space normal map; the tangent follows the texture coordinates of the triangle.
fn mapped_normal(triangle: BvhTriangle, attributes: TriangleAttributes, material: Material, uv: vec2f, normal: vec3f) -> vec3f {
    let d1 = attributes.uv1 - attributes.uv0;
    let d2 = attributes.uv2 - attributes.uv0;
    let det = d1.x * d2.y - d1.y * d2.x;
    if abs(det) < 1.0e-20 {
        return normal;
    }
    let tangent = ((triangle.v1 - triangle.v0) * d2.y - (triangle.v2 - triangle.v0) * d1.y) / det;
    let flat_tangent = tangent - normal * dot(normal, tangent);
    let length2 = dot(flat_tangent, flat_tangent);
    if length2 < 1.0e-20 {
        return normal;
    }
    let t = flat_tangent * inverseSqrt(length2);
    // glTF's v runs down the image: the bitangent of ∂p/∂v is turned to keep the handedness of (t, b, n).
    let b = cross(normal, t) * sign(det);
    let texel = sample_texture(material.normal_texture, uv, false).xyz * 2.0 - 1.0;
    let scaled = vec3f(texel.xy * material.normal_scale, texel.z);
    return normalize(t * scaled.x - b * scaled.y + normal * scaled.z);
}

// Share of the light that is scattered into more than single directions. 0: wholly specular, no light can be connected to it
// and no density estimated on it.
fn surface_opacity(surface: Surface) -> f32 {
    if SCENE_ROUGH_REFRACTION && surface.rough_dielectric {
        return 1.0;
    }
    return select(1.0 - surface.transmission, 0.0, surface.mirror);
}

// `brdf` says all of how the surface scatters.
fn surface_gatherable(surface: Surface) -> bool {
    return !surface.mirror && surface.transmission == 0.0;
}

fn surface_dielectric(surface: Surface) -> Dielectric {
    let thin = surface.thickness <= 0.0;
    let eta = select(1.0 / surface.ior, surface.ior, thin || surface.front);
    return Dielectric(surface.brdf.normal, brdf_alpha(surface.brdf), eta, thin, surface.brdf.base_color);
}

// All that is scattered from ω_i to ω_o but for what leaves in single directions, and the density with which `scatter` draws ω_i, of either
// kind; `radiance` as in shared/dielectric.wgsl.
fn surface_response(surface: Surface, wi: vec3f, wo: vec3f, radiance: bool) -> Response {
    let cos_i = dot(surface.brdf.normal, wi);
    var response = Response(vec3f(0.0), 0.0);
    // Shading normals can send light through the surface: such directions are lost.
    if cos_i * dot(surface.normal_geometric, wi) <= 0.0 || (SCENE_GLOSSY && surface.mirror) {
        return response;
    }
    if cos_i > 0.0 {
        response = Response(brdf_eval(surface.brdf, wi, wo) * cos_i, brdf_pdf(surface.brdf, wi, wo));
    }
    if SCENE_REFRACTS {
        let opaque_share = 1.0 - surface.transmission;
        response = Response(response.value * opaque_share, response.pdf * opaque_share);
        if SCENE_ROUGH_REFRACTION && surface.rough_dielectric {
            let passed = rough_dielectric(surface_dielectric(surface), wi, wo, radiance);
            response.value += passed.value * surface.transmission;
            response.pdf += passed.pdf * surface.transmission;
        }
    }
    return response;
}

// Draws where light goes on, from four uniform numbers. `wo` points to where the path came from.
fn scatter(surface: Surface, wo: vec3f, u: vec4f, radiance: bool) -> Scatter {
    let transmits = SCENE_REFRACTS && u.w < surface.transmission;
    if SCENE_ROUGH_REFRACTION && surface.rough_dielectric {
        var drawn = BrdfSample(vec3f(0.0), vec3f(0.0), 0.0, true);
        if transmits {
            drawn.direction = rough_dielectric_sample(surface_dielectric(surface), wo, u.xyz);
        } else {
            drawn = brdf_sample(surface.brdf, wo, u.xyz);
            // What is reflected into the surface is lost, and must not count as transmitted.
            drawn.direction = select(vec3f(0.0), drawn.direction, dot(surface.brdf.normal, drawn.direction) > 0.0);
        }
        // Either lobe may have drawn it.
        let response = surface_response(surface, drawn.direction, wo, radiance);
        let kept = response.pdf > 0.0 && dot(wo, surface.normal_geometric) > 0.0;
        let weight = select(vec3f(0.0), response.value / max(response.pdf, 1.0e-20), kept);
        return Scatter(drawn.direction, weight, response.pdf, false, drawn.glossy);
    }
    if transmits {
        let drawn = smooth_dielectric_sample(surface_dielectric(surface), wo, u.x, radiance);
        return Scatter(drawn.direction, drawn.weight, 0.0, true, false);
    }
    if SCENE_GLOSSY && surface.mirror {
        let cos_o = dot(surface.brdf.normal, wo);
        return Scatter(reflect(-wo, surface.brdf.normal), schlick(surface.brdf.base_color, cos_o), 0.0, true, false);
    }
    let drawn = brdf_sample(surface.brdf, wo, u.xyz);
    let kept = dot(drawn.direction, surface.normal_geometric) > 0.0 && dot(wo, surface.normal_geometric) > 0.0;
    let pdf = drawn.pdf * select(1.0, 1.0 - surface.transmission, SCENE_REFRACTS);
    return Scatter(drawn.direction, select(vec3f(0.0), drawn.weight, kept), pdf, false, drawn.glossy);
}

// Origin for a ray that leaves the surface in `direction`.
fn surface_exit(surface: Surface, direction: vec3f) -> vec3f {
    let side = select(-1.0, 1.0, dot(direction, surface.normal_geometric) >= 0.0);
    return offset_origin(surface.position, surface.normal_geometric * side);
}
