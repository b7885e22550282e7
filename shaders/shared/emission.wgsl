// Photons leave the lights: flux Φ = Φ_light / (N p) for a light that has the share p of N photons.
//
// Shares are set by power, with a floor for small lamps (`PhotonBudget` in Rust). They are kept by systematic sampling in
// whole numbers: a light has ⌊N p⌋ or ⌈N p⌉ photons, N p on average over seeds.
//
// Guided emission serves photons that are wanted only where they first meet something specular: a punctual light sends them
// into the cones or discs of its guides alone, the projection volume of [Jensen01] and [Kim19]. Where guides overlap, a
// photon is weighted by the density of all of them together (one-sample balance heuristic, [Veach97]).
#import "shared/math.wgsl"
#import "shared/rng.wgsl"
#import "shared/lights.wgsl"

const NO_PHOTONS: u32 = 0xffffffffu;

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

// High word of a 64-bit product.
fn multiply_high(x: u32, y: u32) -> u32 {
    let x_high = x >> 16u;
    let x_low = x & 0xffffu;
    let y_high = y >> 16u;
    let y_low = y & 0xffffu;
    let high_low = x_high * y_low;
    let low_high = x_low * y_high;
    let carry = ((x_low * y_low) >> 16u) + (high_low & 0xffffu) + (low_high & 0xffffu);
    return x_high * y_high + (high_low >> 16u) + (low_high >> 16u) + (carry >> 16u);
}

// First photon of the light whose share of `count` photons begins at `start`: ⌊(start · count + shift) / 2³²⌋.
fn first_photon(start: u32, count: u32, shift: u32) -> u32 {
    if start == NO_PHOTONS {
        return count;
    }
    let low = start * count;
    return multiply_high(start, count) + select(0u, 1u, low + shift < low);
}

// Index of the light that photon `index` of `count` leaves.
fn photon_light(index: u32, count: u32, shift: u32, info: LightInfo) -> u32 {
    let guided = info.emission == 1u;
    var low = select(0u, info.punctual_count, guided);
    var high = info.light_count + select(0u, info.punctual_count * info.guide_count, guided) - 1u;
    while low < high {
        let middle = (low + high + 1u) / 2u;
        if first_photon(lights[middle].photon_start[info.emission], count, shift) <= index {
            low = middle;
        } else {
            high = middle - 1u;
        }
    }
    return low;
}

// Photon `index` of `count`; position and direction follow a four-dimensional Kronecker sequence, so that equal numbers
// cover the sphere evenly. Unbiased over seeds.
fn emit_photon(index: u32, count: u32, seed: u32, info: LightInfo) -> Emitted {
    let shift = photon_shift(seed);
    let chosen = photon_light(index, count, shift, info);
    let light = lights[chosen];
    let u = kronecker4(index, seed);
    if light.guide_radius > 0.0 {
        return emit_guided(chosen, f32(count), u, info);
    }
    return emit_from_light(light, u, 1.0 / (f32(count) * light.photon_probability[info.emission]), info);
}

// Where the systematic samples of a seed begin.
fn photon_shift(seed: u32) -> u32 {
    return pcg4d(vec4u(seed, 0x4c494748u, 0u, 0u)).x;
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
            let direction = tangent_frame(light.direction) * sample_cone(u.xy, 1.0 - light.cos_outer);
            let solid_angle = 2.0 * PI * (1.0 - light.cos_outer);
            let flux = light.intensity * (spot_falloff(light, dot(direction, light.direction)) * solid_angle * share);
            return Emitted(light.position, direction, flux, true, 0.0, solid_angle * share);
        }
        case LIGHT_DIRECTIONAL: {
            let origin = disc_origin(info.bounds_center, info.bounds_radius, light.direction, u.xy, info);
            return Emitted(origin, light.direction, light.intensity * (light.area * share), true, light.area * share, 0.0);
        }
        case LIGHT_ENVIRONMENT: {
            let drawn = sample_environment(u.xy);
            let origin = disc_origin(info.bounds_center, info.bounds_radius, -drawn.direction, u.zw, info);
            return Emitted(origin, -drawn.direction, drawn.radiance * (light.area * share / drawn.pdf), false,
                light.area * sqrt(share), sqrt(share) / drawn.pdf);
        }
        default: {
            return emit_from_triangle(light, u, share, light.direction);
        }
    }
}

// As `emit_from_light`, with u.xy the position and u.zw the direction; of two sides the front has the lesser u.z. Equal u.zw are
// equal angles to the normal and to the frame of `axis`, carried there.
fn emit_from_triangle(light: Light, u: vec4f, share: f32, axis: vec3f) -> Emitted {
    let bary = sample_triangle(u.xy);
    let position = light.position + light.edge1 * bary.x + light.edge2 * bary.y;
    let sides = select(1.0, 2.0, light.two_sided != 0u);
    let side = select(1.0, -1.0, light.two_sided != 0u && u.z >= 0.5);
    let normal = side * light.direction;
    let direction = carried_frame(side * axis, normal) * sample_cosine_hemisphere(vec2f(fract(u.z * sides), u.w));
    let flux = light_radiance(light, bary) * (PI * sides * light.area * share);
    return Emitted(offset_origin(position, normal), direction, flux, false, light.area * sqrt(share), PI * sides * sqrt(share));
}

// The frame of `axis` after the least turn that takes it to `normal`; both unit and not opposite.
fn carried_frame(axis: vec3f, normal: vec3f) -> mat3x3f {
    let frame = tangent_frame(axis);
    let middle = (axis + normal) / (1.0 + dot(axis, normal));
    return mat3x3f(frame[0] - middle * dot(normal, frame[0]), frame[1] - middle * dot(normal, frame[1]), normal);
}

// Uniform by solid angle in the cone around +z whose half angle has the cosine 1 − `one_minus_cos`.
fn sample_cone(u: vec2f, one_minus_cos: f32) -> vec3f {
    let below = u.x * one_minus_cos;
    let sin_theta = sqrt(max(0.0, below * (2.0 - below)));
    let phi = 2.0 * PI * u.y;
    return vec3f(sin_theta * cos(phi), sin_theta * sin(phi), 1.0 - below);
}

// Uniform over the disc that a sphere shows in `direction`, moved against it to just outside the scene.
fn disc_origin(center: vec3f, radius: f32, direction: vec3f, u: vec2f, info: LightInfo) -> vec3f {
    let frame = tangent_frame(direction);
    let disc = sample_disc(u) * radius;
    let on_disc = center + frame[0] * disc.x + frame[1] * disc.y;
    return on_disc - direction * (dot(on_disc - info.bounds_center, direction) + 1.001 * info.bounds_radius);
}

// Unit, to the middle of a guide; any direction will do from there, for its cone is then the whole sphere.
fn guide_axis(light: Light) -> vec3f {
    let to_guide = light.guide_center - light.position;
    let distance2 = dot(to_guide, to_guide);
    if distance2 < 1.0e-24 {
        return vec3f(0.0, 0.0, 1.0);
    }
    return to_guide * inverseSqrt(distance2);
}

// 1 − cos of the half angle under which a guide appears from `position`; 2 from inside it.
fn guide_cone(light: Light) -> f32 {
    let to_guide = light.guide_center - light.position;
    let sin2 = light.guide_radius * light.guide_radius / max(dot(to_guide, to_guide), 1.0e-30);
    return select(sin2 / (1.0 + sqrt(max(0.0, 1.0 - sin2))), 2.0, sin2 >= 1.0);
}

// A photon of the punctual light `chosen`, which has a guide, of `count`.
fn emit_guided(chosen: u32, count: f32, u: vec4f, info: LightInfo) -> Emitted {
    let light = lights[chosen];
    let first = chosen - (chosen - info.light_count) % info.guide_count;
    if light.kind == LIGHT_DIRECTIONAL {
        let origin = disc_origin(light.guide_center, light.guide_radius, light.direction, u.xy, info);
        // Photons per area (m⁻²) of all guides that hold the photon's line.
        var density = 0.0;
        for (var i = first; i < first + info.guide_count; i += 1u) {
            let guide = lights[i];
            let across = cross(origin - guide.guide_center, light.direction);
            if i == chosen || dot(across, across) <= guide.guide_radius * guide.guide_radius {
                density += guide.photon_probability.y / (PI * guide.guide_radius * guide.guide_radius);
            }
        }
        let area = 1.0 / (count * density);
        return Emitted(origin, light.direction, light.intensity * area, true, area, 0.0);
    }
    let direction = tangent_frame(guide_axis(light)) * sample_cone(u.xy, guide_cone(light));
    // Photons per solid angle (sr⁻¹) of all guides that hold the direction.
    var density = 0.0;
    for (var i = first; i < first + info.guide_count; i += 1u) {
        let guide = lights[i];
        let below = guide_cone(guide);
        let offset = guide_axis(guide) - direction;
        // |a − d|² / 2 is 1 − cos of the angle between unit vectors.
        if i == chosen || 0.5 * dot(offset, offset) <= below {
            density += guide.photon_probability.y / (2.0 * PI * below);
        }
    }
    var intensity = light.intensity;
    if light.kind == LIGHT_SPOT {
        intensity *= spot_falloff(light, dot(direction, light.direction));
    }
    let solid_angle = 1.0 / (count * density);
    return Emitted(light.position, direction, intensity * solid_angle, true, 0.0, solid_angle);
}
