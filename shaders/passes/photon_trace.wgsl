// Follows one batch of photons from the lights and notes one record per non-specular hit after the first scattering
// (light that arrives straight from a light is direct light). One thread per photon; records go to the photon's own
// places in `staging`, so that a scan can pack them in an order that does not depend on the race of threads.
//
// Russian roulette keeps the largest channel of the flux [Jen01]: q = max(ρΦ) / max(Φ), Φ_r = ρΦ / q.
// Every change of flux is tallied in fixed point: emitted = absorbed + escaped + terminated holds to the last bit.
#import "shared/dispatch.wgsl"
#import "shared/emission.wgsl"
#import "shared/photon.wgsl"
#import "shared/surface.wgsl"

struct PhotonTraceParams {
    lights: LightInfo,
    // Photons in all batches together.
    emitted: u32,
    first: u32,
    // Photons of this batch.
    count: u32,
    seed: u32,
    // Scatterings a photon may undergo; also its places in `staging`.
    max_bounces: u32,
    // 1: only paths that begin with a specular scattering are followed.
    caustics_only: u32,
    // Fixed-point units per watt.
    ledger_scale: f32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: PhotonTraceParams;
@group(0) @binding(1) var<storage, read_write> staging: array<Photon>;
// Records each photon of the batch left.
@group(0) @binding(2) var<storage, read_write> counts: array<u32>;
@group(0) @binding(3) var<storage, read_write> ledger: array<atomic<u32>>;

const EMITTED: u32 = 0u;
const ABSORBED: u32 = 1u;
const ESCAPED: u32 = 2u;
const TERMINATED: u32 = 3u;

// Sums of the workgroup: low 16 bits and the signed rest apart, so that neither can overflow.
var<workgroup> tally_low: array<atomic<u32>, 12>;
var<workgroup> tally_high: array<atomic<i32>, 12>;

fn to_fixed(flux: vec3f) -> vec3i {
    return vec3i(round(min(flux * params.ledger_scale, vec3f(1.0e9))));
}

fn tally_one(slot: u32, value: i32) {
    if value != 0 {
        atomicAdd(&tally_low[slot], u32(value) & 0xffffu);
        atomicAdd(&tally_high[slot], value >> 16u);
    }
}

fn tally(kind: u32, value: vec3i) {
    tally_one(kind * 3u, value.x);
    tally_one(kind * 3u + 1u, value.y);
    tally_one(kind * 3u + 2u, value.z);
}

// Solid angle (sr) over which [MML13, Eq. 5] takes the probability of a scattering.
const PROBABILITY_SOLID_ANGLE: f32 = 1.0e-3;

fn follow(thread: u32) {
    let index = params.first + thread;
    let emitted = emit_photon(index, params.emitted, params.seed, params.lights);
    var rng = rng_new(params.seed, 0x50484f54u, index);
    var origin = emitted.origin;
    var direction = emitted.direction;
    var flux = emitted.flux;
    var remaining = to_fixed(flux);
    tally(EMITTED, remaining);
    var path_probability = 1.0;
    var flags = PHOTON_CAUSTIC;
    var stored = 0u;
    for (var bounce = 0u; ; bounce += 1u) {
        let hit = trace_ray(origin, direction, INFINITY, false);
        if hit.index == NO_HIT {
            tally(ESCAPED, remaining);
            break;
        }
        let surface = surface_at(hit, direction);
        if SCENE_REFRACTS && !surface.front && surface.thickness > 0.0 {
            flux *= exp(-surface.absorption * hit.t);
        }
        let specular = surface_opacity(surface) == 0.0;
        if !specular && bounce > 0u {
            let noise = rng_next4(&rng);
            staging[thread * params.max_bounces + stored] = Photon(
                surface.position,
                flux_encode(flux, noise.xyz),
                octahedral_encode(direction),
                octahedral_encode(surface.normal_geometric),
                pack2x16float(vec2f(min(hit.t, 65504.0), path_probability)),
                bounce | flags,
            );
            stored += 1u;
        }
        if bounce == params.max_bounces || (params.caustics_only != 0u && bounce == 0u && !specular) {
            tally(TERMINATED, remaining);
            break;
        }

        let wo = -direction;
        let scattered = scatter(surface, wo, rng_next4(&rng), false);
        var weight = scattered.weight;
        if !scattered.specular && max_component(weight) > 0.0 {
            // Light travels against the direction the shading normal was made for [Veach97, §5.3].
            let n_s = surface.brdf.normal;
            let n_g = surface.normal_geometric;
            let swap = abs(dot(wo, n_s) * dot(scattered.direction, n_g))
                / max(abs(dot(wo, n_g) * dot(scattered.direction, n_s)), 1.0e-4);
            weight *= min(swap, 8.0);
        }
        let scattered_flux = flux * weight;
        let survival = min(1.0, max_component(scattered_flux) / max(max_component(flux), 1.0e-37));
        if rng_next4(&rng).x >= survival {
            tally(TERMINATED, remaining);
            break;
        }
        flux = scattered_flux / survival;
        let after = to_fixed(flux);
        tally(ABSORBED, remaining - after);
        remaining = after;

        if scattered.specular {
            path_probability *= min(1.0, max_component(scattered.weight));
            if bounce == 0u && emitted.delta {
                flags |= PHOTON_LIGHT_ONLY;
            }
        } else {
            path_probability *= min(1.0, max_component(scattered.weight) * scattered.pdf * PROBABILITY_SOLID_ANGLE);
            flags &= ~PHOTON_CAUSTIC;
        }
        direction = scattered.direction;
        origin = surface_exit(surface, direction);
    }
    counts[thread] = stored;
}

// Adds the workgroup's sum to the 64-bit total.
fn publish(slot: u32) {
    let low = atomicLoad(&tally_low[slot]);
    let high = atomicLoad(&tally_high[slot]);
    let shifted = bitcast<u32>(high) << 16u;
    let word = shifted + low;
    var upper = bitcast<u32>(high >> 16u) + select(0u, 1u, word < shifted);
    let before = atomicAdd(&ledger[2u * slot], word);
    upper += select(0u, 1u, before + word < before);
    if upper != 0u {
        atomicAdd(&ledger[2u * slot + 1u], upper);
    }
}

@compute @workgroup_size(64)
fn photon_trace(@builtin(global_invocation_id) global_id: vec3u, @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let thread = linear_index(global_id, workgroups, 64u);
    if thread < params.count {
        follow(thread);
    }
    workgroupBarrier();
    if local < 12u {
        publish(local);
    }
}
