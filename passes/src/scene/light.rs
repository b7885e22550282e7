//! Punctual lights and the flux they emit.
//!
//! glTF's candela and lux are read one to one as W·sr⁻¹ and W·m⁻².

use glam::{Mat4, Vec3};
use std::f32::consts::PI;

/// A light without extent. Emissive triangles are lights too; they live in the materials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Shines alike in all directions.
    Point {
        /// Where it is (m).
        position_world: Vec3,
        /// Radiant intensity (W·sr⁻¹).
        intensity: Vec3,
    },
    /// Shines into a cone.
    Spot {
        /// Where it is (m).
        position_world: Vec3,
        /// Axis of the cone: the direction in which light travels (unit).
        direction_world: Vec3,
        /// Radiant intensity inside the inner cone (W·sr⁻¹).
        intensity: Vec3,
        /// Cosine of the half angle up to which the intensity is full.
        cos_inner: f32,
        /// Cosine of the half angle from which on it is zero.
        cos_outer: f32,
    },
    /// Shines from infinitely far away.
    Directional {
        /// The direction in which light travels (unit).
        direction_world: Vec3,
        /// Irradiance on a plane that faces it (W·m⁻²).
        irradiance: Vec3,
    },
}

impl Light {
    /// Flux emitted into the scene (W). A directional light fills the disc that the scene's bounding
    /// sphere, of radius `bounds_radius` (m), shows it.
    ///
    /// - point: Φ = 4π I
    /// - spot: Φ = 2π I ((1 − cᵢ) + (cᵢ − cₒ)/3), the integral of [`spot_falloff`] over the sphere
    /// - directional: Φ = π R² E
    pub fn flux(&self, bounds_radius: f32) -> Vec3 {
        match *self {
            Self::Point { intensity, .. } => 4.0 * PI * intensity,
            Self::Spot { intensity, cos_inner, cos_outer, .. } => {
                let (inner, outer) = ordered_cosines(cos_inner, cos_outer);
                2.0 * PI * ((1.0 - inner) + (inner - outer) / 3.0) * intensity
            }
            Self::Directional { irradiance, .. } => PI * bounds_radius * bounds_radius * irradiance,
        }
    }

    /// Puts it at the origin of a node and aims it along the node's −Z, as `KHR_lights_punctual` asks. Scale does not count.
    pub(crate) fn move_to(&mut self, world_from_node: Mat4) {
        let position = world_from_node.w_axis.truncate();
        let direction = world_from_node.transform_vector3(Vec3::NEG_Z).try_normalize().unwrap_or(Vec3::NEG_Z);
        match self {
            Self::Point { position_world, .. } => *position_world = position,
            Self::Spot { position_world, direction_world, .. } => (*position_world, *direction_world) = (position, direction),
            Self::Directional { direction_world, .. } => *direction_world = direction,
        }
    }

    /// What the light is made of: intensity (W·sr⁻¹) or irradiance (W·m⁻²).
    pub fn strength(&self) -> Vec3 {
        match *self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => intensity,
            Self::Directional { irradiance, .. } => irradiance,
        }
    }
}

/// How photons leave the lights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Emission {
    /// Into all directions that a light shines in.
    #[default]
    Uniform = 0,
    /// Punctual lights aim at what refracts or mirrors: at bounding spheres of it, the projection volume of Jensen
    /// (*Realistic Image Synthesis Using Photon Mapping*, 2001) and Kim (*Ray Tracing Gems*, ch. 30). The same light arrives
    /// there with less noise, and less elsewhere: only for photons whose first scattering is to be specular. Emissive
    /// triangles and the environment emit as ever.
    Guided = 1,
}

/// The cosines in order, `inner − outer ≥ 10⁻³`, so that the falloff can divide. These are what is uploaded.
pub(crate) fn ordered_cosines(cos_inner: f32, cos_outer: f32) -> (f32, f32) {
    let outer = cos_outer.clamp(-1.0, 0.999);
    (cos_inner.clamp(outer + 1e-3, 1.0), outer)
}

/// The share of a spot's intensity at cosine `cos` from its axis, as `KHR_lights_punctual` recommends:
/// t², t = clamp((cos − cₒ)/(cᵢ − cₒ), 0, 1), with cᵢ − cₒ at least 10⁻³.
pub fn spot_falloff(cos: f32, cos_inner: f32, cos_outer: f32) -> f32 {
    let (inner, outer) = ordered_cosines(cos_inner, cos_outer);
    let t = ((cos - outer) / (inner - outer)).clamp(0.0, 1.0);
    t * t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn point_emits_four_pi_times_its_intensity() {
        let light = Light::Point { position_world: Vec3::ZERO, intensity: Vec3::new(1.0, 2.0, 0.0) };
        assert!(light.flux(9.0).abs_diff_eq(4.0 * PI * Vec3::new(1.0, 2.0, 0.0), 1e-5), "4πI");
    }

    #[test]
    fn spot_flux_is_the_integral_of_its_falloff() {
        for (inner, outer) in [(0.0_f32, 0.6_f32), (0.2, 0.9), (0.7, 0.7), (0.0, 0.0), (1.0, 1.5)] {
            let (cos_inner, cos_outer) = (inner.cos(), outer.cos());
            let light = Light::Spot {
                position_world: Vec3::ZERO,
                direction_world: Vec3::NEG_Z,
                intensity: Vec3::ONE,
                cos_inner,
                cos_outer,
            };
            // Midpoint rule in the cosine: dω = 2π d cos θ.
            let steps = 400_000;
            let sum: f64 = (0..steps)
                .map(|i| {
                    let cos = -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(steps);
                    f64::from(spot_falloff(cos as f32, cos_inner, cos_outer))
                })
                .sum();
            let integral = (2.0 * std::f64::consts::PI * sum * 2.0 / f64::from(steps)) as f32;
            let flux = light.flux(1.0).x;
            assert!((flux - integral).abs() < 1e-3 * integral, "{flux} against {integral}");
        }
    }

    #[test]
    fn directional_fills_the_disc_of_the_bounds() {
        let light = Light::Directional { direction_world: Vec3::NEG_Y, irradiance: Vec3::splat(3.0) };
        assert!((light.flux(2.0).x - 12.0 * PI).abs() < 1e-4, "EπR²");
    }
}
