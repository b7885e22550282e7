//! Scenes that move: after a refit and after a build the same hits, photons and light as in the same scene that stands so.

use crate::determinism::settings;
use crate::traversal::{RAYS, rays};
use glam::Vec3;
use lightloom_passes::scene::{Bvh, Followed, GpuScene, Light, Scene, builtin};
use lightloom_passes::{Ray, RayBackend, RayHit};
use lightloom_tests::{Lab, View};
use std::f64::consts::PI;

/// How the hierarchy follows.
#[derive(Clone, Copy, Debug, PartialEq)]
enum By {
    Refit,
    Build,
}

/// A scene on the GPU that went through poses.
struct Moving {
    scene: Scene,
    bvh: Bvh,
    gpu_scene: GpuScene,
}

impl Moving {
    fn new(lab: &Lab, scene: Scene, backend: RayBackend) -> Self {
        let bvh = Bvh::build(&scene.name, &scene.triangles).expect("the scene has triangles");
        let gpu_scene = lab.upload(&scene).with_rays(backend).expect("the device has the backend");
        Self { scene, bvh, gpu_scene }
    }

    fn go(&mut self, time: f32, by: By) {
        self.scene.pose(time).expect("the time is finite");
        match by {
            By::Refit => drop(self.bvh.refit(&self.scene.triangles).expect("as many triangles as before")),
            By::Build => self.bvh = Bvh::build(&self.scene.name, &self.scene.triangles).expect("the scene has triangles"),
        }
        self.gpu_scene.update(&self.scene, &self.bvh).expect("it takes no more memory");
    }
}

/// The scene as if it had always stood so.
fn still(lab: &Lab, scene: &Scene, backend: RayBackend) -> GpuScene {
    let scene = Scene { animation: None, ..scene.clone() };
    lab.upload(&scene).with_rays(backend).expect("the device has the backend")
}

/// The lab with the backends that it has.
fn labs() -> Vec<(Lab, RayBackend)> {
    Lab::open().map(|lab| (lab, RayBackend::Bvh)).into_iter().chain(Lab::open_with_each()).collect()
}

/// Times (s) in turn, and how the hierarchy gets there.
fn poses() -> Vec<(f32, By)> {
    vec![(0.7, By::Refit), (2.0, By::Refit), (3.1, By::Build), (1.3, By::Refit), (4.0, By::Build)]
}

fn assert_same_hits(name: &str, rays: &[Ray], moved: &[RayHit], still: &[RayHit]) {
    let mut found = 0;
    for (i, (a, b)) in moved.iter().zip(still).enumerate() {
        // One test of a triangle serves both, so that `t` is the same in bits. Where two triangles are met at once, the order of
        // traversal decides which counts.
        assert_eq!(a.t.to_bits(), b.t.to_bits(), "{name}, ray {i} {:?}: {a:?} and {b:?}", rays[i]);
        found += u32::from(a.triangle != RayHit::NONE);
    }
    let other = moved.iter().zip(still).filter(|(a, b)| a.triangle != b.triangle).count() as u32;
    assert!(found > RAYS / 2 && other * 100 < RAYS, "{name}: {found} hits, {other} of another triangle");
}

#[test]
fn hits_are_those_of_the_scene_that_stands_so() {
    for (mut lab, backend) in labs() {
        let mut moving = Moving::new(&lab, builtin::moving(), backend);
        let mut before: Option<Vec<RayHit>> = None;
        let rays = rays(&moving.scene);
        for (time, by) in poses() {
            moving.go(time, by);
            let still = still(&lab, &moving.scene, backend);
            let name = format!("{} at {time} s by {by:?}", backend.name());
            let hits = lab.rays(&moving.gpu_scene, &rays);
            assert_same_hits(&name, &rays, &hits, &lab.rays(&still, &rays));
            let differ = before.is_some_and(|before| before.iter().zip(&hits).any(|(a, b)| a.t.to_bits() != b.t.to_bits()));
            assert!(differ || time < 1.0, "{name}: the pose before is hit");
            before = Some(hits);
        }
    }
}

#[test]
fn meshes_without_area_are_met_by_nothing() {
    for (mut lab, backend) in labs() {
        let mut scene = builtin::moving();
        let kept: Vec<_> = scene.triangles.iter().filter(|t| t.material != 4).copied().collect();
        let shrink = |scene: &mut Scene, size: f32| {
            let fresh = builtin::moving();
            for (triangle, original) in scene.triangles.iter_mut().zip(&fresh.triangles).filter(|(t, _)| t.material == 4) {
                triangle.positions_world = original.positions_world.map(|p| Vec3::new(0.1, 0.5, 0.2).lerp(p, size));
            }
        };
        scene.animation = None;
        let mut moving = Moving::new(&lab, scene, backend);
        let rays = rays(&moving.scene);
        for by in [By::Refit, By::Build] {
            shrink(&mut moving.scene, 0.0);
            moving.go(0.0, by);
            let hits = lab.rays(&moving.gpu_scene, &rays);
            let without = lab.upload(&Scene { triangles: kept.clone(), ..moving.scene.clone() });
            let without = without.with_rays(backend).expect("the device has the backend");
            assert_same_hits(
                &format!("shrunk, {by:?}"),
                &rays,
                &hits,
                &lab.rays(&without, &rays)
                    .iter()
                    .map(|hit| {
                        // The sphere's triangles come before the block's.
                        let behind = hit.triangle != RayHit::NONE && hit.triangle >= (kept.len() - 12) as u32;
                        let sphere = (moving.scene.triangles.len() - kept.len()) as u32;
                        RayHit { triangle: if behind { hit.triangle + sphere } else { hit.triangle }, ..*hit }
                    })
                    .collect::<Vec<_>>(),
            );
            assert_eq!(moving.gpu_scene.info().guide_count, 0, "nothing is left to aim at");
            shrink(&mut moving.scene, 1.0);
            moving.go(0.0, by);
            let still = still(&lab, &moving.scene, backend);
            let hits = lab.rays(&moving.gpu_scene, &rays);
            assert_same_hits(&format!("grown again, {by:?}"), &rays, &hits, &lab.rays(&still, &rays));
        }
    }
}

#[test]
fn photons_are_those_of_the_scene_that_stands_so() {
    for (mut lab, backend) in labs() {
        let mut moving = Moving::new(&lab, builtin::moving(), backend);
        for (time, by) in [(2.9, By::Build), (0.9, By::Refit)] {
            moving.go(time, by);
            let still = still(&lab, &moving.scene, backend);
            let name = format!("{} at {time} s by {by:?}", backend.name());
            assert_eq!(moving.gpu_scene.info(), still.info(), "{name}: bounds, lights and guides");
            assert_eq!(moving.gpu_scene.budget(), still.budget(), "{name}");
            let settings = settings(20_000, 4, 5);
            let [a, b] = [&moving.gpu_scene, &still].map(|scene| lab.photons(scene, &settings));
            assert!(a.state.flux_ledger().balances() && a.records.len() > 10_000, "{name}: {:?}", a.state);
            // After a build the two are alike to the last bit. After a refit the order of traversal is another: where a ray meets two
            // triangles at once it may go on from the other one, which fewer than one ray in a thousand does.
            let same = a.records.iter().zip(&b.records).filter(|(a, b)| a == b).count();
            println!("{name}: {same} of {} records alike", a.records.len());
            if by == By::Build {
                assert_eq!(a.records, b.records, "{name}");
            }
            let apart = a.records.len().abs_diff(b.records.len());
            assert!(apart * 1000 <= a.records.len(), "{name}: {} and {} records", a.records.len(), b.records.len());
            let [a, b] = [a.state.flux_ledger(), b.state.flux_ledger()];
            assert_eq!(a.emitted, b.emitted, "{name}: emission traces no rays");
            for c in 0..3 {
                assert!((a.absorbed[c] - b.absorbed[c]).abs() * 1000 <= a.emitted[c], "{name}: {a:?} and {b:?}");
            }
        }
    }
}

/// A lamp over a plane, as a file that moves it from 1 m above (−0.5, 0) to 2 m above (0.5, 0) within a second.
fn lamp_over_a_plane() -> Scene {
    let floats = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let corners = [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]].concat();
    let bin =
        [floats(&corners), floats(&[0.0, 1.0]), floats(&[-0.5, 1.0, 0.0, 0.5, 2.0, 0.0]), vec![0, 1, 2, 0, 2, 3, 0, 0]].concat();
    let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],
        "nodes":[{"mesh":0},{"extensions":{"KHR_lights_punctual":{"light":0}}}],
        "materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1],"metallicFactor":0,"roughnessFactor":1}}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":3,"material":0}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
            {"bufferView":1,"componentType":5126,"count":2,"type":"SCALAR"},
            {"bufferView":2,"componentType":5126,"count":2,"type":"VEC3"},
            {"bufferView":3,"componentType":5121,"count":6,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":8},
            {"buffer":0,"byteOffset":56,"byteLength":24},{"buffer":0,"byteOffset":80,"byteLength":6}],
        "buffers":[{"byteLength":88}],
        "animations":[{"channels":[{"sampler":0,"target":{"node":1,"path":"translation"}}],"samplers":[{"input":1,"output":2}]}],
        "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":3}]}},
        "extensionsUsed":["KHR_lights_punctual"]}"#;
    let mut text = json.as_bytes().to_vec();
    text.resize(text.len().next_multiple_of(4), b' ');
    let word = |value: usize| (value as u32).to_le_bytes().to_vec();
    let chunk = |kind: &[u8; 4], bytes: &[u8]| [word(bytes.len()), kind.to_vec(), bytes.to_vec()].concat();
    let chunks = [chunk(b"JSON", &text), chunk(b"BIN\0", &bin)].concat();
    let glb = [b"glTF".to_vec(), word(2), word(12 + chunks.len()), chunks].concat();
    Scene::from_slice(&glb, "lamp").expect("the file is sound")
}

/// Mean irradiance (W·m⁻²) of the square [−1, 1]² in the plane y = 0, from a point light of 3 W·sr⁻¹: midpoint rule on E = I h / r³.
fn mean_irradiance(lamp: [f64; 3]) -> f64 {
    let steps = 400;
    let at = |i: u32| -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(steps);
    let points = (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j)));
    let sum: f64 = points
        .map(|(i, j)| {
            let [x, z] = [at(i) - lamp[0], at(j) - lamp[2]];
            3.0 * lamp[1] / (x * x + lamp[1] * lamp[1] + z * z).powf(1.5)
        })
        .sum();
    sum / f64::from(steps * steps)
}

#[test]
fn an_animated_lamp_lights_by_its_closed_form() {
    let Some(mut lab) = Lab::open() else { return };
    let mut moving = Moving::new(&lab, lamp_over_a_plane(), RayBackend::Bvh);
    let emitted = 200_000;
    for (time, lamp) in [(0.25, [-0.25, 1.25, 0.0]), (1.0, [0.5, 2.0, 0.0])] {
        moving.go(time, By::Refit);
        assert_eq!(
            moving.scene.lights,
            [Light::Point { position_world: Vec3::from(lamp.map(|c: f64| c as f32)), intensity: Vec3::splat(3.0) }]
        );
        let expected = mean_irradiance(lamp);
        // Half of what lands on the plane ends there, the other half is scattered away for good. By roulette the number that ends is
        // binomial, of variance n p (1 − p): three standard deviations of it.
        let ledger = lab.photons(&moving.gpu_scene, &settings(emitted, 1, 11)).state.flux_ledger();
        let p = 0.5 * expected * 4.0 / (3.0 * 4.0 * PI);
        let ended = 1.0 - ledger.escaped[1] as f64 / ledger.emitted[1] as f64;
        let tolerance = 3.0 * (p * (1.0 - p) / f64::from(emitted)).sqrt();
        assert!((ended - p).abs() < tolerance, "{time} s: {ended} of the flux ends on the plane, expected {p} ± {tolerance}");
        // The picture: L = ρ E / π, ρ = ½, where the pixels see the plane.
        let camera = builtin::plane(2.0).camera(None).expect("it has a camera");
        let (image, seen) = lab.direct(&moving.gpu_scene, &View::new(camera, [32, 32]), 3, 1);
        for (pixel, [x, _, z, distance]) in image.pixels.iter().zip(&seen).filter(|(_, seen)| seen[3] > 0.0) {
            let [x, z] = [f64::from(*x) - lamp[0], f64::from(*z) - lamp[2]];
            let radiance = 0.5 / PI * 3.0 * lamp[1] / (x * x + lamp[1] * lamp[1] + z * z).powf(1.5);
            // The G-buffer keeps 11 bits of the reflectance: half of 1/2047 is 5e-4 of ½. The shading factor's ε of 1e-4 takes 2e-4 more
            // at the lowest sun here (a cosine of 0.5).
            assert!((pixel[1] / radiance - 1.0).abs() < 8e-4, "{time} s: {pixel:?} for {radiance}, {distance} m away");
        }
        assert!(seen.iter().filter(|seen| seen[3] > 0.0).count() > 400, "the plane fills most of the image");
    }
}

#[test]
fn buffers_stay_where_their_size_does() {
    let Some(lab) = Lab::open() else { return };
    let mut moving = Moving::new(&lab, builtin::moving(), RayBackend::Bvh);
    let bytes = moving.gpu_scene.bytes();
    let declared = |scene: &GpuScene| {
        let mut graph = lightloom_graph::Graph::new("f");
        scene.declare(&mut graph);
        graph.declaration().expect("imports are sound").to_frame_json()
    };
    let before = declared(&moving.gpu_scene);
    moving.go(1.0, By::Refit);
    assert_eq!((moving.gpu_scene.bytes(), declared(&moving.gpu_scene)), (bytes, before), "plans are found again");
    moving.scene.pose(2.0).expect("the time is finite");
    assert_eq!(moving.bvh.follow("moving", &moving.scene.triangles).expect("it has triangles"), Followed::Refit, "little moved");
    moving.scene.triangles.pop();
    let error = moving.gpu_scene.update(&moving.scene, &moving.bvh).expect_err("the hierarchy is over one more");
    assert!(error.to_string().contains("build it anew"), "{error}");
}
