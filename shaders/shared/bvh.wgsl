// Rays against the scene: traversal of a compressed eight-wide BVH [Ylitie17], "Efficient Incoherent Ray Traversal on
// GPUs Through Compressed Wide BVHs". Unlike there, children are visited in the order of their distances, and those
// behind a hit are dropped without a look at them: a node costs more to fetch than to sort, on a software adapter by far.
//
// `trace_ray` and `unoccluded` are all that other shaders know of rays; `shared/ray_query.wgsl` offers the same two.
#import "shared/hit.wgsl"
#import "shared/sort8.wgsl"

// Deeper trees than this are refused when the scene is built. A power of two.
const TRAVERSAL_STACK_SIZE: u32 = 32u;
// Of the distance to a node and its size, for the rounding of a box's distance: that of the inverse direction (2.5 ulp by WGSL's
// rules) and of four operations.
const BOX_ROUNDING: f32 = 6.0e-7;
// Behind every hit.
const FARTHEST: i32 = 0x7fffffff;

// Inner children of a node that were met and are not visited yet.
struct Group {
    first_child: u32,
    // Three bits for each, the nearest lowest, and a one above the last.
    order: u32,
    // None is nearer.
    nearest: i32,
}

// Distances in units of the ray's direction are compared as the integers of the same bits: those of floats that are not
// negative have their order, and the negative ones are below, whatever theirs. So a distance can carry the index of its child
// in its lowest bits, and a ray that is not finite meets nothing.
fn box_distances(bytes: u32, step: f32, start: f32) -> vec4i {
    return bitcast<vec4i>(vec4f(unpack4xU8(bytes)) * step + start);
}

// Where a ray enters four boxes. `planes`: their sides towards it in x, y and z.
fn entries(planes: vec3u, step: vec3f, start: vec3f, t_min: f32) -> vec4i {
    return max(
        max(box_distances(planes.x, step.x, start.x), box_distances(planes.y, step.y, start.y)),
        max(box_distances(planes.z, step.z, start.z), vec4i(bitcast<i32>(t_min))));
}

// Where it leaves them. `planes`: their sides away from it.
fn exits(planes: vec3u, step: vec3f, start: vec3f, t_max: f32) -> vec4i {
    return min(
        min(box_distances(planes.x, step.x, start.x), box_distances(planes.y, step.y, start.y)),
        min(box_distances(planes.z, step.z, start.z), vec4i(bitcast<i32>(t_max))));
}

// What of a node the ray meets between `t_min` and `t_max`.
struct Met {
    // Of the node's bits for its children, those of the ones met.
    children: u32,
    // Distances of the inner ones and their indices in the lowest three bits, sorted; FARTHEST: there are no more.
    sorted: array<i32, 8>,
}

fn intersect_node(node: BvhNode, origin: vec3f, inv_direction: vec3f, t_min: f32, t_max: f32) -> Met {
    let step = inv_direction * vec3f(
        bitcast<f32>((node.grid.w & 0xffu) << 23u),
        bitcast<f32>((node.grid.w & 0xff00u) << 15u),
        bitcast<f32>((node.grid.w & 0xff0000u) << 7u),
    );
    let start = (bitcast<vec3f>(node.grid.xyz) - origin) * inv_direction;
    let rounding = BOX_ROUNDING * (abs(start) + 255.0 * abs(step));
    let negative = inv_direction < vec3f(0.0);
    let x_near = select(node.x_planes.xy, node.x_planes.zw, negative.x);
    let x_far = select(node.x_planes.zw, node.x_planes.xy, negative.x);
    let y_near = select(node.y_planes.xy, node.y_planes.zw, negative.y);
    let y_far = select(node.y_planes.zw, node.y_planes.xy, negative.y);
    let z_near = select(node.z_planes.xy, node.z_planes.zw, negative.z);
    let z_far = select(node.z_planes.zw, node.z_planes.xy, negative.z);
    let enter_low = entries(vec3u(x_near.x, y_near.x, z_near.x), step, start - rounding, t_min);
    let enter_high = entries(vec3u(x_near.y, y_near.y, z_near.y), step, start - rounding, t_min);
    let leave_low = exits(vec3u(x_far.x, y_far.x, z_far.x), step, start + rounding, t_max);
    let leave_high = exits(vec3u(x_far.y, y_far.y, z_far.y), step, start + rounding, t_max);
    // Of each child, its bit as a node and those of its triangles.
    let bits = select(vec4u(0u), vec4u(0x01000007u, 0x02000038u, 0x040001c0u, 0x08000e00u), enter_low <= leave_low)
        | select(vec4u(0u), vec4u(0x10007000u, 0x20038000u, 0x401c0000u, 0x80e00000u), enter_high <= leave_high);
    let children = (bits.x | bits.y | bits.z | bits.w) & node.links.z;
    let inner_low = (vec4u(children) & vec4u(0x01000000u, 0x02000000u, 0x04000000u, 0x08000000u)) != vec4u(0u);
    let inner_high = (vec4u(children) & vec4u(0x10000000u, 0x20000000u, 0x40000000u, 0x80000000u)) != vec4u(0u);
    return Met(children, sort8(
        select(vec4i(FARTHEST), (enter_low & vec4i(~7)) | vec4i(0, 1, 2, 3), inner_low),
        select(vec4i(FARTHEST), (enter_high & vec4i(~7)) | vec4i(4, 5, 6, 7), inner_high)));
}

// The `order` of a group of the first `count`.
fn order_of(sorted: array<i32, 8>, count: u32) -> u32 {
    let slots = (u32(sorted[0]) & 7u) | ((u32(sorted[1]) & 7u) << 3u) | ((u32(sorted[2]) & 7u) << 6u)
        | ((u32(sorted[3]) & 7u) << 9u) | ((u32(sorted[4]) & 7u) << 12u) | ((u32(sorted[5]) & 7u) << 15u)
        | ((u32(sorted[6]) & 7u) << 18u) | ((u32(sorted[7]) & 7u) << 21u);
    let end = 1u << (3u * count);
    return (slots & (end - 1u)) | end;
}

// Nearest hit of the ray in (t_min, t_max), alpha left aside. With `any`, the first opaque one found.
fn traverse(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, any: bool) -> Hit {
    var hit = Hit(t_max, NO_HIT, vec2f(0.0));
    // A zero component becomes tiny: no infinities meet a zero in the slab test.
    let tiny = abs(direction) < vec3f(1.0e-20);
    let inv_direction = 1.0 / select(direction, vec3f(1.0e-20), tiny);
    let axes = ray_axes(direction);
    var stack: array<Group, TRAVERSAL_STACK_SIZE>;
    var stack_size = 0u;
    var index = 0u;
    loop {
        let node = bvh_nodes[index];
        let met = intersect_node(node, origin, inv_direction, t_min, hit.t);
        var triangles = met.children & 0x00ffffffu;
        // A loop that ends with its test, as most leaves are not met: software adapters pass over an `if` that no ray of
        // several takes, but run each loop at least once.
        if triangles != 0u {
            loop {
                let bit = firstTrailingBit(triangles);
                triangles &= triangles - 1u;
                let leaf = node.links.y + countOneBits(node.links.z & ((1u << bit) - 1u));
                let triangle = bvh_triangles[leaf];
                let tuv = intersect_triangle(triangle, origin, axes);
                if tuv.x > t_min && tuv.x < hit.t {
                    hit = Hit(tuv.x, leaf, tuv.yz);
                    if any && !(SCENE_ALPHA && (triangle.id & ALPHA_TESTED) != 0u) {
                        return hit;
                    }
                }
                continuing {
                    break if triangles == 0u;
                }
            }
        }

        // On to the nearest child. If there is none before the hit, to the stack: two groups are tried, for a loop would cost all
        // rays more than the few needless visits do.
        var group = Group(node.links.x, order_of(met.sorted, countOneBits(met.children >> 24u)), met.sorted[0] & ~7);
        var next = met.sorted[1] & ~7;
        if group.order == 1u || group.nearest > bitcast<i32>(hit.t) {
            if stack_size == 0u {
                break;
            }
            // The mask changes nothing; it tells the compiler that the index is within bounds.
            stack_size -= 1u;
            group = stack[stack_size & (TRAVERSAL_STACK_SIZE - 1u)];
            if group.nearest > bitcast<i32>(hit.t) && stack_size != 0u {
                stack_size -= 1u;
                group = stack[stack_size & (TRAVERSAL_STACK_SIZE - 1u)];
            }
            next = group.nearest;
        }
        index = group.first_child + (group.order & 7u);
        group = Group(group.first_child, group.order >> 3u, next);
        if group.order != 1u {
            stack[stack_size & (TRAVERSAL_STACK_SIZE - 1u)] = group;
            stack_size += 1u;
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
