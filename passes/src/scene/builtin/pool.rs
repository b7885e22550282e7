//! A swimming pool in the sun.

use crate::scene::mesh::{height_field, icosphere, placed, quad};
use crate::scene::{Camera, Environment, Light, Material, Scene, Triangle};
use glam::{Mat4, Quat, Vec2, Vec3};
use std::f32::consts::TAU;

/// Half the length and half the width of the basin, and its depth below the deck (m).
const HALF: Vec2 = Vec2::new(3.0, 2.0);
const DEPTH: f32 = 1.6;
/// The water at rest lies this far below the deck (m).
const LEVEL: f32 = 0.12;
/// Width of the deck around the basin (m).
const DECK: f32 = 1.5;
/// Tiles are as long (m); so are rows of them on the walls high, but for rounding.
const TILE: f32 = 0.25;
/// The water's edge stands this far inside the walls (m), which seals it.
const SEAL: f32 = 0.01;
/// Cells of the water along and across.
const CELLS: [u32; 2] = [150, 100];

/// Length (m), height (m), heading (turns) and phase (turns) of each wave. Those of slope s and length λ have a focus n λ / (2π s (n − 1)) below their
/// crests, some 2 to 4 m here; several together come down to the floor.
const WAVES: [[f32; 4]; 4] =
    [[1.3, 0.03, 0.06, 0.0], [0.8, 0.015, 0.21, 0.3], [0.55, 0.008, 0.93, 0.7], [0.41, 0.004, 0.38, 0.1]];

const TILES: u32 = 0;
const DARK_TILES: u32 = 1;
const STONE: u32 = 2;
const WATER: u32 = 3;
const BALL: u32 = 4;
const STEEL: u32 = 5;

/// A basin of 6 × 4 m (x, z about the origin), 1.6 m deep, lined with tiles, in a deck at y = 0 that is 1.5 m wide. Waves of up to 57 mm run over
/// water (ior 1.33, faintly green, 1.48 m deep), and the sun draws their net of caustics on floor and walls. A ball floats on it, and one of polished steel lies on the
/// deck.
///
/// Lights: the sun, E = (6, 5.6, 5) W·m⁻² on a plane that faces it; a sky that is dim overhead and brighter at the horizon, dimmer below it.
/// Cameras: `main` stands beside the deck, `below` is under water and looks along the basin.
pub fn pool() -> Scene {
    let mut triangles = basin();
    triangles.extend(deck());
    let half = HALF + SEAL;
    triangles.extend(height_field([-half, half], CELLS, water, WATER));
    let ball = |radius: f32, at: Vec3, material: u32| {
        placed(icosphere(4, material), Mat4::from_scale_rotation_translation(Vec3::splat(radius), Quat::IDENTITY, at))
    };
    triangles.extend(ball(0.3, Vec3::new(-1.1, -LEVEL + 0.1, 0.5), BALL));
    triangles.extend(ball(0.45, Vec3::new(-3.75, 0.451, -1.1), STEEL));
    let water = Material {
        attenuation_color: [0.55, 0.85, 0.9],
        attenuation_distance_m: 4.0,
        ..Material::glass("water", 1.33, DEPTH - LEVEL)
    };
    let mut scene = Scene {
        name: "pool".into(),
        triangles,
        materials: vec![
            Material::lambert("tiles", Vec3::new(0.55, 0.72, 0.75)),
            Material::lambert("dark tiles", Vec3::new(0.12, 0.3, 0.42)),
            Material::lambert("stone", Vec3::new(0.62, 0.56, 0.47)),
            water,
            Material::lambert("ball", Vec3::new(0.75, 0.12, 0.08)),
            Material::metal("polished steel", Vec3::new(0.77, 0.78, 0.78), 0.0),
        ],
        lights: vec![Light::Directional {
            direction_world: Vec3::new(-0.45, -0.8, 0.3).normalize(),
            irradiance: Vec3::new(6.0, 5.6, 5.0),
        }],
        light_names: vec!["sun".into()],
        cameras: vec![
            Camera::look_at("main", Vec3::new(2.6, 2.4, 5.2), Vec3::new(0.0, -0.75, 0.0), Vec3::Y, 0.72),
            Camera::look_at("below", Vec3::new(2.7, -1.0, 1.6), Vec3::new(-1.5, -0.75, -0.7), Vec3::Y, 0.9),
        ],
        ..Scene::default()
    };
    let sky = sky();
    debug_assert!(sky.is_ok(), "radiance is finite and not negative");
    scene.environment = sky.ok();
    scene
}

/// Height (m, world) and upward normal of the water at (x, z).
fn water(at: Vec2) -> (f32, Vec3) {
    let (mut height, mut slope) = (-LEVEL, Vec2::ZERO);
    for [length, amplitude, heading, phase] in WAVES {
        let along = Vec2::from_angle(TAU * heading) * (TAU / length);
        let (sin, cos) = (along.dot(at) + TAU * phase).sin_cos();
        height += amplitude * sin;
        slope += along * (amplitude * cos);
    }
    (height, Vec3::new(-slope.x, 1.0, -slope.y).normalize())
}

/// Tiles of floor and walls, fronts inwards.
fn basin() -> Vec<Triangle> {
    let count = |length: f32| (length / TILE).round() as u32;
    let [length, width, depth] = [2.0 * HALF.x, 2.0 * HALF.y, DEPTH];
    // A corner, two edges whose cross product points inwards, and how many tiles fill them.
    let faces = [
        (Vec3::new(-HALF.x, -depth, HALF.y), Vec3::X * length, Vec3::NEG_Z * width),
        (Vec3::new(-HALF.x, -depth, -HALF.y), Vec3::X * length, Vec3::Y * depth),
        (Vec3::new(HALF.x, -depth, HALF.y), Vec3::NEG_X * length, Vec3::Y * depth),
        (Vec3::new(-HALF.x, -depth, HALF.y), Vec3::NEG_Z * width, Vec3::Y * depth),
        (Vec3::new(HALF.x, -depth, -HALF.y), Vec3::Z * width, Vec3::Y * depth),
    ];
    let mut tiles = Vec::new();
    for (index, (corner, along, up)) in faces.into_iter().enumerate() {
        let (columns, rows) = (count(along.length()), count(up.length()));
        let at = |column: u32, row: u32| corner + along * (column as f32 / columns as f32) + up * (row as f32 / rows as f32);
        for (column, row) in (0..columns).flat_map(|column| (0..rows).map(move |row| (column, row))) {
            // Lines along the floor and below the rim, and a few tiles that differ.
            let line = if index == 0 { [4, 11].contains(&row) } else { row + 2 == rows };
            let material = if line || (7 * column + 5 * row + index as u32).is_multiple_of(23) { DARK_TILES } else { TILES };
            tiles.extend(quad([at(column, row), at(column + 1, row), at(column + 1, row + 1), at(column, row + 1)], material));
        }
    }
    tiles
}

/// The deck, in four pieces around the basin.
fn deck() -> Vec<Triangle> {
    let outer = HALF + DECK;
    let piece = |least: Vec2, most: Vec2| {
        let at = |x: f32, z: f32| Vec3::new(x, 0.0, z);
        quad([at(least.x, most.y), at(most.x, most.y), at(most.x, least.y), at(least.x, least.y)], STONE)
    };
    [
        piece(-outer, Vec2::new(outer.x, -HALF.y)),
        piece(Vec2::new(-outer.x, HALF.y), outer),
        piece(Vec2::new(-outer.x, -HALF.y), Vec2::new(-HALF.x, HALF.y)),
        piece(Vec2::new(HALF.x, -HALF.y), Vec2::new(outer.x, HALF.y)),
    ]
    .concat()
}

/// Eight rows from the zenith to the horizon, as many of dim meadows below.
fn sky() -> Result<Environment, crate::scene::SceneError> {
    let row = |row: u8| {
        let horizon = f32::from(row) / 7.0;
        let above = Vec3::new(0.16, 0.3, 0.55).lerp(Vec3::new(0.55, 0.62, 0.68), horizon * horizon);
        if row < 8 { above.to_array() } else { [0.09, 0.12, 0.06] }
    };
    Environment::from_map("sky", [1, 16], (0..16).map(row).collect())
}
