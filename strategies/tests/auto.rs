//! `auto` counts what there is, chooses by it, says so, and shows what it chose.

mod common;

use common::{Bench, SPECULAR, VALID, View, floor_and_wall, photons, strategy, views};
use glam::{Mat4, Vec3};
use lightloom_graph::{Executor, Gpu, Graph, wgpu};
use lightloom_passes::Photon;
use lightloom_passes::scene::{Camera, GpuScene, builtin};
use lightloom_strategies::{Auto, DeviceTraits, Layer, Pipeline, RenderProgress, Rendered, Settings, Strategy, by_name};
use std::ops::ControlFlow;

const SIZE: [u32; 2] = [75, 50];
const RADII: [(&str, &str); 2] = [("r_min", "0.05"), ("r_max", "0.4")];

/// The words that measure the frame, by name.
fn measures(bench: &mut Bench, auto: &mut dyn Strategy, view: &View, photons: &[Photon]) -> Vec<(&'static str, u32)> {
    let mut graph = Graph::new("auto");
    let estimate = bench.declare(&mut graph, auto, view, photons, photons.len() as u32, false);
    let measures = estimate.measures.expect("nothing was measured before");
    let readback = graph.readback_buffer(&measures.buffer);
    let words = bench.executor.execute(graph).expect("the frame runs").cast::<u32>(readback);
    auto.observe(&words).expect("a choice is made");
    measures.names.iter().copied().zip(words).collect()
}

/// All photons and all tiles are in the sample: a pixel is compared with one in 64 photons, those of its place in its tile.
#[test]
fn counts_are_those_of_all_pairs() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(2500);
    for (place, camera) in views(SIZE) {
        let view = View::new(camera, floor_and_wall);
        let words = measures(&mut bench, &mut *strategy("auto", &RADII), &view, &photons);
        let word = |wanted: &str| words.iter().find(|(name, _)| *name == wanted).expect("it is counted").1;
        let radius = |photon: &Photon| 0.05 + 0.35 * (1.0 - photon.length_and_probability()[1]).sqrt();
        let [mut gathering, mut pairs, mut near, mut in_rows] = [0; 4];
        for (index, (position, surface)) in view.position.iter().zip(&view.surface).enumerate() {
            if surface[3] & (VALID | SPECULAR) != VALID {
                continue;
            }
            gathering += 1;
            let (x, y) = (index % SIZE[0] as usize, index / SIZE[0] as usize);
            for photon in photons.iter().skip(x % 8 + 8 * (y % 8)).step_by(64) {
                let apart = (Vec3::from(photon.position) - Vec3::new(position[0], position[1], position[2])).abs();
                pairs += 1;
                near += u32::from(apart.length() < radius(photon));
                in_rows += u32::from(apart.x < 0.4 && apart.y < 0.6 && apart.z < 0.6);
            }
        }
        // Pairs at an edge may fall on either side of it, by rounding.
        let close = |name: &str, expected: u32| {
            let found = word(name);
            assert!(found.abs_diff(expected) <= 2 + expected / 1000, "{place}, {name}: {found} in place of {expected}");
        };
        assert_eq!([word("stored"), word("sampled"), word("pixels")], [2600, 2600, SIZE[0] * SIZE[1]], "{place}");
        assert_eq!([word("gathering"), word("pairs")], [gathering, pairs], "{place}");
        close("near", near);
        close("in_rows", in_rows);
        assert!(near > 100 || place == "turned away", "{place}: {near}");

        let view_from_world = Mat4::from_cols_array_2d(&view.camera.view_from_world);
        let tan = view.camera.tan_half;
        let [mut seen, mut covered] = [0.0; 2];
        for photon in &photons {
            let (p, r) = (view_from_world.transform_point3(photon.position.into()), radius(photon));
            let depth = -p.z;
            let beyond = |p: f32, tan: f32| (p.abs() - depth * tan) / (1.0 + tan * tan).sqrt() > r;
            let around = depth < r;
            if if around { p.length() >= r } else { beyond(p.x, tan[0]) || beyond(p.y, tan[1]) } {
                continue;
            }
            seen += 1.0;
            let pixels = r / depth * SIZE[1] as f32 / (2.0 * tan[1]);
            covered += if around { 65_536.0 } else { (std::f32::consts::PI * pixels * pixels).min(65_536.0).round() };
        }
        assert!((f64::from(word("seen")) - f64::from(seen)).abs() <= 2.0, "{place}: {} seen, {seen} are", word("seen"));
        let found = f64::from(word("covered"));
        assert!((found / f64::from(covered.max(1.0_f32)) - 1.0).abs() < 1e-3 || covered == 0.0, "{place}: {found} {covered}");
    }
}

/// A tile meets at least the photons that one of its pixels has in reach, and at most those near its box.
#[test]
fn tiles_meet_what_is_near() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(1000);
    let view = View::new(views(SIZE)[0].1, floor_and_wall);
    let words = measures(&mut bench, &mut *strategy("auto", &[("radius", "0.3")]), &view, &photons);
    let word = |wanted: &str| words.iter().find(|(name, _)| *name == wanted).expect("it is counted").1;
    let [mut tiles, mut deep, mut least, mut most] = [0; 4];
    for tile in 0..10 * 7 {
        let pixels = (0..64).map(|i| [8 * (tile % 10) + i % 8, 8 * (tile / 10) + i / 8]);
        let inside = pixels.filter(|pixel| pixel[0] < SIZE[0] && pixel[1] < SIZE[1]).map(|[x, y]| (y * SIZE[0] + x) as usize);
        let points: Vec<[f32; 4]> =
            inside.filter(|&i| view.surface[i][3] & (VALID | SPECULAR) == VALID).map(|i| view.position[i]).collect();
        if points.is_empty() {
            continue;
        }
        tiles += 1;
        let fold = |axis: usize, pick: fn(f32, f32) -> f32| points.iter().map(|point| point[axis]).reduce(pick).unwrap_or(0.0);
        deep += u32::from(fold(3, f32::max) - fold(3, f32::min) > 0.6);
        let [lower, upper] =
            [f32::min as fn(f32, f32) -> f32, f32::max].map(|pick| Vec3::new(fold(0, pick), fold(1, pick), fold(2, pick)));
        for photon in &photons {
            let at = Vec3::from(photon.position);
            most += u32::from(at.clamp(lower, upper).distance(at) < 0.3001);
            // Facing photons alone count: half of those near, as the test's normals lie.
            least += u32::from(points.iter().any(|p| Vec3::new(p[0], p[1], p[2]).distance(at) < 0.2999));
        }
    }
    assert_eq!([word("tiles"), word("deep_tiles")], [tiles, deep]);
    assert!(deep > 0 && deep < tiles, "{deep} of {tiles} are deep");
    let found = word("in_tiles");
    assert!(found <= most && 2 * found >= least, "{found}, not {least}/2 to {most}");
}

#[test]
fn it_shows_what_it_chose() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(2500);
    let view = View::new(views(SIZE)[0].1, floor_and_wall);
    let mut auto = Auto::new(&lightloom_passes::shaders()).expect("the shaders are sound");
    for (key, value) in RADII {
        auto.set(key, value).expect("it has radii");
    }
    let before = bench.run(&mut auto, &view, &photons, 2500, true);
    assert_eq!((auto.chosen(), auto.choice()), ("sorted-grid", None), "nothing is measured yet");
    assert_eq!(before, bench.run(&mut *strategy("sorted-grid", &RADII), &view, &photons, 2500, true));
    measures(&mut bench, &mut auto, &view, &photons);
    let after = bench.run(&mut auto, &view, &photons, 2500, true);
    let chosen = auto.chosen();
    assert_eq!(after, bench.run(&mut *strategy(chosen, &RADII), &view, &photons, 2500, true), "{chosen}");
    let choice = auto.choice().expect("it has chosen");
    assert!(choice.starts_with(chosen) && choice.contains("because"), "{choice}");
}

fn render(pipeline: &mut Pipeline, executor: &mut Executor, scene: &GpuScene, camera: &Camera, settings: &Settings) -> Rendered {
    pipeline.render(executor, scene, camera, settings, &mut |_| ControlFlow::Continue(())).expect("it renders")
}

fn measured(rendered: &Rendered) -> bool {
    rendered.passes.iter().any(|pass| pass.name == "auto_measure")
}

/// It measures frames of a new kind, once.
#[test]
fn choices_last_as_long_as_they_hold() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut executor = Executor::new(&gpu);
    let scene = builtin::cornell();
    let camera = scene.cameras[0].clone();
    let gpu_scene = GpuScene::upload(&gpu.device, &gpu.queue, &scene).expect("the scene fits");
    let mut pipeline = Pipeline::new(by_name("auto").expect("it exists")).expect("it builds");
    let settings = Settings { size: [40, 24], photons: 3000, bounces: 4, layers: vec![Layer::Indirect], ..Settings::default() };

    // Measured before, without an image; a reset and another camera change nothing.
    let mut go_on = |_: RenderProgress<'_>| ControlFlow::Continue(());
    pipeline.measure(&mut executor, &gpu_scene, &camera, &settings, &mut go_on).expect("it measures");
    let first = render(&mut pipeline, &mut executor, &gpu_scene, &camera, &settings);
    assert!(!measured(&first), "it was measured before");
    let choice = first.choice.expect("it has chosen");
    assert!(!choice.contains("until it was measured"), "{choice}");
    pipeline.reset();
    let moved = Camera { yfov: 0.9 * camera.yfov, ..camera.clone() };
    assert!(!measured(&render(&mut pipeline, &mut executor, &gpu_scene, &moved, &settings)), "the kind is the same");

    // Another kind is measured in its first frame.
    let more = Settings { photons: 6000, frames: 2, ..settings.clone() };
    let rendered = render(&mut pipeline, &mut executor, &gpu_scene, &camera, &more);
    assert!(measured(&rendered) && rendered.choice.is_some(), "{:?}", rendered.choice);
    assert!(!measured(&render(&mut pipeline, &mut executor, &gpu_scene, &camera, &more)), "once");
    assert!(!measured(&render(&mut pipeline, &mut executor, &gpu_scene, &camera, &settings)), "the first is remembered");

    pipeline.strategy_mut().set("r_max", "0.2").expect("it has radii");
    assert!(measured(&render(&mut pipeline, &mut executor, &gpu_scene, &camera, &settings)), "other radii, another choice");

    // A device of another kind.
    pipeline.strategy_mut().meet_device(&DeviceTraits { kind: wgpu::DeviceType::DiscreteGpu, ..DeviceTraits::of(&gpu.device) });
    assert!(measured(&render(&mut pipeline, &mut executor, &gpu_scene, &camera, &settings)), "another device, another choice");
}
