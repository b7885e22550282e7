// Resolves the visibility of each pixel into the G-buffer (see shared/gbuffer.wgsl for its three textures).
#import "shared/camera.wgsl"
#import "shared/environment.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/surface.wgsl"

struct GBufferParams {
    camera: Camera,
}

@group(0) @binding(0) var<uniform> params: GBufferParams;
@group(0) @binding(1) var visibility: texture_2d<u32>;
@group(0) @binding(2) var position: texture_storage_2d<rgba32float, write>;
@group(0) @binding(3) var surface: texture_storage_2d<rgba32uint, write>;
@group(0) @binding(4) var emission: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn gbuffer(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.camera.size) {
        return;
    }
    let direction = camera_direction(params.camera, vec2f(pixel.xy) + params.camera.jitter);
    let seen = textureLoad(visibility, pixel.xy, 0);
    if seen.x == 0u {
        textureStore(position, pixel.xy, vec4f(0.0));
        textureStore(surface, pixel.xy, vec4u(0u));
        // Nothing is there but the environment, which emits.
        var background = vec3f(0.0);
        if SCENE_ENVIRONMENT {
            background = environment_radiance(direction);
        }
        textureStore(emission, pixel.xy, vec4f(background, 0.0));
        return;
    }
    let found = surface_at(Hit(0.0, seen.x - 1u, bitcast<vec2f>(seen.yz)), direction);
    let depth = distance(found.position, camera_position(params.camera));
    textureStore(position, pixel.xy, vec4f(found.position, depth));
    textureStore(surface, pixel.xy, surface_encode(found.brdf, found.normal_geometric, !surface_gatherable(found)));
    textureStore(emission, pixel.xy, vec4f(found.emission, 1.0));
}
