// Unbiased path tracing from the eye with next-event estimation, and multiple importance sampling of emissive surfaces and
// of the environment (balance heuristic, [Veach97]). x1 is the first surface the eye sees, x2 the next, and so on.
//
// Light that leaves a point or directional light through a mirror or a refractor and meets a diffuse surface cannot be
// sampled from the eye; particles traced from the lights add it (see passes/photon_splat.wgsl).
#import "shared/rng.wgsl"
#import "shared/bvh.wgsl"
#import "shared/surface.wgsl"
#import "shared/lights.wgsl"
#import "shared/light_found.wgsl"

// Radiance towards the eye (W·m⁻²·sr⁻¹).
struct PathRadiance {
    // Emitted at x1, and light that reached x1 straight from a light; x1 can be gathered at (`surface_gatherable`).
    direct: vec3f,
    // All other.
    indirect: vec3f,
    // Part of `indirect` that was only scattered by specular surfaces before x1.
    caustic: vec3f,
}

// Survival by throughput begins at this vertex.
const ROULETTE_START: u32 = 4u;

// Adds what is emitted towards the path at `vertex`.
fn add_emitted(value: vec3f, vertex: u32, first_gatherable: bool, chain_specular: bool, result: ptr<function, PathRadiance>) {
    if vertex == 1u || (vertex == 2u && first_gatherable) {
        (*result).direct += value;
        return;
    }
    (*result).indirect += value;
    if chain_specular && first_gatherable {
        (*result).caustic += value;
    }
}

// `max_bounces`: surfaces that light may be scattered at before it reaches x1.
fn path_radiance(ray_origin: vec3f, ray_direction: vec3f, info: LightInfo, max_bounces: u32, rng: ptr<function, Rng>) -> PathRadiance {
    var result = PathRadiance(vec3f(0.0), vec3f(0.0), vec3f(0.0));
    var origin = ray_origin;
    var direction = ray_direction;
    var throughput = vec3f(1.0);
    var last = LastScatter(0.0, true);
    var first_gatherable = true;
    // x2 … are all specular so far.
    var chain_specular = true;
    for (var vertex = 1u; vertex <= max_bounces + 2u; vertex += 1u) {
        let hit = trace_ray(origin, direction, INFINITY, false);
        if hit.index == NO_HIT {
            if SCENE_ENVIRONMENT {
                add_emitted(throughput * environment_found(direction, last, info), vertex, first_gatherable, chain_specular, &result);
            }
            break;
        }
        let surface = surface_at(hit, direction);
        if SCENE_REFRACTS && !surface.front && surface.thickness > 0.0 {
            throughput *= exp(-surface.absorption * hit.t);
        }
        let wo = -direction;

        if max_component(surface.emission) > 0.0 {
            let found = emission_found(surface, direction, hit.t, last, info);
            add_emitted(throughput * found, vertex, first_gatherable, chain_specular, &result);
        }
        if vertex == 1u {
            first_gatherable = surface_gatherable(surface);
        }
        if vertex == max_bounces + 2u {
            break;
        }

        // Next-event estimation.
        if surface_opacity(surface) > 0.0 {
            let value = light_sampled(surface, wo, info, rng);
            if vertex == 1u && first_gatherable {
                result.direct += throughput * value;
            } else {
                result.indirect += throughput * value;
            }
        }

        let scattered = scatter(surface, wo, rng_next4(rng), true);
        throughput *= scattered.weight;
        var survival = 1.0;
        if vertex >= ROULETTE_START {
            survival = clamp(max_component(throughput), 0.05, 1.0);
        }
        if max_component(throughput) <= 0.0 || rng_next4(rng).x >= survival {
            break;
        }
        throughput /= survival;
        last = LastScatter(scattered.pdf, scattered.specular);
        if vertex > 1u {
            chain_specular = chain_specular && scattered.specular;
        }
        origin = surface_exit(surface, scattered.direction);
        direction = scattered.direction;
    }
    return result;
}
