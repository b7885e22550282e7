// Lights that follow one map: a punctual light, or a piece of an emissive surface. The map steers where photons go; where on a surface
// they leave is drawn as without it.
#import "shared/emission.wgsl"

const NO_GROUP: u32 = 0xffffffffu;

// The group among the first `count` that `light` belongs to, or NO_GROUP.
fn group_of(light: u32, count: u32) -> u32 {
    var low = 0u;
    var high = count;
    while low < high {
        let middle = (low + high) / 2u;
        if light_groups[middle].first <= light {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    let group = max(low, 1u) - 1u;
    let within = low > 0u && light - light_groups[group].first < light_groups[group].count;
    return select(NO_GROUP, group, within);
}

// The light of a group that `u` in [0, 1) selects as its photons are shared, and what is left of `u`, in [0, 1).
struct Member {
    light: u32,
    u: f32,
}

fn group_member(group: LightGroup, u: f32) -> Member {
    let start = lights[group.first].photon_start.x;
    let at = u * group.photon_probability;
    var low = group.first;
    var high = group.first + group.count - 1u;
    while low < high {
        let middle = (low + high + 1u) / 2u;
        if f32(lights[middle].photon_start.x - start) <= at * 4294967296.0 {
            low = middle;
        } else {
            high = middle - 1u;
        }
    }
    let before = f32(lights[low].photon_start.x - start) / 4294967296.0;
    let rest = (at - before) / max(lights[low].photon_probability.x, 1.0e-37);
    return Member(low, clamp(rest, 0.0, 0.99999994));
}

// The photon of `light` that leaves for the point `aim` of the unit square over which the group's map lies: directions, or of a
// directional light positions. `place`: where on a surface.
fn emit_from_group(group: LightGroup, light: Light, aim: vec2f, place: vec2f, share: f32, info: LightInfo) -> Emitted {
    if light.kind == LIGHT_TRIANGLE {
        return emit_from_triangle(light, vec4f(place, aim), share, group.axis);
    }
    return emit_from_light(light, vec4f(aim, place), share, info);
}
