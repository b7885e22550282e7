//! Turned glass on a board of squares.

use crate::scene::mesh::{cuboid, lathe, placed, quad};
use crate::scene::{Camera, Light, Material, Scene, Triangle};
use glam::{Mat4, Vec3};

/// Edge of a square (m).
const SQUARE: f32 = 0.05;
/// Air between the board and what stands on it (m).
const GAP: f32 = 2.0e-4;
/// Edges of the turned shapes.
const SEGMENTS: u32 = 32;

const LIGHT_WOOD: u32 = 0;
const DARK_WOOD: u32 = 1;
const TABLE: u32 = 2;
const CLEAR: u32 = 3;
const AMBER: u32 = 4;
const BRASS: u32 = 5;

/// From the middle of the foot to the tip: radius and height (mm).
type Outline = &'static [[f32; 2]];

#[rustfmt::skip]
const PAWN: Outline = &[
    [0.0, 0.0], [15.0, 0.0], [17.5, 2.0], [17.5, 5.0], [14.0, 9.0], [12.0, 12.0], [8.5, 20.0], [6.5, 30.0], [6.5, 34.0],
    [10.5, 36.0], [10.5, 37.5], [6.2, 39.0], [9.5, 42.5], [10.8, 47.5], [9.5, 52.5], [5.5, 56.3], [0.0, 58.0],
];
#[rustfmt::skip]
const BISHOP: Outline = &[
    [0.0, 0.0], [16.5, 0.0], [19.0, 2.2], [19.0, 6.0], [15.0, 11.0], [12.5, 15.0], [8.5, 26.0], [6.5, 42.0], [6.5, 46.5],
    [11.5, 49.0], [11.5, 50.8], [6.8, 52.5], [9.5, 58.0], [10.8, 64.0], [8.5, 70.5], [4.0, 75.5], [2.8, 77.5], [3.2, 79.5],
    [2.0, 81.5], [0.0, 82.2],
];
#[rustfmt::skip]
const QUEEN: Outline = &[
    [0.0, 0.0], [18.0, 0.0], [21.0, 2.5], [21.0, 7.0], [16.5, 12.5], [13.5, 17.0], [9.5, 30.0], [7.0, 50.0], [7.0, 56.0],
    [13.0, 58.5], [13.0, 60.8], [8.0, 62.5], [9.5, 70.0], [13.5, 80.0], [14.0, 82.5], [11.5, 84.5], [6.5, 86.5], [4.5, 88.5],
    [5.2, 91.5], [3.8, 94.5], [0.0, 95.8],
];
#[rustfmt::skip]
const ROOK: Outline = &[
    [0.0, 0.0], [16.0, 0.0], [18.5, 2.2], [18.5, 6.0], [14.5, 10.5], [12.5, 14.0], [10.5, 24.0], [9.5, 36.0], [9.8, 42.0],
    [13.5, 45.5], [13.8, 48.0], [13.8, 56.0], [12.5, 57.8], [10.8, 57.2], [9.8, 53.5], [6.0, 52.5], [0.0, 52.5],
];

/// Outline, material, and the square it stands on: column and row.
const PLACES: [(Outline, u32, [u32; 2]); 8] = [
    (QUEEN, CLEAR, [3, 3]),
    (BISHOP, AMBER, [5, 2]),
    (ROOK, CLEAR, [1, 1]),
    (PAWN, AMBER, [4, 5]),
    (PAWN, CLEAR, [2, 5]),
    (PAWN, CLEAR, [6, 4]),
    (ROOK, AMBER, [6, 0]),
    (PAWN, BRASS, [1, 4]),
];

/// A board of 8 × 8 squares of 50 mm, its top at y = 0, on a table of 0.9 × 0.9 m before a wall, and eight turned pieces of 58 to 96 mm on it: four of clear
/// and three of amber glass (ior 1.5), one of brass.
///
/// Lights: a spot from behind on the left, I = (2.2, 2, 1.7) W·sr⁻¹, flux (1.01, 0.92, 0.78) W, which draws caustics towards the viewer; a faint point light
/// on the right, I = 0.06 W·sr⁻¹, flux 0.75 W. Cameras: `main` looks down on the board, `low` along it through the glass.
pub fn pieces() -> Scene {
    let mut triangles = board();
    for (outline, material, [column, row]) in PLACES {
        let at = |index: u32| (index as f32 - 3.5) * SQUARE;
        let outline: Vec<_> = outline.iter().map(|point| point.map(|mm| 1.0e-3 * mm)).collect();
        let shape = lathe(&outline, SEGMENTS, material);
        let corners = shape.iter().flat_map(|triangle| triangle.positions_world);
        let lowest = corners.map(|corner| corner.y).fold(f32::MAX, f32::min);
        triangles.extend(placed(shape, Mat4::from_translation(Vec3::new(at(column), GAP - lowest, at(row)))));
    }
    let amber = Material {
        attenuation_color: [0.95, 0.55, 0.15],
        attenuation_distance_m: 0.02,
        ..Material::glass("amber glass", 1.5, 0.03)
    };
    Scene {
        name: "pieces".into(),
        triangles,
        materials: vec![
            Material::lambert("light wood", Vec3::new(0.68, 0.53, 0.36)),
            Material::lambert("dark wood", Vec3::new(0.24, 0.12, 0.07)),
            Material::lambert("table", Vec3::new(0.42, 0.4, 0.38)),
            Material::glass("clear glass", 1.5, 0.03),
            amber,
            Material::metal("polished brass", Vec3::new(0.95, 0.79, 0.49), 0.0),
        ],
        lights: vec![
            Light::Spot {
                position_world: Vec3::new(-0.3, 0.4, -0.3),
                direction_world: Vec3::new(0.32, -0.4, 0.32).normalize(),
                intensity: Vec3::new(2.2, 2.0, 1.7),
                cos_inner: 0.94,
                cos_outer: 0.9,
            },
            Light::Point { position_world: Vec3::new(0.4, 0.45, 0.3), intensity: Vec3::splat(0.06) },
        ],
        light_names: vec!["spot".into(), "fill".into()],
        cameras: vec![
            Camera::look_at("main", Vec3::new(0.12, 0.3, 0.46), Vec3::new(0.01, 0.015, 0.01), Vec3::Y, 0.5),
            Camera::look_at("low", Vec3::new(0.1, 0.07, 0.4), Vec3::new(-0.01, 0.035, 0.0), Vec3::Y, 0.5),
        ],
        ..Scene::default()
    }
}

/// Squares, their frame, table and wall.
fn board() -> Vec<Triangle> {
    let corner = |column: u32, row: u32| Vec3::new((column as f32 - 4.0) * SQUARE, 0.0, (row as f32 - 4.0) * SQUARE);
    let mut triangles = Vec::new();
    for (column, row) in (0..8).flat_map(|column| (0..8).map(move |row| (column, row))) {
        let material = if (column + row) % 2 == 0 { DARK_WOOD } else { LIGHT_WOOD };
        let corners = [(column, row + 1), (column + 1, row + 1), (column + 1, row), (column, row)];
        triangles.extend(quad(corners.map(|(column, row)| corner(column, row)), material));
    }
    // A box below the squares, a little wider than they.
    triangles.extend(cuboid(Vec3::new(-0.225, -0.02, -0.225), Vec3::new(0.225, -0.0005, 0.225), DARK_WOOD));
    let at = Vec3::new;
    let (half, low, high) = (0.45, -0.02, 0.4);
    triangles.extend(quad([at(-half, low, half), at(half, low, half), at(half, low, -half), at(-half, low, -half)], TABLE));
    triangles.extend(quad([at(-half, low, -half), at(half, low, -half), at(half, high, -half), at(-half, high, -half)], TABLE));
    triangles
}
