// Ray differentials [Igehy99] of photons: how a beam of one photon's share of its light widens and narrows on the way.
//
// A beam is a ray and its derivatives by two parameters whose unit square is one photon's share of the emission. Its cross section
// at a hit, seen along the normal, is |∂P/∂u × ∂P/∂v · n|: the area over which the photon stands for light.
//
// [Igehy99]: "Tracing ray differentials", SIGGRAPH 1999. Lengths are in units of the scene's radius where they are packed.
#import "shared/math.wgsl"

struct RayDifferential {
    position_u: vec3f,
    position_v: vec3f,
    direction_u: vec3f,
    direction_v: vec3f,
}

// Twelve halves.
struct PackedDifferential {
    words: array<u32, 6>,
}

fn differential_pack(d: RayDifferential) -> PackedDifferential {
    // Halves end at 65504.
    let limit = vec3f(6.0e4);
    let a = clamp(d.position_u, -limit, limit);
    let b = clamp(d.position_v, -limit, limit);
    let c = clamp(d.direction_u, -limit, limit);
    let e = clamp(d.direction_v, -limit, limit);
    return PackedDifferential(array<u32, 6>(
        pack2x16float(a.xy), pack2x16float(vec2f(a.z, b.x)), pack2x16float(b.yz),
        pack2x16float(c.xy), pack2x16float(vec2f(c.z, e.x)), pack2x16float(e.yz),
    ));
}

fn differential_unpack(packed: PackedDifferential) -> RayDifferential {
    let a = unpack2x16float(packed.words[0]);
    let b = unpack2x16float(packed.words[1]);
    let c = unpack2x16float(packed.words[2]);
    let d = unpack2x16float(packed.words[3]);
    let e = unpack2x16float(packed.words[4]);
    let f = unpack2x16float(packed.words[5]);
    return RayDifferential(vec3f(a, b.x), vec3f(b.y, c), vec3f(d, e.x), vec3f(e.y, f));
}

// A beam that starts with the cross section `area` (in units of the scene's radius squared) and fills `solid_angle` (sr).
fn differential_start(direction: vec3f, area: f32, solid_angle: f32) -> RayDifferential {
    let frame = tangent_frame(direction);
    let p = sqrt(area);
    // Beyond a radian a derivative says nothing.
    let d = min(sqrt(solid_angle), 1.0);
    return RayDifferential(frame[0] * p, frame[1] * p, frame[0] * d, frame[1] * d);
}

fn transfer_one(position: vec3f, direction_change: vec3f, direction: vec3f, t: f32, normal: vec3f) -> vec3f {
    let there = position + direction_change * t;
    let cosine = dot(direction, normal);
    return there - direction * (dot(there, normal) / select(cosine, 1.0e-4, abs(cosine) < 1.0e-4));
}

// To the plane that the ray meets at `t` (in units of the scene's radius); [Igehy99, Eq. 10].
fn differential_transfer(d: RayDifferential, direction: vec3f, t: f32, normal: vec3f) -> RayDifferential {
    return RayDifferential(
        transfer_one(d.position_u, d.direction_u, direction, t, normal),
        transfer_one(d.position_v, d.direction_v, direction, t, normal),
        d.direction_u,
        d.direction_v,
    );
}

// Area of the beam's section with a surface of that normal.
fn differential_area(d: RayDifferential, normal: vec3f) -> f32 {
    return abs(dot(cross(d.position_u, d.position_v), normal));
}

fn reflect_one(change: vec3f, normal_change: vec3f, direction: vec3f, normal: vec3f) -> vec3f {
    let cosine = dot(direction, normal);
    return change - 2.0 * (cosine * normal_change + (dot(change, normal) + dot(direction, normal_change)) * normal);
}

// [Igehy99, Eq. 14]; `normal_u` and `normal_v` are the derivatives of the normal.
fn differential_reflect(d: RayDifferential, direction: vec3f, normal: vec3f, normal_u: vec3f, normal_v: vec3f) -> RayDifferential {
    return RayDifferential(
        d.position_u,
        d.position_v,
        reflect_one(d.direction_u, normal_u, direction, normal),
        reflect_one(d.direction_v, normal_v, direction, normal),
    );
}

fn refract_one(change: vec3f, normal_change: vec3f, direction: vec3f, refracted: vec3f, normal: vec3f, eta: f32) -> vec3f {
    let cos_in = dot(direction, normal);
    let cos_out = min(dot(refracted, normal), -1.0e-4);
    let mu = eta * cos_in - cos_out;
    let mu_change = (eta - eta * eta * cos_in / cos_out) * (dot(change, normal) + dot(direction, normal_change));
    return eta * change - (mu * normal_change + mu_change * normal);
}

// [Igehy99, Eq. 17]; the normal on the side the ray comes from, `eta` = n_incident / n_transmitted.
fn differential_refract(d: RayDifferential, direction: vec3f, refracted: vec3f, normal: vec3f, normal_u: vec3f, normal_v: vec3f,
    eta: f32) -> RayDifferential {
    return RayDifferential(
        d.position_u,
        d.position_v,
        refract_one(d.direction_u, normal_u, direction, refracted, normal, eta),
        refract_one(d.direction_v, normal_v, direction, refracted, normal, eta),
    );
}
