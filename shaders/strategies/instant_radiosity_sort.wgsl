// Sorts virtual point lights along a curve that fills space (Z order), 2,048 to a workgroup, by Batcher's bitonic network: neighbours in the list light alike
// and are hidden alike. Ties fall as their indices do.
#import "shared/virtual_light.wgsl"

struct SortParams {
    bounds_center: vec3f,
    bounds_radius: f32,
    // Lights wanted.
    lights: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: SortParams;
@group(0) @binding(1) var<storage, read> lights_made: array<VirtualLight>;
@group(0) @binding(2) var<storage, read> photon_state: PhotonState;
@group(0) @binding(3) var<storage, read_write> lights_sorted: array<VirtualLight>;

const BLOCK: u32 = 2048u;
const WIDTH: u32 = 256u;
const AXIS_BITS: u32 = 7u;
const INDEX_BITS: u32 = 11u;

// Place on the curve, then the index within the block.
var<workgroup> keys: array<u32, BLOCK>;

// The bits of a number below 128, two zeros between each.
fn spread_bits(x: u32) -> u32 {
    var v = (x | (x << 8u)) & 0x0000700fu;
    v = (v | (v << 4u)) & 0x000430c3u;
    return (v | (v << 2u)) & 0x00049249u;
}

fn key_of(position: vec3f) -> u32 {
    let cells = f32(1u << AXIS_BITS);
    let unit = (position - params.bounds_center) / (2.0 * params.bounds_radius) + 0.5;
    let cell = vec3u(clamp(unit * cells, vec3f(0.0), vec3f(cells - 1.0)));
    return spread_bits(cell.x) | (spread_bits(cell.y) << 1u) | (spread_bits(cell.z) << 2u);
}

@compute @workgroup_size(256)
fn instant_radiosity_sort(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let first = group.x * BLOCK;
    let count = light_count(params.lights, photon_state.stored);
    for (var i = thread; i < BLOCK; i += WIDTH) {
        var key = 0xffffffffu;
        if first + i < count {
            key = (key_of(lights_made[first + i].position) << INDEX_BITS) | i;
        }
        keys[i] = key;
    }
    for (var size = 2u; size <= BLOCK; size *= 2u) {
        for (var step = size / 2u; step > 0u; step /= 2u) {
            workgroupBarrier();
            for (var pair = thread; pair < BLOCK / 2u; pair += WIDTH) {
                let low = 2u * pair - (pair & (step - 1u));
                let a = keys[low];
                let b = keys[low + step];
                let swap = (a > b) == ((low & size) == 0u);
                keys[low] = select(a, b, swap);
                keys[low + step] = select(b, a, swap);
            }
        }
    }
    workgroupBarrier();
    for (var i = thread; i < BLOCK; i += WIDTH) {
        if first + i < count {
            lights_sorted[first + i] = lights_made[first + (keys[i] & (BLOCK - 1u))];
        }
    }
}
