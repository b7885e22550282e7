// An unbounded grid of cubic cells kept in an open-addressing hash table, after [MML13] section 2.3.1 and listing 3.
//
// A cell is named by three integers. Their hash picks the first slot to try; further slots follow at triangular steps
// (1, 3, 6, …), which visit every slot of a power-of-two table. The hash is pcg3d of [JarzynskiOlano20], "Hash
// Functions for GPU Rendering", JCGT 9(3), in place of the paper's 64-bit one: WGSL has no 64-bit integers.

struct HashGrid {
    // World position (m) of the corner of cell (0, 0, 0): near the photons, so that differences keep their bits.
    origin_world: vec3f,
    // 1 / edge of a cell (1/m).
    cells_per_m: f32,
    // Number of slots − 1; the number is a power of two.
    slot_mask: u32,
}

// One subtraction and one multiplication, both correctly rounded and hence monotone: a position between two others never
// lies in a cell outside theirs.
fn grid_cell(grid: HashGrid, position_world: vec3f) -> vec3i {
    return vec3i(floor((position_world - grid.origin_world) * grid.cells_per_m));
}

fn hash_cell(cell: vec3i) -> u32 {
    var v = bitcast<vec3u>(cell) * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> vec3u(16u);
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v.x;
}

// The slot tried at attempt 1, 2, … after `slot`.
fn next_slot(grid: HashGrid, slot: u32, attempt: u32) -> u32 {
    return (slot + attempt) & grid.slot_mask;
}
