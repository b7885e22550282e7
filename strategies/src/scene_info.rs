//! The few numbers of a scene that strategies choose their sizes by.

use glam::Vec3;

/// Extent of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneInfo {
    /// Centre of the bounding sphere (m).
    pub bounds_center_world: Vec3,
    /// Radius of the bounding sphere (m).
    pub bounds_radius_m: f32,
    /// Area of all triangles, one side each (m²).
    pub surface_area_m2: f32,
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The cube of edge 1 around the origin.
    pub(crate) fn unit_scene() -> SceneInfo {
        SceneInfo { bounds_center_world: Vec3::ZERO, bounds_radius_m: 0.75_f32.sqrt(), surface_area_m2: 6.0 }
    }
}
