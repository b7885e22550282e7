//! Which photons need not be stored because no pixel of a camera can gather them.

use crate::CameraUniform;
use glam::{Mat4, Vec3, Vec4};
use lightloom_graph::shader_struct;

shader_struct! {
    /// A camera's frustum and a kernel's reach; the struct `DepositCull` of `shared/deposit_cull.wgsl`.
    ///
    /// Left out are photons farther outside the frustum than the reach, and photons on surfaces turned so far away that no
    /// pixel within reach can face both the eye and the photon's side. Nothing that could contribute is left out ([SA19]
    /// culls by position alone and loses light at the image's edge).
    ///
    /// [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, 2019"
    pub struct DepositCull {
        /// Planes of the frustum's sides: unit normal inwards and offset (m), n·x + d ≥ 0 inside.
        pub planes: [[f32; 4]; 4],
        /// World (m).
        pub eye: [f32; 3],
        /// Largest kernel radius (m); below 0: nothing is left out.
        pub reach: f32,
    }
}

impl DepositCull {
    /// Everything is stored.
    pub fn nothing() -> Self {
        Self { planes: [[0.0; 4]; 4], eye: [0.0; 3], reach: -1.0 }
    }

    /// For what `camera` sees, gathered with radii up to `reach_m` (m).
    pub fn new(camera: &CameraUniform, reach_m: f32) -> Self {
        let world_from_view = Mat4::from_cols_array_2d(&camera.world_from_view);
        let eye = world_from_view.w_axis.truncate();
        let [x, y] = camera.tan_half;
        // View space looks along −z.
        let planes = [Vec3::new(1.0, 0.0, -x), Vec3::new(-1.0, 0.0, -x), Vec3::new(0.0, 1.0, -y), Vec3::new(0.0, -1.0, -y)].map(
            |inwards| {
                let normal = world_from_view.transform_vector3(inwards).normalize();
                Vec4::from((normal, -normal.dot(eye))).to_array()
            },
        );
        Self { planes, eye: eye.to_array(), reach: reach_m }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;

    #[test]
    fn planes_hold_what_the_image_shows() {
        let camera = Camera::look_at("c", Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 2.5, -1.0), Vec3::Y, 0.8);
        let uniform = CameraUniform::new(&camera, [160, 90], [0.5; 2], 1.0);
        let cull = DepositCull::new(&uniform, 0.1);
        let inside = |ndc: [f32; 2], depth: f32| {
            let view = Vec3::new(ndc[0] * uniform.tan_half[0], ndc[1] * uniform.tan_half[1], -1.0) * depth;
            let world = camera.world_from_view.transform_point3(view);
            cull.planes.iter().all(|&[a, b, c, d]| Vec3::new(a, b, c).dot(world) + d >= 0.0)
        };
        for depth in [0.1, 7.0] {
            for (x, y, seen) in [(0.99, 0.99, true), (-0.99, -0.99, true), (1.01, 0.0, false), (0.0, -1.01, false)] {
                assert_eq!(inside([x, y], depth), seen, "({x}, {y}) at {depth} m");
            }
        }
        assert!(!inside([0.0, 0.0], -1.0), "behind the eye");
    }
}
