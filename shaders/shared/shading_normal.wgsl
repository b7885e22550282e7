// Photons and irradiance are counted on geometric surfaces; shading normals are brought in by the ratio of the cosines.

// Bound of the ratio (ω·n_s) / (ω·n_g).
const MAX_SHADING_CORRECTION: f32 = 4.0;

// The ratio for light whose cosines with the two normals are given, at four points; 0 for light behind the shading surface. For light
// before the geometric surface, so that nothing here is no number: selections cost less than bounds that look for those.
fn shading_corrections(cos_shading: vec4f, cos_geometric: vec4f) -> vec4f {
    let ratio = cos_shading / (cos_geometric + 1.0e-4);
    let bounded = select(ratio, vec4f(MAX_SHADING_CORRECTION), ratio > vec4f(MAX_SHADING_CORRECTION));
    return select(vec4f(0.0), bounded, cos_shading > vec4f(0.0));
}

// The same at one point, for light from `incident`.
fn shading_correction(incident: vec3f, shading_normal: vec3f, cos_geometric: f32) -> f32 {
    return shading_corrections(vec4f(dot(incident, shading_normal)), vec4f(cos_geometric)).x;
}

// Factor of the scattering of flux from `incident` to `onward`, both away from the surface: light travels against the direction that shading
// normals were made for [Veach97, §5.3].
fn flux_correction(incident: vec3f, onward: vec3f, shading_normal: vec3f, normal_geometric: vec3f) -> f32 {
    let swap = abs(dot(incident, shading_normal) * dot(onward, normal_geometric))
        / max(abs(dot(incident, normal_geometric) * dot(onward, shading_normal)), 1.0e-4);
    return min(swap, 8.0);
}
