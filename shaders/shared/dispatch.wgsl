// One-dimensional work: more than 65,535 workgroups are folded into y.

fn linear_index(global_id: vec3u, workgroups: vec3u, workgroup_width: u32) -> u32 {
    return global_id.y * (workgroups.x * workgroup_width) + global_id.x;
}

// Workgroups along x, y and z of an indirect dispatch of at least `groups`.
fn folded_groups(groups: u32) -> vec3u {
    let rows = (groups + 65534u) / 65535u;
    return vec3u((groups + max(rows, 1u) - 1u) / max(rows, 1u), rows, 1u);
}
