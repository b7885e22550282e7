// What the light of each group of lights meets first: one ray per texel of its map, traced or looked up in the light's views. A
// texel is an equal part of the unit square that emission takes directions or positions from, so the flux that arrives in it is that
// of one photon.
//
// What a surface's light meets depends on where it leaves, too, which the map does not know: its texels hold the mean over rays from
// many places. Such a mean is smooth, so blocks of texels share their rays.
#import "shared/bvh.wgsl"
#import "shared/light_views.wgsl"

struct RsmMapParams {
    lights: LightInfo,
    // Texels across and down.
    size: u32,
    // Added to the albedo of every texel.
    albedo_floor: f32,
    // 1: rays are looked up in the views of the lights that have some.
    views_drawn: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: RsmMapParams;
@group(0) @binding(1) var importance: texture_storage_2d_array<r32float, write>;
@group(0) @binding(2) var held: texture_storage_2d_array<r32uint, write>;
@group(0) @binding(3) var seen: texture_2d_array<u32>;

// Texels across and down that share their rays in the map of a surface. In a room with one bright wall the variance is 0.50 of that
// of uniform emission with 1, 0.34 with 2, 0.31 with 4 and 0.32 with 8.
const SHARING: u32 = 4u;

// Row by row, 8 to a row.
var<workgroup> values: array<f32, 64>;

// What a ray of a group meets first, as near as its importance needs it.
fn first_hit(group: LightGroup, origin: vec3f, direction: vec3f) -> Hit {
    let place = seen_along(group, origin, direction, params.views_drawn);
    if place == NOT_SEEN {
        return trace_ray(origin, direction, INFINITY, false);
    }
    if place == 0u {
        return Hit(INFINITY, NO_HIT, vec2f(0.0));
    }
    let tuv = intersect_triangle(bvh_triangles[place - 1u], origin, ray_axes(direction));
    // A ray that passes by what its texel's centre saw has the colour of its middle.
    return Hit(tuv.x, place - 1u, select(vec2f(1.0 / 3.0), tuv.yz, tuv.x > 0.0));
}

struct RayValue {
    // luminance(flux × albedo) of a photon that stands for all of the group's light: maps of different groups are never compared.
    importance: f32,
    // Index into `bvh_triangles` + 1 of what every ray of the texel may meet; 0: they leave from different places, or meet nothing.
    held: u32,
}

fn ray_value(map: u32, texel: vec2u) -> RayValue {
    let group = light_groups[map];
    var light = group.first;
    var aim = vec2f(0.5);
    var place = vec2f(0.5);
    if lights[light].kind == LIGHT_TRIANGLE {
        let u = kronecker4(texel.y * params.size + texel.x, map);
        let member = group_member(group, u.x);
        light = member.light;
        place = vec2f(member.u, u.y);
        aim = u.zw;
    }
    let share = group.photon_probability / max(lights[light].photon_probability.x, 1.0e-37);
    let photon = emit_from_group(group, lights[light], (vec2f(texel) + aim) / f32(params.size), place, share, params.lights);
    let hit = first_hit(group, photon.origin, photon.direction);
    var albedo = params.albedo_floor;
    var met = 0u;
    if hit.index != NO_HIT {
        met = select(hit.index + 1u, 0u, lights[light].kind == LIGHT_TRIANGLE);
        let surface = surface_at(hit, photon.direction);
        albedo += luminance(surface.brdf.base_color);
    }
    return RayValue(luminance(photon.flux) * albedo, met);
}

@compute @workgroup_size(8, 8)
fn rsm_map(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_id) local: vec3u) {
    // The side of a map is a multiple of a workgroup's.
    let value = ray_value(id.z, id.xy);
    values[local.y * 8u + local.x] = value.importance;
    workgroupBarrier();
    var sum = 0.0;
    let corner = local.xy / SHARING * SHARING;
    for (var y = corner.y; y < corner.y + SHARING; y += 1u) {
        for (var x = corner.x; x < corner.x + SHARING; x += 1u) {
            sum += values[y * 8u + x];
        }
    }
    let shared_value = sum / f32(SHARING * SHARING);
    let surface = lights[light_groups[id.z].first].kind == LIGHT_TRIANGLE;
    textureStore(importance, id.xy, id.z, vec4f(select(value.importance, shared_value, surface), 0.0, 0.0, 0.0));
    textureStore(held, id.xy, id.z, vec4u(value.held, 0u, 0u, 0u));
}
