// Pixels whose first surface is a mirror or transmits light: no density is estimated there, so that each follows
// a few paths per frame (shared/path.wgsl), one per dispatch: each adds its share to what the ones before brought. Other pixels pass through.
#import "shared/camera.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/path.wgsl"

struct SpecularPixelsParams {
    camera: Camera,
    lights: LightInfo,
    seed: u32,
    frame: u32,
    max_bounces: u32,
    // Which of the pixel's paths this is, and the weight of each.
    index: u32,
    weight: f32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
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
        // Paths of one pixel are apart by the stream's name.
        var rng = rng_new(params.seed, 0x53504543u + params.frame, (pixel.y * params.camera.size.x + pixel.x) ^ (params.index << 28u));
        let direction = camera_direction(params.camera, vec2f(pixel.xy) + params.camera.jitter);
        let path = path_radiance(camera_position(params.camera), direction, params.lights, params.max_bounces, &rng);
        radiance += path.indirect * params.weight;
    }
    textureStore(indirect, pixel.xy, vec4f(radiance, 1.0));
}
