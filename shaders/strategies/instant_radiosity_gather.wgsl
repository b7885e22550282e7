// Adds some of the virtual point lights to what the ones before brought, with a shadow ray to each. A thread per pixel.
//
//   L(x) = Σ I(ω) f_x V cos θ_x / max(r², ε²) · stored / lights
#import "shared/bvh.wgsl"
#import "shared/virtual_light.wgsl"

struct GatherParams {
    camera_position_world: vec3f,
    // ε² (m²).
    least2: f32,
    size: vec2u,
    // Lights wanted, and the range of them that this dispatch adds.
    lights: u32,
    first: u32,
    end: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: GatherParams;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var<storage, read> virtual_lights: array<VirtualLight>;
@group(0) @binding(4) var<storage, read> photon_state: PhotonState;
// Radiance towards the eye (W·m⁻²·sr⁻¹), and the luminance that the least distance took.
@group(0) @binding(5) var before: texture_2d<f32>;
@group(0) @binding(6) var after: texture_storage_2d<rgba32float, write>;
// The third word counts sums that a driver cut short.
@group(0) @binding(7) var<storage, read_write> stats: array<atomic<u32>>;

const CUT: u32 = 2u;

@compute @workgroup_size(8, 8)
fn instant_radiosity_gather(@builtin(global_invocation_id) pixel: vec3u) {
    if any(pixel.xy >= params.size) {
        return;
    }
    let point = visible_point(
        textureLoad(position, pixel.xy, 0), textureLoad(surface, pixel.xy, 0), params.camera_position_world
    );
    let at = lit_surface(point);
    let end = select(0u, min(params.end, light_count(params.lights, photon_state.stored)), point.gatherable);
    var sum = vec4f(0.0);
    var i = params.first;
    while i < end {
        let light = virtual_lights[i];
        i += 1u;
        let lit = lit_by(at, point.to_eye, light, params.least2);
        if max_component(lit.radiance) > 0.0 {
            let ray = shadow_ray(at, light);
            if unoccluded(ray.origin, ray.span, 0.9999) {
                sum += vec4f(lit.radiance, lit.removed);
            }
        }
    }
    // llvmpipe ends every loop of an invocation, without a word, once they have turned 65,535 times together.
    if i < end {
        atomicAdd(&stats[CUT], 1u);
    }
    textureStore(after, pixel.xy, textureLoad(before, pixel.xy, 0) + sum * light_weight(params.lights, photon_state.stored));
}
