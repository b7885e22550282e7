//! A corridor with two bends.

use crate::scene::mesh::{cuboid, quad};
use crate::scene::{Camera, Light, Material, Scene, Triangle};
use glam::{Vec2, Vec3};

/// Height (m).
const HEIGHT: f32 = 2.5;
/// Lower and upper edge of the mirror (m).
const MIRROR: [f32; 2] = [0.15, 2.35];
/// Upper edge of the glass door (m).
const DOOR: f32 = 2.1;

const PLASTER: u32 = 0;
const FLOOR: u32 = 1;
const PILLAR: u32 = 2;
const SILVER: u32 = 3;
const GLASS: u32 = 4;
const PANEL: u32 = 5;
const WINDOW: u32 = 6;

/// Outline of the floor (x, z in m), such that walls from each corner to the next have their fronts inwards. The chamfer is the second wall.
const OUTLINE: [[f32; 2]; 9] =
    [[-1.0, 0.0], [-1.0, -9.0], [0.0, -10.0], [8.0, -10.0], [8.0, -18.0], [10.0, -18.0], [10.0, -8.0], [1.0, -8.0], [1.0, 0.0]];

/// Rectangles that floor and ceiling consist of: least and greatest x and z (m). They reach behind the chamfer.
const PLAN: [[[f32; 2]; 2]; 3] = [[[-1.0, -10.0], [1.0, 0.0]], [[1.0, -10.0], [10.0, -8.0]], [[8.0, -18.0], [10.0, -10.0]]];

/// A closed corridor, 2 m wide and 2.5 m high: 10 m ahead (towards −z), 10 m to the right behind a door of glass, 10 m ahead again. A mirror across
/// the first bend shows what lies beyond it. Walls are plaster with pillars, the floor shines (GGX, roughness 0.5).
///
/// Lights: two points in the first part, I = (2.6, 2.2, 1.6) W·sr⁻¹, flux (32.7, 27.6, 20.1) W each; two spots on a wall of the second, I = (8, 9, 12) W·sr⁻¹, flux
/// (7.5, 8.5, 11.3) W each; in the third a panel of 0.8 × 2.4 m below the ceiling, L = 5, flux 30.2 W, and a window of 1.6 × 1.6 m at its end,
/// L = (2.2, 2.8, 3.6), flux (17.7, 22.5, 29.0) W. Cameras: `main` sees the second part in the mirror, `bend` looks from there into the third.
pub fn corridor() -> Scene {
    let mut triangles = shell();
    triangles.extend(mirror());
    triangles.extend(furniture());
    let at = Vec3::new;
    let panel = [at(8.6, 2.49, -15.2), at(9.4, 2.49, -15.2), at(9.4, 2.49, -12.8), at(8.6, 2.49, -12.8)];
    triangles.extend(quad(panel, PANEL));
    let window = [at(8.2, 0.6, -17.99), at(9.8, 0.6, -17.99), at(9.8, 2.2, -17.99), at(8.2, 2.2, -17.99)];
    triangles.extend(quad(window, WINDOW));
    let point = |z: f32| Light::Point { position_world: at(0.0, 2.2, z), intensity: Vec3::new(2.6, 2.2, 1.6) };
    let spot = |x: f32| Light::Spot {
        position_world: at(x, 2.45, -8.9),
        direction_world: at(0.0, -1.0, -0.45).normalize(),
        intensity: Vec3::new(8.0, 9.0, 12.0),
        cos_inner: 0.9,
        cos_outer: 0.75,
    };
    Scene {
        name: "corridor".into(),
        triangles,
        materials: vec![
            Material::lambert("plaster", Vec3::new(0.7, 0.68, 0.64)),
            Material { roughness: 0.5, ..Material::lambert("floor", Vec3::new(0.36, 0.3, 0.25)) },
            Material::lambert("pillars", Vec3::new(0.5, 0.22, 0.14)),
            Material::metal("silver", Vec3::new(0.95, 0.94, 0.92), 0.0),
            Material::glass("door", 1.5, 0.0),
            Material::emitter("panel", Vec3::splat(5.0)),
            Material::emitter("window", Vec3::new(2.2, 2.8, 3.6)),
        ],
        lights: vec![point(-2.5), point(-6.5), spot(3.6), spot(6.4)],
        light_names: ["near", "far", "first spot", "second spot"].map(str::to_owned).to_vec(),
        cameras: vec![
            Camera::look_at("main", at(0.35, 1.55, -3.2), at(-0.35, 1.25, -9.5), Vec3::Y, 0.75),
            Camera::look_at("bend", at(8.4, 1.5, -8.5), at(9.1, 1.2, -14.0), Vec3::Y, 0.9),
        ],
        ..Scene::default()
    }
}

fn upright(from: Vec2, to: Vec2, [low, high]: [f32; 2], material: u32) -> Vec<Triangle> {
    let at = |place: Vec2, y: f32| Vec3::new(place.x, y, place.y);
    quad([at(from, low), at(to, low), at(to, high), at(from, high)], material)
}

/// Floor, ceiling and walls without the chamfer.
fn shell() -> Vec<Triangle> {
    let mut triangles = Vec::new();
    for [[x0, z0], [x1, z1]] in PLAN {
        let at = |x: f32, z: f32, y: f32| Vec3::new(x, y, z);
        triangles.extend(quad([at(x0, z1, 0.0), at(x1, z1, 0.0), at(x1, z0, 0.0), at(x0, z0, 0.0)], FLOOR));
        triangles.extend(quad([at(x0, z0, HEIGHT), at(x1, z0, HEIGHT), at(x1, z1, HEIGHT), at(x0, z1, HEIGHT)], PLASTER));
    }
    for (index, from) in OUTLINE.into_iter().enumerate().filter(|&(index, _)| index != 1) {
        let to = OUTLINE[(index + 1) % OUTLINE.len()];
        triangles.extend(upright(from.into(), to.into(), [0.0, HEIGHT], PLASTER));
    }
    triangles
}

/// The chamfer: a mirror between two strips of wall.
fn mirror() -> Vec<Triangle> {
    let [from, to] = [1, 2].map(|index| Vec2::from(OUTLINE[index]));
    let [low, high] = MIRROR;
    let strips = [([0.0, low], PLASTER), (MIRROR, SILVER), ([high, HEIGHT], PLASTER)];
    strips.into_iter().flat_map(|(heights, material)| upright(from, to, heights, material)).collect()
}

/// Pillars along the walls, and the door: one pane of glass below a lintel.
fn furniture() -> Vec<Triangle> {
    let block =
        |[x0, z0]: [f32; 2], [x1, z1]: [f32; 2], low: f32| cuboid(Vec3::new(x0, low, z0), Vec3::new(x1, HEIGHT, z1), PILLAR);
    let mut triangles = Vec::new();
    for z in [-1.6, -3.6, -5.6, -7.6] {
        triangles.extend(block([-1.0, z - 0.15], [-0.88, z + 0.15], 0.0));
        triangles.extend(block([0.88, z - 0.15], [1.0, z + 0.15], 0.0));
    }
    for x in [2.2, 5.0, 7.8] {
        triangles.extend(block([x - 0.15, -8.12], [x + 0.15, -8.0], 0.0));
        triangles.extend(block([x - 0.15, -10.0], [x + 0.15, -9.88], 0.0));
    }
    for z in [-11.5, -13.5, -15.5] {
        triangles.extend(block([8.0, z - 0.15], [8.12, z + 0.15], 0.0));
        triangles.extend(block([9.88, z - 0.15], [10.0, z + 0.15], 0.0));
    }
    triangles.extend(block([1.35, -10.0], [1.45, -8.0], DOOR));
    triangles.extend(upright(Vec2::new(1.4, -10.0), Vec2::new(1.4, -8.0), [0.0, DOOR], GLASS));
    triangles
}
