// Arguments of the dispatch of a workgroup per block, and their number for the report.
#import "shared/dispatch.wgsl"

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

@compute @workgroup_size(1)
fn splat_block_arguments() {
    let blocks = splat_offsets[params.capacity];
    let groups = folded_groups(blocks);
    arguments[0] = groups.x;
    arguments[1] = groups.y;
    arguments[2] = groups.z;
    stats[0] = blocks;
}
