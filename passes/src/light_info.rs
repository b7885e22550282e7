//! What kernels need to know of the light list besides the list itself.

use crate::scene::SceneInfo;
use lightloom_graph::shader_struct;

shader_struct! {
    /// Part of the params of every pass that draws lights; `LightInfo` of `shared/lights.wgsl`.
    pub struct LightInfo {
        /// All lights.
        pub light_count: u32,
        /// Of them punctual; they come first. The environment comes last.
        pub punctual_count: u32,
        /// Code of the scene's [`Emission`](crate::scene::Emission).
        pub emission: u32,
        /// Guides of each punctual light.
        pub guide_count: u32,
        /// Centre of the scene's bounding sphere (m).
        pub bounds_center: [f32; 3],
        /// Its radius (m).
        pub bounds_radius: f32,
    }
}

impl From<&SceneInfo> for LightInfo {
    fn from(info: &SceneInfo) -> Self {
        Self {
            light_count: info.light_count,
            punctual_count: info.punctual_count,
            emission: info.emission as u32,
            guide_count: info.guide_count,
            bounds_center: info.bounds_center.to_array(),
            bounds_radius: info.bounds_radius,
        }
    }
}
