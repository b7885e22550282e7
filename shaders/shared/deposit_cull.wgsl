// Which photons no pixel of a camera can gather: those farther outside its frustum than a kernel reaches, and those on surfaces
// turned so far away that every pixel within reach, whose normal may differ, is turned away too.

struct DepositCull {
    // Planes of the frustum's sides: unit normal inwards and offset, n·x + d ≥ 0 inside.
    planes: array<vec4f, 4>,
    // World (m).
    eye: vec3f,
    // Largest kernel radius (m); below 0: nothing is culled.
    reach: f32,
}

// Photons serve pixels whose normal differs by at most 60° (MIN_NORMAL_COSINE of shared/estimate.wgsl): beyond 90° + 60° from
// the direction to the eye, and what the reach subtends, nobody sees them.
const SIN_60: f32 = 0.8660254;

fn deposit_can_be_seen(cull: DepositCull, position: vec3f, normal: vec3f) -> bool {
    // No branches: Mesa's lavapipe 22 may compile a shader anew at every dispatch if one hangs on uniforms alone.
    var inside = true;
    for (var i = 0u; i < 4u; i += 1u) {
        inside &= dot(cull.planes[i].xyz, position) + cull.planes[i].w >= -cull.reach;
    }
    let to_eye = cull.eye - position;
    let distance = length(to_eye);
    // cos(150° + a) with sin a = reach / distance; from a = 30° on nothing is turned away too far.
    let sin_a = cull.reach / max(distance, 1.0e-20);
    let cos_a = sqrt(max(1.0 - sin_a * sin_a, 0.0));
    let limit = -SIN_60 * cos_a - 0.5 * sin_a;
    let faces = (dot(normal, to_eye) >= distance * limit) | (sin_a >= 0.5);
    return (cull.reach < 0.0) | (inside & faces);
}
