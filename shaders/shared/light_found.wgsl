// Light that paths from the eye find in two ways, by being scattered to a light and by sampling one, each weighted by the balance heuristic
// [Veach97].
#import "shared/lights.wgsl"

// How the path left the surface before.
struct LastScatter {
    // Density of the direction (sr⁻¹); 0 for a specular scattering and for the eye's own ray.
    pdf: f32,
    // No light could be sampled there.
    specular: bool,
}

// What the surface emits towards a path that came along `direction` through `distance`.
fn emission_found(surface: Surface, direction: vec3f, distance: f32, last: LastScatter, info: LightInfo) -> vec3f {
    if last.specular {
        return surface.emission;
    }
    let light_pdf = emissive_pdf(lights[surface.light], info, distance, abs(dot(surface.normal_geometric, direction)));
    return surface.emission * (last.pdf / (last.pdf + light_pdf));
}

// The environment's radiance for a path that leaves the scene along `direction`.
fn environment_found(direction: vec3f, last: LastScatter, info: LightInfo) -> vec3f {
    if last.specular {
        return environment_radiance(direction);
    }
    return environment_radiance(direction) * (last.pdf / (last.pdf + environment_light_pdf(direction, info)));
}

// Light scattered towards `wo` that comes straight from the lights, for a path that goes on and may find some of them.
fn light_sampled(surface: Surface, wo: vec3f, info: LightInfo, rng: ptr<function, Rng>) -> vec3f {
    var value = punctual_light(surface, wo, info, rng);
    let emissive = emissive_light(surface, wo, info, rng_next4(rng));
    if emissive.pdf > 0.0 {
        value += emissive.value * (emissive.pdf / (emissive.pdf + emissive.scatter_pdf));
    }
    return value;
}
