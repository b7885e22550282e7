// The density estimate of [MML13], the same for every strategy: L_o = Σ Φ f κ(d) / ∫κ over the photons near a point.
//
// [MML13]: "Toward Practical Real-Time Photon Mapping: Efficient GPU Density Estimation", I3D 2013.
#import "shared/math.wgsl"
#import "shared/brdf.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/photon.wgsl"
#import "shared/shading_normal.wgsl"

// Height at which the cone kernel κ(s) = min(c, 1 − s/r) is cut.
const KERNEL_CUT: f32 = 0.2;
// Photons whose surface is turned further away than this lie on another surface: the other side of a wall, or the next
// wall of a corner.
const MIN_NORMAL_COSINE: f32 = 0.5;

// r = r_min + (r_max − r_min) √(1 − ρ) [MML13, Eq. 4] (m).
fn photon_radius(photon: Photon, r_min: f32, r_max: f32) -> f32 {
    if r_min == r_max {
        return r_max;
    }
    return r_min + (r_max - r_min) * sqrt(saturate(1.0 - photon_path_probability(photon)));
}

// ∫κ over the kernel's disc (m²).
fn kernel_integral(radius: f32) -> f32 {
    return PI * radius * radius * KERNEL_CUT * (KERNEL_CUT * KERNEL_CUT / 3.0 - KERNEL_CUT + 1.0);
}

// κ at four distances inside. Near the edge it is as coarse as the quotient of distance and radius, so that all take the same: a product with
// the inverse, which is one for many distances.
fn kernel_heights(s: vec4f, inverse_radius: f32) -> vec4f {
    let cone = 1.0 - s * inverse_radius;
    return select(cone, vec4f(KERNEL_CUT), cone > vec4f(KERNEL_CUT));
}

// κ(s) / ∫κ (m⁻²) at a distance inside.
fn kernel_density(s: f32, radius: f32) -> f32 {
    return kernel_heights(vec4f(s), 1.0 / radius).x / kernel_integral(radius);
}

// What a photon brings, whatever point it is gathered at.
struct PhotonLight {
    // Unit, towards where it came from (world).
    incident: vec3f,
    // Geometric normal of the surface it lies on (world).
    normal: vec3f,
    // W.
    flux: vec3f,
}

fn photon_light(photon: Photon) -> PhotonLight {
    return PhotonLight(-octahedral_decode(photon.direction), octahedral_decode(photon.normal), flux_decode(photon.flux));
}

// Radiance (W·m⁻²·sr⁻¹) that a photon at the squared distance `distance2` (m²) adds to what leaves `point` towards the eye.
fn light_contribution(point: VisiblePoint, light: PhotonLight, distance2: f32, radius: f32) -> vec3f {
    let cos_geometric = dot(light.incident, point.normal_geometric);
    let counts = distance2 < radius * radius && cos_geometric > 0.0 && dot(light.normal, point.normal_geometric) >= MIN_NORMAL_COSINE;
    let correction = shading_correction(light.incident, point.brdf.normal, cos_geometric);
    let reflected = brdf_eval(point.brdf, light.incident, point.to_eye) * correction;
    return select(vec3f(0.0), light.flux * reflected * kernel_density(sqrt(distance2), radius), counts);
}

fn photon_contribution(point: VisiblePoint, photon: Photon, radius: f32) -> vec3f {
    let apart = photon.position - point.position;
    return light_contribution(point, photon_light(photon), dot(apart, apart), radius);
}
