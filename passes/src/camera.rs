//! The camera as shaders see it.

use crate::scene::Camera;
use glam::Mat4;
use lightloom_graph::shader_struct;

shader_struct! {
    /// A pinhole camera over an image; the struct `Camera` of `shared/camera.wgsl`.
    pub struct CameraUniform {
        /// Rigid; columns.
        pub world_from_view: [[f32; 4]; 4],
        /// Its inverse.
        pub view_from_world: [[f32; 4]; 4],
        /// Tangents of half the horizontal and vertical angle.
        pub tan_half: [f32; 2],
        /// Image size (pixels).
        pub size: [u32; 2],
        /// Sample position inside each pixel, in [0, 1)².
        pub jitter: [f32; 2],
        /// Distance of the near plane (m).
        pub near_m: f32,
        /// Padding.
        pub pad0: u32,
    }
}

impl CameraUniform {
    /// `camera` over an image of `size` pixels: the vertical angle is kept, the aspect ratio is the image's. `jitter`
    /// is the sample position inside the pixel; `[0.5, 0.5]` is its centre. `bounds_radius` (m) of the scene sets the
    /// near plane: a hundred-thousandth of it.
    pub fn new(camera: &Camera, size: [u32; 2], jitter: [f32; 2], bounds_radius: f32) -> Self {
        let tan_y = (0.5 * camera.yfov).tan();
        let aspect = size[0] as f32 / size[1].max(1) as f32;
        let world_from_view: Mat4 = camera.world_from_view;
        Self {
            world_from_view: world_from_view.to_cols_array_2d(),
            view_from_world: world_from_view.inverse().to_cols_array_2d(),
            tan_half: [tan_y * aspect, tan_y],
            size,
            jitter,
            near_m: (bounds_radius * 1.0e-5).max(1.0e-6),
            pad0: 0,
        }
    }

    /// Where the eye is (m).
    pub fn position_world(&self) -> [f32; 3] {
        let [x, y, z, _] = self.world_from_view[3];
        [x, y, z]
    }

    /// Height of a pixel at a distance of 1 m (m).
    pub fn pixel_angle(&self) -> f32 {
        2.0 * self.tan_half[1] / self.size[1].max(1) as f32
    }
}
