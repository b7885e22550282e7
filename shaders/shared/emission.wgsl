// Photons leave the lights: flux Φ = Φ_light / (N p) for the light drawn with probability p, N photons in all.
#import "shared/math.wgsl"
#import "shared/rng.wgsl"
#import "shared/lights.wgsl"

struct Emitted {
    origin: vec3f,
    direction: vec3f,
    // W.
    flux: vec3f,
    // The light is a point or a single direction, which paths from the eye cannot hit.
    delta: bool,
    // The photon's share of the light: section (m²) and solid angle (sr) of its beam.
    beam_area: f32,
    beam_solid_angle: f32,
}

// Photon `index` of `count`. Lights are drawn by power, stratified by the index; position and direction follow a
// four-dimensional Kronecker sequence, so that equal numbers cover the sphere evenly. Unbiased over seeds.
fn emit_photon(index: u32, count: u32, seed: u32, info: LightInfo) -> Emitted {
    let light = lights[photon_light(index, count, seed, info)];
    return emit_from_light(light, kronecker4(index, seed), 1.0 / (f32(count) * light.probability), info);
}

// The light that photon `index` of `count` leaves.
fn photon_light(index: u32, count: u32, seed: u32, info: LightInfo) -> u32 {
    let shift = unit_float(pcg4d(vec4u(seed, 0x4c494748u, 0u, 0u)).x);
    return select_light((f32(index) + shift) / f32(count), 0u, info.light_count);
}

// The photon that leaves `light` for the point `u` of the unit hypercube, and stands for the part `share` of its flux. Punctual lights
// use u.xy only. Uniform points are uniform directions over the sphere or the cone, or positions over the disc: the flux differs only
// by the falloff.
fn emit_from_light(light: Light, u: vec4f, share: f32, info: LightInfo) -> Emitted {
    switch light.kind {
        case LIGHT_POINT: {
            return Emitted(light.position, sample_sphere(u.xy), light.intensity * (4.0 * PI * share), true, 0.0, 4.0 * PI * share);
        }
        case LIGHT_SPOT: {
            // Uniform over the outer cone; the falloff is in the flux.
            let cos_theta = 1.0 - u.x * (1.0 - light.cos_outer);
            let sin_theta = sqrt(max(0.0, 1.0 - cos_theta * cos_theta));
            let phi = 2.0 * PI * u.y;
            let local = vec3f(sin_theta * cos(phi), sin_theta * sin(phi), cos_theta);
            let solid_angle = 2.0 * PI * (1.0 - light.cos_outer);
            let flux = light.intensity * (spot_falloff(light, cos_theta) * solid_angle * share);
            return Emitted(light.position, tangent_frame(light.direction) * local, flux, true, 0.0, solid_angle * share);
        }
        case LIGHT_DIRECTIONAL: {
            // Over the disc of the scene's bounding sphere, from just outside it.
            let frame = tangent_frame(light.direction);
            let disc = sample_disc(u.xy) * info.bounds_radius;
            let origin = info.bounds_center + frame[0] * disc.x + frame[1] * disc.y
                - light.direction * (1.001 * info.bounds_radius);
            return Emitted(origin, light.direction, light.intensity * (light.area * share), true, light.area * share, 0.0);
        }
        default: {
            let bary = sample_triangle(u.xy);
            let position = light.position + light.edge1 * bary.x + light.edge2 * bary.y;
            let direction = tangent_frame(light.direction) * sample_cosine_hemisphere(u.zw);
            let flux = light_radiance(light, bary) * (PI * light.area * share);
            return Emitted(offset_origin(position, light.direction), direction, flux, false, light.area * sqrt(share), PI * sqrt(share));
        }
    }
}
