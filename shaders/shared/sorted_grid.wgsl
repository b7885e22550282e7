// A grid whose rows along x lie contiguously in one table of buckets, so that a stretch of a row is one range of it.
//
//     bucket(x, y, z) = (y · stride_y + z · stride_z) mod 2^k + x        rows begin anywhere among 2^k buckets, and overlap
//
// The table is as small as the photons ask for, and not the scene. Rows that overlap mix their photons in the buckets they share;
// whoever gathers tests distances anyhow. What must not happen is that two rows in reach of one point overlap within that reach:
// then photons would be summed twice. The strides rule it out: see sorted_grid.rs.

struct SortedGrid {
    // World position (m) of the corner of cell (0, 0, 0): near the photons, so that differences keep their bits.
    origin_world: vec3f,
    // 2^k − 1.
    row_mask: u32,
    // 1 / edge of a cell (1/m); cells are thinner along x.
    cells_per_m: vec3f,
    // The last cell of a row.
    last_x: f32,
    // Buckets from a row to its neighbour in y and in z.
    row_strides: vec2u,
    // Bound of the rounding of two cell coordinates' difference (cells).
    rounding_cells: f32,
    pad0: u32,
}

// In cells. One subtraction and one multiplication, both correctly rounded and hence monotone: a position between two others
// never lies in a cell outside theirs.
fn cell_place(grid: SortedGrid, position_world: vec3f) -> vec3f {
    return (position_world - grid.origin_world) * grid.cells_per_m;
}

// First bucket of the row (y, z).
fn row_begin(grid: SortedGrid, row: vec2i) -> u32 {
    let start = bitcast<vec2u>(row) * grid.row_strides;
    return (start.x + start.y) & grid.row_mask;
}

// The cell of a row at `x` (cells). What lies outside belongs to the row's ends, which keeps the order, too.
fn row_cell(grid: SortedGrid, x: f32) -> u32 {
    return u32(clamp(floor(x), 0.0, grid.last_x));
}

// Range of buckets of the row (y, z) that hold what is within `reach` (m) of a box; empty where the row is out of reach.
fn row_buckets(grid: SortedGrid, row: vec2i, lower_world: vec3f, upper_world: vec3f, reach: f32) -> vec2u {
    // From the box to the row, across x: nothing in the row is nearer.
    let apart = max(vec2f(row) - cell_place(grid, upper_world).yz, cell_place(grid, lower_world).yz - vec2f(row) - 1.0);
    let gap = max(apart - grid.rounding_cells, vec2f(0.0)) / grid.cells_per_m.yz;
    let half2 = reach * reach - dot(gap, gap);
    if half2 <= 0.0 {
        return vec2u(0u);
    }
    let half = vec3f(sqrt(half2), 0.0, 0.0);
    let begin = row_begin(grid, row);
    let first = begin + row_cell(grid, cell_place(grid, lower_world - half).x);
    let last = begin + row_cell(grid, cell_place(grid, upper_world + half).x);
    return vec2u(first, last + 1u);
}

// Where the sorted photon `index` lies in the textures that hold them, a row after the other. Textures, for a software adapter
// fetches texels for all threads of a group at once, and words of a buffer for each thread in turn.
fn sorted_texel(index: u32) -> vec2u {
    return vec2u(index & 4095u, index >> 12u);
}
