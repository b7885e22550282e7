// Where the previous image showed what each pixel shows.
#import "shared/camera.wgsl"
#import "shared/hit.wgsl"

struct MotionParams {
    camera: Camera,
    previous: Camera,
}

@group(0) @binding(0) var<uniform> params: MotionParams;
@group(0) @binding(1) var position: texture_2d<f32>;
// Zeros where the caller has none.
@group(0) @binding(2) var visibility: texture_2d<u32>;
// Corners of the triangles in the previous frame, in scene order; zeros where nothing moves.
@group(0) @binding(3) var<storage, read> positions: array<vec4f>;
// Displacement to the previous image (pixels right and down), depth along its view (m), 1 if it lay before the camera.
@group(0) @binding(4) var motion: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn filter_motion(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.camera.size) {
        return;
    }
    let now = textureLoad(position, pixel.xy, 0);
    let seen = textureLoad(visibility, pixel.xy, 0);
    var before = now.xyz;
    if seen.x != 0u {
        let first = 3u * (bvh_triangles[seen.x - 1u].id & ~ALPHA_TESTED);
        // Without corners the read is of the buffer's only elements, which are zero.
        let last = arrayLength(&positions) - 1u;
        let v0 = positions[min(first, last)];
        let v1 = positions[min(first + 1u, last)];
        let v2 = positions[min(first + 2u, last)];
        let bary = bitcast<vec2f>(seen.yz);
        let moved = v0 + (v1 - v0) * bary.x + (v2 - v0) * bary.y;
        before = select(before, moved.xyz, v0.w > 0.0);
    }
    let view = (params.previous.view_from_world * vec4f(before, 1.0)).xyz;
    let valid = now.w > 0.0 && view.z < 0.0;
    let film = camera_film(params.previous, vec3f(view.xy, min(view.z, -1.0e-20)));
    let displacement = film - (vec2f(pixel.xy) + params.camera.jitter);
    textureStore(motion, pixel.xy, select(vec4f(0.0), vec4f(displacement, -view.z, 1.0), valid));
}
