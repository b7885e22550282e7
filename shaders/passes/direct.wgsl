// Emission and direct light at every pixel of the G-buffer: every lamp by its own shadow ray while there are few, and
// points on emissive triangles and directions of the environment drawn by power. Where nothing is seen, the environment.
#import "shared/bvh.wgsl"
#import "shared/camera.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/lights.wgsl"

struct DirectParams {
    camera: Camera,
    lights: LightInfo,
    seed: u32,
    frame: u32,
    // Shadow rays to emissive triangles and the environment per pixel.
    emissive_samples: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: DirectParams;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var emission: texture_2d<f32>;
// Radiance (W·m⁻²·sr⁻¹).
@group(0) @binding(4) var direct_radiance: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn direct(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.camera.size) {
        return;
    }
    var radiance = textureLoad(emission, pixel.xy, 0).rgb;
    let point = visible_point(textureLoad(position, pixel.xy, 0), textureLoad(surface, pixel.xy, 0), camera_position(params.camera));
    if point.gatherable {
        var at: Surface;
        at.position = point.position;
        at.normal_geometric = point.normal_geometric;
        at.brdf = point.brdf;
        var rng = rng_new(params.seed, 0x44495245u + params.frame, pixel.y * params.camera.size.x + pixel.x);
        if params.lights.punctual_count <= MAX_CANDIDATES {
            for (var i = 0u; i < params.lights.punctual_count; i += 1u) {
                radiance += one_lamp(at, point.to_eye, lights[i]);
            }
        } else {
            radiance += punctual_light(at, point.to_eye, params.lights, &rng);
        }
        var emissive = vec3f(0.0);
        for (var i = 0u; i < params.emissive_samples; i += 1u) {
            emissive += emissive_light(at, point.to_eye, params.lights, rng_next4(&rng)).value;
        }
        radiance += emissive / f32(max(params.emissive_samples, 1u));
    }
    textureStore(direct_radiance, pixel.xy, vec4f(radiance, 1.0));
}

fn one_lamp(at: Surface, to_eye: vec3f, light: Light) -> vec3f {
    let incident = punctual_incident(light, at.position);
    let value = surface_response(at, incident.direction, to_eye, true).value * incident.irradiance;
    if max_component(value) <= 0.0
        || !unoccluded(surface_exit(at, incident.direction), incident.direction, incident.distance * 0.9999) {
        return vec3f(0.0);
    }
    return value;
}
