// What a ray met, whatever traced it, and the tests of one triangle that all who trace share.
#import "shared/math.wgsl"
#import "shared/rng.wgsl"
#import "shared/scene_bindings.wgsl"
#import "shared/scene_traits.wgsl"
#import "shared/texture.wgsl"

const NO_HIT: u32 = 0xffffffffu;
const ALPHA_TESTED: u32 = 0x80000000u;

struct Hit {
    // Distance along the ray in units of its direction's length.
    t: f32,
    // Index into `bvh_triangles`, or NO_HIT.
    index: u32,
    // Barycentric weights of the second and third corner.
    uv: vec2f,
}

fn triangle_uv(attributes: TriangleAttributes, bary: vec2f) -> vec2f {
    return attributes.uv0 * (1.0 - bary.x - bary.y) + attributes.uv1 * bary.x + attributes.uv2 * bary.y;
}

// Whether an alpha-tested triangle lets the ray pass at `bary`. Blending is decided by a coin of the hit's own bits.
fn alpha_passes(id: u32, bary: vec2f, direction: vec3f) -> bool {
    let attributes = triangles[id];
    let material = materials[attributes.material];
    let alpha = material.base_color.a * sample_texture(material.base_color_texture, triangle_uv(attributes, bary), true).a;
    if material.alpha_cutoff >= 0.0 {
        return alpha < material.alpha_cutoff;
    }
    let coin = pcg4d(vec4u(bitcast<u32>(bary.x), bitcast<u32>(bary.y), id, bitcast<u32>(direction.x)));
    return unit_float(coin.x) >= alpha;
}

// Axes in which the ray is the z axis from 0: two across it, and the third scaled so that z is t.
fn ray_axes(direction: vec3f) -> mat3x3f {
    let length = length(direction);
    let frame = tangent_frame(direction / length);
    return mat3x3f(frame[0], frame[1], frame[2] / length);
}

// Watertight along shared edges and corners, after [Woop13], "Watertight Ray/Triangle Intersection", with a rotation in
// place of its shear. Whether a corner lies left or right of an edge is told by comparing the two products of the 2D
// cross product: rounding is monotonic, so the answer is right or "equal", and both triangles of an edge take an equal
// one. A difference would not do: contracted to a fused multiply-add it rounds differently for the two.
// Returns (t, u, v), t < 0 on a miss. Most tests miss, and what only a hit needs is behind a branch.
fn intersect_triangle(triangle: BvhTriangle, origin: vec3f, axes: mat3x3f) -> vec3f {
    let across = mat2x3f(axes[0], axes[1]);
    let v0 = triangle.v0 - origin;
    let v1 = triangle.v1 - origin;
    let v2 = triangle.v2 - origin;
    let a = v0 * across;
    let b = v1 * across;
    let c = v2 * across;
    let plus = vec3f(c.x * b.y, a.x * c.y, b.x * a.y);
    let minus = vec3f(c.y * b.x, a.y * c.x, b.y * a.x);
    let weights = plus - minus;
    let det = weights.x + weights.y + weights.z;
    var tuv = vec3f(-1.0);
    if (all(plus >= minus) || all(plus <= minus)) && det != 0.0 {
        let bary = weights / det;
        tuv = vec3f(dot(bary, axes[2] * mat3x3f(v0, v1, v2)), bary.yz);
    }
    return tuv;
}
