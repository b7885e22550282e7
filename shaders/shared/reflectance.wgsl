// What a surface reflects of light from everywhere: the number by which light before reflection and after it differ, about.
#import "shared/brdf.wgsl"

// Directional-hemispherical reflectance towards `to_eye`; for GGX a fit of its integral [Karis14].
//
// [Karis14]: Karis, "Physically based shading on mobile", 2014.
fn reflectance(brdf: Brdf, to_eye: vec3f) -> vec3f {
    if brdf.lambert || !SCENE_GLOSSY {
        return brdf.base_color;
    }
    let cos_o = saturate(dot(brdf.normal, to_eye));
    let r = brdf.roughness * vec4f(-1.0, -0.0275, -0.572, 0.022) + vec4f(1.0, 0.0425, 1.04, -0.04);
    let a = min(r.x * r.x, exp2(-9.28 * cos_o)) * r.x + r.y;
    let glossy = vec2f(-1.04, 1.04) * a + r.zw;
    let f0 = mix(vec3f(brdf.f0), brdf.base_color, brdf.metallic);
    let diffuse = brdf.base_color * ((1.0 - brdf.metallic) * (1.0 - brdf.f0));
    return diffuse + saturate(f0 * glossy.x + glossy.y);
}
