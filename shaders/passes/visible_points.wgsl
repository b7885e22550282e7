// Where light is gathered for each pixel: at its first surface, or, if that is a mirror or transmits, at the first surface that is seen by way of
// it and gathers. One ray of the eye is followed there, and at each surface chance chooses between reflection and transmission.
#import "shared/bvh.wgsl"
#import "shared/camera.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/light_found.wgsl"
#import "shared/rng.wgsl"
#import "shared/surface.wgsl"

struct VisiblePointsParams {
    camera: Camera,
    lights: LightInfo,
    seed: u32,
    frame: u32,
    // Surfaces on the way at the most, less one.
    max_bounces: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: VisiblePointsParams;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
// The points, as in shared/gbuffer.wgsl.
@group(0) @binding(3) var visible_position: texture_storage_2d<rgba32float, write>;
@group(0) @binding(4) var visible_surface: texture_storage_2d<rgba32uint, write>;
// Part of the radiance of the point that the eye receives, RGB; 1 where the eye sees the point itself, else 0.
@group(0) @binding(5) var throughput: texture_storage_2d<rgba32float, write>;
// Radiance that the eye receives from the point and from all on the way, without what is gathered (W·m⁻²·sr⁻¹).
@group(0) @binding(6) var seen: texture_storage_2d<rgba32float, write>;

// Survival by throughput begins at this vertex, as in shared/path.wgsl.
const EYE_ROULETTE_START: u32 = 4u;

struct EyePath {
    // Where light is gathered, if `gathers`.
    point: Surface,
    // Unit, from the point to where it is seen from.
    to_eye: vec3f,
    gathers: bool,
    throughput: vec3f,
    seen: vec3f,
}

// Light straight from the lights, where a path ends.
fn direct_light(at: Surface, wo: vec3f, info: LightInfo, rng: ptr<function, Rng>) -> vec3f {
    let punctual = punctual_light(at, wo, info, rng);
    return punctual + emissive_light(at, wo, info, rng_next4(rng)).value;
}

fn eye_path(ray_origin: vec3f, ray_direction: vec3f, info: LightInfo, max_bounces: u32, rng: ptr<function, Rng>) -> EyePath {
    var path: EyePath;
    path.throughput = vec3f(1.0);
    var origin = ray_origin;
    var direction = ray_direction;
    var last = LastScatter(0.0, true);
    for (var vertex = 1u; vertex <= max_bounces + 2u; vertex += 1u) {
        let hit = trace_ray(origin, direction, INFINITY, false);
        if hit.index == NO_HIT {
            if SCENE_ENVIRONMENT {
                path.seen += path.throughput * environment_found(direction, last, info);
            }
            break;
        }
        var at = surface_at(hit, direction);
        if SCENE_REFRACTS && !at.front && at.thickness > 0.0 {
            path.throughput *= exp(-at.absorption * hit.t);
        }
        let wo = -direction;
        // What the first surface emits is in the G-buffer.
        if vertex > 1u && max_component(at.emission) > 0.0 {
            path.seen += path.throughput * emission_found(at, direction, hit.t, last, info);
        }
        if vertex == max_bounces + 2u {
            break;
        }

        let rough = SCENE_ROUGH_REFRACTION && at.rough_dielectric;
        let u = rng_next4(rng);
        // Of a surface that transmits in part the eye sees one part or the other; `scatter` makes the same choice by the same number.
        if surface_opacity(at) > 0.0 && !rough && u.w >= at.transmission {
            at.transmission = 0.0;
            path.seen += path.throughput * direct_light(at, wo, info, rng);
            path.point = at;
            path.to_eye = wo;
            path.gathers = true;
            break;
        }
        if rough {
            path.seen += path.throughput * light_sampled(at, wo, info, rng);
        }
        let scattered = scatter(at, wo, u, true);
        path.throughput *= scattered.weight;
        var survival = 1.0;
        if vertex >= EYE_ROULETTE_START {
            survival = clamp(max_component(path.throughput), 0.05, 1.0);
        }
        if max_component(path.throughput) <= 0.0 || rng_next4(rng).x >= survival {
            break;
        }
        path.throughput /= survival;
        last = LastScatter(scattered.pdf, scattered.specular);
        origin = surface_exit(at, scattered.direction);
        direction = scattered.direction;
    }
    return path;
}

@compute @workgroup_size(8, 8)
fn visible_points(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.camera.size) {
        return;
    }
    var point = textureLoad(position, pixel.xy, 0);
    var what = textureLoad(surface, pixel.xy, 0);
    var kept = vec4f(1.0);
    var light = vec3f(0.0);
    if (what.w & (SURFACE_VALID | SURFACE_SPECULAR)) == (SURFACE_VALID | SURFACE_SPECULAR) {
        var rng = rng_new(params.seed, 0x56495350u + params.frame, pixel.y * params.camera.size.x + pixel.x);
        let direction = camera_direction(params.camera, vec2f(pixel.xy) + params.camera.jitter);
        let path = eye_path(camera_position(params.camera), direction, params.lights, params.max_bounces, &rng);
        light = path.seen;
        point = vec4f(0.0);
        what = vec4u(0u);
        kept = vec4f(0.0);
        if path.gathers {
            point = vec4f(path.point.position, to_eye_encode(path.to_eye));
            what = surface_encode(path.point.brdf, path.point.normal_geometric, false);
            kept = vec4f(path.throughput, 0.0);
        }
    }
    textureStore(visible_position, pixel.xy, point);
    textureStore(visible_surface, pixel.xy, what);
    textureStore(throughput, pixel.xy, kept);
    textureStore(seen, pixel.xy, vec4f(light, 1.0));
}
