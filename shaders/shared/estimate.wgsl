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

// κ(s) / ∫κ (m⁻²); ∫κ = π r² c (c²/3 − c + 1).
fn kernel_density(s: f32, radius: f32) -> f32 {
    let integral = PI * radius * radius * KERNEL_CUT * (KERNEL_CUT * KERNEL_CUT / 3.0 - KERNEL_CUT + 1.0);
    return min(KERNEL_CUT, max(0.0, 1.0 - s / radius)) / integral;
}

// Radiance (W·m⁻²·sr⁻¹) that the photon adds to what leaves `point` towards the eye.
fn photon_contribution(point: VisiblePoint, photon: Photon, radius: f32) -> vec3f {
    let apart = photon.position - point.position;
    let distance2 = dot(apart, apart);
    if distance2 >= radius * radius {
        return vec3f(0.0);
    }
    let incident = -octahedral_decode(photon.direction);
    let cos_geometric = dot(incident, point.normal_geometric);
    if cos_geometric <= 0.0 || dot(octahedral_decode(photon.normal), point.normal_geometric) < MIN_NORMAL_COSINE {
        return vec3f(0.0);
    }
    let correction = shading_correction(incident, point.brdf.normal, cos_geometric);
    let reflected = brdf_eval(point.brdf, incident, point.to_eye) * correction;
    return flux_decode(photon.flux) * reflected * kernel_density(sqrt(distance2), radius);
}
