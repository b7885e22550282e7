// The map of caustics from its sums: light before reflection, and what denoisers need of each pixel. A thread per pixel.
//
// Light is E = π L / R, R the surface's reflectance: on Lambertian surfaces the irradiance. Black channels show no light.
#import "shared/camera.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/pixel_area.wgsl"
#import "shared/reflectance.wgsl"
#import "shared/splat_sums.wgsl"

struct ResolveParams {
    camera: Camera,
    // One over what the sums are scaled by.
    unit: f32,
    // Unit of the distances (m).
    distance_max: f32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: ResolveParams;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
// E (W·m⁻²); mean distance (m) that its light came from the last hit.
@group(0) @binding(3) var light: texture_storage_2d<rgba32float, write>;
// Visible point (world, m); area that the pixel shows of its surface (m²), 0 where no light is gathered.
@group(0) @binding(4) var points: texture_storage_2d<rgba32float, write>;
// Word 3: pixels whose sum passed what it can hold.
@group(0) @binding(5) var<storage, read_write> stats: array<atomic<u32>>;

@compute @workgroup_size(8, 8)
fn screen_space_resolve(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.camera.size) {
        return;
    }
    let point = visible_point(textureLoad(position, id.xy, 0), textureLoad(surface, id.xy, 0), camera_position(params.camera));
    var area = 0.0;
    if point.gatherable {
        area = pixel_area(params.camera, id.xy, point.position, point.normal_geometric);
    }
    let sums = light_sums(id.y * params.camera.size.x + id.x);
    if sums.overflowed {
        atomicAdd(&stats[3], 1u);
    }
    let share = reflectance(point.brdf, point.to_eye);
    let before = select(vec3f(0.0), sums.first * params.unit * PI / max(share, vec3f(1.0e-20)), share > vec3f(0.0));
    let distance = params.distance_max * sums.second.x / max(luminance(sums.first), 1.0e-30);
    textureStore(light, id.xy, vec4f(before, distance));
    textureStore(points, id.xy, vec4f(point.position, area));
}
