//! Cameras: a rigid frame and a vertical angle.

use super::error::SceneError;
use glam::{Mat4, Vec3, Vec4};

/// Vertical angle of cameras that no file gave (rad): 45°.
const DEFAULT_YFOV: f32 = std::f32::consts::FRAC_PI_4;

/// A pinhole camera. It looks along −Z of its own frame, Y is up; the aspect ratio is that of the image.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name by which it is selected.
    pub name: String,
    /// Rigid transform from the camera's frame to the world (m).
    pub world_from_view: Mat4,
    /// Vertical angle of view (rad), in (0, π).
    pub yfov: f32,
}

impl Camera {
    /// A camera at `eye_world` that looks at `target_world`. `up` is any direction; where it is
    /// parallel to the view, another one is chosen.
    pub fn look_at(name: &str, eye_world: Vec3, target_world: Vec3, up: Vec3, yfov: f32) -> Self {
        let back = (eye_world - target_world).try_normalize().unwrap_or(Vec3::Z);
        Self { name: name.into(), world_from_view: rigid(back, up, eye_world), yfov }
    }

    /// The rigid part of a node's transform: the view direction and position stay, up is made
    /// perpendicular, scale, shear and mirroring go.
    pub fn from_node(name: &str, world_from_node: Mat4, yfov: f32) -> Self {
        let back = world_from_node.z_axis.truncate().try_normalize().unwrap_or(Vec3::Z);
        let up = world_from_node.y_axis.truncate();
        let eye = world_from_node.w_axis.truncate();
        Self { name: name.into(), world_from_view: rigid(back, up, eye), yfov }
    }

    /// A camera that sees the whole sphere from above one corner.
    pub fn framing(center_world: Vec3, radius_m: f32) -> Self {
        let radius = radius_m.max(1e-6);
        let from = Vec3::new(0.55, 0.45, 1.0).normalize();
        // Images may be taller than wide down to about 3:4, hence the margin.
        let distance = 1.35 * radius / (0.5 * DEFAULT_YFOV).sin();
        let eye = center_world + from * distance;
        Self::look_at("default", eye, center_world, Vec3::Y, DEFAULT_YFOV)
    }

    /// Where the camera stands (m).
    pub fn position_world(&self) -> Vec3 {
        self.world_from_view.w_axis.truncate()
    }

    /// The direction it looks into (unit).
    pub fn forward_world(&self) -> Vec3 {
        -self.world_from_view.z_axis.truncate()
    }
}

/// A right-handed orthonormal frame with `back` (unit) as Z and Y as near to `up` as it gets.
fn rigid(back: Vec3, up: Vec3, eye: Vec3) -> Mat4 {
    let right = up
        .cross(back)
        .try_normalize()
        .filter(|_| up.normalize_or_zero().cross(back).length() > 1e-4)
        .unwrap_or_else(|| back.any_orthonormal_vector());
    let up = back.cross(right);
    Mat4::from_cols(right.extend(0.0), up.extend(0.0), back.extend(0.0), Vec4::new(eye.x, eye.y, eye.z, 1.0))
}

/// Picks a camera by name, or else by index from 0.
pub(crate) fn select<'a>(scene: &str, cameras: &'a [Camera], selector: &str) -> Result<&'a Camera, SceneError> {
    let by_name = cameras.iter().find(|camera| camera.name == selector);
    let by_index = || selector.parse::<usize>().ok().and_then(|index| cameras.get(index));
    by_name.or_else(by_index).ok_or_else(|| {
        let names: Vec<String> = cameras.iter().enumerate().map(|(i, camera)| format!("{i} `{}`", camera.name)).collect();
        SceneError::UnknownCamera {
            scene: scene.into(),
            selector: selector.into(),
            available: if names.is_empty() { "none".into() } else { names.join(", ") },
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_rigid(m: Mat4) -> bool {
        let r = glam::Mat3::from_mat4(m);
        (r.transpose() * r).abs_diff_eq(glam::Mat3::IDENTITY, 1e-5) && (r.determinant() - 1.0).abs() < 1e-5
    }

    #[test]
    fn node_scale_and_mirroring_go_but_the_view_stays() {
        let node = Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0))
            * Mat4::from_rotation_y(0.7)
            * Mat4::from_scale(Vec3::new(-2.0, 3.0, 0.5));
        let camera = Camera::from_node("c", node, 1.0);
        assert!(is_rigid(camera.world_from_view), "rigid");
        assert_eq!(camera.position_world(), Vec3::new(1.0, 2.0, 3.0));
        let forward = -node.z_axis.truncate().normalize();
        assert!(camera.forward_world().abs_diff_eq(forward, 1e-6), "forward");
    }

    #[test]
    fn looking_straight_down_is_still_rigid() {
        let camera = Camera::look_at("c", Vec3::Y, Vec3::ZERO, Vec3::Y, 1.0);
        assert!(is_rigid(camera.world_from_view), "rigid");
        assert!(camera.forward_world().abs_diff_eq(Vec3::NEG_Y, 1e-6), "down");
    }

    #[test]
    fn framing_holds_the_sphere() {
        let center = Vec3::new(5.0, -1.0, 2.0);
        let camera = Camera::framing(center, 3.0);
        let distance = camera.position_world().distance(center);
        assert!((3.0 / distance).asin() < 0.5 * camera.yfov, "the sphere fits the angle");
    }

    #[test]
    fn cameras_go_by_name_then_index() {
        let camera = |name: &str| Camera::look_at(name, Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0);
        let cameras = [camera("main"), camera("0")];
        assert_eq!(select("s", &cameras, "main").unwrap().name, "main");
        assert_eq!(select("s", &cameras, "0").unwrap().name, "0");
        assert_eq!(select("s", &cameras, "1").unwrap().name, "0");
        let message = select("s", &cameras, "side").unwrap_err().to_string();
        assert!(message.contains("0 `main`, 1 `0`"), "{message}");
    }
}
