// One bounce of a batch: each photon that hit something leaves a record there, if it was scattered before (light that arrives
// straight from a light is direct light) and the surface is not wholly specular, and is then absorbed or scattered. One thread per path.
// With `light_vertices` records are of light that goes on: first vertices leave them, too, and last ones only where their light is caustic.
//
// Russian roulette keeps the largest channel of the flux [Jen01]: q = max(ρΦ) / max(Φ), Φ_r = ρΦ / q. Where the photon's source chose it
// for the part e that it expects the first scattering to keep, q = max(ρΦ) / max(eΦ) there: such photons go on with equal flux.
#import "shared/deposit_cull.wgsl"
#import "shared/dispatch.wgsl"
#import "shared/flux_ledger.wgsl"
#import "shared/shading_normal.wgsl"
#import "shared/surface.wgsl"

struct PhotonScatterParams {
    cull: DepositCull,
    seed: u32,
    // Scatterings a photon may undergo before its last record.
    max_bounces: u32,
    // 1: only paths that begin with a specular scattering are followed.
    caustics_only: u32,
    // 1: records are vertices that send light to what is seen, first ones among them.
    light_vertices: u32,
    // Fixed-point units per watt.
    ledger_scale: f32,
    // Scene's radius (m), the unit of differentials.
    bounds_radius: f32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: PhotonScatterParams;
@group(0) @binding(1) var<storage, read> hits: array<RayHit>;
@group(0) @binding(2) var<storage, read_write> rays: array<Ray>;
@group(0) @binding(3) var<storage, read_write> paths: array<PhotonPath>;
// The record each path leaves here, in its own place; NO_RECORD in bounce_flags: none.
@group(0) @binding(4) var<storage, read_write> staging: array<Photon>;
@group(0) @binding(5) var<storage, read_write> tally: PhotonTally;

// Solid angle (sr) over which [MML13, Eq. 5] takes the probability of a scattering.
const PROBABILITY_SOLID_ANGLE: f32 = 1.0e-3;

var<workgroup> block_stored: atomic<u32>;
var<workgroup> block_alive: atomic<u32>;

// The beam after the photon was scattered specularly; it keeps its section.
fn scattered_beam(beam: RayDifferential, surface: Surface, direction: vec3f, onward: vec3f) -> RayDifferential {
    let normal = surface.brdf.normal;
    let radius = params.bounds_radius;
    let normal_u = surface_normal_derivative(surface, beam.position_u * radius);
    let normal_v = surface_normal_derivative(surface, beam.position_v * radius);
    if dot(onward, surface.normal_geometric) > 0.0 {
        return differential_reflect(beam, direction, normal, normal_u, normal_v);
    }
    if surface.thickness <= 0.0 {
        return beam;
    }
    let eta = select(surface.ior, 1.0 / surface.ior, surface.front);
    return differential_refract(beam, direction, onward, normal, normal_u, normal_v, eta);
}

// Handles one path; false when it ends here. `record` is what it leaves.
fn scatter_photon(i: u32, record: ptr<function, Photon>) -> bool {
    let ray = rays[i];
    let direction = ray.direction;
    var path = paths[i];
    let bounce = path.bounce_flags & 0xffu;
    var flags = path.bounce_flags & 0xff00u;
    let expected = unpack2x16float(path.bounce_flags >> 16u).x;
    let remaining = to_fixed(path.flux, params.ledger_scale);
    if bounce == 0u {
        ledger_add(EMITTED, remaining);
    }
    let found = hits[i];
    if found.triangle == NO_HIT {
        ledger_add(ESCAPED, remaining);
        return false;
    }
    let surface = surface_at(Hit(found.t, triangles[found.triangle].leaf, found.bary), direction);
    if SCENE_REFRACTS && !surface.front && surface.thickness > 0.0 {
        path.flux *= exp(-surface.absorption * found.t);
    }
    var rng = Rng(vec3u(params.seed, 0x50484f54u, path.index), bounce * 4u);
    let noise = rng_next4(&rng);
    var beam = differential_unpack(path.differential);
    let specular_so_far = (flags & PHOTON_CAUSTIC) != 0u;
    if specular_so_far {
        beam = differential_transfer(beam, direction, found.t / params.bounds_radius, surface.normal_geometric);
    }
    let opacity = surface_opacity(surface);
    let as_vertex = (params.light_vertices != 0u) & ((bounce < params.max_bounces) | specular_so_far);
    if (opacity > 0.0) & (as_vertex | ((params.light_vertices == 0u) & (bounce > 0u))) {
        if deposit_can_be_seen(params.cull, surface.position, surface.normal_geometric) {
            var footprint = 0.0;
            if specular_so_far {
                footprint = sqrt(differential_area(beam, surface.normal_geometric) / PI) * params.bounds_radius;
            }
            // Light that nothing scattered is no caustic.
            let record_flags = flags & select(PHOTON_RECORD_FLAGS, PHOTON_RECORD_FLAGS & ~PHOTON_CAUSTIC, bounce == 0u);
            *record = photon_record(surface.position, path.flux, noise.xyz, direction, surface.normal_geometric, found.t,
                path.path_probability, bounce | record_flags, footprint);
        } else {
            atomicAdd(&tally.culled, 1u);
        }
    }
    // No short-circuits: Mesa's lavapipe 22 may compile a shader anew at every dispatch if a branch hangs on uniforms alone.
    if (bounce == params.max_bounces) | ((params.caustics_only != 0u) & (bounce == 0u) & (opacity == 1.0)) {
        ledger_add(TERMINATED, remaining);
        return false;
    }

    let wo = -direction;
    let scattered = scatter(surface, wo, rng_next4(&rng), false);
    var weight = scattered.weight;
    if !scattered.specular && max_component(weight) > 0.0 {
        weight *= flux_correction(wo, scattered.direction, surface.brdf.normal, surface.normal_geometric);
    }
    let scattered_flux = path.flux * weight;
    let compared = max_component(path.flux) * select(1.0, expected, expected > 0.0);
    var survival = min(1.0, max_component(scattered_flux) / max(compared, 1.0e-37));
    // A surface may be specular in part.
    survival = select(survival, 0.0, (params.caustics_only != 0u) & (bounce == 0u) & !scattered.specular);
    if rng_next4(&rng).x >= survival {
        ledger_add(TERMINATED, remaining);
        return false;
    }
    path.flux = scattered_flux / survival;
    ledger_add(ABSORBED, remaining - to_fixed(path.flux, params.ledger_scale));

    if scattered.specular {
        path.path_probability *= min(1.0, max_component(scattered.weight));
        if bounce == 0u && (flags & PHOTON_DELTA) != 0u {
            flags |= PHOTON_LIGHT_ONLY;
        }
        if specular_so_far {
            path.differential = differential_pack(scattered_beam(beam, surface, direction, scattered.direction));
        }
    } else {
        path.path_probability *= min(1.0, max_component(scattered.weight) * scattered.pdf * PROBABILITY_SOLID_ANGLE);
        flags = (flags & ~PHOTON_CAUSTIC) | select(PHOTON_DIFFUSE, PHOTON_GLOSSY, scattered.glossy);
    }
    path.bounce_flags = (bounce + 1u) | flags;
    paths[i] = path;
    rays[i] = Ray(surface_exit(surface, scattered.direction), INFINITY, scattered.direction, 0u);
    return true;
}

@compute @workgroup_size(64)
fn photon_scatter(@builtin(global_invocation_id) global_id: vec3u, @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let i = linear_index(global_id, workgroups, PATH_BLOCK);
    if rays[i].t_max > 0.0 {
        var record: Photon;
        record.bounce_flags = NO_RECORD;
        if scatter_photon(i, &record) {
            atomicAdd(&block_alive, 1u);
        } else {
            rays[i].t_max = -1.0;
        }
        if record.bounce_flags != NO_RECORD {
            atomicAdd(&block_stored, 1u);
            staging[i] = record;
        } else {
            staging[i].bounce_flags = NO_RECORD;
        }
    } else {
        staging[i].bounce_flags = NO_RECORD;
    }
    ledger_publish(local);
    if local == 0u {
        tally.stored[i / PATH_BLOCK] = atomicLoad(&block_stored);
        tally.alive[i / PATH_BLOCK] = atomicLoad(&block_alive);
    }
}
