// Finds the light on whose map each caustic photon is splatted, and how broad its splat is. A thread per record.
//
// Of the lights that see where the photon landed it is the one whose texels are smallest there: the record does not say where the photon came
// from, and any map of the surface will do.
#import "shared/caustic_places.wgsl"
#import "shared/caustic_receivers.wgsl"
#import "shared/dispatch.wgsl"
#import "shared/lights.wgsl"
#import "shared/photon_store.wgsl"

struct PlaceParams {
    // Groups of lights; those without views are passed over.
    groups: u32,
    // Texels across and down a view.
    side: u32,
    // How far (m) a photon may lie off the receiver, however small the texels.
    slack: f32,
    // Diameter of all splats (texels); 0: by their beams.
    diameter: f32,
    // Diameter of a splat in breadths of its beam.
    spread: f32,
    // Largest diameter (texels).
    most: f32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: PlaceParams;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;
@group(0) @binding(3) var receivers: texture_2d_array<u32>;
@group(0) @binding(4) var<storage, read_write> places: array<CausticPlace>;
@group(0) @binding(5) var<storage, read_write> place_count: atomic<u32>;
// Caustic photons: seen, unseen.
@group(0) @binding(6) var<storage, read_write> stats: array<atomic<u32>>;

const SEEN: u32 = 0u;
const UNSEEN: u32 = 1u;
const NOT_ASKED: u32 = 2u;

var<workgroup> counts: array<atomic<u32>, 2>;
var<workgroup> first_place: u32;

// Breadth (texels) that the photon's share of the light would have if nothing had been met on the way. Its flux is the light's intensity
// times the solid angle it stands for, or the irradiance times the area: roulette keeps the largest channel of it.
fn unrefracted_breadth(photon: Photon, light: Light, view: CausticView, q: vec3f) -> f32 {
    let edges = texel_edges(view, f32(params.side));
    var intensity = max_component(light.intensity);
    if light.kind == LIGHT_SPOT {
        intensity *= spot_falloff(light, -dot(light.direction, to_light(view, q)));
    }
    let share = max_component(flux_decode(photon.flux)) / max(intensity, 1.0e-30);
    // A texel's solid angle is its area on the film times the cubed cosine there.
    let cosine = dot(view.forward, q) * inverseSqrt(max(dot(q, q), 1.0e-30));
    let texel = edges.x * edges.y * select(cosine * cosine * cosine, 1.0, view.parallel);
    return sqrt(share / max(texel, 1.0e-30));
}

struct Found {
    place: CausticPlace,
    became: u32,
}

fn find_place(record: u32) -> Found {
    let photon = photon_load(photons[record], photon_state.grid);
    var found = Found(CausticPlace(record, 0u, 0.0, 0.0), select(UNSEEN, NOT_ASKED, (photon.bounce_flags & PHOTON_CAUSTIC) == 0u));
    if found.became == NOT_ASKED {
        return found;
    }
    let normal = octahedral_decode(photon.normal);
    let side = f32(params.side);
    var smallest = INFINITY;
    for (var group = 0u; group < params.groups; group += 1u) {
        let of_light = light_groups[group];
        for (var index = of_light.first_view; index < of_light.first_view + of_light.view_count; index += 1u) {
            let view = caustic_view(index);
            let q = photon.position - view.origin;
            if light_sees(view, index, side, q, normal, params.slack) {
                let area = texel_area(view, map_film(view, q, side), side, q, normal);
                if area < smallest {
                    smallest = area;
                    found.place.views = of_light.first_view | (of_light.view_count << 16u);
                    found.place.unrefracted = unrefracted_breadth(photon, lights[of_light.first], view, q);
                    found.became = SEEN;
                }
            }
        }
    }
    let beam = unpack2x16float(photon.bounce_flags >> 16u).x * sqrt(PI);
    let diameter = select(params.spread * beam * inverseSqrt(smallest), params.diameter, params.diameter > 0.0);
    found.place.diameter = clamp(diameter, LEAST_DIAMETER, params.most);
    return found;
}

@compute @workgroup_size(64)
fn caustic_map_place(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let stored = min(photon_state.stored, arrayLength(&photons));
    let first = linear_index(group, workgroups, 1u) * 64u;
    // Most of a store laid out for all photons lies beyond its caustics: whole workgroups have nothing to do.
    if first >= stored {
        return;
    }
    var found = Found(CausticPlace(0u, 0u, 0.0, 0.0), NOT_ASKED);
    var within = 0u;
    if first + local < stored {
        found = find_place(first + local);
        if found.became != NOT_ASKED {
            within = atomicAdd(&counts[found.became], 1u);
        }
    }
    workgroupBarrier();
    if local < 2u {
        let count = atomicLoad(&counts[local]);
        if count > 0u {
            atomicAdd(&stats[local], count);
        }
        if local == SEEN {
            first_place = atomicAdd(&place_count, count);
        }
    }
    workgroupBarrier();
    if found.became == SEEN {
        places[first_place + within] = found.place;
    }
}
