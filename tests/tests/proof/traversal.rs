//! Rays through the hierarchy in WGSL against rays through the same triangles one by one, in f64.

use glam::{DVec3, Vec3};
use lightloom_graph::{BufferDesc, ComputeShader, Graph};
use lightloom_passes::scene::{Bvh, Scene, builtin};
use lightloom_passes::{Ray, RayHit};
use lightloom_tests::Lab;

pub(crate) const RAYS: u32 = 4000;

/// A rational lattice over the unit interval: evenly spread, no two dimensions alike.
pub(crate) fn spread(i: u32, dimension: usize) -> f64 {
    const RATIOS: [f64; 5] =
        [0.856_674_883_854_502_9, 0.733_891_856_627_126, 0.628_706_721_037_809_4, 0.538_597_257_223_610_6, 0.461_401_575_293_1];
    (0.5 + f64::from(i) * RATIOS[dimension]).fract()
}

/// Rays from inside the bounds in all directions; some have a zero component or a direction that is not unit.
pub(crate) fn rays(scene: &Scene) -> Vec<Ray> {
    let (least, most) = scene.bounds();
    (0..RAYS)
        .map(|i| {
            let u = Vec3::new(spread(i, 0) as f32, spread(i, 1) as f32, spread(i, 2) as f32);
            let z = 2.0 * spread(i, 3) - 1.0;
            let (sin, cos) = (std::f64::consts::TAU * spread(i, 4)).sin_cos();
            let ring = (1.0 - z * z).sqrt();
            let mut direction = Vec3::new((ring * cos) as f32, (ring * sin) as f32, z as f32);
            match i % 10 {
                0 => direction[(i / 10 % 3) as usize] = 0.0,
                1 => direction *= 0.01,
                2 => direction = [Vec3::X, Vec3::NEG_Y, Vec3::Z][(i / 10 % 3) as usize],
                _ => {}
            }
            let origin = least + (most - least) * u;
            Ray { origin: origin.to_array(), t_max: 3e38, direction: direction.to_array(), seen: 0 }
        })
        .collect()
}

/// Distance along the ray to the triangle's plane, and the least barycentric weight there, in f64.
fn meet(ray: &Ray, corners: [Vec3; 3]) -> Option<(f64, f64)> {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let (origin, direction) = (Vec3::from(ray.origin).as_dvec3(), Vec3::from(ray.direction).as_dvec3());
    let normal = (b - a).cross(c - a);
    let facing = normal.dot(direction);
    if facing == 0.0 {
        return None;
    }
    let t = normal.dot(a - origin) / facing;
    let p = origin + direction * t;
    let weight = |q: DVec3, r: DVec3| (r - q).cross(p - q).dot(normal) / normal.length_squared();
    Some((t, weight(a, b).min(weight(b, c)).min(weight(c, a))))
}

fn by_hand(scene: &Scene, ray: &Ray) -> Option<(f64, u32, f64)> {
    let met = scene.triangles.iter().zip(0..).filter_map(|(triangle, id)| {
        let (t, weight) = meet(ray, triangle.positions_world)?;
        (t > 0.0 && weight >= 0.0).then_some((t, id, weight))
    });
    met.min_by(|a, b| a.0.total_cmp(&b.0))
}

#[test]
fn hits_are_those_of_every_triangle_tested() {
    let Some(mut lab) = Lab::open() else { return };
    for scene in [builtin::cornell(), builtin::closed_sphere(3), builtin::caustics()] {
        let gpu_scene = lab.upload(&scene);
        let bvh = Bvh::build(&scene.name, &scene.triangles).expect("the scene has triangles");
        let rays = rays(&scene);
        let hits = lab.rays(&gpu_scene, &rays);
        let (mut found, mut ties) = (0, 0);
        for (i, (ray, hit)) in rays.iter().zip(&hits).enumerate() {
            let name = &scene.name;
            let expected = by_hand(&scene, ray);
            found += usize::from(expected.is_some());
            let Some((t, id, weight)) = expected else {
                assert_eq!(hit.triangle, RayHit::NONE, "{name}, ray {i}: nothing is there");
                continue;
            };
            if hit.triangle == RayHit::NONE || f64::from(hit.t) > t * (1.0 + 1e-4) {
                // Only where the ray passes within rounding of the triangle's edge may f32 see past it.
                assert!(weight < 1e-5, "{name}, ray {i}: {hit:?}, expected {t} at {id}, {weight} from the edge");
                ties += 1;
                continue;
            }
            let error = (f64::from(hit.t) - t).abs() / t.max(1e-3 / f64::from(Vec3::from(ray.direction).length()));
            assert!(error < 1e-4, "{name}, ray {i}: t {} in place of {t}", hit.t);
            if hit.triangle != id {
                // Another triangle as near: an edge that two share, or surfaces that touch.
                let other = meet(ray, scene.triangles[hit.triangle as usize].positions_world);
                assert!(other.is_some_and(|(_, weight)| weight > -1e-5), "{name}, ray {i}: {hit:?} is no hit at all");
                ties += 1;
            }
            let cpu = bvh.closest_hit(ray.origin.into(), ray.direction.into(), 0.0, f32::INFINITY);
            let apart = cpu.map_or(f64::MAX, |cpu| (f64::from(cpu.distance - hit.t) / t).abs());
            assert!(apart < 1e-4 || weight < 1e-5, "{name}, ray {i}: {hit:?}, the same hierarchy on the CPU says {cpu:?}");
        }
        println!("{}: {found} of {RAYS} rays hit, {ties} on edges", scene.name);
        assert!(found as u32 > RAYS / 2, "{}: {found} hits", scene.name);
        assert!(ties * 100 < RAYS, "{}: {ties} rays on edges", scene.name);
    }
}

/// A closed, lumpy sphere: every shared corner moved by a random factor, the same in all triangles that share it.
pub(crate) fn lumpy(seed: u32, offset: Vec3) -> Scene {
    let mut scene = builtin::closed_sphere(3);
    for triangle in &mut scene.triangles {
        for corner in &mut triangle.positions_world {
            // Equal corners have equal bits, so the factor depends on the corner alone.
            let mut bits =
                corner.to_array().iter().fold(seed, |hash, x| (hash ^ x.to_bits()).wrapping_mul(0x9e37_79b1).rotate_left(15));
            bits = (bits ^ (bits >> 15)).wrapping_mul(0x85eb_ca6b);
            *corner = *corner * (0.7 + 0.6 * (bits >> 8) as f32 / (1 << 24) as f32) + offset;
        }
    }
    scene
}

/// Rays from `origin` to the corners of the scene's triangles and to points of their edges; those are at t = 1.
pub(crate) fn to_edges(scene: &Scene, origin: Vec3) -> Vec<Ray> {
    (scene.triangles.iter())
        .flat_map(|triangle| (0..3).map(move |i| (triangle.positions_world[i], triangle.positions_world[(i + 1) % 3])))
        .flat_map(|(a, b)| [0.0, 0.5, 0.25, 0.1, 0.77].map(|s| a.lerp(b, s) - origin))
        .map(|direction| Ray { origin: origin.to_array(), t_max: 3e38, direction: direction.to_array(), seen: 0 })
        .collect()
}

#[test]
fn no_ray_escapes_a_closed_mesh_through_edges_or_corners() {
    let Some(mut lab) = Lab::open() else { return };
    for (seed, offset) in [(1, Vec3::ZERO), (2, Vec3::new(100.3, -57.1, 31.7)), (3, Vec3::new(-0.3, 2.7, 0.1))] {
        let scene = lumpy(seed, offset);
        let gpu_scene = lab.upload(&scene);
        // The mesh is star-shaped about its centre; the origin stays well inside the least radius.
        let rays = to_edges(&scene, offset + Vec3::new(0.11, -0.07, 0.05));
        let hits = lab.rays(&gpu_scene, &rays);
        let escaped = hits.iter().filter(|hit| hit.triangle == RayHit::NONE).count();
        assert_eq!(escaped, 0, "mesh {seed}: of {} rays at edges and corners", rays.len());
        for (ray, hit) in rays.iter().zip(&hits) {
            // The target is at t = 1; f32 resolves it to about the ulp of the farthest coordinate.
            assert!((hit.t - 1.0).abs() < 1e-3, "mesh {seed}: {ray:?} met the surface at {}", hit.t);
        }
    }
}

/// By the 0–1 principle [Knuth98, 5.3.4, theorem Z], a network that sorts all rows of zeros and ones sorts all rows.
#[test]
fn every_row_of_zeros_and_ones_is_sorted() {
    const TEXT: &str = r#"
#import "shared/sort8.wgsl"
@group(0) @binding(0) var<storage, read_write> rows: array<u32>;
@compute @workgroup_size(64)
fn rows_sorted(@builtin(global_invocation_id) id: vec3u) {
    let row = vec4u(id.x);
    var numbers = sort8(vec4i((row >> vec4u(0u, 1u, 2u, 3u)) & vec4u(1u)), vec4i((row >> vec4u(4u, 5u, 6u, 7u)) & vec4u(1u)));
    var sorted = 0u;
    for (var i = 0u; i < 8u; i += 1u) {
        sorted |= u32(numbers[i]) << i;
    }
    rows[id.x] = sorted;
}"#;
    let Some(mut lab) = Lab::open() else { return };
    let sources = lab.sources.with(&[("rows_sorted.wgsl", TEXT)]);
    let shader = ComputeShader::new(&sources, "rows_sorted.wgsl").expect("it is sound");
    let mut graph = Graph::new("rows");
    let mut rows = graph.buffer("rows", BufferDesc::words(256));
    graph.compute(&shader).write("rows", &mut rows).dispatch_1d(256);
    let read = graph.readback_buffer(&rows);
    let sorted: Vec<u32> = lab.run(graph).cast(read);
    for (row, sorted) in (0_u32..).zip(sorted) {
        assert_eq!(sorted, 0xff & !(0xff >> row.count_ones()), "row {row:08b}");
    }
}
