//! Shapes that the built-in scenes are made of.

use super::Triangle;
use glam::{Mat4, Vec2, Vec3};
use std::collections::HashMap;
use std::f32::consts::TAU;

/// A quadrilateral `a b c d`, counter-clockwise as seen from its front, of two triangles.
pub(super) fn quad(corners: [Vec3; 4], material: u32) -> Vec<Triangle> {
    let [a, b, c, d] = corners;
    let uv = [Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::X, Vec2::ZERO];
    vec![flat([a, b, c], [uv[0], uv[1], uv[2]], material), flat([a, c, d], [uv[0], uv[2], uv[3]], material)]
}

/// A box between two corners, its fronts outwards.
pub(super) fn cuboid(least: Vec3, most: Vec3, material: u32) -> Vec<Triangle> {
    let at = |x: u8, y: u8, z: u8| {
        Vec3::new(
            if x == 0 { least.x } else { most.x },
            if y == 0 { least.y } else { most.y },
            if z == 0 { least.z } else { most.z },
        )
    };
    let faces = [
        [at(1, 0, 1), at(1, 0, 0), at(1, 1, 0), at(1, 1, 1)],
        [at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0)],
        [at(0, 1, 1), at(1, 1, 1), at(1, 1, 0), at(0, 1, 0)],
        [at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1)],
        [at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)],
        [at(1, 0, 0), at(0, 0, 0), at(0, 1, 0), at(1, 1, 0)],
    ];
    faces.into_iter().flat_map(|corners| quad(corners, material)).collect()
}

/// A unit icosphere about the origin, fronts and smooth normals outwards: 20·4ⁿ triangles.
pub(super) fn icosphere(subdivisions: u32, material: u32) -> Vec<Triangle> {
    let golden = 0.5 * (1.0 + 5.0_f32.sqrt());
    let mut points: Vec<Vec3> = [
        [-1.0, golden, 0.0],
        [1.0, golden, 0.0],
        [-1.0, -golden, 0.0],
        [1.0, -golden, 0.0],
        [0.0, -1.0, golden],
        [0.0, 1.0, golden],
        [0.0, -1.0, -golden],
        [0.0, 1.0, -golden],
        [golden, 0.0, -1.0],
        [golden, 0.0, 1.0],
        [-golden, 0.0, -1.0],
        [-golden, 0.0, 1.0],
    ]
    .map(|p| Vec3::from_array(p).normalize())
    .to_vec();
    let mut faces: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..subdivisions {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    faces
        .iter()
        .map(|face| {
            let corners = face.map(|i| points[i as usize]);
            Triangle {
                positions_world: corners,
                normals_world: corners,
                uvs: corners.map(|p| Vec2::new(0.5 + p.x.atan2(p.z) / TAU, p.y.acos() / (0.5 * TAU))),
                material,
            }
        })
        .collect()
}

/// A unit disc about the origin in the plane y = 0, front upwards, of `segments` wedges in `rings`
/// rings. Its polygon has the area π of the true disc.
pub(super) fn disc(segments: u32, rings: u32, material: u32) -> Vec<Triangle> {
    let step = TAU / segments as f32;
    let scale = (step / step.sin()).sqrt();
    let at = |ring: u32, segment: u32| {
        let (sin, cos) = (step * (segment % segments) as f32).sin_cos();
        let radius = scale * ring as f32 / rings as f32;
        Vec3::new(radius * cos, 0.0, -radius * sin)
    };
    let uv = |p: Vec3| Vec2::new(0.5 + 0.5 * p.x, 0.5 + 0.5 * p.z);
    let wedge = |corners: [Vec3; 3]| flat(corners, corners.map(uv), material);
    let mut triangles = Vec::new();
    for s in 0..segments {
        triangles.push(wedge([Vec3::ZERO, at(1, s), at(1, s + 1)]));
        for r in 1..rings {
            triangles.push(wedge([at(r, s), at(r + 1, s), at(r + 1, s + 1)]));
            triangles.push(wedge([at(r, s), at(r + 1, s + 1), at(r, s + 1)]));
        }
    }
    triangles
}

/// A standing band of a cylinder of radius 1 and height 1 about the y axis, smooth, front outwards.
pub(super) fn band(segments: u32, material: u32) -> Vec<Triangle> {
    let step = TAU / segments as f32;
    let normal = |s: u32| {
        let (sin, cos) = (step * (s % segments) as f32).sin_cos();
        Vec3::new(cos, 0.0, -sin)
    };
    (0..segments)
        .flat_map(|s| {
            let (left, right) = (normal(s), normal(s + 1));
            let mut pair = quad([left, right, right + Vec3::Y, left + Vec3::Y], material);
            pair[0].normals_world = [left, right, right];
            pair[1].normals_world = [left, right, left];
            pair
        })
        .collect()
}

/// Moves triangles by a similarity (rotation, uniform scale, translation).
pub(super) fn placed(mut triangles: Vec<Triangle>, world_from_shape: Mat4) -> Vec<Triangle> {
    for triangle in &mut triangles {
        triangle.positions_world = triangle.positions_world.map(|p| world_from_shape.transform_point3(p));
        triangle.normals_world = triangle.normals_world.map(|n| world_from_shape.transform_vector3(n).normalize());
    }
    triangles
}

/// Turns fronts and normals to the other side.
pub(super) fn inverted(mut triangles: Vec<Triangle>) -> Vec<Triangle> {
    for triangle in &mut triangles {
        triangle.positions_world.swap(1, 2);
        triangle.normals_world.swap(1, 2);
        triangle.normals_world = triangle.normals_world.map(|n| -n);
        triangle.uvs.swap(1, 2);
    }
    triangles
}

/// Replaces shading normals by geometric ones.
pub(super) fn faceted(mut triangles: Vec<Triangle>) -> Vec<Triangle> {
    for triangle in &mut triangles {
        triangle.normals_world = [triangle.normal_world(); 3];
    }
    triangles
}

fn flat(positions_world: [Vec3; 3], uvs: [Vec2; 3], material: u32) -> Triangle {
    let triangle = Triangle { positions_world, normals_world: [Vec3::ZERO; 3], uvs, material };
    Triangle { normals_world: [triangle.normal_world(); 3], ..triangle }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn total_area(triangles: &[Triangle]) -> f32 {
        triangles.iter().map(|t| f64::from(t.area())).sum::<f64>() as f32
    }

    /// Six times the volume that closed triangles enclose, positive when fronts point outwards.
    fn volume(triangles: &[Triangle]) -> f32 {
        let det = |t: &Triangle| t.positions_world[0].dot(t.positions_world[1].cross(t.positions_world[2]));
        triangles.iter().map(det).sum::<f32>() / 6.0
    }

    #[test]
    fn shapes_face_outwards_and_have_their_size() {
        let cube = cuboid(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0), 0);
        assert!((total_area(&cube) - 22.0).abs() < 1e-5 && (volume(&cube) - 6.0).abs() < 1e-5, "box");
        let sphere = icosphere(3, 0);
        assert_eq!(sphere.len(), 1280);
        assert!((volume(&sphere) - 2.0 * TAU / 3.0).abs() < 0.05, "{}", volume(&sphere));
        assert!((volume(&inverted(sphere)) + 2.0 * TAU / 3.0).abs() < 0.05, "inverted");
        let disc = disc(48, 4, 0);
        assert!((total_area(&disc) - 0.5 * TAU).abs() < 1e-4, "{}", total_area(&disc));
        assert!(disc.iter().all(|t| t.normal_world().y > 0.999), "disc faces up");
        let band = band(64, 0);
        assert!(band.iter().all(|t| t.normal_world().dot(t.normals_world[0]) > 0.99), "band");
        assert!(band.iter().all(|t| t.normal_world().dot(t.positions_world[0]) > 0.0), "outwards");
    }
}
