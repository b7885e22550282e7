// Draws an icosahedron about the sphere of each photon: the back faces, which a ray that meets a visible point inside always meets behind it,
// also where the eye is inside. Spheres of about a texel are drawn as the texels whose centres they may cover.
#import "shared/splat_bound.wgsl"
#import "shared/splat_hull.wgsl"
#import "shared/splat_spheres.wgsl"

@vertex
fn splat_3d_sphere_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Varyings {
    let photon = splat_photon(instance);
    let center = splat_view(photon.position);
    // The kernel is 0 at its edge; the slack covers the rounding of the distance there.
    let radius = photon_radius(photon, params.r_min, params.r_max);
    let wide = radius * 1.0001;
    var clip = NOWHERE;
    if !sphere_off_screen(center, wide) {
        let depth = -center.z;
        // A cheap test first: most spheres are larger.
        if depth > 2.0 * wide && wide < 2.0 * pixel_size(depth) {
            let bound = sphere_bound(center, wide);
            if bound_is_small(bound) {
                return sphere_varyings(bound_texels(bound, vertex), photon, radius);
            }
        }
        let hull = wide + splat_slack() * pixel_size(depth + wide);
        clip = view_to_clip(center + hull * icosahedron_corner(vertex));
    }
    return sphere_varyings(clip, photon, radius);
}

@fragment
fn splat_3d_sphere_fragment(in: Varyings) -> Targets {
    return splat_sphere(in);
}
