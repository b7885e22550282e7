//! The light list: punctual lights, then emissive triangles, selected in proportion to their power.
//!
//! The probability of a light is the step of the cumulative distribution *after* rounding to 32 bits,
//! so that weights 1/p fit exactly what a search in that distribution selects.

use super::gpu_types::{Light as GpuLight, LightKind, NONE};
use super::{Light, Material, Scene, Triangle, light::ordered_cosines};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// The lights of a scene as they are uploaded, and which triangle is which light.
pub(super) struct LightList {
    /// In order of selection.
    pub(super) lights: Vec<GpuLight>,
    /// Punctual lights at the start of `lights`.
    pub(super) punctual_count: u32,
    /// Flux of all lights (W).
    pub(super) total_power: Vec3,
    /// Index into `lights` for each triangle, or [`NONE`].
    pub(super) of_triangle: Vec<u32>,
}

/// Points per side of the grid on which a textured triangle's emission is averaged.
const GRID: u32 = 8;

impl LightList {
    /// `bounds_radius` (m) bounds the disc of directional lights.
    pub(super) fn new(scene: &Scene, bounds_radius: f32) -> Self {
        let mut lights: Vec<GpuLight> = scene.lights.iter().map(|light| punctual(light, bounds_radius)).collect();
        let punctual_count = lights.len() as u32;
        let mut of_triangle = vec![NONE; scene.triangles.len()];
        for (index, triangle) in scene.triangles.iter().enumerate() {
            let Some(material) = scene.materials.get(triangle.material as usize) else { continue };
            let radiance = mean_radiance(scene, triangle, material);
            let power = PI * triangle.area() * radiance;
            if !(power.is_finite() && power.max_element() > 0.0) {
                continue;
            }
            of_triangle[index] = lights.len() as u32;
            lights.push(emissive(triangle, index as u32, radiance, power));
        }
        let total_power = sum(&lights);
        distribute(&mut lights);
        Self { lights, punctual_count, total_power, of_triangle }
    }
}

/// Radiance of a triangle (W·m⁻²·sr⁻¹), averaged over a grid of points where it is textured.
///
/// An average that misses small bright spots would leave a triangle that emits out of the list, so it
/// is at least a 64th of the whole image's mean. Estimators evaluate the texture itself; this average
/// only steers selection and is the reported power.
fn mean_radiance(scene: &Scene, triangle: &Triangle, material: &Material) -> Vec3 {
    let factor = Vec3::from_array(material.emissive);
    let Some(slot) = material.emissive_texture.filter(|_| factor.max_element() > 0.0) else {
        return factor;
    };
    let Some(data) = scene.textures.get(slot.texture as usize) else { return factor };
    let [a, b, c] = triangle.uvs;
    let cells = GRID * GRID;
    // The unit square folds onto the triangle area for area: u → √u, as samplers do.
    let grid_mean = (0..cells)
        .map(|cell| {
            let u = ((cell % GRID) as f32 + 0.5) / GRID as f32;
            let v = ((cell / GRID) as f32 + 0.5) / GRID as f32;
            let s = u.sqrt();
            let (wb, wc) = (s * (1.0 - v), s * v);
            let uv: Vec2 = a * (1.0 - s) + b * wb + c * wc;
            slot.nearest_srgb(data, uv)
        })
        .sum::<Vec3>()
        / cells as f32;
    // Means of encoded values serve as a floor; they need not be exact.
    let image_mean = Vec3::new(data.channel_mean(0), data.channel_mean(1), data.channel_mean(2));
    factor * grid_mean.max(image_mean / 64.0)
}

fn punctual(light: &Light, bounds_radius: f32) -> GpuLight {
    let power = light.flux(bounds_radius).to_array();
    let intensity = light.strength().to_array();
    let plain = GpuLight { intensity, power, material: NONE, triangle: NONE, ..GpuLight::default() };
    match *light {
        Light::Point { position_world, .. } => {
            GpuLight { position: position_world.to_array(), kind: LightKind::Point as u32, ..plain }
        }
        Light::Spot { position_world, direction_world, cos_inner, cos_outer, .. } => {
            let (cos_inner, cos_outer) = ordered_cosines(cos_inner, cos_outer);
            GpuLight {
                position: position_world.to_array(),
                kind: LightKind::Spot as u32,
                direction: direction_world.to_array(),
                cos_inner,
                cos_outer,
                ..plain
            }
        }
        Light::Directional { direction_world, .. } => GpuLight {
            kind: LightKind::Directional as u32,
            direction: direction_world.to_array(),
            area: PI * bounds_radius * bounds_radius,
            ..plain
        },
    }
}

fn emissive(triangle: &Triangle, index: u32, radiance: Vec3, power: Vec3) -> GpuLight {
    let [a, b, c] = triangle.positions_world;
    GpuLight {
        position: a.to_array(),
        kind: LightKind::Triangle as u32,
        direction: triangle.normal_world().to_array(),
        area: triangle.area(),
        intensity: radiance.to_array(),
        edge1: (b - a).to_array(),
        edge2: (c - a).to_array(),
        power: power.to_array(),
        material: triangle.material,
        triangle: index,
        ..GpuLight::default()
    }
}

fn sum(lights: &[GpuLight]) -> Vec3 {
    let total = lights.iter().fold(glam::DVec3::ZERO, |sum, light| sum + Vec3::from_array(light.power).as_dvec3());
    total.as_vec3()
}

/// Fills `cdf` and `probability`; all alike when there is no power at all.
fn distribute(lights: &mut [GpuLight]) {
    let weight = |light: &GpuLight| light.power.iter().map(|&p| f64::from(p)).sum::<f64>();
    let total: f64 = lights.iter().map(weight).sum();
    let uniform = !(total > 0.0 && total.is_finite());
    let count = lights.len() as f64;
    let mut cumulative = 0.0;
    for light in lights.iter_mut() {
        cumulative += if uniform { 1.0 / count } else { weight(light) / total };
        light.cdf = cumulative.min(1.0) as f32;
    }
    // Rounding must not leave a gap at the end, nor give it to a light without power.
    if let Some(last) = lights.iter().rposition(|light| uniform || weight(light) > 0.0) {
        for light in &mut lights[last..] {
            light.cdf = 1.0;
        }
    }
    let mut before = 0.0;
    for light in lights.iter_mut() {
        light.probability = light.cdf - before;
        before = light.cdf;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{TextureData, TextureUse, builtin};

    fn list(scene: &Scene) -> LightList {
        LightList::new(scene, scene.bounding_sphere().1)
    }

    #[test]
    fn emissive_quad_has_its_flux() {
        let scene = builtin::cornell();
        let lights = list(&scene);
        let area: f32 =
            scene.triangles.iter().filter(|t| scene.materials[t.material as usize].emissive[0] > 0.0).map(Triangle::area).sum();
        let expected = PI * area * builtin::CORNELL_RADIANCE;
        assert!(lights.total_power.abs_diff_eq(expected, 1e-3), "{} ≠ {expected}", lights.total_power);
        assert_eq!((lights.punctual_count, lights.lights.len()), (0, 2));
        let emitters = lights.of_triangle.iter().filter(|&&l| l != NONE).count();
        assert_eq!(emitters, 2);
        for (triangle, &light) in lights.of_triangle.iter().enumerate().filter(|(_, l)| **l != NONE) {
            assert_eq!(lights.lights[light as usize].triangle, triangle as u32);
        }
    }

    #[test]
    fn probabilities_follow_power_and_end_at_one() {
        let mut scene = builtin::cornell();
        for i in 0..1000_u32 {
            let intensity = Vec3::new(1.0, 0.5, 0.0) * (i % 7) as f32;
            scene.lights.push(Light::Point { position_world: Vec3::Y, intensity });
        }
        let lights = list(&scene).lights;
        let total: f32 = lights.iter().map(|l| Vec3::from_array(l.power).element_sum()).sum();
        let mut before = 0.0;
        for light in &lights {
            assert!(light.cdf >= before, "monotone");
            let expected = Vec3::from_array(light.power).element_sum() / total;
            assert!((light.probability - expected).abs() < 1e-6, "{} ≠ {expected}", light.probability);
            assert!((light.probability - (light.cdf - before)).abs() < f32::EPSILON, "step of the cdf");
            before = light.cdf;
        }
        assert!((before - 1.0).abs() < f32::EPSILON, "ends at {before}");
    }

    #[test]
    fn a_dark_light_at_the_end_is_never_selected() {
        let mut scene = builtin::closed_sphere(0);
        scene.lights.push(Light::Point { position_world: Vec3::Y, intensity: Vec3::ZERO });
        let lights = list(&scene).lights;
        assert!((lights[0].cdf - 1.0).abs() < f32::EPSILON && lights[1].probability == 0.0, "{lights:?}");
    }

    #[test]
    fn textured_emission_is_averaged() {
        let mut scene = builtin::cornell();
        // Left half white, right half black.
        scene.textures.push(TextureData {
            name: "half".into(),
            width: 2,
            height: 1,
            rgba8: vec![255, 255, 255, 255, 0, 0, 0, 255],
        });
        let plain = list(&scene).total_power;
        for material in &mut scene.materials {
            material.emissive_texture = Some(TextureUse::new(0));
        }
        let textured = list(&scene).total_power;
        assert!((textured.x / plain.x - 0.5).abs() < 0.05, "{textured} of {plain}");
    }
}
