// How open the surroundings of each visible point are: the mean over directions of the cosine law of t/r, t the distance (m) of what a ray
// meets first, r the radius beyond which nothing counts.
#import "shared/bvh.wgsl"
#import "shared/camera.wgsl"
#import "shared/gbuffer.wgsl"

struct AmbientOcclusionParams {
    camera: Camera,
    seed: u32,
    frame: u32,
    // Per pixel.
    rays: u32,
    // r (m).
    radius: f32,
}

@group(0) @binding(0) var<uniform> params: AmbientOcclusionParams;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
// In each channel 0, closed in, to 1, open.
@group(0) @binding(3) var openness: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn ambient_occlusion(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.camera.size) {
        return;
    }
    let point = visible_point(textureLoad(position, pixel.xy, 0), textureLoad(surface, pixel.xy, 0), camera_position(params.camera));
    var open = 1.0;
    if point.gatherable {
        var rng = rng_new(params.seed, 0x414d4249u + params.frame, pixel.y * params.camera.size.x + pixel.x);
        let frame = tangent_frame(point.normal_geometric);
        let origin = offset_origin(point.position, point.normal_geometric);
        var sum = 0.0;
        for (var i = 0u; i < params.rays; i += 1u) {
            let direction = frame * sample_cosine_hemisphere(rng_next4(&rng).xy);
            sum += trace_ray(origin, direction, params.radius, false).t;
        }
        open = sum / (f32(max(params.rays, 1u)) * params.radius);
    }
    textureStore(openness, pixel.xy, vec4f(vec3f(open), 1.0));
}
