//! Ray queries and ray-tracing pipelines against the hierarchy in WGSL: the same hits, the same photons, the same images. Skipped
//! where the adapter has none.

use crate::determinism::settings;
use crate::traversal::{RAYS, lumpy, rays, spread, to_edges};
use glam::{Vec2, Vec3};
use lightloom_passes::scene::{Alpha, GpuScene, Light, Material, Scene, TextureData, TextureUse, Triangle, builtin};
use lightloom_passes::{Ray, RayBackend, RayHit};
use lightloom_tests::{Image, Lab, View};

/// Relative difference of `t` that rounding explains. All backends end in the same function, `intersect_triangle`, of which a
/// compiler may contract products and sums differently in two kernels: a few ulp (6e-8) of the corners' distances, which exceed
/// `t` by little.
const ROUNDING: f32 = 1e-6;

/// The scene with rays traced by `backend`.
fn traced_by(lab: &Lab, scene: &Scene, backend: RayBackend) -> GpuScene {
    lab.upload(scene).with_rays(backend).expect("the device has the backend")
}

/// The hits by the hierarchy and by `backend`.
fn both(lab: &mut Lab, scene: &Scene, rays: &[Ray], backend: RayBackend) -> [Vec<RayHit>; 2] {
    [RayBackend::Bvh, backend].map(|backend| {
        let gpu_scene = traced_by(lab, scene, backend);
        lab.rays(&gpu_scene, rays)
    })
}

/// Least barycentric weight of a hit.
fn margin(hit: &RayHit) -> f32 {
    let [v, w] = hit.bary;
    v.min(w).min(1.0 - v - w)
}

/// How the two answers of one ray may differ.
#[derive(Clone, Copy, PartialEq)]
enum Apart {
    /// Not at all.
    Same,
    /// Another triangle as near as the first.
    Tie,
    /// One saw past an edge that the other met.
    Edge,
}

fn compare(name: &str, i: usize, bvh: &RayHit, device: &RayHit, extent: f32) -> Apart {
    if bvh.triangle == device.triangle {
        if bvh.triangle != RayHit::NONE {
            assert!((bvh.t - device.t).abs() <= ROUNDING * bvh.t.max(extent), "{name}, ray {i}: {bvh:?} and {device:?}");
            let apart = (Vec2::from(bvh.bary) - Vec2::from(device.bary)).abs().max_element();
            assert!(apart < 1e-3, "{name}, ray {i}: {bvh:?} and {device:?}");
        }
        return Apart::Same;
    }
    let both_hit = bvh.triangle != RayHit::NONE && device.triangle != RayHit::NONE;
    if both_hit && (bvh.t - device.t).abs() <= 1e-5 * bvh.t.max(extent) {
        return Apart::Tie;
    }
    // The nearer hit is one that the other backend missed: only at the rim of that triangle may it.
    let nearer = if device.triangle == RayHit::NONE || bvh.triangle != RayHit::NONE && bvh.t < device.t { bvh } else { device };
    assert!(margin(nearer) < 1e-4, "{name}, ray {i}: {bvh:?} by the hierarchy, {device:?} by the device");
    Apart::Edge
}

/// Compares all; how many were ties, and at edges.
fn compare_all(name: &str, rays: &[Ray], [bvh, device]: &[Vec<RayHit>; 2], extent: f32) -> [usize; 2] {
    let apart: Vec<Apart> = (rays.iter().zip(bvh).zip(device).enumerate())
        .map(|(i, ((ray, bvh), device))| compare(name, i, bvh, device, extent / Vec3::from(ray.direction).length()))
        .collect();
    let count = |kind| apart.iter().filter(|&&found| found == kind).count();
    let hits = bvh.iter().filter(|hit| hit.triangle != RayHit::NONE).count();
    println!("{name}: {hits} of {} rays hit, {} ties, {} at edges", rays.len(), count(Apart::Tie), count(Apart::Edge));
    [count(Apart::Tie), count(Apart::Edge)]
}

fn extent(scene: &Scene) -> f32 {
    let (least, most) = scene.bounds();
    least.abs().max(most.abs()).max_element()
}

/// A grey scene of these triangles.
fn scene_of(name: &str, triangles: Vec<[Vec3; 3]>) -> Scene {
    let triangles = triangles.into_iter().map(|positions_world| Triangle {
        positions_world,
        normals_world: [Vec3::Y; 3],
        uvs: [Vec2::ZERO, Vec2::X, Vec2::Y],
        material: 0,
    });
    Scene { name: name.into(), triangles: triangles.collect(), materials: vec![Material::default()], ..Scene::default() }
}

/// Triangles here and there, of all sizes.
fn soup(count: u32) -> Vec<[Vec3; 3]> {
    let point = |i: u32| Vec3::new(spread(i, 0) as f32, spread(i, 1) as f32, spread(i, 2) as f32);
    (0..count)
        .map(|i| {
            let size = 0.5_f32.powi((i % 7) as i32);
            let from = point(3 * i) * 10.0;
            [from, from + (point(3 * i + 1) - 0.5) * size, from + (point(3 * i + 2) - 0.5) * size]
        })
        .collect()
}

#[test]
fn hits_are_the_same_in_the_built_in_scenes_and_among_random_triangles() {
    for (mut lab, backend) in Lab::open_with_each() {
        let mut scenes = vec![scene_of("soup", soup(20_000))];
        scenes.extend(builtin::names().iter().filter_map(|name| builtin::by_name(name)));
        for scene in scenes {
            let mut rays = rays(&scene);
            // In a scene as flat as the plane they would begin on the surface, and rounding say on which side.
            for (ray, i) in rays.iter_mut().zip(0..) {
                ray.origin[1] += 0.01 * (1.0 + spread(i, 0) as f32);
            }
            let hits = both(&mut lab, &scene, &rays, backend);
            let [ties, edges] = compare_all(&scene.name, &rays, &hits, extent(&scene));
            // Rays come at random, but for the tenth along an axis: few meet an edge within rounding.
            assert!((ties + edges) as u32 * 100 < RAYS, "{}: {ties} ties, {edges} at edges", scene.name);
        }
    }
}

#[test]
fn degenerate_triangles_are_met_by_both_or_by_neither() {
    for (mut lab, backend) in Lab::open_with_each() {
        let quad = [[Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Z], [Vec3::ZERO, Vec3::X + Vec3::Z, Vec3::Z]];
        let at = |y: f32, triangle: [Vec3; 3]| triangle.map(|corner| corner + Vec3::Y * y);
        let mut triangles: Vec<[Vec3; 3]> = soup(500).into_iter().map(|t| t.map(|p| p * 0.1)).collect();
        for copy in 0..4 {
            // Coplanar duplicates, one of them turned over, and one with its corners in another order.
            let [a, b, c] = at(0.5, quad[copy % 2]);
            triangles.extend([[a, b, c], [c, b, a], [b, c, a]]);
        }
        // No area: a point, a doubled corner, three corners in line.
        let first = at(0.75, quad[0]);
        triangles.extend([[first[0]; 3], [first[0], first[1], first[1]], [first[0], first[0].lerp(first[2], 0.5), first[2]]]);
        // Slivers: a metre long, from 1e-3 to 1e-7 m across.
        for i in 3..8 {
            let x = 0.1 * i as f32;
            triangles.push([Vec3::new(x, 1.0, 0.0), Vec3::new(x, 1.0, 1.0), Vec3::new(x + 10.0_f32.powi(-i), 1.0, 0.5)]);
        }
        let scene = scene_of("degenerate", triangles);
        let mut rays = rays(&scene);
        // Straight down and up, and into the slivers.
        rays.extend((0..1000).map(|i| {
            let down = i % 2 == 0;
            let (x, z) = if i % 4 < 2 {
                (spread(i, 0) as f32, spread(i, 1) as f32)
            } else {
                let sliver = 3 + (i / 4 % 5) as i32;
                (0.1 * sliver as f32 + 0.4 * 10.0_f32.powi(-sliver), 0.5)
            };
            let (y, direction) = if down { (1.5, Vec3::NEG_Y) } else { (-0.5, Vec3::Y) };
            Ray { origin: [x, y, z], t_max: 3e38, direction: direction.to_array(), seen: 0 }
        }));
        let hits = both(&mut lab, &scene, &rays, backend);
        compare_all(&scene.name, &rays, &hits, extent(&scene));
        for hits in &hits {
            let duplicates = 500..512;
            assert!(hits.iter().any(|hit| duplicates.contains(&hit.triangle)), "the duplicates are seen");
            assert!(hits.iter().all(|hit| !(512..515).contains(&hit.triangle)), "what has no area is not");
        }
    }
}

#[test]
fn neither_lets_rays_escape_through_edges_or_corners() {
    for (mut lab, backend) in Lab::open_with_each() {
        for (seed, offset) in [(1, Vec3::ZERO), (2, Vec3::new(100.3, -57.1, 31.7)), (3, Vec3::new(-0.3, 2.7, 0.1))] {
            let scene = lumpy(seed, offset);
            let origin = offset + Vec3::new(0.11, -0.07, 0.05);
            let rays = to_edges(&scene, origin);
            let hits = both(&mut lab, &scene, &rays, backend);
            compare_all(&scene.name, &rays, &hits, extent(&scene));
            let escaped =
                |hits: &[RayHit]| -> Vec<usize> { (0..hits.len()).filter(|&i| hits[i].triangle == RayHit::NONE).collect() };
            assert_eq!(escaped(&hits[0]).len(), 0, "mesh {seed}, hierarchy: of {} rays", rays.len());
            // Each fifth ray aims at a corner. There, one in a hundred escapes lavapipe 25.0.7's traversal: a hole of no width, for
            // nothing escapes around it, so that no share of a beam is lost.
            let holes = escaped(&hits[1]);
            assert!(holes.iter().all(|i| i % 5 == 0), "mesh {seed}, {backend:?}: a ray at an edge escaped: {holes:?}");
            assert!(holes.len() * 5 * 50 < rays.len(), "mesh {seed}, {backend:?}: {} rays at corners escaped", holes.len());
            let around = holes.iter().flat_map(|&i| {
                let direction = Vec3::from(rays[i].direction);
                let [side, up] = [direction.any_orthonormal_vector(), direction.cross(direction.any_orthonormal_vector())];
                [side, up, -side, -up].map(|aside| Ray { direction: (direction + 2e-6 * aside).to_array(), ..rays[i] })
            });
            let around: Vec<Ray> = around.chain([rays[1]]).collect();
            let gpu_scene = traced_by(&lab, &scene, backend);
            assert_eq!(escaped(&lab.rays(&gpu_scene, &around)).len(), 0, "mesh {seed}: around {} holes", holes.len());
        }
    }
}

/// Layers of [`screens`].
const LAYERS: u32 = 5;

/// Quads one behind the other, from z = 0 down, each with holes of its own: masked, blended, and a solid one last.
fn screens() -> Scene {
    let mut scene = scene_of("screens", Vec::new());
    scene.textures.push(TextureData {
        name: "holes".into(),
        width: 16,
        height: 16,
        rgba8: (0..256).flat_map(|texel| [255, 255, 255, (spread(texel, 2) * 255.0) as u8]).collect(),
    });
    let with = |alpha| Material { alpha, base_color_texture: Some(TextureUse::new(0)), ..Material::default() };
    scene.materials = vec![with(Alpha::Mask(0.6)), with(Alpha::Blend), with(Alpha::Mask(0.3)), Material::default()];
    for layer in 0..LAYERS {
        let corner = |x: f32, y: f32| Vec3::new(x, y, -0.1 * layer as f32);
        let uv = |x: f32, y: f32| Vec2::new(x + 0.37 * layer as f32, y + 0.23 * layer as f32);
        for [a, b, c] in [[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]] {
            scene.triangles.push(Triangle {
                positions_world: [a, b, c].map(|[x, y]| corner(x, y)),
                normals_world: [Vec3::Z; 3],
                uvs: [a, b, c].map(|[x, y]| uv(x, y)),
                material: if layer == LAYERS - 1 { 3 } else { layer % 3 },
            });
        }
    }
    scene
}

#[test]
fn alpha_lets_the_same_rays_pass() {
    for (mut lab, backend) in Lab::open_with_each() {
        let scene = screens();
        let rays: Vec<Ray> = (0..RAYS)
            .map(|i| {
                let through = Vec3::new(spread(i, 0) as f32, spread(i, 1) as f32, 0.0);
                let direction = if i % 4 == 0 { Vec3::NEG_Z } else { through - Vec3::new(0.5, 0.4, 2.0) };
                Ray { origin: (through - direction).to_array(), t_max: 3e38, direction: direction.to_array(), seen: 0 }
            })
            .collect();
        let hits = both(&mut lab, &scene, &rays, backend);
        let [ties, edges] = compare_all(&scene.name, &rays, &hits, extent(&scene));
        // A quad's diagonal is an edge that few rays meet within rounding.
        assert!(ties + edges < 10, "{ties} ties, {edges} at edges");
        for layer in 0..LAYERS {
            let here = hits[1].iter().filter(|hit| hit.triangle / 2 == layer).count();
            assert!(here > 0, "no ray ends on layer {layer}, so nothing was proved of it");
        }
    }
}

#[test]
fn lengths_are_kept_and_bad_rays_meet_nothing() {
    for (mut lab, backend) in Lab::open_with_each() {
        let scene = builtin::cornell();
        let mut all = rays(&scene);
        let [far, _] = both(&mut lab, &scene, &all, backend);
        for (i, (ray, hit)) in all.iter_mut().zip(&far).enumerate() {
            // Before the hit, behind it, no ray at all, and what is no number.
            match i % 4 {
                0 => ray.t_max = hit.t * 0.999,
                1 => ray.t_max = hit.t * 1.001,
                2 => ray.t_max = 0.0,
                _ => ray.direction[i % 3] = f32::NAN,
            }
        }
        let hits = both(&mut lab, &scene, &all, backend);
        for (i, (far, (bvh, device))) in far.iter().zip(hits[0].iter().zip(&hits[1])).enumerate() {
            let expected = i % 4 == 1 && far.triangle != RayHit::NONE;
            for hit in [bvh, device] {
                assert_eq!(hit.triangle != RayHit::NONE, expected, "ray {i}: {:?}: {hit:?}", all[i]);
                // Surfaces touch here and there, so the triangle is not always the same.
                assert!(!expected || (hit.t - far.t).abs() <= 1e-5 * far.t.max(1.0), "ray {i}: {far:?} and {hit:?}");
            }
        }
    }
}

#[test]
fn photons_are_the_same() {
    for (mut lab, backend) in Lab::open_with_each() {
        for scene in [builtin::cornell(), builtin::caustics(), builtin::closed_sphere(4)] {
            let name = &scene.name;
            let settings = settings(50_000, 4, 3);
            let [bvh, device] = [RayBackend::Bvh, backend].map(|backend| {
                let gpu_scene = traced_by(&lab, &scene, backend);
                lab.photons(&gpu_scene, &settings)
            });
            let [a, b] = [bvh.state.flux_ledger(), device.state.flux_ledger()];
            println!("{name}: {} and {} stored; {a:?}; {b:?}", bvh.state.total, device.state.total);
            assert!(a.balances() && b.balances(), "{name}: {a:?}, {b:?}");
            assert_eq!(a.emitted, b.emitted, "{name}: emission traces no rays");
            // A path that meets an edge, or two surfaces at once, may go on otherwise: fewer than one in a thousand rays does, by the
            // test above, and none of these on lavapipe.
            let near = |a: i64, b: i64, all: i64| (a - b).abs() * 1000 <= all;
            assert!(near(bvh.state.total.into(), device.state.total.into(), bvh.state.total.into()), "{name}: records");
            for (a, b, all) in [(a.absorbed, b.absorbed), (a.escaped, b.escaped), (a.terminated, b.terminated)]
                .iter()
                .flat_map(|(x, y)| (0..3).map(|c| (x[c], y[c], a.emitted[c])))
            {
                assert!(near(a, b, all), "{name}: {a} and {b} of {all}");
            }
        }
    }
}

/// Asserts that two pictures are the same but for one pixel in a hundred: a pixel is a few rays, of which one in a thousand may end
/// elsewhere, as above.
fn assert_same(name: &str, bvh: &Image, device: &Image) {
    let apart = bvh.pixels.iter().zip(&device.pixels).filter(|(a, b)| a.map(f64::to_bits) != b.map(f64::to_bits)).count();
    println!("{name}: {apart} of {} pixels apart, mean {:?}", bvh.pixels.len(), bvh.mean());
    assert!(apart * 100 < bvh.pixels.len(), "{name}: {apart} pixels differ");
    assert!(bvh.mean()[1] > 0.0, "{name}: nothing is seen");
}

#[test]
fn path_traced_images_are_the_same() {
    for (mut lab, backend) in Lab::open_with_each() {
        let scene = builtin::caustics();
        let view = View::new(scene.camera(None).expect("the scene has a camera"), [48, 48]);
        let [bvh, device] = [RayBackend::Bvh, backend].map(|backend| {
            let gpu_scene = traced_by(&lab, &scene, backend);
            lab.path(&gpu_scene, &view, 2, 7, 6)
        });
        assert_same("direct light of paths", &bvh.direct.mean, &device.direct.mean);
        assert_same("indirect light of paths", &bvh.indirect.mean, &device.indirect.mean);
    }
}

#[test]
fn shadows_of_what_is_partly_there_are_the_same() {
    for (mut lab, backend) in Lab::open_with_each() {
        let mut scene = screens();
        scene.lights.push(Light::Point { position_world: Vec3::new(0.3, 0.6, 1.0), intensity: Vec3::splat(4.0) });
        let view = View::new(scene.camera(None).expect("the scene is framed"), [48, 48]);
        let [bvh, device] = [RayBackend::Bvh, backend].map(|backend| {
            let gpu_scene = traced_by(&lab, &scene, backend);
            lab.direct(&gpu_scene, &view, 7, 1).0
        });
        assert_same("direct light", &bvh, &device);
    }
}
