// Connects photons to the eye: light tracing for what no path from the eye can sample, light of points and directions
// that first met a mirror or a refractor. A photon of flux Φ at x adds to the pixel that shows x
//
//   Φ f(ω_P, ω_eye) |ω_P·n_s / ω_P·n_g| cos θ_x / (d² cos³ θ_film A_pixel)
//
// with A_pixel the pixel's area on the film at distance 1: the box filter of the picture, exactly.
#import "shared/bvh.wgsl"
#import "shared/camera.wgsl"
#import "shared/dispatch.wgsl"
#import "shared/photon_store.wgsl"
#import "shared/surface.wgsl"

struct PhotonSplatParams {
    camera: Camera,
    capacity: u32,
    // Fixed-point units per W·m⁻²·sr⁻¹.
    splat_scale: f32,
    seed: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: PhotonSplatParams;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> state: PhotonState;
// Six words a pixel.
@group(0) @binding(3) var<storage, read_write> splats: array<atomic<u32>>;
// Additions that overflowed a sum.
@group(0) @binding(4) var<storage, read_write> overflowed: atomic<u32>;

fn add(slot: u32, value: f32, dither: f32) {
    // Rounded by chance, so that sums are unbiased; bounded well below the counter.
    let fixed = u32(min(value * params.splat_scale + dither, 2.0e9));
    let before = atomicAdd(&splats[slot], fixed);
    if before + fixed < before {
        atomicAdd(&overflowed, 1u);
    }
}

@compute @workgroup_size(64)
fn photon_splat(@builtin(global_invocation_id) global_id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let index = linear_index(global_id, workgroups, 64u);
    if index >= min(state.stored, params.capacity) {
        return;
    }
    let photon = photon_load(photons[index], state.grid);
    if (photon.bounce_flags & PHOTON_LIGHT_ONLY) == 0u {
        return;
    }
    let view = (params.camera.view_from_world * vec4f(photon.position, 1.0)).xyz;
    if view.z >= 0.0 {
        return;
    }
    let film = camera_film(params.camera, view);
    if any(film < vec2f(0.0)) || any(film >= vec2f(params.camera.size)) {
        return;
    }
    let eye = camera_position(params.camera);
    let distance = length(view);
    let direction = (photon.position - eye) / distance;
    let hit = trace_ray(eye, direction, distance * 1.001, false);
    if hit.index == NO_HIT || hit.t < distance * 0.999 {
        return;
    }
    // The ray brings the material. The normal in the record is on the photon's side, the eye's side or, through a rough dielectric, the
    // other one; a record of another surface is told by it.
    let surface = surface_at(hit, direction);
    let incident = -octahedral_decode(photon.direction);
    let cos_incident = dot(incident, surface.normal_geometric);
    if dot(octahedral_decode(photon.normal), surface.normal_geometric) * sign(cos_incident) <= 0.5 {
        return;
    }
    let cos_film = -view.z / distance;
    let pixel_area = 4.0 * params.camera.tan_half.x * params.camera.tan_half.y / (f32(params.camera.size.x) * f32(params.camera.size.y));
    let geometry = dot(-direction, surface.normal_geometric) / (distance * distance * cos_film * cos_film * cos_film * pixel_area);
    let scattered = surface_response(surface, incident, -direction, true).value / max(abs(cos_incident), 1.0e-4);
    let value = flux_decode(photon.flux) * scattered * geometry;

    var rng = rng_new(params.seed, 0x53504c54u, index);
    let dither = rng_next4(&rng).xyz;
    let pixel = vec2u(film);
    let base = (pixel.y * params.camera.size.x + pixel.x) * 6u;
    add(base, value.r, dither.x);
    add(base + 1u, value.g, dither.y);
    add(base + 2u, value.b, dither.z);
    if (photon.bounce_flags & PHOTON_CAUSTIC) != 0u {
        add(base + 3u, value.r, dither.x);
        add(base + 4u, value.g, dither.y);
        add(base + 5u, value.b, dither.z);
    }
}
