// Draws the tightest polygon around what an ellipsoid about each photon's kernel covers of the image.
#import "shared/splat_ellipsoids.wgsl"

@vertex
fn splat_25d_ellipsoid_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Varyings {
    let photon = splat_photon(instance);
    let center = splat_view(photon.position);
    let e = photon_ellipsoid(photon, center);
    if left_out(photon) {
        return ellipsoid_varyings(NOWHERE, e);
    }
    if ellipsoid_is_written(e, -center.z) {
        return written_varyings(vertex, e, center);
    }
    return ellipsoid_varyings(bound_vertex(ellipsoid_bound(e, center), vertex), e);
}

@fragment
fn splat_25d_ellipsoid_fragment(in: Varyings) -> Targets {
    return splat_ellipsoid_fragment(in);
}
