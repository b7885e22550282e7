// Arguments of the dispatches over the places, folded into y where there are many: 8 lanes a place, then a thread a place.

@group(0) @binding(0) var<storage, read> place_count: u32;
// Workgroups of the splats, of the lenses: x, y and z each.
@group(0) @binding(1) var<storage, read_write> arguments: array<u32, 6>;

const MAX_GROUPS: u32 = 65535u;

fn write_groups(at: u32, groups: u32) {
    let rows = (groups + MAX_GROUPS - 1u) / MAX_GROUPS;
    arguments[at] = (groups + max(rows, 1u) - 1u) / max(rows, 1u);
    arguments[at + 1u] = rows;
    arguments[at + 2u] = 1u;
}

@compute @workgroup_size(1)
fn caustic_map_arguments() {
    write_groups(0u, (place_count + 7u) / 8u);
    write_groups(3u, (place_count + 63u) / 64u);
}
