// Draws a hexagonal prism about the kernel of each photon, as `splat_3d_sphere` draws icosahedra: back faces.
#import "shared/splat_ellipsoids.wgsl"
#import "shared/splat_hull.wgsl"

@vertex
fn splat_3d_ellipsoid_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Varyings {
    let photon = splat_photon(instance);
    let center = splat_view(photon.position);
    let e = photon_ellipsoid(photon, center);
    let depth = -center.z;
    let radius = ellipsoid_radius(e);
    if left_out(photon) || sphere_off_screen(center, radius) {
        return ellipsoid_varyings(NOWHERE, e);
    }
    if ellipsoid_is_written(e, depth) {
        return written_varyings(vertex, e, center);
    }
    let hull = e.radii * 1.0001 + splat_slack() * pixel_size(depth + radius);
    let corner = prism_corner(vertex) * hull;
    let offset_world = e.u * corner.x + e.t * corner.y + e.n * corner.z;
    return ellipsoid_varyings(view_to_clip(center + (params.camera.view_from_world * vec4f(offset_world, 0.0)).xyz), e);
}

@fragment
fn splat_3d_ellipsoid_fragment(in: Varyings) -> Targets {
    return splat_ellipsoid_fragment(in);
}
