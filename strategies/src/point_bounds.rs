//! What bounds a few visible points.

use lightloom_graph::shader_struct;

shader_struct! {
    /// World-space box and normal cone of some visible points, as in `shared/point_bounds.wgsl`.
    pub(crate) struct PointBounds {
        lower_world: [f32; 3],
        points: u32,
        upper_world: [f32; 3],
        min_cos_normal: f32,
        axis: [f32; 3],
        min_cos_incident: f32,
    }
}
