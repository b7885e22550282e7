// Measures on a sample of a frame's pixels and photons what tells the cost of the strategies: see auto/measure.rs.
//
// A workgroup for each sampled tile of 8 × 8 pixels. A thread counts a 64th of the sampled photons around its own pixel, so that the
// workgroup compares all photons with all of its tile. Counts are whole numbers: the same in every order.
#import "shared/bound_points.wgsl"
#import "shared/camera.wgsl"
#import "shared/estimate.wgsl"
#import "shared/photon_store.wgsl"

struct Params {
    camera: Camera,
    // In the image, and how many of them are sampled.
    tiles: vec2u,
    samples: vec2u,
    // Kernel radii (m).
    r_min: f32,
    r_max: f32,
    pad0: u32,
    pad1: u32,
}

// Sums over the sample, in the order of `Counts` in Rust.
struct Counts {
    // Photons in the store, and sampled.
    stored: u32,
    sampled: atomic<u32>,
    // Pixels that gather, and pixels, of the sampled tiles.
    gathering: atomic<u32>,
    pixels: atomic<u32>,
    // Pairs of a gathering pixel and a photon that were compared; those in reach of each other; those in one of the rows of cells that
    // `sorted-grid` looks at.
    pairs: atomic<u32>,
    near: atomic<u32>,
    in_rows: atomic<u32>,
    // Pairs of a tile and a photon that meet.
    in_tiles: atomic<u32>,
    // Tiles that gather, and those of them whose depths are farther apart than kernels are wide.
    tiles: atomic<u32>,
    deep_tiles: atomic<u32>,
    // Photons whose kernels are in view, and pixels that these cover.
    seen: atomic<u32>,
    covered: atomic<u32>,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var position: texture_2d<f32>;
@group(0) @binding(2) var surface: texture_2d<u32>;
@group(0) @binding(3) var<storage, read> photons: array<StoredPhoton>;
@group(0) @binding(4) var<storage, read> photon_state: PhotonState;
@group(0) @binding(5) var<storage, read_write> counts: Counts;

const THREADS: u32 = 64u;
// Photons sampled at the most.
const SAMPLE: u32 = 8192u;
// Pixels that one kernel is counted to cover at the most: sums of all samples fit a word.
const LARGEST: f32 = 65536.0;

var<workgroup> tile_bounds: PointBounds;
var<workgroup> nearest: atomic<u32>;
var<workgroup> farthest: atomic<u32>;

// Pixels that a kernel covers; below 0: it is out of view.
fn pixels_covered(centre: vec3f, radius: f32) -> f32 {
    let p = (params.camera.view_from_world * vec4f(centre, 1.0)).xyz;
    let depth = -p.z;
    if depth < radius {
        return select(-1.0, LARGEST, length(p) < radius);
    }
    // The image's sides are planes through the eye.
    let beyond = (abs(p.xy) - depth * params.camera.tan_half) / sqrt(1.0 + params.camera.tan_half * params.camera.tan_half);
    if any(beyond > vec2f(radius)) {
        return -1.0;
    }
    let pixels = radius / depth * f32(params.camera.size.y) / (2.0 * params.camera.tan_half.y);
    return min(PI * pixels * pixels, LARGEST);
}

@compute @workgroup_size(8, 8)
fn auto_measure(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_id) local: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let tile = (2u * group.xy + 1u) * params.tiles / (2u * params.samples);
    let wanted = tile * 8u + local.xy;
    let inside = all(wanted < params.camera.size);
    let pixel = min(wanted, params.camera.size - 1u);
    let point = visible_point(textureLoad(position, pixel, 0), textureLoad(surface, pixel, 0), camera_position(params.camera));
    let gathers = inside && point.gatherable;
    if thread == 0u {
        atomicStore(&nearest, 0xffffffffu);
    }
    let bounds = bound_points(thread, point, gathers);
    if thread == 0u {
        tile_bounds = bounds;
    }
    if gathers {
        // Depths are positive: as floats, so as whole numbers.
        atomicMin(&nearest, bitcast<u32>(point.depth));
        atomicMax(&farthest, bitcast<u32>(point.depth));
    }
    workgroupBarrier();

    let stored = min(photon_state.stored, arrayLength(&photons));
    let stride = max((stored + SAMPLE - 1u) / SAMPLE, 1u);
    let sampled = (stored + stride - 1u) / stride;
    var pairs = 0u;
    var near = 0u;
    var in_rows = 0u;
    var in_tiles = 0u;
    for (var i = thread; i < sampled; i += THREADS) {
        let photon = photon_load(photons[i * stride], photon_state.grid);
        let radius = photon_radius(photon, params.r_min, params.r_max);
        let apart = abs(photon.position - point.position);
        pairs += select(0u, 1u, gathers);
        near += select(0u, 1u, gathers && dot(apart, apart) < radius * radius);
        // Three rows of the width of a kernel's radius each way, and of each what the search sphere may hold.
        in_rows += select(0u, 1u, gathers && all(apart < params.r_max * vec3f(1.0, 1.5, 1.5)));
        in_tiles += select(0u, 1u, photon_meets_points(tile_bounds, photon, radius));
    }
    atomicAdd(&counts.pairs, pairs);
    atomicAdd(&counts.near, near);
    atomicAdd(&counts.in_rows, in_rows);
    atomicAdd(&counts.in_tiles, in_tiles);
    atomicAdd(&counts.gathering, select(0u, 1u, gathers));
    atomicAdd(&counts.pixels, select(0u, 1u, inside));
    if thread == 0u && tile_bounds.points > 0u {
        let span = bitcast<f32>(atomicLoad(&farthest)) - bitcast<f32>(atomicLoad(&nearest));
        atomicAdd(&counts.tiles, 1u);
        atomicAdd(&counts.deep_tiles, select(0u, 1u, span > 2.0 * params.r_max));
    }

    // Each sampled photon once, by whatever workgroup.
    let index = (group.y * params.samples.x + group.x) * THREADS + thread;
    for (var i = index; i < sampled; i += params.samples.x * params.samples.y * THREADS) {
        let photon = photon_load(photons[i * stride], photon_state.grid);
        let covered = pixels_covered(photon.position, photon_radius(photon, params.r_min, params.r_max));
        if covered >= 0.0 {
            atomicAdd(&counts.seen, 1u);
            atomicAdd(&counts.covered, u32(round(covered)));
        }
    }
    if index == 0u {
        counts.stored = stored;
        atomicStore(&counts.sampled, sampled);
    }
}
