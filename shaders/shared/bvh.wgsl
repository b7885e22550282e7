// Rays against the scene: traversal of a compressed eight-wide BVH [Ylitie17], "Efficient Incoherent Ray Traversal on
// GPUs Through Compressed Wide BVHs", with the node layout of the crate obvhs (80 bytes; minima and maxima interleaved).
//
// `trace_ray` and `unoccluded` are all that other shaders know of rays; `shared/ray_query.wgsl` offers the same two.
#import "shared/hit.wgsl"

// Deeper trees than this are refused when the scene is built.
const TRAVERSAL_STACK_SIZE: u32 = 32u;

fn bytes_of(word: u32) -> vec4f {
    return vec4f(unpack4xU8(word));
}

// Children of a node that the ray meets between `t_min` and `t_max`: a bit per inner child in the top byte, a bit per triangle below.
fn intersect_node(node: u32, origin: vec3f, inv_direction: vec3f, octant: u32, t_min: f32, t_max: f32) -> vec4u {
    let base = node * 5u;
    let head = bvh_nodes[base];
    let meta_words = bvh_nodes[base + 1u];
    let x_planes = bvh_nodes[base + 2u];
    let y_planes = bvh_nodes[base + 3u];
    let z_planes = bvh_nodes[base + 4u];
    let scale = vec3f(
        bitcast<f32>((head.w & 0xffu) << 23u),
        bitcast<f32>(((head.w >> 8u) & 0xffu) << 23u),
        bitcast<f32>(((head.w >> 16u) & 0xffu) << 23u),
    ) * inv_direction;
    let start = (bitcast<vec3f>(head.xyz) - origin) * inv_direction;
    let negative = inv_direction < vec3f(0.0);
    var hits = 0u;
    for (var half = 0u; half < 2u; half += 1u) {
        let meta4 = select(meta_words.z, meta_words.w, half == 1u);
        let inner = (meta4 & (meta4 << 1u)) & 0x10101010u;
        let inner_mask = (inner >> 4u) * 0xffu;
        let bit_index = (meta4 ^ (octant & inner_mask)) & 0x1f1f1f1fu;
        let child_bits = (meta4 >> 5u) & 0x07070707u;
        let x_low = bytes_of(select(x_planes.x, x_planes.y, half == 1u));
        let x_high = bytes_of(select(x_planes.z, x_planes.w, half == 1u));
        let y_low = bytes_of(select(y_planes.x, y_planes.y, half == 1u));
        let y_high = bytes_of(select(y_planes.z, y_planes.w, half == 1u));
        let z_low = bytes_of(select(z_planes.x, z_planes.y, half == 1u));
        let z_high = bytes_of(select(z_planes.z, z_planes.w, half == 1u));
        let near = max(max(
            select(x_low, x_high, negative.x) * scale.x + start.x,
            select(y_low, y_high, negative.y) * scale.y + start.y),
            max(select(z_low, z_high, negative.z) * scale.z + start.z, vec4f(t_min)));
        // Widened by two ulp [Ize13], so that rounding loses no box.
        let far = min(min(
            select(x_high, x_low, negative.x) * scale.x + start.x,
            select(y_high, y_low, negative.y) * scale.y + start.y),
            min(select(z_high, z_low, negative.z) * scale.z + start.z, vec4f(t_max))) * 1.0000003;
        let met = near <= far;
        let bits = vec4u(
            (child_bits & 0xffu) << (bit_index & 0xffu),
            ((child_bits >> 8u) & 0xffu) << ((bit_index >> 8u) & 0xffu),
            ((child_bits >> 16u) & 0xffu) << ((bit_index >> 16u) & 0xffu),
            (child_bits >> 24u) << (bit_index >> 24u),
        );
        let kept = select(vec4u(0u), bits, met);
        hits |= kept.x | kept.y | kept.z | kept.w;
    }
    // Hits, inner-child mask, first child, first triangle.
    return vec4u(hits, head.w >> 24u, meta_words.x, meta_words.y);
}

// Nearest hit of the ray in (t_min, t_max), alpha left aside. With `any`, the first opaque one found.
fn traverse(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, any: bool) -> Hit {
    var hit = Hit(t_max, NO_HIT, vec2f(0.0));
    // A zero component becomes tiny: no infinities meet a zero in the slab test.
    let tiny = abs(direction) < vec3f(1.0e-20);
    let safe = select(direction, vec3f(1.0e-20), tiny);
    let inv_direction = 1.0 / safe;
    let axes = ray_axes(direction);
    let octant = select(0x04040404u, 0u, safe.x < 0.0) | select(0x02020202u, 0u, safe.y < 0.0)
        | select(0x01010101u, 0u, safe.z < 0.0);
    var stack: array<vec2u, TRAVERSAL_STACK_SIZE>;
    var stack_size = 0u;
    var group = vec2u(0u, 0x80000000u);
    loop {
        var primitives = vec2u(0u);
        if (group.y & 0xff000000u) != 0u {
            let bit = firstLeadingBit(group.y);
            let inner_mask = group.y;
            group.y &= ~(1u << bit);
            if (group.y & 0xff000000u) != 0u && stack_size < TRAVERSAL_STACK_SIZE {
                stack[stack_size] = group;
                stack_size += 1u;
            }
            let slot = (bit - 24u) ^ (octant & 0xffu);
            let child = group.x + countOneBits(inner_mask & ~(0xffffffffu << slot));
            let found = intersect_node(child, origin, inv_direction, octant, t_min, hit.t);
            group = vec2u(found.z, (found.x & 0xff000000u) | found.y);
            primitives = vec2u(found.w, found.x & 0x00ffffffu);
        } else {
            group = vec2u(0u);
        }
        while primitives.y != 0u {
            let bit = firstLeadingBit(primitives.y);
            primitives.y &= ~(1u << bit);
            let index = primitives.x + bit;
            let triangle = bvh_triangles[index];
            let tuv = intersect_triangle(triangle, origin, axes);
            if tuv.x > t_min && tuv.x < hit.t {
                hit = Hit(tuv.x, index, tuv.yz);
                if any && !(SCENE_ALPHA && (triangle.id & ALPHA_TESTED) != 0u) {
                    return hit;
                }
            }
        }
        if (group.y & 0xff000000u) == 0u {
            if stack_size == 0u {
                break;
            }
            stack_size -= 1u;
            group = stack[stack_size];
        }
    }
    return hit;
}

// Nearest hit of the ray in (0, t_max). With `any`, one hit in that range, not always the nearest: for shadow rays.
//
// Alpha is looked at once per traversal, not once per triangle: a ray that passes its nearest hit starts again behind it.
// Few do, and the inner loop stays free of textures.
fn trace_ray(origin: vec3f, direction: vec3f, t_max: f32, any: bool) -> Hit {
    var t_min = 0.0;
    loop {
        let hit = traverse(origin, direction, t_min, t_max, any);
        if !SCENE_ALPHA || hit.index == NO_HIT {
            return hit;
        }
        let id = bvh_triangles[hit.index].id;
        if (id & ALPHA_TESTED) == 0u || !alpha_passes(id & ~ALPHA_TESTED, hit.uv, direction) {
            return hit;
        }
        t_min = hit.t;
    }
    return Hit(t_max, NO_HIT, vec2f(0.0));
}

// Whether nothing stands between `origin` and `origin + direction * t_max`.
fn unoccluded(origin: vec3f, direction: vec3f, t_max: f32) -> bool {
    return trace_ray(origin, direction, t_max, true).index == NO_HIT;
}
