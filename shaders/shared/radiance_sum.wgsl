// What a strategy sums at one visible point: the density estimate of [MML13] Eq. 1, and the part of it that caustic
// photons (all earlier bounces specular) bring. Outgoing radiance, W·m⁻²·sr⁻¹.
#import "shared/estimate.wgsl"

struct RadianceSum {
    indirect: vec3f,
    caustic: vec3f,
    // Photons tested so far, and photons found near and not yet added. llvmpipe ends every loop of an invocation, without a
    // word, once they have turned 65,535 times together: these two tell.
    tested: u32,
    pending: u32,
}

// Whether the sum lacks some of the `count` photons that it should have tested.
fn sum_is_cut(sum: RadianceSum, count: u32) -> bool {
    return sum.tested != count || sum.pending != 0u;
}

fn add_photon(sum: ptr<function, RadianceSum>, point: VisiblePoint, photon: Photon, radius: f32) {
    (*sum).pending -= 1u;
    let radiance = photon_contribution(point, photon, radius);
    (*sum).indirect += radiance;
    if (photon.bounce_flags & PHOTON_CAUSTIC) != 0u {
        (*sum).caustic += radiance;
    }
}
