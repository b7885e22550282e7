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

/// Points that a curve through the corners of an outline is drawn by, between each two.
const OUTLINE_STEPS: u32 = 6;

/// A solid turned about the y axis, smooth, fronts outwards, of `segments` sectors. `outline` has radius and height of points from the axis to the axis,
/// with the solid on its left; a Catmull-Rom spline goes through them.
pub(super) fn lathe(outline: &[[f32; 2]], segments: u32, material: u32) -> Vec<Triangle> {
    let profile = turned_profile(outline);
    let at = |(point, _): (Vec2, Vec2), segment: u32| {
        let (sin, cos) = (TAU * (segment % segments) as f32 / segments as f32).sin_cos();
        Vec3::new(point.x * cos, point.y, -point.x * sin)
    };
    let normal = |(_, normal): (Vec2, Vec2), segment: f32| {
        let (sin, cos) = (TAU * segment / segments as f32).sin_cos();
        Vec3::new(normal.x * cos, normal.y, -normal.x * sin)
    };
    let mut triangles = Vec::new();
    for (low, high) in profile.iter().copied().zip(profile[1..].iter().copied()) {
        for s in 0..segments {
            let corners = [at(low, s), at(low, s + 1), at(high, s + 1), at(high, s)];
            let mut pair = quad(corners, material);
            let [left, right] = [s as f32, (s + 1) as f32];
            let normals = [normal(low, left), normal(low, right), normal(high, right), normal(high, left)];
            pair[0].normals_world = [normals[0], normals[1], normals[2]];
            pair[1].normals_world = [normals[0], normals[2], normals[3]];
            // At the axis one of the two has no area.
            triangles.extend(pair.into_iter().filter(Triangle::is_sound));
        }
    }
    triangles
}

/// Points of the spline through `outline`, and its normals.
fn turned_profile(outline: &[[f32; 2]]) -> Vec<(Vec2, Vec2)> {
    let points: Vec<Vec2> = outline.iter().map(|&point| point.into()).collect();
    // Beyond the axis the outline goes on as its mirror image.
    let mirrored = |point: Vec2| Vec2::new(-point.x, point.y);
    let last = points.len() - 1;
    let corner = |index: isize| match index {
        -1 => mirrored(points[1]),
        _ if index as usize > last => mirrored(points[last - 1]),
        _ => points[index as usize],
    };
    let mut profile = Vec::new();
    for index in 0..last as isize {
        let [before, from, to, after] = [-1, 0, 1, 2].map(|step| corner(index + step));
        let [leaving, arriving] = [0.5 * (to - before), 0.5 * (after - from)];
        let steps = if index + 1 == last as isize { OUTLINE_STEPS + 1 } else { OUTLINE_STEPS };
        for step in 0..steps {
            let t = step as f32 / OUTLINE_STEPS as f32;
            // The cubic with these ends and these tangents.
            let cubic = 2.0 * (from - to) + leaving + arriving;
            let square = 3.0 * (to - from) - 2.0 * leaving - arriving;
            let point = ((cubic * t + square) * t + leaving) * t + from;
            let tangent = (3.0 * cubic * t + 2.0 * square) * t + leaving;
            let normal = Vec2::new(tangent.y, -tangent.x).normalize_or(Vec2::Y);
            profile.push((Vec2::new(point.x.max(0.0), point.y), normal));
        }
    }
    // On the axis itself, whatever rounding says.
    for (end, normal) in [(0, Vec2::NEG_Y), (profile.len() - 1, Vec2::Y)] {
        profile[end] = (Vec2::new(0.0, profile[end].0.y), normal);
    }
    profile
}

/// A surface over the rectangle between two corners (x and z), of `cells` along x and z, smooth, front upwards. `surface` gives height and normal.
pub(super) fn height_field(
    [least, most]: [Vec2; 2],
    cells: [u32; 2],
    surface: impl Fn(Vec2) -> (f32, Vec3),
    material: u32,
) -> Vec<Triangle> {
    let place = |i: u32, j: u32| least + (most - least) * Vec2::new(i as f32 / cells[0] as f32, j as f32 / cells[1] as f32);
    let corner = |i: u32, j: u32| {
        let at = place(i, j);
        let (height, normal) = surface(at);
        (Vec3::new(at.x, height, at.y), normal)
    };
    let mut triangles = Vec::new();
    for (i, j) in (0..cells[0]).flat_map(|i| (0..cells[1]).map(move |j| (i, j))) {
        let corners = [corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j), corner(i, j)];
        let mut pair = quad(corners.map(|(position, _)| position), material);
        let normals = corners.map(|(_, normal)| normal);
        pair[0].normals_world = [normals[0], normals[1], normals[2]];
        pair[1].normals_world = [normals[0], normals[2], normals[3]];
        triangles.extend(pair);
    }
    triangles
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

    /// A turned diamond: two cones, rounded by the spline; and a slope.
    #[test]
    fn turned_shapes_are_closed_and_fields_face_up() {
        let turned = lathe(&[[0.0, 0.0], [0.7, 0.3], [1.0, 1.0], [0.7, 1.7], [0.0, 2.0]], 64, 0);
        // A unit sphere, nearly: the spline lies up to a fiftieth within it, which takes three fiftieths of the volume at the most.
        assert!((volume(&turned) - 2.0 * TAU / 3.0).abs() < 0.06 * 2.0 * TAU / 3.0, "{}", volume(&turned));
        let mut edges = HashMap::new();
        for triangle in &turned {
            for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                let bits = |corner: usize| triangle.positions_world[corner].to_array().map(|x| (x + 0.0).to_bits());
                *edges.entry((bits(from), bits(to))).or_insert(0) += 1;
                *edges.entry((bits(to), bits(from))).or_insert(0) -= 1;
            }
        }
        assert!(edges.values().all(|&count| count == 0), "every edge has two triangles");
        let slope = |at: Vec2| (0.5 * at.x, Vec3::new(-0.5, 1.0, 0.0).normalize());
        let field = height_field([Vec2::ZERO, Vec2::new(2.0, 1.0)], [3, 4], slope, 0);
        assert!((total_area(&field) - 2.0 * 1.25_f32.sqrt()).abs() < 1e-5, "{}", total_area(&field));
        assert!(field.iter().all(|t| t.normal_world().dot(t.normals_world[1]) > 0.999), "its own normals");
    }
}
