// Draws the tightest polygon around what an ellipsoid about each photon's kernel covers of the image.
#import "shared/splat_bound.wgsl"
#import "shared/splat_ellipsoids.wgsl"

// The kernel is a cylinder: of the ellipsoids about it this one is wider by little and higher by much, for the kernels are flat.
// 1/w² + 1/h² = 1.
const WIDER: f32 = 1.0690450;
const HIGHER: f32 = 2.8284271;

@vertex
fn splat_25d_ellipsoid_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Varyings {
    let photon = splat_photon(instance);
    let center = splat_view(photon.position);
    let e = photon_ellipsoid(photon, center);
    if ellipsoid_is_written(e, -center.z) {
        return written_varyings(vertex, e, center);
    }
    let to_view = mat3x3f(
        params.camera.view_from_world[0].xyz, params.camera.view_from_world[1].xyz, params.camera.view_from_world[2].xyz
    );
    let half_axes = to_view * mat3x3f(e.u * (WIDER * e.radii.x), e.t * (WIDER * e.radii.y), e.n * (HIGHER * e.radii.z));
    // The sphere must hold the ellipsoid, which has no corners.
    let radius = max(WIDER * max(e.radii.x, e.radii.y), HIGHER * e.radii.z);
    return ellipsoid_varyings(bound_vertex(splat_bound(center, half_axes, radius), vertex), e);
}

@fragment
fn splat_25d_ellipsoid_fragment(in: Varyings) -> Targets {
    return splat_ellipsoid_fragment(in);
}
