// What the light of each punctual lamp meets first: one ray per texel of its map. A texel is an equal part of the unit square that
// `emit_from_light` takes directions or positions from, so the flux that arrives in it is that of one photon.
#import "shared/bvh.wgsl"
#import "shared/emission.wgsl"

struct RsmMapParams {
    lights: LightInfo,
    // Texels across and down.
    size: u32,
    // Added to the albedo of every texel.
    albedo_floor: f32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: RsmMapParams;
@group(0) @binding(1) var importance: texture_storage_2d_array<r32float, write>;

@compute @workgroup_size(8, 8)
fn rsm_map(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= vec2u(params.size)) {
        return;
    }
    let u = (vec2f(id.xy) + 0.5) / f32(params.size);
    // Parts of the light's own flux: maps of different lights are never compared.
    let photon = emit_from_light(lights[id.z], vec4f(u, 0.5, 0.5), 1.0, params.lights);
    let hit = trace_ray(photon.origin, photon.direction, INFINITY, false);
    var albedo = params.albedo_floor;
    if hit.index != NO_HIT {
        let surface = surface_at(hit, photon.direction);
        albedo += luminance(surface.brdf.base_color);
    }
    textureStore(importance, id.xy, id.z, vec4f(luminance(photon.flux) * albedo, 0.0, 0.0, 0.0));
}
