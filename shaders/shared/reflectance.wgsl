// The share of even light from all around that a surface reflects to the eye, by which radiance is divided before it is filtered.
#import "shared/brdf.wgsl"

// Of Lambertian surfaces the base colour. Of glTF's model what is not metal likewise, less the dielectric's reflection at normal
// incidence, and the specular part by the fit of [Karis14], "Physically Based Shading on Mobile"; [MML13]'s model (shared/brdf.wgsl) is near
// enough to it, for what is divided is multiplied again.
fn reflectance(brdf: Brdf, to_eye: vec3f) -> vec3f {
    if brdf.lambert || !SCENE_GLOSSY {
        return brdf.base_color;
    }
    let f0 = brdf_f0(brdf);
    let r = brdf.roughness * vec4f(-1.0, -0.0275, -0.572, 0.022) + vec4f(1.0, 0.0425, 1.04, -0.04);
    let a = min(r.x * r.x, exp2(-9.28 * saturate(dot(brdf.normal, to_eye)))) * r.x + r.y;
    let specular = max(f0 * (r.z - 1.04 * a) + (r.w + 1.04 * a), vec3f(0.0));
    return brdf.base_color * ((1.0 - brdf.metallic) * (1.0 - brdf.f0)) + specular;
}
