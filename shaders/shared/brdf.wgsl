// Reflection at one point: Lambert, and glTF 2.0's metallic-roughness model (GGX with height-correlated Smith masking,
// Schlick's Fresnel; glTF 2.0 appendix B). Directions point away from the surface; `f` is in sr⁻¹, without the cosine.
//
// In scenes that ask for it (SCENE_PHONG) the model of [MML13, Eq. 6 to 8] stands in for glTF's: with the same F₀, colours and roughness,
//     F = F₀ + (1 − F₀)(1 − max(0, ω_h·ω_i))⁵,    f = ρ_L/π + (8 + s) F/(8π) max(0, ω_h·n)ˢ,    ρ_L = base colour (1 − metallic).
// Nothing masks the lobe and the diffuse part does not give way to it: a white surface reflects up to 1 + F of the light, and some lobes
// alone more than 1 at grazing angles.
//
// [MML13]: "Toward Practical Real-Time Photon Mapping: Efficient GPU Density Estimation", I3D 2013.
#import "shared/blinn_phong.wgsl"
#import "shared/math.wgsl"
#import "shared/scene_traits.wgsl"

struct Brdf {
    // Shading normal, on the side of the viewer.
    normal: vec3f,
    base_color: vec3f,
    roughness: f32,
    metallic: f32,
    // Reflectance of the dielectric at normal incidence.
    f0: f32,
    // Plain Lambert: metallic 0 and roughness 1 without a texture for them.
    lambert: bool,
    // [MML13]'s model; only in scenes of SCENE_PHONG.
    phong: bool,
}

struct BrdfSample {
    direction: vec3f,
    // f · |cos θ| / pdf.
    weight: vec3f,
    // Per solid angle (sr⁻¹).
    pdf: f32,
    // Drawn from the glossy lobe.
    glossy: bool,
}

// GGX narrower than this (α = roughness²) is noise in every estimator that is not a mirror.
const MIN_ALPHA: f32 = 1.0e-3;

fn schlick(f0: vec3f, cos_theta: f32) -> vec3f {
    let c = clamp(1.0 - cos_theta, 0.0, 1.0);
    let c2 = c * c;
    return f0 + (1.0 - f0) * (c2 * c2 * c);
}

// Reflectance at normal incidence.
fn brdf_f0(brdf: Brdf) -> vec3f {
    return mix(vec3f(brdf.f0), brdf.base_color, brdf.metallic);
}

fn brdf_alpha(brdf: Brdf) -> f32 {
    return max(brdf.roughness * brdf.roughness, MIN_ALPHA);
}

// Density of facets `h` about the normal `n`. The sine comes from the cross product: 1 − cos² in floats, 10⁻⁷ off, is a tenth of the α² of
// the narrowest lobe.
fn ggx_distribution(alpha: f32, n: vec3f, h: vec3f) -> f32 {
    let a2 = alpha * alpha;
    let cos_h = dot(n, h);
    let across = cross(n, h);
    let d = dot(across, across) + a2 * cos_h * cos_h;
    return a2 / (PI * d * d);
}

// Smith's masking of one direction: 1 / (1 + Λ).
fn ggx_masking(alpha: f32, cos_theta: f32) -> f32 {
    let a2 = alpha * alpha;
    return 2.0 * cos_theta / (cos_theta + sqrt(a2 + (1.0 - a2) * cos_theta * cos_theta));
}

// Density (sr⁻¹) of the normals visible from the direction that has `cos_o` with the surface, over its cosine with them [Heitz18].
fn ggx_visible_density(alpha: f32, cos_o: f32, n: vec3f, h: vec3f) -> f32 {
    return ggx_masking(alpha, cos_o) * ggx_distribution(alpha, n, h) / cos_o;
}

fn brdf_eval(brdf: Brdf, wi: vec3f, wo: vec3f) -> vec3f {
    let cos_i = dot(brdf.normal, wi);
    let cos_o = dot(brdf.normal, wo);
    if cos_i <= 0.0 || cos_o <= 0.0 {
        return vec3f(0.0);
    }
    if brdf.lambert || !SCENE_GLOSSY {
        return brdf.base_color * (1.0 / PI);
    }
    let h = normalize(wi + wo);
    let alpha = brdf_alpha(brdf);
    let a2 = alpha * alpha;
    let cos_d = dot(wo, h);
    if SCENE_PHONG && brdf.phong {
        let exponent = blinn_phong_exponent(alpha);
        let lobe = blinn_phong_scale(exponent) * blinn_phong_lobe(exponent, brdf.normal, h);
        return brdf.base_color * ((1.0 - brdf.metallic) / PI) + schlick(brdf_f0(brdf), cos_d) * lobe;
    }
    let visibility = 0.5 / (cos_i * sqrt(a2 + (1.0 - a2) * cos_o * cos_o) + cos_o * sqrt(a2 + (1.0 - a2) * cos_i * cos_i));
    let specular = schlick(brdf_f0(brdf), cos_d)
        * (ggx_distribution(alpha, brdf.normal, h) * visibility);
    let diffuse = brdf.base_color * ((1.0 - brdf.metallic) * (1.0 - schlick(vec3f(brdf.f0), cos_d).x) / PI);
    return diffuse + specular;
}

// Probability with which the glossy lobe is sampled.
fn brdf_glossy_probability(brdf: Brdf, wo: vec3f) -> f32 {
    if brdf.lambert || !SCENE_GLOSSY {
        return 0.0;
    }
    let fresnel = schlick(brdf_f0(brdf), max(0.0, dot(brdf.normal, wo)));
    let glossy = mean_component(fresnel);
    let diffuse = (1.0 - brdf.metallic) * mean_component(brdf.base_color) * (1.0 - brdf.f0);
    return clamp(glossy / max(glossy + diffuse, 1.0e-6), 0.1, select(0.9, 1.0, diffuse == 0.0));
}

fn brdf_pdf(brdf: Brdf, wi: vec3f, wo: vec3f) -> f32 {
    let cos_i = dot(brdf.normal, wi);
    let cos_o = dot(brdf.normal, wo);
    if cos_i <= 0.0 || cos_o <= 0.0 {
        return 0.0;
    }
    let p = brdf_glossy_probability(brdf, wo);
    var pdf = (1.0 - p) * cos_i / PI;
    if p > 0.0 {
        let h = normalize(wi + wo);
        let alpha = brdf_alpha(brdf);
        if SCENE_PHONG && brdf.phong {
            pdf += p * blinn_phong_density(blinn_phong_exponent(alpha), brdf.normal, h, wo);
        } else {
            // The Jacobian of reflection is 4 (ω_o·h).
            pdf += p * 0.25 * ggx_visible_density(alpha, cos_o, brdf.normal, h);
        }
    }
    return pdf;
}

// Normal visible from `wo` (local frame, z up) [Heitz18], "Sampling the GGX Distribution of Visible Normals".
fn sample_visible_normal(wo: vec3f, alpha: f32, u: vec2f) -> vec3f {
    let v = normalize(vec3f(alpha * wo.xy, wo.z));
    let d = sample_disc(u);
    let s = 0.5 * (1.0 + v.z);
    // The visible half of the projected hemisphere: the axis of the squeeze lies in the plane of v and z.
    let across = cross(vec3f(0.0, 0.0, 1.0), v);
    let length2 = dot(across, across);
    let t1 = select(vec3f(1.0, 0.0, 0.0), across * inverseSqrt(max(length2, 1.0e-30)), length2 > 1.0e-12);
    let t2 = cross(v, t1);
    let p1 = d.x;
    let p2 = mix(sqrt(max(0.0, 1.0 - d.x * d.x)), d.y, s);
    let n = p1 * t1 + p2 * t2 + sqrt(max(0.0, 1.0 - p1 * p1 - p2 * p2)) * v;
    return normalize(vec3f(alpha * n.xy, max(1.0e-6, n.z)));
}

// Draws a direction; the weight is zero where the drawn direction cannot be reflected into.
fn brdf_sample(brdf: Brdf, wo: vec3f, u: vec3f) -> BrdfSample {
    let frame = tangent_frame(brdf.normal);
    let p = brdf_glossy_probability(brdf, wo);
    let glossy = SCENE_GLOSSY && u.z < p;
    var wi: vec3f;
    if glossy {
        let alpha = brdf_alpha(brdf);
        var h: vec3f;
        if SCENE_PHONG && brdf.phong {
            h = sample_blinn_phong(blinn_phong_exponent(alpha), u.xy);
        } else {
            h = sample_visible_normal(wo * frame, alpha, u.xy);
        }
        wi = reflect(-wo, frame * h);
    } else {
        wi = frame * sample_cosine_hemisphere(u.xy);
    }
    if brdf.lambert || !SCENE_GLOSSY {
        return BrdfSample(wi, brdf.base_color, max(dot(brdf.normal, wi), 0.0) / PI, false);
    }
    let pdf = brdf_pdf(brdf, wi, wo);
    let weight = brdf_eval(brdf, wi, wo) * (dot(brdf.normal, wi) / max(pdf, 1.0e-20));
    return BrdfSample(wi, select(vec3f(0.0), weight, pdf > 0.0), pdf, glossy);
}
