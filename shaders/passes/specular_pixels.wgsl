// Pixels whose first surface is a mirror or a smooth dielectric: no density can be estimated there, so that each follows
// a few paths per frame (shared/path.wgsl). Other pixels pass through.
#import "shared/camera.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/path.wgsl"

struct SpecularPixelsParams {
    camera: Camera,
    lights: LightInfo,
    seed: u32,
    frame: u32,
    max_bounces: u32,
    // Paths per pixel.
    samples: u32,
}

@group(0) @binding(0) var<uniform> params: SpecularPixelsParams;
@group(0) @binding(1) var surface: texture_2d<u32>;
@group(0) @binding(2) var gathered: texture_2d<f32>;
@group(0) @binding(3) var indirect: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn specular_pixels(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.camera.size) {
        return;
    }
    var radiance = textureLoad(gathered, pixel.xy, 0).rgb;
    let bits = textureLoad(surface, pixel.xy, 0).w;
    if (bits & SURFACE_VALID) != 0u && (bits & SURFACE_SPECULAR) != 0u {
        var rng = rng_new(params.seed, 0x53504543u + params.frame, pixel.y * params.camera.size.x + pixel.x);
        let direction = camera_direction(params.camera, vec2f(pixel.xy) + params.camera.jitter);
        radiance = vec3f(0.0);
        for (var i = 0u; i < params.samples; i += 1u) {
            radiance += path_radiance(camera_position(params.camera), direction, params.lights, params.max_bounces, &rng).indirect;
        }
        radiance /= f32(max(params.samples, 1u));
    }
    textureStore(indirect, pixel.xy, vec4f(radiance, 1.0));
}
