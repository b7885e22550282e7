// Arguments of the dispatches over the places: 8 lanes a place, then a thread a place.
#import "shared/dispatch.wgsl"

@group(0) @binding(0) var<storage, read> place_count: u32;
// Workgroups of the splats, of the lenses: x, y and z each.
@group(0) @binding(1) var<storage, read_write> arguments: array<u32, 6>;

fn write_groups(at: u32, count: u32) {
    let groups = folded_groups(count);
    arguments[at] = groups.x;
    arguments[at + 1u] = groups.y;
    arguments[at + 2u] = groups.z;
}

@compute @workgroup_size(1)
fn caustic_map_arguments() {
    write_groups(0u, (place_count + 7u) / 8u);
    write_groups(3u, (place_count + 63u) / 64u);
}
