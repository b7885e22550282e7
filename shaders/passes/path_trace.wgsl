// The reference: one path per pixel and frame from the eye (shared/path.wgsl), for a band of rows, plus the light that
// only particles from the lights can bring (`splats`, see photon_splat.wgsl).
#import "shared/camera.wgsl"
#import "shared/path.wgsl"

struct PathTraceParams {
    camera: Camera,
    lights: LightInfo,
    seed: u32,
    frame: u32,
    max_bounces: u32,
    first_row: u32,
    row_count: u32,
    // Radiance of one unit of `splats`; 0: there are none.
    splat_unit: f32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: PathTraceParams;
// Per pixel: indirect red, green, blue, and the caustic part of it, in fixed point.
@group(0) @binding(1) var<storage, read> splats: array<u32>;
@group(0) @binding(2) var direct: texture_storage_2d<rgba32float, write>;
@group(0) @binding(3) var indirect: texture_storage_2d<rgba32float, write>;
@group(0) @binding(4) var caustic: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn path_trace(@builtin(global_invocation_id) thread: vec3u) {
    let pixel = vec2u(thread.x, thread.y + params.first_row);
    if pixel.x >= params.camera.size.x || thread.y >= params.row_count || pixel.y >= params.camera.size.y {
        return;
    }
    let index = pixel.y * params.camera.size.x + pixel.x;
    var rng = rng_new(params.seed, 0x50415448u + params.frame, index);
    let direction = camera_direction(params.camera, vec2f(pixel) + rng_next4(&rng).xy);
    var result = path_radiance(camera_position(params.camera), direction, params.lights, params.max_bounces, &rng);
    if params.splat_unit > 0.0 {
        let base = index * 6u;
        result.indirect += vec3f(f32(splats[base]), f32(splats[base + 1u]), f32(splats[base + 2u])) * params.splat_unit;
        result.caustic += vec3f(f32(splats[base + 3u]), f32(splats[base + 4u]), f32(splats[base + 5u])) * params.splat_unit;
    }
    textureStore(direct, pixel, vec4f(result.direct, 1.0));
    textureStore(indirect, pixel, vec4f(result.indirect, 1.0));
    textureStore(caustic, pixel, vec4f(result.caustic, 1.0));
}
