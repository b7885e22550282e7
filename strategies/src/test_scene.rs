//! Numbers of a small scene, for unit tests.

use glam::Vec3;
use lightloom_passes::scene::SceneInfo;

/// The cube of edge 1 around the origin.
pub(crate) fn unit_scene() -> SceneInfo {
    SceneInfo { bounds_center: Vec3::ZERO, bounds_radius: 0.75_f32.sqrt(), ..SceneInfo::default() }
}
