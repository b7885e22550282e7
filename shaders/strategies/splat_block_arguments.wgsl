// Arguments of the dispatch of a workgroup per block, folded into y where there are many; and their number for the report.

struct Params {
    // Records of the store.
    capacity: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> splat_offsets: array<u32>;
@group(0) @binding(2) var<storage, read_write> arguments: array<u32, 3>;
// Word 0: blocks of pixels.
@group(0) @binding(3) var<storage, read_write> stats: array<u32>;

const MAX_GROUPS: u32 = 65535u;

@compute @workgroup_size(1)
fn splat_block_arguments() {
    let blocks = splat_offsets[params.capacity];
    let rows = (blocks + MAX_GROUPS - 1u) / MAX_GROUPS;
    arguments[0] = (blocks + max(rows, 1u) - 1u) / max(rows, 1u);
    arguments[1] = rows;
    arguments[2] = 1u;
    stats[0] = blocks;
}
