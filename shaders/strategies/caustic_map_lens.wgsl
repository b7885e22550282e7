// Diameters of splats by the lens equations [WD08, section 4.2], of photons that came through one solid, in at one face and out at another.
// The record says where a photon left the lens; two rays back find the faces and their curvatures. All other photons, among them those that
// mirrors reflected, keep the diameter that ray differentials gave them. A thread per place.
//
// [WD08]: Wyman and Dachsbacher, "Reducing noise in image-space caustics with variable-sized splatting", 2008.
#import "shared/bvh.wgsl"
#import "shared/caustic_lens.wgsl"
#import "shared/caustic_places.wgsl"
#import "shared/caustic_view.wgsl"
#import "shared/dispatch.wgsl"
#import "shared/photon_store.wgsl"
#import "shared/surface.wgsl"

struct LensParams {
    grid: PhotonGrid,
    // Diameter of a splat in breadths of its beam.
    spread: f32,
    // Largest diameter (texels).
    most: f32,
    // 1: with the lens's thickness.
    thick: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: LensParams;
@group(0) @binding(1) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(2) var<storage, read_write> places: array<CausticPlace>;
@group(0) @binding(3) var<storage, read> place_count: u32;

// Cosine of the angle to the light within which a way back must end: rounding of the record's direction, magnified by the lens.
const ENDS_AT_LIGHT: f32 = 0.999;

// Mean curvature (m⁻¹) of a face, positive where it bulges to the side of its normal. A sphere has one curvature.
fn curvature(surface: Surface) -> f32 {
    let frame = tangent_frame(surface.normal_geometric);
    return 0.5 * (dot(surface_normal_derivative(surface, frame[0]), frame[0]) + dot(surface_normal_derivative(surface, frame[1]), frame[1]));
}

// Whether light passes the surface into a solid or out of it, unscattered.
fn bends(surface: Surface) -> bool {
    return surface.transmission > 0.0 && surface.thickness > 0.0 && !surface.rough_dielectric;
}

// Diameter over that without the lens; negative: the photon did not come through one.
fn magnification(photon: Photon, view: CausticView) -> f32 {
    let backwards = -octahedral_decode(photon.direction);
    let start = offset_origin(photon.position, octahedral_decode(photon.normal));
    let out = trace_ray(start, backwards, INFINITY, false);
    if out.index == NO_HIT {
        return -1.0;
    }
    let back = surface_at(out, backwards);
    if !(bends(back) && back.front) {
        return -1.0;
    }
    let inwards = refract(backwards, back.brdf.normal, 1.0 / back.ior);
    let entry = trace_ray(surface_exit(back, inwards), inwards, INFINITY, false);
    if entry.index == NO_HIT {
        return -1.0;
    }
    let front = surface_at(entry, inwards);
    if !bends(front) || front.front {
        return -1.0;
    }
    let outwards = refract(inwards, front.brdf.normal, front.ior);
    let q = front.position - view.origin;
    if dot(outwards, to_light(view, q)) < ENDS_AT_LIGHT {
        return -1.0;
    }
    let near = select(inverseSqrt(max(dot(q, q), 1.0e-30)), 0.0, view.parallel);
    // The ray meets the front face from inside: there its normal points inwards, and a bulge is hollow.
    let power = back.ior - 1.0;
    let lens = Lens(-power * curvature(front), power * curvature(back), entry.t * f32(params.thick), back.ior);
    return abs(lens_magnification(lens, near, out.t));
}

@compute @workgroup_size(64)
fn caustic_map_lens(@builtin(global_invocation_id) global_id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let slot = linear_index(global_id, workgroups, 64u);
    if slot >= place_count {
        return;
    }
    let place = places[slot];
    let photon = photon_load(photons[place.photon], params.grid);
    if (photon.bounce_flags & 0xffu) == 2u {
        let times = magnification(photon, caustic_view(place.views & 0xffffu));
        if times >= 0.0 {
            places[slot].diameter = clamp(params.spread * place.unrefracted * times, LEAST_DIAMETER, params.most);
        }
    }
}
