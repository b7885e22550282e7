// What bounds a few visible points, and the photons that none of them can gather.
#import "shared/math.wgsl"
#import "shared/photon.wgsl"

// World-space box and normals of those of some visible points that gather photons.
struct PointBounds {
    lower_world: vec3f,
    // Number of such points; without any, the rest means nothing.
    points: u32,
    upper_world: vec3f,
    // Least cosine with the axis of the normals of photons that some point can gather.
    min_cos_normal: f32,
    // Of the cone that holds the points' geometric normals; unit, world.
    axis: vec3f,
    // Least cosine with the axis of the directions from which some point can take light.
    min_cos_incident: f32,
}

// Whether some of the points may gather the photon. Conservative.
fn photon_meets_points(bounds: PointBounds, photon: Photon, radius: f32) -> bool {
    let outside = max(max(bounds.lower_world - photon.position, photon.position - bounds.upper_world), vec3f(0.0));
    return bounds.points > 0u && dot(outside, outside) <= radius * radius
        && dot(octahedral_decode(photon.normal), bounds.axis) >= bounds.min_cos_normal
        && -dot(octahedral_decode(photon.direction), bounds.axis) >= bounds.min_cos_incident;
}
