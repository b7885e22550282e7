// As `sorted_grid_gather`, all photons, and 4 × 4 pixels to a thread: a photon is fetched and decoded once for the sixteen.
//
//     neighbours see nearly the same photons; a fetch costs more than a test, most of all where threads run in lockstep and
//     each fetches from a place of its own
#import "shared/estimate.wgsl"
#import "shared/gbuffer.wgsl"
#import "shared/scene_traits.wgsl"
#import "shared/sorted_grid.wgsl"
#import "shared/sorted_grid_gather.wgsl"

// Of a pixel that takes no part: out of reach of everything.
const NOWHERE: f32 = 1.0e18;
const LARGEST: f32 = 3.0e38;
// Points no further from the first than this many kernel radii, along each axis, are gathered for together.
const TOGETHER: f32 = 2.0;
// Covers the rounding of the distance from a box.
const BOX_SLACK: f32 = 1.00001;

// Four visible points. A matrix holds one vector for each of them: its columns are x, y and z (or red, green and blue) of the four.
struct Quad {
    // World (m).
    position: mat3x4f,
    normal_geometric: mat3x4f,
    normal: mat3x4f,
    gathers: vec4<bool>,
    // The four by themselves.
    points: array<VisiblePoint, 4>,
}

// Photons of a thread are summed times the BRDF, or, where all surfaces are Lambertian, without: their BRDF does not depend on the photon.
struct QuadSum {
    indirect: mat3x4f,
    caustic: mat3x4f,
}

struct Sums {
    quads: array<QuadSum, 4>,
    // As in `RadianceSum`.
    tested: u32,
    pending: u32,
}

struct Box {
    lower: vec3f,
    upper: vec3f,
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

// Bit `i` where candidate `first + i` is in reach of the box.
fn reach_bit(middle: vec3f, half: vec3f, first: u32, i: u32, last: u32) -> u32 {
    let sphere = textureLoad(sorted_spheres, sorted_texel(min(first + i, last)), 0);
    let beyond = abs(sphere.xyz - middle) - half;
    let apart = select(vec3f(0.0), beyond, beyond > vec3f(0.0));
    return select(0u, 1u << i, dot(apart, apart) <= sphere.w * sphere.w * BOX_SLACK);
}

// The same of the up to 32 candidates from `first` to before `end`.
fn reach_bits(middle: vec3f, half: vec3f, first: u32, end: u32) -> u32 {
    if first >= end {
        return 0u;
    }
    var near = 0u;
    let count = min(32u, end - first);
    for (var i = 0u; i < count; i += 4u) {
        near |= reach_bit(middle, half, first, i, end - 1u) | reach_bit(middle, half, first, i + 1u, end - 1u)
            | reach_bit(middle, half, first, i + 2u, end - 1u) | reach_bit(middle, half, first, i + 3u, end - 1u);
    }
    return near & (0xffffffffu >> (32u - count));
}

// Columns times numbers, one for each point.
fn scaled(matrix: mat3x4f, by: vec4f) -> mat3x4f {
    return mat3x4f(matrix[0] * by, matrix[1] * by, matrix[2] * by);
}

// BRDF of each point towards the eye (sr⁻¹); where all are Lambertian, one.
fn quad_brdf(quad: Quad, incident: vec3f) -> mat3x4f {
    if !SCENE_GLOSSY {
        return mat3x4f(vec4f(1.0), vec4f(1.0), vec4f(1.0));
    }
    let p = quad.points;
    return each_of(
        brdf_eval(p[0].brdf, incident, p[0].to_eye), brdf_eval(p[1].brdf, incident, p[1].to_eye),
        brdf_eval(p[2].brdf, incident, p[2].to_eye), brdf_eval(p[3].brdf, incident, p[3].to_eye)
    );
}

// What `quad_brdf` leaves out.
fn left_out_brdf(point: VisiblePoint) -> vec3f {
    if SCENE_GLOSSY {
        return vec3f(1.0);
    }
    return brdf_eval(point.brdf, point.brdf.normal, point.to_eye);
}

// What a point's own numbers do not enter into is computed once for the sixteen.
struct Candidate {
    // World (m).
    position: vec3f,
    radius2: f32,
    inverse_radius: f32,
    light: PhotonLight,
    // Flux over the kernel's integral (W·m⁻²).
    irradiance: vec3f,
    is_caustic: bool,
}

fn candidate_at(i: u32) -> Candidate {
    let sphere = textureLoad(sorted_spheres, sorted_texel(i), 0);
    let packed = textureLoad(sorted_light, sorted_texel(i), 0);
    let light = photon_light(Photon(sphere.xyz, packed.x, packed.y, packed.z, 0u, packed.w));
    let radius = sphere.w;
    // Finite however small the kernel, so that it times zero is zero.
    let irradiance = min(light.flux / kernel_integral(radius), vec3f(LARGEST));
    return Candidate(sphere.xyz, radius * radius, 1.0 / radius, light, irradiance, (packed.w & PHOTON_CAUSTIC) != 0u);
}

// `light_contribution` at four points.
fn with_candidate(sum: QuadSum, quad: Quad, candidate: Candidate) -> QuadSum {
    let light = candidate.light;
    let distance2 = distances2(quad, candidate.position);
    let cos_geometric = quad.normal_geometric * light.incident;
    let counts = quad.gathers & (distance2 < vec4f(candidate.radius2)) & (cos_geometric > vec4f(0.0))
        & (quad.normal_geometric * light.normal >= vec4f(MIN_NORMAL_COSINE));
    let correction = shading_corrections(quad.normal * light.incident, cos_geometric);
    let height = kernel_heights(sqrt(distance2), candidate.inverse_radius);
    let reflected = scaled(quad_brdf(quad, light.incident), select(vec4f(0.0), correction * height, counts));
    let irradiance = candidate.irradiance;
    let radiance = mat3x4f(reflected[0] * irradiance.r, reflected[1] * irradiance.g, reflected[2] * irradiance.b);
    var added = QuadSum(sum.indirect + radiance, sum.caustic);
    if SCENE_GLOSSY || SCENE_REFRACTS {
        added.caustic += radiance * select(0.0, 1.0, candidate.is_caustic);
    }
    return added;
}

fn add_candidate(sums: ptr<function, Sums>, quads: array<Quad, 4>, i: u32) {
    let candidate = candidate_at(i);
    (*sums).quads[0] = with_candidate((*sums).quads[0], quads[0], candidate);
    (*sums).quads[1] = with_candidate((*sums).quads[1], quads[1], candidate);
    (*sums).quads[2] = with_candidate((*sums).quads[2], quads[2], candidate);
    (*sums).quads[3] = with_candidate((*sums).quads[3], quads[3], candidate);
    (*sums).pending -= 1u;
}

// Candidates of the `index`-th 64 of two runs, those of the first run before those of the second; none beyond them.
fn batch(a: vec2u, b: vec2u, index: u32) -> vec2u {
    let of_a = (a.y - a.x + 63u) / 64u;
    let run = select(b, a, index < of_a);
    let first = run.x + 64u * select(index - of_a, index, index < of_a);
    return min(vec2u(first, first + 64u), run.yy);
}

// As `gather_run` of `shared/gather_run.wgsl`, of two rows and by 128: the more are tested before they are added, the less threads that run in lockstep
// wait for the one that found most. Candidates keep their order, whatever lies between them.
fn gather_runs_of_box(sums: ptr<function, Sums>, quads: array<Quad, 4>, around: Box, a: vec2u, b: vec2u) {
    let middle = 0.5 * (around.lower + around.upper);
    let half = max(around.upper - middle, middle - around.lower);
    let batches = (a.y - a.x + 63u) / 64u + (b.y - b.x + 63u) / 64u;
    for (var index = 0u; index < batches; index += 2u) {
        let c = batch(a, b, index);
        let d = batch(a, b, index + 1u);
        let firsts = vec4u(c.x, c.x + 32u, d.x, d.x + 32u);
        var near = vec4u(
            reach_bits(middle, half, firsts.x, c.y), reach_bits(middle, half, firsts.y, c.y), reach_bits(middle, half, firsts.z, d.y),
            reach_bits(middle, half, firsts.w, d.y)
        );
        (*sums).tested += c.y - c.x + d.y - d.x;
        (*sums).pending += countOneBits(near.x) + countOneBits(near.y) + countOneBits(near.z) + countOneBits(near.w);
        while any(near != vec4u(0u)) {
            // The first word with a bit, and its lowest.
            let some = near != vec4u(0u);
            let taken = vec4<bool>(some.x, some.y & !some.x, some.z & !(some.x | some.y), !(some.x | some.y | some.z));
            let word = select(select(select(near.w, near.z, taken.z), near.y, taken.y), near.x, taken.x);
            let first = select(select(select(firsts.w, firsts.z, taken.z), firsts.y, taken.y), firsts.x, taken.x);
            near = select(near, near & (near - 1u), taken);
            add_candidate(sums, quads, first + firstTrailingBit(word));
        }
    }
}

fn row_run(row: vec2i, around: Box) -> vec2u {
    let buckets = row_buckets(params.grid, row, around.lower, around.upper, params.reach);
    return vec2u(bucket_offsets[buckets.x], bucket_offsets[buckets.y]);
}

fn point_at(pixel: vec2u) -> VisiblePoint {
    let texel = min(pixel, params.size - 1u);
    var point = visible_point(textureLoad(position, texel, 0), textureLoad(surface, texel, 0), params.camera_position_world);
    point.gatherable = point.gatherable && all(pixel < params.size);
    return point;
}

fn quad_at(pixel: vec2u) -> Quad {
    let a = point_at(pixel);
    let b = point_at(pixel + vec2u(1u, 0u));
    let c = point_at(pixel + vec2u(0u, 1u));
    let d = point_at(pixel + vec2u(1u, 1u));
    return Quad(
        each_of(a.position, b.position, c.position, d.position),
        each_of(a.normal_geometric, b.normal_geometric, c.normal_geometric, d.normal_geometric),
        each_of(a.brdf.normal, b.brdf.normal, c.brdf.normal, d.brdf.normal),
        vec4<bool>(a.gatherable, b.gatherable, c.gatherable, d.gatherable),
        array<VisiblePoint, 4>(a, b, c, d)
    );
}

// The first of the points that gather, or `other`.
fn first_point(quad: Quad, other: vec3f) -> vec3f {
    let p = quad.points;
    let left = quad.gathers;
    return select(select(select(select(other, p[3].position, left.w), p[2].position, left.z), p[1].position, left.y), p[0].position, left.x);
}

// The quad with those points that gather and lie near `anchor`.
fn taken(quad: Quad, anchor: vec3f) -> Quad {
    var some = quad;
    let p = quad.position;
    let apart = max(max(abs(p[0] - anchor.x), abs(p[1] - anchor.y)), abs(p[2] - anchor.z));
    some.gathers &= apart <= vec4f(params.reach * TOGETHER);
    return some;
}

fn least(v: vec4f) -> f32 {
    return min(min(v.x, v.y), min(v.z, v.w));
}

fn most(v: vec4f) -> f32 {
    return max(max(v.x, v.y), max(v.z, v.w));
}

// The box with the points of a quad that gather.
fn widened(around: Box, quad: Quad) -> Box {
    let p = quad.position;
    let in = quad.gathers;
    let lower = vec3f(
        least(select(vec4f(NOWHERE), p[0], in)), least(select(vec4f(NOWHERE), p[1], in)), least(select(vec4f(NOWHERE), p[2], in))
    );
    let upper = vec3f(
        most(select(vec4f(-NOWHERE), p[0], in)), most(select(vec4f(-NOWHERE), p[1], in)), most(select(vec4f(-NOWHERE), p[2], in))
    );
    return Box(min(around.lower, lower), max(around.upper, upper));
}

fn store_sum(pixel: vec2u, point: VisiblePoint, indirect_sum: vec3f, caustic_sum: vec3f) {
    if all(pixel < params.size) {
        let brdf = left_out_brdf(point);
        textureStore(indirect, pixel, vec4f(indirect_sum * brdf, 1.0));
        textureStore(caustic, pixel, vec4f(caustic_sum * brdf, 1.0));
    }
}

fn store_quad(pixel: vec2u, quad: Quad, sum: QuadSum) {
    let indirect_sums = transpose(sum.indirect);
    let caustic_sums = transpose(sum.caustic);
    store_sum(pixel, quad.points[0], indirect_sums[0], caustic_sums[0]);
    store_sum(pixel + vec2u(1u, 0u), quad.points[1], indirect_sums[1], caustic_sums[1]);
    store_sum(pixel + vec2u(0u, 1u), quad.points[2], indirect_sums[2], caustic_sums[2]);
    store_sum(pixel + vec2u(1u, 1u), quad.points[3], indirect_sums[3], caustic_sums[3]);
}

@compute @workgroup_size(8, 8)
fn sorted_grid_gather_blocks(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_id) thread: vec3u) {
    // Eight threads that follow one another lie 4 × 2: those that run in lockstep see the more alike the closer they are.
    let place = vec2u((thread.x & 3u) | ((thread.y & 1u) << 2u), (thread.x >> 2u) | (thread.y & 6u));
    let pixel = (workgroup.xy * 8u + place) * 4u;
    if any(pixel >= params.size) {
        return;
    }
    let corners = array<vec2u, 4>(pixel, pixel + vec2u(2u, 0u), pixel + vec2u(0u, 2u), pixel + vec2u(2u, 2u));
    let quads = array<Quad, 4>(quad_at(corners[0]), quad_at(corners[1]), quad_at(corners[2]), quad_at(corners[3]));
    var left = quads;

    var sums: Sums;
    var expected = 0u;
    var rows = 0u;
    var expected_rows = 0u;
    // Points far from one another, at the edge of a surface, are gathered for in turn: a box around them would hold everything between.
    while any(left[0].gathers | left[1].gathers | left[2].gathers | left[3].gathers) {
        let anchor = first_point(left[0], first_point(left[1], first_point(left[2], first_point(left[3], vec3f(0.0)))));
        let now = array<Quad, 4>(taken(left[0], anchor), taken(left[1], anchor), taken(left[2], anchor), taken(left[3], anchor));
        left[0].gathers &= !now[0].gathers;
        left[1].gathers &= !now[1].gathers;
        left[2].gathers &= !now[2].gathers;
        left[3].gathers &= !now[3].gathers;
        let around = widened(widened(widened(widened(Box(anchor, anchor), now[0]), now[1]), now[2]), now[3]);
        let first = vec2i(floor(cell_place(params.grid, around.lower - params.reach).yz));
        let last = vec2i(floor(cell_place(params.grid, around.upper + params.reach).yz));
        let span = vec2u(last - first) + 1u;
        expected_rows += span.x * span.y;
        for (var z = first.y; z <= last.y; z++) {
            for (var y = first.x; y <= last.x; y += 2) {
                let a = row_run(vec2i(y, z), around);
                var b = row_run(vec2i(y + 1, z), around);
                // A row beyond the last is none.
                b.y = select(b.x, b.y, y < last.x);
                rows += select(1u, 2u, y < last.x);
                expected += a.y - a.x + b.y - b.x;
                gather_runs_of_box(&sums, now, around, a, b);
            }
        }
    }
    if sums.tested != expected || sums.pending != 0u || rows != expected_rows {
        atomicAdd(&stats[4], 16u);
    }
    store_quad(corners[0], quads[0], sums.quads[0]);
    store_quad(corners[1], quads[1], sums.quads[1]);
    store_quad(corners[2], quads[2], sums.quads[2]);
    store_quad(corners[3], quads[3], sums.quads[3]);
}
