// Keeps where the triangles' corners are, for the motion vectors of the next frame. In scene order: that of the hierarchy may change.
#import "shared/dispatch.wgsl"
#import "shared/hit.wgsl"

struct PositionsParams {
    count: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: PositionsParams;
// Three per triangle; w is 1 (m, world).
@group(0) @binding(1) var<storage, read_write> positions: array<vec4f>;

@compute @workgroup_size(64)
fn filter_positions(@builtin(global_invocation_id) global_id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let i = linear_index(global_id, workgroups, 64u);
    if i >= params.count {
        return;
    }
    let triangle = bvh_triangles[i];
    let first = 3u * (triangle.id & ~ALPHA_TESTED);
    positions[first] = vec4f(triangle.v0, 1.0);
    positions[first + 1u] = vec4f(triangle.v1, 1.0);
    positions[first + 2u] = vec4f(triangle.v2, 1.0);
}
