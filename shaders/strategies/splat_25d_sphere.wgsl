// Draws the tightest polygon around what each photon's sphere covers of the image, as a fan of triangles. Spheres of about a texel are drawn
// as the texels whose centres they may cover.
#import "shared/splat_bound.wgsl"
#import "shared/splat_spheres.wgsl"

@vertex
fn splat_25d_sphere_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Varyings {
    let photon = splat_photon(instance);
    // The kernel is 0 at its edge; the slack covers the rounding of the distance there.
    let radius = photon_radius(photon, params.r_min, params.r_max);
    let bound = sphere_bound(splat_view(photon.position), radius * 1.0001);
    return sphere_varyings(bound_vertex(bound, vertex), photon, radius);
}

@fragment
fn splat_25d_sphere_fragment(in: Varyings) -> Targets {
    return splat_sphere(in);
}
