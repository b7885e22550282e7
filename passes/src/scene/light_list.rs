//! The light list: punctual lights, then emissive triangles, piece by piece, then the environment, selected for direct light in
//! proportion to their power and given photons by [`PhotonBudget`].
//!
//! The probability of a light is the step of the cumulative distribution *after* rounding to 32 bits,
//! so that weights 1/p fit exactly what a search in that distribution selects.

use super::budget::{Lamp, PhotonBudget, divide, shares};
use super::gpu_types::{Light as GpuLight, LightGroup, LightKind, NONE};
use super::guides::{Sphere, guides};
use super::light_groups::{Group, pieces, strongest};
use super::{Environment, Light, Material, Scene, Triangle, light::ordered_cosines};
use glam::{Vec2, Vec3};
use std::collections::HashMap;
use std::f32::consts::PI;

/// The lights of a scene as they are uploaded, and which triangle is which light.
pub(super) struct LightList {
    /// In order of selection; behind them the guided twins of the punctual ones, guide by guide.
    pub(super) lights: Vec<GpuLight>,
    /// Without the twins.
    pub(super) light_count: u32,
    /// Punctual lights at the start of `lights`.
    pub(super) punctual_count: u32,
    /// Guided twins of each punctual light.
    pub(super) guide_count: u32,
    /// Flux of all lights (W).
    pub(super) total_power: Vec3,
    /// Index into `lights` for each triangle, or [`NONE`].
    pub(super) of_triangle: Vec<u32>,
    /// Which lights are one lamp, and how photons are shared.
    pub(super) budget: PhotonBudget,
    /// Lights that maps steer as one.
    pub(super) groups: Vec<LightGroup>,
}

/// Points per side of the grid on which a textured triangle's emission is averaged.
const GRID: u32 = 8;

/// A light with what only the CPU needs of it.
struct Entry {
    light: GpuLight,
    /// Flux (W).
    power: Vec3,
    /// Index into the lamps.
    lamp: u32,
}

impl LightList {
    /// `bounds_radius` (m) bounds the disc of directional lights and the environment.
    pub(super) fn new(scene: &Scene, bounds_radius: f32) -> Self {
        let mut lamps: Vec<Lamp> = Vec::new();
        let mut add_lamp = |name: String, kind| {
            let weight = scene.photon_weights.iter().find(|(lamp, _)| *lamp == name).map_or(1.0, |&(_, weight)| weight);
            lamps.push(Lamp { name, kind, power: Vec3::ZERO, weight });
            lamps.len() as u32 - 1
        };
        let mut entries: Vec<Entry> = Vec::new();
        for (index, light) in scene.lights.iter().enumerate() {
            let lamp = add_lamp(punctual_name(scene, index), kind_of(light));
            entries.push(Entry { light: punctual(light, bounds_radius), power: light.flux(bounds_radius), lamp });
        }
        let punctual_count = entries.len() as u32;

        let mut groups: Vec<Group> = (0..punctual_count).map(|first| Group { first, count: 1, axis: Vec3::ZERO }).collect();

        let mut lamp_of_material: HashMap<u32, u32> = HashMap::new();
        let mut image_means = HashMap::new();
        let mut surfaces: Vec<Entry> = Vec::new();
        for (index, triangle) in scene.triangles.iter().enumerate() {
            let Some(material) = scene.materials.get(triangle.material as usize) else { continue };
            let radiance = mean_radiance(scene, triangle, material, &mut image_means);
            let sides = if material.double_sided { 2.0 } else { 1.0 };
            let power = PI * sides * triangle.area() * radiance;
            // A pose may leave a triangle without area.
            if !(power.is_finite() && power.max_element() > 0.0 && triangle.is_sound()) {
                continue;
            }
            let lamp = *lamp_of_material
                .entry(triangle.material)
                .or_insert_with(|| add_lamp(material_name(scene, triangle.material), LightKind::Triangle));
            surfaces.push(Entry { light: emissive(triangle, index as u32, radiance, material.double_sided), power, lamp });
        }
        append_pieces(scene, surfaces, &mut entries, &mut groups);
        let mut of_triangle = vec![NONE; scene.triangles.len()];
        for (index, entry) in entries.iter().enumerate().skip(punctual_count as usize) {
            of_triangle[entry.light.triangle as usize] = index as u32;
        }
        if let Some(environment) = &scene.environment {
            let lamp = add_lamp(ENVIRONMENT.into(), LightKind::Environment);
            let (light, power) = infinite(environment, bounds_radius);
            entries.push(Entry { light, power, lamp });
        }
        for entry in &entries {
            lamps[entry.lamp as usize].power += entry.power;
        }
        distribute(&mut entries);
        let light_count = entries.len() as u32;
        let total_power = entries.iter().map(|entry| entry.power.as_dvec3()).sum::<glam::DVec3>().as_vec3();
        give_photons(&mut entries, &lamps, 0);
        let starts = entries.iter().map(|entry| entry.light.photon_start[0]).collect();
        let lamp_of = entries.iter().map(|entry| entry.lamp).collect();
        let groups = strongest(&groups, |light| entries[light as usize].light.photon_probability[0]);

        let guides = if punctual_count > 0 { guides(scene) } else { Vec::new() };
        for index in 0..punctual_count as usize {
            entries.extend(guides.iter().map(|guide| guided(&entries[index], guide)).collect::<Vec<_>>());
        }
        give_photons(&mut entries[punctual_count as usize..], &lamps, 1);
        Self {
            lights: entries.into_iter().map(|entry| entry.light).collect(),
            light_count,
            punctual_count,
            guide_count: guides.len() as u32,
            total_power,
            of_triangle,
            budget: PhotonBudget::new(lamps, lamp_of, starts),
            groups,
        }
    }
}

/// Appends the triangles of `surfaces` to `entries`, piece by piece within a lamp, and the pieces to `groups`.
fn append_pieces(scene: &Scene, surfaces: Vec<Entry>, entries: &mut Vec<Entry>, groups: &mut Vec<Group>) {
    let triangles: Vec<_> = surfaces.iter().map(|entry| &scene.triangles[entry.light.triangle as usize]).collect();
    let mut in_pieces: Vec<_> = pieces(&triangles).into_iter().zip(surfaces).collect();
    in_pieces.sort_by_key(|(piece, entry)| (entry.lamp, *piece));
    let mut last = None;
    for (piece, entry) in in_pieces {
        match groups.last_mut().filter(|_| last == Some(piece)) {
            Some(group) => group.count += 1,
            None => groups.push(Group { first: entries.len() as u32, count: 1, axis: entry.light.direction.into() }),
        }
        last = Some(piece);
        entries.push(entry);
    }
}

/// The name of the environment as a lamp.
const ENVIRONMENT: &str = "environment";

fn punctual_name(scene: &Scene, index: usize) -> String {
    scene.light_names.get(index).filter(|name| !name.is_empty()).map_or_else(|| format!("light {index}"), String::clone)
}

fn material_name(scene: &Scene, index: u32) -> String {
    let name = scene.materials.get(index as usize).map(|material| material.name.as_str()).filter(|name| !name.is_empty());
    name.map_or_else(|| format!("material {index}"), str::to_owned)
}

/// The names of all lamps.
pub(super) fn lamp_names(scene: &Scene) -> Vec<String> {
    let list = LightList::new(scene, 1.0);
    list.budget.lamps().iter().map(|lamp| lamp.name.clone()).collect()
}

/// Shares photons among `entries`, for emission `mode`: among their lamps by [`shares`], within a lamp by power.
fn give_photons(entries: &mut [Entry], lamps: &[Lamp], mode: usize) {
    let weight = |power: Vec3| f64::from(power.x) + f64::from(power.y) + f64::from(power.z);
    let mut powers = vec![0.0; lamps.len()];
    let mut members = vec![0_u32; lamps.len()];
    for entry in entries.iter() {
        powers[entry.lamp as usize] += weight(entry.power);
        members[entry.lamp as usize] += 1;
    }
    let of_lamps = shares(&powers.iter().zip(lamps).map(|(&power, lamp)| (power, lamp.weight)).collect::<Vec<_>>());
    let share = |entry: &Entry| {
        let lamp = entry.lamp as usize;
        let within = if powers[lamp] > 0.0 { weight(entry.power) / powers[lamp] } else { 1.0 / f64::from(members[lamp].max(1)) };
        of_lamps[lamp] * within
    };
    let divided = divide(&entries.iter().map(share).collect::<Vec<_>>());
    for (entry, (start, probability)) in entries.iter_mut().zip(divided) {
        entry.light.photon_start[mode] = start;
        entry.light.photon_probability[mode] = probability;
    }
}

/// A punctual light as it aims at a guide, with the flux it sends there (W). A spot counts as if its cone were full.
fn guided(entry: &Entry, guide: &Sphere) -> Entry {
    let mut light = entry.light;
    light.guide_center = guide.center.to_array();
    light.guide_radius = guide.radius;
    (light.cdf, light.probability) = (1.0, 0.0);
    (light.photon_start[0], light.photon_probability[0]) = (NONE, 0.0);
    let share = if light.kind == LightKind::Directional as u32 {
        PI * guide.radius * guide.radius
    } else {
        let sin2 = guide.radius.powi(2) / guide.center.distance_squared(light.position.into()).max(1e-30);
        let one_minus_cos = if sin2 >= 1.0 { 2.0 } else { sin2 / (1.0 + (1.0 - sin2).sqrt()) };
        2.0 * PI * one_minus_cos
    };
    Entry { light, power: Vec3::from(light.intensity) * share, lamp: entry.lamp }
}

/// Radiance of a triangle (W·m⁻²·sr⁻¹), averaged over a grid of points where it is textured.
///
/// An average that misses small bright spots would leave a triangle that emits out of the list, so it
/// is at least a 64th of the whole image's mean. Estimators evaluate the texture itself; this average
/// only steers selection and is the reported power. `image_means` has the means of the textures met before.
fn mean_radiance(scene: &Scene, triangle: &Triangle, material: &Material, image_means: &mut HashMap<u32, Vec3>) -> Vec3 {
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
    let of_image = || Vec3::new(data.channel_mean(0), data.channel_mean(1), data.channel_mean(2));
    let image_mean = image_means.entry(slot.texture).or_insert_with(of_image);
    factor * grid_mean.max(*image_mean / 64.0)
}

fn kind_of(light: &Light) -> LightKind {
    match light {
        Light::Point { .. } => LightKind::Point,
        Light::Spot { .. } => LightKind::Spot,
        Light::Directional { .. } => LightKind::Directional,
    }
}

fn punctual(light: &Light, bounds_radius: f32) -> GpuLight {
    let intensity = light.strength().to_array();
    let plain = GpuLight { intensity, kind: kind_of(light) as u32, material: NONE, triangle: NONE, ..GpuLight::default() };
    match *light {
        Light::Point { position_world, .. } => GpuLight { position: position_world.to_array(), ..plain },
        Light::Spot { position_world, direction_world, cos_inner, cos_outer, .. } => {
            let (cos_inner, cos_outer) = ordered_cosines(cos_inner, cos_outer);
            GpuLight { position: position_world.to_array(), direction: direction_world.to_array(), cos_inner, cos_outer, ..plain }
        }
        Light::Directional { direction_world, .. } => {
            GpuLight { direction: direction_world.to_array(), area: PI * bounds_radius * bounds_radius, ..plain }
        }
    }
}

/// The environment as a light, and its flux into the scene's bounding sphere: Φ = π R² ∫ L dω (W).
fn infinite(environment: &Environment, bounds_radius: f32) -> (GpuLight, Vec3) {
    let area = PI * bounds_radius * bounds_radius;
    let sum = environment.irradiance_all_round();
    let light = GpuLight {
        kind: LightKind::Environment as u32,
        area,
        intensity: (sum / (4.0 * PI)).to_array(),
        material: NONE,
        triangle: NONE,
        ..GpuLight::default()
    };
    (light, area * sum)
}

fn emissive(triangle: &Triangle, index: u32, radiance: Vec3, two_sided: bool) -> GpuLight {
    let [a, b, c] = triangle.positions_world;
    GpuLight {
        position: a.to_array(),
        kind: LightKind::Triangle as u32,
        direction: triangle.normal_world().to_array(),
        area: triangle.area(),
        intensity: radiance.to_array(),
        edge1: (b - a).to_array(),
        edge2: (c - a).to_array(),
        material: triangle.material,
        triangle: index,
        two_sided: u32::from(two_sided),
        ..GpuLight::default()
    }
}

/// Fills `cdf` and `probability`; all alike when there is no power at all.
fn distribute(entries: &mut [Entry]) {
    let weight = |entry: &Entry| entry.power.to_array().iter().map(|&p| f64::from(p)).sum::<f64>();
    let total: f64 = entries.iter().map(weight).sum();
    let uniform = !(total > 0.0 && total.is_finite());
    let count = entries.len() as f64;
    let mut cumulative = 0.0;
    for entry in entries.iter_mut() {
        cumulative += if uniform { 1.0 / count } else { weight(entry) / total };
        entry.light.cdf = cumulative.min(1.0) as f32;
    }
    // Rounding must not leave a gap at the end, nor give it to a light without power.
    if let Some(last) = entries.iter().rposition(|entry| uniform || weight(entry) > 0.0) {
        for entry in &mut entries[last..] {
            entry.light.cdf = 1.0;
        }
    }
    let mut before = 0.0;
    for entry in entries {
        entry.light.probability = entry.light.cdf - before;
        before = entry.light.cdf;
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
        let flux = |light: &GpuLight| match light.kind {
            0 => Vec3::from(light.intensity).element_sum() * 4.0 * PI,
            _ => Vec3::from(light.intensity).element_sum() * PI * light.area,
        };
        let total: f32 = lights.iter().map(flux).sum();
        let mut before = 0.0;
        for light in &lights {
            assert!(light.cdf >= before, "monotone");
            let expected = flux(light) / total;
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

    #[test]
    fn both_sides_of_a_double_sided_emitter_count() {
        let mut scene = builtin::cornell();
        let single = list(&scene).total_power;
        for material in &mut scene.materials {
            material.double_sided = true;
        }
        let double = list(&scene);
        assert!(double.total_power.abs_diff_eq(2.0 * single, 1e-4), "{} of {single}", double.total_power);
        assert!(double.lights.iter().all(|light| light.two_sided == 1), "each light says so");
    }

    #[test]
    fn the_environment_is_the_last_light_and_fills_the_bounding_sphere() {
        let mut scene = builtin::caustics();
        scene.set_environment(Environment::constant(Vec3::new(1.0, 0.5, 0.0)).unwrap());
        let radius = scene.bounding_sphere().1;
        let lights = list(&scene);
        let last = &lights.lights[lights.light_count as usize - 1];
        assert_eq!(last.kind, LightKind::Environment as u32);
        assert!(last.cdf.to_bits() == 1.0_f32.to_bits(), "the last that is selected");
        // 4π² R² L.
        let expected = 4.0 * PI * PI * radius * radius;
        let power = lights.budget.lamps()[1].power;
        assert!((power.x / expected - 1.0).abs() < 1e-5 && (power.y / power.x - 0.5).abs() < 1e-5, "{power} of {expected}");
        assert!((lights.total_power - lights.budget.lamps()[0].power - power).length() < 1e-3 * expected, "the sum of both");
    }

    #[test]
    fn a_guided_light_has_all_its_photons_in_its_twins() {
        let scene = builtin::caustics();
        let lights = list(&scene);
        assert!(lights.guide_count > 0, "glass and brass");
        assert_eq!(lights.lights.len() as u32, lights.light_count + lights.punctual_count * lights.guide_count);
        let twins = &lights.lights[lights.light_count as usize..];
        let sum: f32 = twins.iter().map(|twin| twin.photon_probability[1]).sum();
        assert!((sum - 1.0).abs() < 1e-6, "{sum}");
        assert!(twins.iter().all(|twin| twin.guide_radius > 0.0 && twin.photon_probability[0] == 0.0), "{twins:?}");
        assert!((lights.lights[0].photon_probability[0] - 1.0).abs() < 1e-6, "uniform emission leaves from the light itself");
    }
}
