// Small mathematics every pass shares.

const PI: f32 = 3.14159265358979;
const INFINITY: f32 = 3.0e38;

fn max_component(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

fn mean_component(v: vec3f) -> f32 {
    return (v.x + v.y + v.z) * (1.0 / 3.0);
}

// Tangent frame of a unit normal, without branches at the pole [Duff17], "Building an Orthonormal Basis, Revisited".
fn tangent_frame(n: vec3f) -> mat3x3f {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    let t = vec3f(1.0 + s * n.x * n.x * a, s * b, -s * n.x);
    let u = vec3f(b, s + n.y * n.y * a, -n.y);
    return mat3x3f(t, u, n);
}

// Of linear Rec. 709.
fn luminance(color: vec3f) -> f32 {
    return dot(color, vec3f(0.2126, 0.7152, 0.0722));
}

// Unit vectors in 32 bits: octahedral, 16-bit signed components [Cigolle14]; error below 4e-5 rad.
fn octahedral_encode(v: vec3f) -> u32 {
    var p = v.xy / (abs(v.x) + abs(v.y) + abs(v.z));
    if v.z < 0.0 {
        p = (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
    }
    return pack2x16snorm(p);
}

fn octahedral_decode(bits: u32) -> vec3f {
    let p = unpack2x16snorm(bits);
    var v = vec3f(p, 1.0 - abs(p.x) - abs(p.y));
    let fold = max(-v.z, 0.0);
    v.x -= select(-fold, fold, v.x >= 0.0);
    v.y -= select(-fold, fold, v.y >= 0.0);
    return normalize(v);
}

// Origin of a ray that leaves a surface at `position` on the side of `normal`: further than the rounding of `position`
// (a few ulp of its largest coordinate), far nearer than anything the scene shows.
fn offset_origin(position: vec3f, normal: vec3f) -> vec3f {
    let scale = max(max_component(abs(position)), 0.05);
    return position + normal * (scale * 1.0e-5);
}

// Points of the unit disc, uniform by area, from the unit square.
fn sample_disc(u: vec2f) -> vec2f {
    let r = sqrt(u.x);
    let phi = 2.0 * PI * u.y;
    return r * vec2f(cos(phi), sin(phi));
}

// Direction with density cos θ / π around +z.
fn sample_cosine_hemisphere(u: vec2f) -> vec3f {
    let d = sample_disc(u);
    return vec3f(d, sqrt(max(0.0, 1.0 - u.x)));
}

// Direction uniform over the sphere.
fn sample_sphere(u: vec2f) -> vec3f {
    let z = 1.0 - 2.0 * u.x;
    let r = sqrt(max(0.0, 1.0 - z * z));
    let phi = 2.0 * PI * u.y;
    return vec3f(r * cos(phi), r * sin(phi), z);
}
