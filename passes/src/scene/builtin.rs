//! Scenes made by our own code: for demonstration, and those with a known answer.

mod corridor;
mod moving;
mod pieces;
mod pool;

pub use corridor::corridor;
pub use moving::moving;
pub use pieces::pieces;
pub use pool::pool;

use super::mesh::{band, cuboid, disc, faceted, icosphere, inverted, placed, quad};
use super::{Camera, Light, Material, Scene, Triangle};
use glam::{Mat4, Quat, Vec3};
use std::f32::consts::PI;

/// Radiance of the lamp in [`cornell`] (W·m⁻²·sr⁻¹).
pub const CORNELL_RADIANCE: Vec3 = Vec3::new(17.0, 12.0, 4.0);

/// Names that [`by_name`] knows, the default demonstration first.
pub fn names() -> &'static [&'static str] {
    &[
        "caustics",
        "cornell",
        "pool",
        "pieces",
        "corridor",
        "moving",
        "closed_sphere",
        "closed_box",
        "plane",
        "plane_point",
        "two_discs",
    ]
}

/// A built-in scene with its usual parameters: sphere of 4 subdivisions, box of albedo ½, plane of 4 m.
/// Hyphens may stand for underscores; `cornell_glass` is another name of `caustics`.
pub fn by_name(name: &str) -> Option<Scene> {
    Some(match name.replace('-', "_").as_str() {
        "caustics" | "cornell_glass" => caustics(),
        "cornell" => cornell(),
        "pool" => pool(),
        "pieces" => pieces(),
        "corridor" => corridor(),
        "closed_sphere" => closed_sphere(4),
        "closed_box" => closed_box(0.5),
        "plane" => plane(4.0),
        "plane_point" => plane_point(4.0, 1.0),
        "two_discs" => two_discs(),
        "moving" => moving(),
        _ => return None,
    })
}

/// Materials of the Cornell room, by index.
const WHITE: u32 = 0;
const RED: u32 = 1;
const GREEN: u32 = 2;
const THIRD: u32 = 3;
const FOURTH: u32 = 4;

/// A Cornell room of 2 × 2 × 2 m, x and z in [−1, 1], y in [0, 2], open towards +z. A lamp of
/// 0.5 × 0.4 m below the ceiling, radiance [`CORNELL_RADIANCE`], flux π·0.2·L = (10.68, 7.54, 2.51) W;
/// two boxes. All surfaces are Lambertian.
///
/// Cameras: `fill` stands in the opening and sees walls everywhere, `classic` stands before the room.
pub fn cornell() -> Scene {
    let mut scene = room("cornell");
    scene.materials.push(Material::emitter("lamp", CORNELL_RADIANCE));
    let lamp =
        [Vec3::new(-0.25, 1.995, -0.2), Vec3::new(0.25, 1.995, -0.2), Vec3::new(0.25, 1.995, 0.2), Vec3::new(-0.25, 1.995, 0.2)];
    scene.triangles.extend(quad(lamp, THIRD));
    let block = |size: Vec3, at: Vec3, turn: f32| {
        let shape = cuboid(Vec3::new(-0.5, 0.0, -0.5) * size, Vec3::new(0.5, 1.0, 0.5) * size, WHITE);
        placed(shape, Mat4::from_rotation_translation(Quat::from_rotation_y(turn), at))
    };
    scene.triangles.extend(block(Vec3::new(0.6, 1.2, 0.6), Vec3::new(-0.35, 0.0, -0.35), 0.29));
    scene.triangles.extend(block(Vec3::new(0.6, 0.6, 0.6), Vec3::new(0.35, 0.0, 0.3), -0.31));
    scene
}

/// The room of [`cornell`] with a clear glass sphere (radius 0.36 m, ior 1.5) and a polished ring
/// (radius 0.42 m, height 0.22 m) on the floor, lit by a point light of I = (9, 8.2, 6.8) W·sr⁻¹, flux
/// 4πI = (113.1, 103.0, 85.5) W. The sphere focuses a bright spot onto wall and floor, the ring a crescent.
/// Camera `main` looks down on both; `fill` and `classic` are those of the room.
pub fn caustics() -> Scene {
    let mut scene = room("caustics");
    scene.materials.push(Material::glass("glass", 1.5, 0.72));
    scene.materials.push(Material::metal("polished brass", Vec3::new(0.95, 0.79, 0.49), 0.0));
    let at = Vec3::new(0.44, 0.42, -0.3);
    let sphere = placed(icosphere(5, THIRD), Mat4::from_scale_rotation_translation(Vec3::splat(0.36), Quat::IDENTITY, at));
    scene.triangles.extend(sphere);
    // A ring has an inner and an outer wall and a rim, so that it looks solid.
    let (inner, outer, height) = (0.42, 0.435, 0.22);
    let ring_at = Mat4::from_translation(Vec3::new(-0.34, 0.001, 0.05));
    let wall = |radius: f32| sized(band(192, FOURTH), Vec3::new(radius, height, radius));
    scene.triangles.extend(placed(inverted(wall(inner)), ring_at));
    scene.triangles.extend(placed(wall(outer), ring_at));
    scene.triangles.extend(placed(rim(192, inner, outer, height, FOURTH), ring_at));
    scene.lights.push(Light::Point { position_world: Vec3::new(-0.55, 1.05, -0.45), intensity: Vec3::new(9.0, 8.2, 6.8) });
    let eye = Vec3::new(0.0, 1.5, 2.3);
    let down = Camera::look_at("main", eye, Vec3::new(0.0, 0.36, -0.1), Vec3::Y, 0.6);
    scene.cameras.insert(0, down);
    scene
}

/// The inside of a sphere of radius 1 m and albedo ½ with a point light of I = π W·sr⁻¹ at the centre,
/// flux 4π² W: radiance 1 everywhere, of which ½ is indirect (PHYSICS check 1).
///
/// The sphere is an icosphere of 20·4ⁿ flat triangles, scaled so that its area is 4π m²: mean direct
/// and indirect irradiance are then exactly π.
pub fn closed_sphere(subdivisions: u32) -> Scene {
    let shape = icosphere(subdivisions.min(8), 0);
    let area: f64 = shape.iter().map(|t| f64::from(t.area())).sum();
    let scale = (4.0 * std::f64::consts::PI / area).sqrt() as f32;
    let triangles = faceted(inverted(sized(shape, Vec3::splat(scale))));
    Scene {
        name: "closed_sphere".into(),
        triangles,
        materials: vec![Material::lambert("grey", Vec3::splat(0.5))],
        lights: vec![Light::Point { position_world: Vec3::ZERO, intensity: Vec3::splat(PI) }],
        // Off the light's own place, and not along an axis of the icosahedron.
        cameras: vec![Camera::look_at("inside", Vec3::new(0.03, 0.05, 0.11), Vec3::new(0.4, 0.1, -1.0), Vec3::Y, 1.2)],
        ..Scene::default()
    }
}

/// The inside of a box of 3 × 4 × 5 m (x, y, z from 0; area 94 m²) of that albedo, with a point light of
/// I = 10 W·sr⁻¹ at (1.3, 2.4, 2.2), flux 40π W. Mean direct irradiance 40π/94 W·m⁻², mean indirect that
/// times ρ/(1−ρ) (PHYSICS check 2).
pub fn closed_box(albedo: f32) -> Scene {
    Scene {
        name: "closed_box".into(),
        triangles: inverted(cuboid(Vec3::ZERO, Vec3::new(3.0, 4.0, 5.0), 0)),
        materials: vec![Material::lambert("walls", Vec3::splat(albedo.clamp(0.0, 1.0)))],
        lights: vec![Light::Point { position_world: Vec3::new(1.3, 2.4, 2.2), intensity: Vec3::splat(10.0) }],
        cameras: vec![Camera::look_at("corner", Vec3::new(2.8, 3.6, 4.8), Vec3::new(0.9, 1.2, 1.0), Vec3::Y, 1.2)],
        ..Scene::default()
    }
}

/// A square in the plane y = 0, `size_m` wide about the origin, albedo ½, under a directional light
/// from straight above of 1 W·m⁻²: E = 1 everywhere on it (PHYSICS check 4). The light's flux fills the
/// disc around the square, π·size²/2 W, of which size² lands. The camera looks straight down and sees
/// a quarter more than the square, −z up.
pub fn plane(size_m: f32) -> Scene {
    let light = Light::Directional { direction_world: Vec3::NEG_Y, irradiance: Vec3::ONE };
    square("plane", size_m, light)
}

/// The square of [`plane`] under a point light of I = 1 W·sr⁻¹, `height_m` above its centre:
/// E = h / (h² + r²)^(3/2) W·m⁻² at distance r from the centre. Flux 4π W.
pub fn plane_point(size_m: f32, height_m: f32) -> Scene {
    let position_world = Vec3::new(0.0, height_m, 0.0);
    square("plane_point", size_m, Light::Point { position_world, intensity: Vec3::ONE })
}

/// Two coaxial discs of radius 1 m, 2 m apart: the upper, at y = 2, emits L = 1 W·m⁻²·sr⁻¹ downwards (flux
/// π² W) and reflects nothing; the lower, at y = 0, has albedo ½ and receives E = π·½(6 − √32) = 0.5390
/// W·m⁻² on average (PHYSICS check 6). 256 wedges each, of exact area. The camera hangs just below the
/// emitter and looks down on the whole receiver.
pub fn two_discs() -> Scene {
    let mut triangles = disc(256, 8, 0);
    let turned = Mat4::from_rotation_translation(Quat::from_rotation_x(PI), Vec3::new(0.0, 2.0, 0.0));
    triangles.extend(placed(disc(256, 1, 1), turned));
    let eye = Vec3::new(0.0, 1.99, 0.0);
    Scene {
        name: "two_discs".into(),
        triangles,
        materials: vec![Material::lambert("receiver", Vec3::splat(0.5)), Material::emitter("emitter", Vec3::ONE)],
        cameras: vec![Camera::look_at("down", eye, Vec3::ZERO, Vec3::NEG_Z, 2.0 * (1.05_f32 / eye.y).atan())],
        ..Scene::default()
    }
}

/// White, red and green walls, and the two cameras.
fn room(name: &str) -> Scene {
    let at = Vec3::new;
    let floor = [at(-1.0, 0.0, 1.0), at(1.0, 0.0, 1.0), at(1.0, 0.0, -1.0), at(-1.0, 0.0, -1.0)];
    let ceiling = [at(-1.0, 2.0, -1.0), at(1.0, 2.0, -1.0), at(1.0, 2.0, 1.0), at(-1.0, 2.0, 1.0)];
    let back = [at(-1.0, 0.0, -1.0), at(1.0, 0.0, -1.0), at(1.0, 2.0, -1.0), at(-1.0, 2.0, -1.0)];
    let left = [at(-1.0, 0.0, 1.0), at(-1.0, 0.0, -1.0), at(-1.0, 2.0, -1.0), at(-1.0, 2.0, 1.0)];
    let right = [at(1.0, 0.0, -1.0), at(1.0, 0.0, 1.0), at(1.0, 2.0, 1.0), at(1.0, 2.0, -1.0)];
    let walls = [(floor, WHITE), (ceiling, WHITE), (back, WHITE), (left, RED), (right, GREEN)];
    let look = |name: &str, z: f32, yfov: f32| Camera::look_at(name, at(0.0, 1.0, z), at(0.0, 0.93, -1.0), Vec3::Y, yfov);
    Scene {
        name: name.into(),
        triangles: walls.into_iter().flat_map(|(corners, material)| quad(corners, material)).collect(),
        materials: vec![
            Material::lambert("white", Vec3::splat(0.73)),
            Material::lambert("red", Vec3::new(0.65, 0.05, 0.05)),
            Material::lambert("green", Vec3::new(0.12, 0.45, 0.15)),
        ],
        cameras: vec![look("fill", 1.0, 1.05), look("classic", 3.9, 0.69)],
        ..Scene::default()
    }
}

fn square(name: &str, size_m: f32, light: Light) -> Scene {
    let h = 0.5 * size_m;
    let corners = [Vec3::new(-h, 0.0, h), Vec3::new(h, 0.0, h), Vec3::new(h, 0.0, -h), Vec3::new(-h, 0.0, -h)];
    let eye = Vec3::new(0.0, 2.0 * size_m, 0.0);
    Scene {
        name: name.into(),
        triangles: quad(corners, 0),
        materials: vec![Material::lambert("grey", Vec3::splat(0.5))],
        lights: vec![light],
        cameras: vec![Camera::look_at("above", eye, Vec3::ZERO, Vec3::NEG_Z, 2.0 * (1.25 * h / eye.y).atan())],
        ..Scene::default()
    }
}

/// Scales positions; for shapes whose normals the scale keeps.
fn sized(mut triangles: Vec<Triangle>, scale: Vec3) -> Vec<Triangle> {
    for triangle in &mut triangles {
        triangle.positions_world = triangle.positions_world.map(|p| p * scale);
    }
    triangles
}

/// The flat top of a ring between two radii, facing up.
fn rim(segments: u32, inner: f32, outer: f32, height: f32, material: u32) -> Vec<Triangle> {
    let on = |radius: f32, s: u32| {
        let (sin, cos) = (2.0 * PI * (s % segments) as f32 / segments as f32).sin_cos();
        Vec3::new(radius * cos, height, -radius * sin)
    };
    (0..segments).flat_map(|s| quad([on(inner, s), on(outer, s), on(outer, s + 1), on(inner, s + 1)], material)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_makes_a_sound_scene() {
        for &name in names() {
            let mut scene = by_name(name).unwrap();
            scene.ensure_light();
            assert!(scene.triangles.iter().all(Triangle::is_sound), "{name} has only sound triangles");
            assert!(scene.warnings.is_empty(), "{name}: {:?}", scene.warnings);
            assert!(!scene.cameras.is_empty(), "{name} has a camera");
            for triangle in &scene.triangles {
                assert!((triangle.material as usize) < scene.materials.len(), "{name}: materials exist");
                let front = triangle.normal_world();
                let bent = triangle.normals_world.iter().any(|n| n.dot(front) < 0.8 || (n.length() - 1.0).abs() > 1e-4);
                assert!(!bent, "{name}: shading normals are unit and near the geometric one");
            }
        }
        assert!(by_name("sponza").is_none(), "unknown");
        assert!(by_name("closed-box").is_some(), "hyphens");
    }

    #[test]
    fn every_kind_of_light_occurs() {
        let scenes: Vec<Scene> = names().iter().filter_map(|name| by_name(name)).collect();
        let any = |kind: &dyn Fn(&Light) -> bool| scenes.iter().flat_map(|scene| &scene.lights).any(kind);
        assert!(any(&|light| matches!(light, Light::Point { .. })), "point");
        assert!(any(&|light| matches!(light, Light::Spot { .. })), "spot");
        assert!(any(&|light| matches!(light, Light::Directional { .. })), "directional");
        assert!(scenes.iter().any(|scene| scene.environment.is_some()), "environment");
        let emits =
            |scene: &Scene| scene.materials.iter().any(|material| material.emissive.iter().any(|&radiance| radiance > 0.0));
        assert!(scenes.iter().any(emits), "emissive");
    }

    /// Every edge of a solid of glass belongs to two of its triangles, which run along it in opposite directions.
    #[test]
    fn turned_pieces_are_closed() {
        let scene = pieces();
        let mut edges = std::collections::HashMap::new();
        for triangle in scene.triangles.iter().filter(|triangle| scene.materials[triangle.material as usize].transmission > 0.0) {
            for corners in [[0, 1], [1, 2], [2, 0]] {
                let [from, to] = corners.map(|corner| triangle.positions_world[corner].to_array().map(f32::to_bits));
                *edges.entry((from, to)).or_insert(0) += 1;
                *edges.entry((to, from)).or_insert(0) -= 1;
            }
        }
        assert!(edges.len() > 10_000 && edges.values().all(|&count| count == 0), "{} edges", edges.len());
        assert!(scene.triangles.len() < 60_000 && pool().triangles.len() < 60_000, "moderate");
    }

    #[test]
    fn closed_scenes_face_inwards() {
        for scene in [closed_sphere(2), closed_box(0.5)] {
            let Light::Point { position_world, .. } = scene.lights[0] else { panic!("a point light") };
            for triangle in &scene.triangles {
                let to_light = position_world - triangle.positions_world[0];
                assert!(triangle.normal_world().dot(to_light) > 0.0, "{} faces its light", scene.name);
            }
        }
    }

    #[test]
    fn areas_are_exact() {
        let area = |scene: &Scene, material: u32| -> f64 {
            let of = scene.triangles.iter().filter(|t| t.material == material);
            of.map(|t| f64::from(t.area())).sum()
        };
        assert!((area(&closed_sphere(3), 0) - 4.0 * std::f64::consts::PI).abs() < 1e-4, "4π");
        assert!((area(&closed_box(0.5), 0) - 94.0).abs() < 1e-4, "94 m²");
        let discs = two_discs();
        for material in [0, 1] {
            assert!((area(&discs, material) - std::f64::consts::PI).abs() < 1e-4, "π");
        }
        assert!((area(&plane(4.0), 0) - 16.0).abs() < 1e-5, "16 m²");
    }

    #[test]
    fn discs_face_each_other_and_one_emits() {
        let scene = two_discs();
        for triangle in &scene.triangles {
            let up = if triangle.material == 0 { 1.0 } else { -1.0 };
            assert!(triangle.normal_world().y * up > 0.999, "faces the other disc");
        }
    }
}
