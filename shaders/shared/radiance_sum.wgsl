// What a strategy sums at one visible point: the density estimate of [MML13] Eq. 1, and the part of it that caustic
// photons (all earlier bounces specular) bring. Outgoing radiance, W·m⁻²·sr⁻¹.
#import "shared/estimate.wgsl"

struct RadianceSum {
    indirect: vec3f,
    caustic: vec3f,
}

fn add_photon(sum: ptr<function, RadianceSum>, point: VisiblePoint, photon: Photon, radius: f32) {
    let radiance = photon_contribution(point, photon, radius);
    (*sum).indirect += radiance;
    if (photon.bounce_flags & PHOTON_CAUSTIC) != 0u {
        (*sum).caustic += radiance;
    }
}
