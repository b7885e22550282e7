// Photons and irradiance are counted on geometric surfaces; shading normals are brought in by the ratio of the cosines.

// Bound of the ratio (ω·n_s) / (ω·n_g).
const MAX_SHADING_CORRECTION: f32 = 4.0;

// The ratio for light from `incident`, whose cosine with the geometric normal is `cos_geometric`; 0 for light behind the shading
// surface.
fn shading_correction(incident: vec3f, shading_normal: vec3f, cos_geometric: f32) -> f32 {
    return max(min(dot(incident, shading_normal) / (cos_geometric + 1.0e-4), MAX_SHADING_CORRECTION), 0.0);
}
