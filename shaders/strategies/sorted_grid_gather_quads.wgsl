// As `sorted_grid_gather`, all photons, and four pixels to a thread: a photon is fetched and decoded once for the four.
//
//     neighbours see nearly the same photons; a fetch costs more than a test, most of all where threads run in lockstep and
//     each fetches from a place of its own
#import "shared/estimate.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/sorted_grid.wgsl"
#import "shared/sorted_grid_gather.wgsl"

// Of a pixel that takes no part: out of reach of everything.
const NOWHERE: f32 = 1.0e18;

// Four visible points. A matrix holds one vector for each of them: its columns are x, y and z (or red, green and blue) of the four.
struct Quad {
    // Where the points lie that take part (m).
    position: mat3x4f,
    normal_geometric: mat3x4f,
    normal: mat3x4f,
    // The four by themselves.
    a: VisiblePoint,
    b: VisiblePoint,
    c: VisiblePoint,
    d: VisiblePoint,
}

struct QuadSum {
    indirect: mat3x4f,
    caustic: mat3x4f,
    // As in `RadianceSum`.
    tested: u32,
    pending: u32,
}

fn each_of(a: vec3f, b: vec3f, c: vec3f, d: vec3f) -> mat3x4f {
    return transpose(mat4x3f(a, b, c, d));
}

fn distances2(quad: Quad, position: vec3f) -> vec4f {
    let x = quad.position[0] - position.x;
    let y = quad.position[1] - position.y;
    let z = quad.position[2] - position.z;
    return x * x + y * y + z * z;
}

// Bit `i` where candidate `first + i` is in reach of some point.
fn reach_bit(quad: Quad, first: u32, i: u32, last: u32) -> u32 {
    let sphere = textureLoad(sorted_spheres, sorted_texel(min(first + i, last)), 0);
    return select(0u, 1u << i, any(distances2(quad, sphere.xyz) < vec4f(sphere.w * sphere.w)));
}

// Columns times numbers, one for each point.
fn scaled(matrix: mat3x4f, by: vec4f) -> mat3x4f {
    return mat3x4f(matrix[0] * by, matrix[1] * by, matrix[2] * by);
}

// BRDF of each point towards the eye (sr⁻¹).
fn quad_brdf(quad: Quad, incident: vec3f) -> mat3x4f {
    return each_of(
        brdf_eval(quad.a.brdf, incident, quad.a.to_eye), brdf_eval(quad.b.brdf, incident, quad.b.to_eye),
        brdf_eval(quad.c.brdf, incident, quad.c.to_eye), brdf_eval(quad.d.brdf, incident, quad.d.to_eye)
    );
}

// `light_contribution` of four points.
fn add_candidate(sum: ptr<function, QuadSum>, quad: Quad, i: u32) {
    let sphere = textureLoad(sorted_spheres, sorted_texel(i), 0);
    let packed = textureLoad(sorted_light, sorted_texel(i), 0);
    let light = photon_light(Photon(sphere.xyz, packed.x, packed.y, packed.z, 0u, packed.w));
    let distance2 = distances2(quad, sphere.xyz);
    let cos_geometric = quad.normal_geometric * light.incident;
    let counts = (distance2 < vec4f(sphere.w * sphere.w)) & (cos_geometric > vec4f(0.0))
        & (quad.normal_geometric * light.normal >= vec4f(MIN_NORMAL_COSINE));
    let correction = shading_corrections(quad.normal * light.incident, cos_geometric);
    let weight = select(vec4f(0.0), correction * kernel_densities(sqrt(distance2), sphere.w), counts);
    let reflected = scaled(quad_brdf(quad, light.incident), weight);
    let radiance = mat3x4f(reflected[0] * light.flux.r, reflected[1] * light.flux.g, reflected[2] * light.flux.b);
    (*sum).indirect += radiance;
    (*sum).caustic += radiance * select(0.0, 1.0, (packed.w & PHOTON_CAUSTIC) != 0u);
    (*sum).pending -= 1u;
}

// As `gather_run` of `shared/gather_run.wgsl`.
fn gather_quad(sum: ptr<function, QuadSum>, quad: Quad, run: vec2u) {
    for (var first = run.x; first < run.y; first += 32u) {
        var near = 0u;
        let batch = min(32u, run.y - first);
        let last = run.y - 1u;
        for (var i = 0u; i < batch; i += 4u) {
            near |= reach_bit(quad, first, i, last) | reach_bit(quad, first, i + 1u, last)
                | reach_bit(quad, first, i + 2u, last) | reach_bit(quad, first, i + 3u, last);
        }
        near &= 0xffffffffu >> (32u - batch);
        (*sum).tested += batch;
        (*sum).pending += countOneBits(near);
        while near != 0u {
            let i = first + firstTrailingBit(near);
            near &= near - 1u;
            add_candidate(sum, quad, i);
        }
    }
}

fn least(v: vec4f) -> f32 {
    return min(min(v.x, v.y), min(v.z, v.w));
}

fn quad_point(thread: vec2u, x: u32, y: u32) -> VisiblePoint {
    let pixel = thread * 2u + vec2u(x, y);
    let texel = min(pixel, params.size - 1u);
    var point = visible_point(textureLoad(position, texel, 0), textureLoad(surface, texel, 0), params.camera_position_world);
    point.gatherable = point.gatherable && all(pixel < params.size);
    return point;
}

fn store_sum(thread: vec2u, x: u32, y: u32, indirect_sum: vec3f, caustic_sum: vec3f) {
    let pixel = thread * 2u + vec2u(x, y);
    if all(pixel < params.size) {
        textureStore(indirect, pixel, vec4f(indirect_sum, 1.0));
        textureStore(caustic, pixel, vec4f(caustic_sum, 1.0));
    }
}

@compute @workgroup_size(8, 8)
fn sorted_grid_gather_quads(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy * 2u >= params.size) {
        return;
    }
    var quad: Quad;
    quad.a = quad_point(id.xy, 0u, 0u);
    quad.b = quad_point(id.xy, 1u, 0u);
    quad.c = quad_point(id.xy, 0u, 1u);
    quad.d = quad_point(id.xy, 1u, 1u);
    quad.normal_geometric =
        each_of(quad.a.normal_geometric, quad.b.normal_geometric, quad.c.normal_geometric, quad.d.normal_geometric);
    quad.normal = each_of(quad.a.brdf.normal, quad.b.brdf.normal, quad.c.brdf.normal, quad.d.brdf.normal);
    let places = each_of(quad.a.position, quad.b.position, quad.c.position, quad.d.position);
    var left = vec4<bool>(quad.a.gatherable, quad.b.gatherable, quad.c.gatherable, quad.d.gatherable);

    var sum: QuadSum;
    var expected = 0u;
    var rows = 0u;
    var expected_rows = 0u;
    // Points far from one another, at the edge of a surface, are gathered for in turn: a box around them would hold everything between.
    while any(left) {
        let anchor = select(select(select(quad.d.position, quad.c.position, left.z), quad.b.position, left.y), quad.a.position, left.x);
        let near = max(max(abs(places[0] - anchor.x), abs(places[1] - anchor.y)), abs(places[2] - anchor.z));
        let taken = left & (near <= vec4f(params.reach * 0.25));
        left &= !taken;
        quad.position = mat3x4f(
            select(vec4f(NOWHERE), places[0], taken), select(vec4f(NOWHERE), places[1], taken),
            select(vec4f(NOWHERE), places[2], taken)
        );
        let lower = vec3f(
            least(select(vec4f(anchor.x), places[0], taken)), least(select(vec4f(anchor.y), places[1], taken)),
            least(select(vec4f(anchor.z), places[2], taken))
        );
        let upper = -vec3f(
            least(-select(vec4f(anchor.x), places[0], taken)), least(-select(vec4f(anchor.y), places[1], taken)),
            least(-select(vec4f(anchor.z), places[2], taken))
        );
        let first = vec2i(floor(cell_place(params.grid, lower - params.reach).yz));
        let last = vec2i(floor(cell_place(params.grid, upper + params.reach).yz));
        let span = vec2u(last - first) + 1u;
        expected_rows += span.x * span.y;
        for (var z = first.y; z <= last.y; z++) {
            for (var y = first.x; y <= last.x; y++) {
                let buckets = row_buckets(params.grid, vec2i(y, z), lower, upper, params.reach);
                let run = vec2u(bucket_offsets[buckets.x], bucket_offsets[buckets.y]);
                rows += 1u;
                expected += run.y - run.x;
                gather_quad(&sum, quad, run);
            }
        }
    }
    if any(left) || sum.tested != expected || sum.pending != 0u || rows != expected_rows {
        atomicAdd(&stats[4], 4u);
    }
    let indirect_sums = transpose(sum.indirect);
    let caustic_sums = transpose(sum.caustic);
    store_sum(id.xy, 0u, 0u, indirect_sums[0], caustic_sums[0]);
    store_sum(id.xy, 1u, 0u, indirect_sums[1], caustic_sums[1]);
    store_sum(id.xy, 0u, 1u, indirect_sums[2], caustic_sums[2]);
    store_sum(id.xy, 1u, 1u, indirect_sums[3], caustic_sums[3]);
}
