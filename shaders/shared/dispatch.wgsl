// One-dimensional work: more than 65,535 workgroups are folded into y.

fn linear_index(global_id: vec3u, workgroups: vec3u, workgroup_width: u32) -> u32 {
    return global_id.y * (workgroups.x * workgroup_width) + global_id.x;
}
