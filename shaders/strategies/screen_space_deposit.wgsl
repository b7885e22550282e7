// Adds each caustic photon to the pixel that sees where it landed, L = f Φ / a_p [Kim19, section 30.3.1]. A thread per record.
//
// [Kim19]: Kim, "Caustics using screen-space photon mapping", Ray Tracing Gems chapter 30, 2019.
#import "shared/camera.wgsl"
#import "shared/dispatch.wgsl"
#import "shared/estimate.wgsl"
#import "shared/photon_store.wgsl"
#import "shared/pixel_area.wgsl"
#import "shared/splat_sums.wgsl"

struct DepositParams {
    camera: Camera,
    // Sums hold radiance times this.
    scale: f32,
    // Range (m) of the distance from the last hit; 1 over the largest, or 0 for no distances.
    distance_min: f32,
    distance_max: f32,
    per_distance: f32,
    // Distance (m) from a pixel's tangent plane within which a photon is on its surface, however small the pixel.
    slack: f32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: DepositParams;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;
@group(0) @binding(3) var position: texture_2d<f32>;
@group(0) @binding(4) var surface: texture_2d<u32>;
// Caustic photons: seen, off the screen, hidden.
@group(0) @binding(5) var<storage, read_write> stats: array<atomic<u32>>;

const SEEN: u32 = 0u;
const OFF_SCREEN: u32 = 1u;
const HIDDEN: u32 = 2u;
const NOT_ASKED: u32 = 3u;

var<workgroup> counts: array<atomic<u32>, 3>;

// Adds one record; what became of it.
fn deposit(photon: Photon) -> u32 {
    if (photon.bounce_flags & PHOTON_CAUSTIC) == 0u {
        return NOT_ASKED;
    }
    let view = (params.camera.view_from_world * vec4f(photon.position, 1.0)).xyz;
    let film = camera_film(params.camera, view);
    if view.z >= 0.0 || !all(film >= vec2f(0.0)) || !all(film < vec2f(params.camera.size)) {
        return OFF_SCREEN;
    }
    let pixel = vec2u(film);
    let code = textureLoad(surface, pixel, 0);
    if !gathers(code) {
        return HIDDEN;
    }
    let point = visible_point(textureLoad(position, pixel, 0), code, camera_position(params.camera));
    let light = photon_light(photon);
    // The surface that the pixel shows is the photon's: it lies on the tangent plane, but for the surface's curvature within the pixel, faces
    // as the photon's does, and the light comes from before it.
    let edge = 2.0 * params.camera.tan_half / vec2f(params.camera.size);
    let slack = max(-view.z * max(edge.x, edge.y), params.slack);
    let cos_geometric = dot(light.incident, point.normal_geometric);
    if abs(dot(point.normal_geometric, photon.position - point.position)) > slack
        || dot(light.normal, point.normal_geometric) < MIN_NORMAL_COSINE || cos_geometric <= 0.0 {
        return HIDDEN;
    }
    // Without a shading normal of its own a surface needs no correction, which is a little off for it.
    let correction = select(shading_correction(light.incident, point.brdf.normal, cos_geometric), 1.0, code.x == code.y);
    let reflected = brdf_eval(point.brdf, light.incident, point.to_eye) * correction;
    let radiance = light.flux * reflected * (params.scale / pixel_area(params.camera, pixel, point.position, point.normal_geometric));
    let distance = clamp(unpack2x16float(photon.length_probability).x, params.distance_min, params.distance_max);
    let weighted = luminance(radiance) * distance * params.per_distance;
    add_light(pixel.y * params.camera.size.x + pixel.x, radiance, vec3f(weighted, 0.0, 0.0));
    return SEEN;
}

@compute @workgroup_size(64)
fn screen_space_deposit(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let stored = min(photon_state.stored, arrayLength(&photons));
    let first = linear_index(group, workgroups, 1u) * 64u;
    // Most of a store laid out for all photons lies beyond its caustics: whole workgroups have nothing to count.
    if first >= stored {
        return;
    }
    let index = first + local;
    if index < stored {
        let became = deposit(photon_load(photons[index], photon_state.grid));
        if became != NOT_ASKED {
            atomicAdd(&counts[became], 1u);
        }
    }
    workgroupBarrier();
    if local < 3u {
        let count = atomicLoad(&counts[local]);
        if count > 0u {
            atomicAdd(&stats[local], count);
        }
    }
}
