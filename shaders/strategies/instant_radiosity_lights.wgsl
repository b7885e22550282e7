// Makes virtual point lights of a frame's light vertices: all of them or, where there are more than asked for, a systematic sample. A thread
// per light.
//
// A record knows where it lies and not on what: a ray of a hair's length finds its surface again, one for each light against one for each light
// *and pixel* that follow. Records that held their surface would take more room, and most are never lights.
#import "shared/bvh.wgsl"
#import "shared/photon_store.wgsl"
#import "shared/virtual_light.wgsl"

struct LightsParams {
    // Lights wanted.
    lights: u32,
    seed: u32,
    // Vertices of as many scatterings send no light to what is seen.
    max_bounces: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: LightsParams;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;
@group(0) @binding(3) var<storage, read_write> lights_made: array<VirtualLight>;
// Lights, and vertices whose surface was not found again.
@group(0) @binding(4) var<storage, read_write> stats: array<atomic<u32>>;

const NO_VERTEX: u32 = 2u;

// The record of light `j` of `count`: ⌊(j stored + o) / count⌋ with o drawn from 0 to stored − 1, so that each is as often taken as another.
fn record_of(j: u32, count: u32, stored: u32) -> u32 {
    let drawn = unit_float(pcg4d(vec4u(params.seed, 0x56504c53u, 0u, 0u)).x);
    let offset = min(u32(drawn * f32(stored)), stored - 1u);
    // j stored would not fit 32 bits.
    return j * (stored / count) + (j * (stored % count) + offset) / count;
}

// The light of a record; what becomes of it: 0 a light, 1 it is lost, NO_VERTEX.
fn make_light(photon: Photon, light: ptr<function, VirtualLight>) -> u32 {
    if (photon.bounce_flags & 0xffu) >= params.max_bounces || photon.flux == 0u {
        return NO_VERTEX;
    }
    let normal = octahedral_decode(photon.normal);
    // Off the surface by its position's rounding, in floats and on the grid of a compact store.
    let reach = distance(offset_origin(photon.position, normal), photon.position) + 2.0 * photon_state.grid.step;
    let hit = trace_ray(photon.position + normal * reach, -normal, 2.0 * reach, false);
    if hit.index == NO_HIT {
        return 1u;
    }
    let surface = surface_at(hit, octahedral_decode(photon.direction));
    if dot(surface.normal_geometric, normal) < 0.5 || surface_opacity(surface) == 0.0 {
        return 1u;
    }
    *light = virtual_light(surface, photon.flux, photon.direction);
    return 0u;
}

@compute @workgroup_size(64)
fn instant_radiosity_lights(@builtin(global_invocation_id) id: vec3u) {
    let j = id.x;
    let stored = photon_state.stored;
    let count = light_count(params.lights, stored);
    if j >= count {
        return;
    }
    var light: VirtualLight;
    let became = make_light(photon_load(photons[record_of(j, count, stored)], photon_state.grid), &light);
    lights_made[j] = light;
    if became < NO_VERTEX {
        atomicAdd(&stats[became], 1u);
    }
}
