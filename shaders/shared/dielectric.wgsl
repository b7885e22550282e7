// Dielectric interfaces: smooth ones by Fresnel's and Snell's laws, rough ones of GGX facets [Walter07], drawn by visible normals
// [Heitz18].
//
// A solid's interface refracts. A thin wall, both faces at once, does not: light that passes leaves as the mirror image of what is
// reflected (KHR_materials_transmission), and the reflections between its faces are added up.
//
// Radiance and flux cross a solid's interface by different factors: solid angles are compressed by η², radiance grows with them and flux
// does not [Veach97, §5.2]. Paths from the eye carry radiance and photons carry flux: `radiance` says which is meant.
//
// Facets are met once, light that would meet several is lost: of what meets a solid head-on from outside 1 % at α = ¼ and 11 % at α = 1,
// from inside 7 % and 58 %, in glass of n = 1.5.
//
// [Walter07]: "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007
#import "shared/math.wgsl"
#import "shared/brdf.wgsl"

// Solids whose index of refraction is nearer to that outside bend light by less than a hundredth of a facet's tilt: they are smooth.
const MIN_CONTRAST: f32 = 0.01;

struct Dielectric {
    // Unit, on the side of ω_o.
    normal: vec3f,
    // Of GGX; only for rough ones.
    alpha: f32,
    // Index of refraction beyond the interface over that on the side of ω_o; of a thin wall: inside over outside.
    eta: f32,
    thin: bool,
    // Share of the light that passes, where it is not reflected.
    tint: vec3f,
}

struct DielectricSample {
    direction: vec3f,
    // What remains of the flux or radiance.
    weight: vec3f,
}

struct Response {
    // f · |cos θ_i|.
    value: vec3f,
    // Density (sr⁻¹) with which ω_i is drawn.
    pdf: f32,
}

// Fresnel reflectance of an interface; `eta` = n_transmitted / n_incident. 1 in total internal reflection.
fn fresnel_dielectric(cos_i: f32, eta: f32) -> f32 {
    let sin2_t = (1.0 - cos_i * cos_i) / (eta * eta);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let cos_t = sqrt(1.0 - sin2_t);
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    return 0.5 * (parallel * parallel + perpendicular * perpendicular);
}

// Share that is reflected; of a thin wall R + RT² + R³T² … = 2R / (1 + R).
fn dielectric_reflectance(d: Dielectric, cos_o: f32) -> f32 {
    let r = fresnel_dielectric(cos_o, d.eta);
    return select(r, 2.0 * r / (1.0 + r), d.thin);
}

// Where light that passes a facet `h` goes on; there is no total reflection.
fn dielectric_transmitted(d: Dielectric, wo: vec3f, h: vec3f) -> vec3f {
    let cos_o = dot(wo, h);
    if d.thin {
        let reflected = reflect(-wo, h);
        return reflected - d.normal * (2.0 * dot(d.normal, reflected));
    }
    let sin2_t = (1.0 - cos_o * cos_o) / (d.eta * d.eta);
    return normalize(-wo / d.eta + h * (cos_o / d.eta - sqrt(max(0.0, 1.0 - sin2_t))));
}

// Factor of what passes.
fn dielectric_transmittance(d: Dielectric, radiance: bool) -> vec3f {
    return d.tint * select(1.0, 1.0 / (d.eta * d.eta), radiance && !d.thin);
}

fn smooth_dielectric_sample(d: Dielectric, wo: vec3f, u: f32, radiance: bool) -> DielectricSample {
    // Edge-on, rounding may put ω_o below the surface.
    let cos_o = max(dot(d.normal, wo), 1.0e-6);
    if u < dielectric_reflectance(d, cos_o) {
        return DielectricSample(reflect(-wo, d.normal), vec3f(1.0));
    }
    if d.thin {
        return DielectricSample(-wo, d.tint);
    }
    return DielectricSample(dielectric_transmitted(d, wo, d.normal), dielectric_transmittance(d, radiance));
}

// Draws a direction; see `rough_dielectric` for its weight. Zero where a facet sends light to the wrong side, which would need another
// facet: such light is lost.
fn rough_dielectric_sample(d: Dielectric, wo: vec3f, u: vec3f) -> vec3f {
    let frame = tangent_frame(d.normal);
    let h = frame * sample_visible_normal(wo * frame, d.alpha, u.xy);
    if u.z < dielectric_reflectance(d, dot(wo, h)) {
        let reflected = reflect(-wo, h);
        return select(vec3f(0.0), reflected, dot(d.normal, reflected) > 0.0);
    }
    let transmitted = dielectric_transmitted(d, wo, h);
    return select(vec3f(0.0), transmitted, dot(d.normal, transmitted) < 0.0);
}

// Scattering of light that comes from ω_i towards ω_o (radiance), or of a photon that came from ω_o and goes on to ω_i (flux).
//
// Reflection is F D G / (4 |cos θ_i| |cos θ_o|), refraction [Walter07, Eq. 21]. Both are written as the density of ω_i times G(ω_i, ω_o) / G₁(ω_o),
// what a facet seen from ω_o keeps of the light. G of reflection is correlated by height, as in shared/brdf.wgsl, that of refraction
// is the product of both sides [Walter07, Eq. 23].
fn rough_dielectric(d: Dielectric, wi: vec3f, wo: vec3f, radiance: bool) -> Response {
    let nothing = Response(vec3f(0.0), 0.0);
    let cos_o = dot(d.normal, wo);
    let cos_i = dot(d.normal, wi);
    if cos_o <= 0.0 || cos_i == 0.0 {
        return nothing;
    }
    let reflects = cos_i > 0.0;
    // A thin wall's transmission is its reflection, mirrored.
    let folded = wi - d.normal * select(0.0, 2.0 * cos_i, d.thin && !reflects);
    let unsided = normalize(wo + folded * select(d.eta, 1.0, d.thin || reflects));
    let h = select(-unsided, unsided, dot(d.normal, unsided) > 0.0);
    let facet_o = dot(wo, h);
    let facet_i = dot(folded, h);
    // A facet shows the same side to both, or, refracting, one to each.
    if facet_o <= 0.0 || (facet_i > 0.0) != (d.thin || reflects) {
        return nothing;
    }
    let reflectance = dielectric_reflectance(d, facet_o);
    let share = select(1.0 - reflectance, reflectance, reflects);
    let visible = ggx_visible_density(d.alpha, cos_o, d.normal, h);
    let seen_o = ggx_masking(d.alpha, cos_o);
    let seen_i = ggx_masking(d.alpha, abs(cos_i));
    if d.thin || reflects {
        let pdf = share * visible * 0.25;
        let kept = seen_i / (seen_o + seen_i - seen_o * seen_i);
        return Response(select(dielectric_transmittance(d, radiance), vec3f(1.0), reflects) * (pdf * kept), pdf);
    }
    // [Walter07, Eq. 17], divided by n_o².
    let root = facet_o + d.eta * facet_i;
    let pdf = share * visible * facet_o * (d.eta * d.eta * -facet_i / (root * root));
    return Response(dielectric_transmittance(d, radiance) * (pdf * seen_i), pdf);
}
