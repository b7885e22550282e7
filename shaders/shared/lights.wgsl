// Light that arrives at a surface straight from the lights.
#import "shared/bvh.wgsl"
#import "shared/surface.wgsl"
#import "shared/environment.wgsl"

const LIGHT_POINT: u32 = 0u;
const LIGHT_SPOT: u32 = 1u;
const LIGHT_DIRECTIONAL: u32 = 2u;
const LIGHT_TRIANGLE: u32 = 3u;
const LIGHT_ENVIRONMENT: u32 = 4u;

// More lamps than this are sampled in place of summed.
const MAX_CANDIDATES: u32 = 16u;

// What the kernels need to know of the light list; part of their params.
struct LightInfo {
    // All lights; the punctual ones come first, the environment last.
    light_count: u32,
    punctual_count: u32,
    // How photons leave: 0 into all directions, 1 punctual lights aim at guides.
    emission: u32,
    // Guides of each punctual light.
    guide_count: u32,
    // Centre and radius (m) of the scene's bounding sphere, for directional lights.
    bounds_center: vec3f,
    bounds_radius: f32,
}

struct Incident {
    // Unit, towards the light.
    direction: vec3f,
    distance: f32,
    // Irradiance on a plane that faces the light (W·m⁻²), unshadowed.
    irradiance: vec3f,
}

// glTF's angular attenuation of KHR_lights_punctual; `cos_theta` between the axis and the direction of travel.
fn spot_falloff(light: Light, cos_theta: f32) -> f32 {
    let t = saturate((cos_theta - light.cos_outer) / max(light.cos_inner - light.cos_outer, 1.0e-4));
    return t * t;
}

fn punctual_incident(light: Light, position: vec3f) -> Incident {
    if light.kind == LIGHT_DIRECTIONAL {
        return Incident(-light.direction, INFINITY, light.intensity);
    }
    let to_light = light.position - position;
    let distance2 = max(dot(to_light, to_light), 1.0e-12);
    let distance = sqrt(distance2);
    let direction = to_light / distance;
    var intensity = light.intensity;
    if light.kind == LIGHT_SPOT {
        intensity *= spot_falloff(light, -dot(light.direction, direction));
    }
    return Incident(direction, distance, intensity / distance2);
}

// Index of the light that `u` in [0, 1) selects by power among lights first..first + count.
fn select_light(u: f32, first: u32, count: u32) -> u32 {
    var low = first;
    var high = first + count - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if u < lights[middle].cdf {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return low;
}

// Cumulative probability of the punctual lights together.
fn punctual_probability(info: LightInfo) -> f32 {
    if info.punctual_count == 0u {
        return 0.0;
    }
    return lights[info.punctual_count - 1u].cdf;
}

// Light scattered towards `wo` from lamps and the sun, one shadow ray: a lamp is drawn in proportion to what it would
// send without shadow; among more than MAX_CANDIDATES, from candidates drawn by power (resampling [Talbot05]).
fn punctual_light(surface: Surface, wo: vec3f, info: LightInfo, rng: ptr<function, Rng>) -> vec3f {
    if info.punctual_count == 0u {
        return vec3f(0.0);
    }
    let all = info.punctual_count <= MAX_CANDIDATES;
    let count = min(info.punctual_count, MAX_CANDIDATES);
    let mass = punctual_probability(info);
    var total = 0.0;
    var chosen_value = vec3f(0.0);
    var chosen_target = 0.0;
    var chosen_direction = vec3f(0.0);
    var chosen_distance = 0.0;
    for (var i = 0u; i < count; i += 1u) {
        let u = rng_next4(rng);
        var index = i;
        var inverse_probability = 1.0;
        if !all {
            index = select_light(u.y * mass, 0u, info.punctual_count);
            inverse_probability = mass / (lights[index].probability * f32(count));
        }
        let incident = punctual_incident(lights[index], surface.position);
        let value = surface_response(surface, incident.direction, wo, true).value * incident.irradiance;
        let target_weight = mean_component(value);
        let weight = target_weight * inverse_probability;
        total += weight;
        if weight > 0.0 && u.x * total < weight {
            chosen_value = value;
            chosen_target = target_weight;
            chosen_direction = incident.direction;
            chosen_distance = incident.distance;
        }
    }
    if chosen_target <= 0.0 {
        return vec3f(0.0);
    }
    if !unoccluded(surface_exit(surface, chosen_direction), chosen_direction, chosen_distance * 0.9999) {
        return vec3f(0.0);
    }
    return chosen_value * (total / chosen_target);
}

struct EmissiveSample {
    // Scattered light before any weight of multiple importance sampling.
    value: vec3f,
    // Density of the direction (sr⁻¹); 0 when nothing was sampled.
    pdf: f32,
    // Density (sr⁻¹) with which `scatter` draws the direction.
    scatter_pdf: f32,
}

// Density per solid angle (sr⁻¹) with which `emissive_light` draws the direction that met `light` at `distance`.
fn emissive_pdf(light: Light, info: LightInfo, distance: f32, cos_light: f32) -> f32 {
    let selection = light.probability / max(1.0 - punctual_probability(info), 1.0e-20);
    return selection * distance * distance / (max(cos_light, 1.0e-6) * light.area);
}

// Density per solid angle (sr⁻¹) with which `emissive_light` draws a direction in which only the environment is.
fn environment_light_pdf(direction: vec3f, info: LightInfo) -> f32 {
    let selection = lights[info.light_count - 1u].probability / max(1.0 - punctual_probability(info), 1.0e-20);
    return selection * environment_pdf(direction);
}

// Light scattered towards `wo` from one point of one emissive triangle, drawn by power and area, or from one direction of
// the environment.
fn emissive_light(surface: Surface, wo: vec3f, info: LightInfo, u: vec4f) -> EmissiveSample {
    let none = EmissiveSample(vec3f(0.0), 0.0, 0.0);
    if info.light_count == info.punctual_count {
        return none;
    }
    let mass = punctual_probability(info);
    let index = select_light(mass + u.z * (1.0 - mass), info.punctual_count, info.light_count - info.punctual_count);
    let light = lights[index];
    if SCENE_ENVIRONMENT && light.kind == LIGHT_ENVIRONMENT {
        let drawn = sample_environment(u.xy);
        let pdf = drawn.pdf * light.probability / max(1.0 - mass, 1.0e-20);
        let response = surface_response(surface, drawn.direction, wo, true);
        let value = response.value * drawn.radiance / pdf;
        if max_component(value) <= 0.0 {
            return none;
        }
        let seen = unoccluded(surface_exit(surface, drawn.direction), drawn.direction, INFINITY);
        return EmissiveSample(select(vec3f(0.0), value, seen), pdf, response.pdf);
    }
    let bary = sample_triangle(u.xy);
    let to_light = light.position + light.edge1 * bary.x + light.edge2 * bary.y - surface.position;
    let distance2 = max(dot(to_light, to_light), 1.0e-12);
    let distance = sqrt(distance2);
    let direction = to_light / distance;
    let facing = -dot(light.direction, direction);
    let cos_light = select(facing, abs(facing), light.two_sided != 0u);
    if cos_light <= 0.0 {
        return none;
    }
    let pdf = emissive_pdf(light, info, distance, cos_light);
    let response = surface_response(surface, direction, wo, true);
    let value = response.value * light_radiance(light, bary) / pdf;
    if max_component(value) <= 0.0 {
        return none;
    }
    if !unoccluded(surface_exit(surface, direction), direction, distance * 0.9999) {
        return EmissiveSample(vec3f(0.0), pdf, response.pdf);
    }
    return EmissiveSample(value, pdf, response.pdf);
}

// Barycentric weights of the second and third corner, uniform by area.
fn sample_triangle(u: vec2f) -> vec2f {
    let s = sqrt(u.x);
    return vec2f(s * (1.0 - u.y), s * u.y);
}

// Emitted radiance of an emissive triangle at `bary`.
fn light_radiance(light: Light, bary: vec2f) -> vec3f {
    let material = materials[light.material];
    if material.emissive_texture.first_texel == NO_TEXTURE {
        return material.emissive;
    }
    let attributes = triangles[light.triangle];
    return material.emissive * sample_texture(material.emissive_texture, triangle_uv(attributes, bary), true).rgb;
}
