//! The filters on surfaces and light made by hand, and on a room.

mod common;

use common::filter_rig::{Hit, Rig, SIZE, corner, jittered, largest_difference, noise, only, step, still, view, wall};
use common::{Random, SPECULAR, View};
use glam::{Mat4, Vec3};
use lightloom_graph::{Executor, Gpu, Graph};
use lightloom_passes::scene::{Bvh, GpuScene, builtin};
use lightloom_passes::{AmbientOcclusionSettings, CameraUniform, FilterSettings};
use lightloom_strategies::{Frame, Layer, LayerImage, Pipeline, Rendered, Settings, by_name};
use std::ops::ControlFlow;

/// Whether a pixel of `view` shows the left wall of a corner, or the near plane of a step.
fn is_left(view: &View) -> Vec<bool> {
    view.position.iter().map(|p| p[0] < 0.0 && p[2] > -1.0).collect()
}

#[test]
fn unlimited_details_give_the_input_and_none_the_plain_blur() {
    let Some(mut rig) = Rig::new() else { return };
    let (view, light) = (still(wall), noise(&mut Random(1)));
    // Equal frames have no noise between them.
    let all = FilterSettings { clip: 1.0e6, ..FilterSettings::default() };
    rig.frame(&view, all, &light, false);
    let again = rig.frame(&view, all, &light, false);
    // Sums of four levels in 32 bits.
    assert!(largest_difference(&again, &light) < 1e-5, "{}", largest_difference(&again, &light));

    let blur = FilterSettings { clip: 0.0, iterations: 1, ..FilterSettings::default() };
    let blurred = rig.frame(&view, blur, &light, false);
    let [width, height] = SIZE.map(|side| side as i32);
    let h = |i: i32| [0.5_f32, 0.25, 0.125][i.unsigned_abs() as usize];
    let expected: Vec<Vec3> = (0..width * height)
        .map(|at| {
            let (mut sum, mut weight) = (Vec3::ZERO, 0.0);
            for (i, j) in (-2..=2).flat_map(|j| (-2..=2).map(move |i| (i, j))) {
                let (x, y) = (at % width + i, at / width + j);
                if (0..width).contains(&x) && (0..height).contains(&y) {
                    sum += light[(y * width + x) as usize] * (h(i) * h(j));
                    weight += h(i) * h(j);
                }
            }
            sum / weight
        })
        .collect();
    // The wall is tilted by 0.04 against the view: depths differ, by less than a footprint for each pixel, and weights fall by some per cent.
    assert!(largest_difference(&blurred, &expected) < 0.05, "{}", largest_difference(&blurred, &expected));
    assert!(largest_difference(&blurred, &light) > 0.3, "it blurs");
}

#[test]
fn a_constant_stays_what_it_is_to_the_last_bit() {
    let Some(mut rig) = Rig::new() else { return };
    let light = vec![Vec3::new(0.3, 7.0, 1e-3); (SIZE[0] * SIZE[1]) as usize];
    for frame in 0..4 {
        let filtered = rig.frame(&jittered(corner, frame), FilterSettings::default(), &light, false);
        // Means over frames round.
        assert!(largest_difference(&filtered, &light) <= 2e-6, "{}", largest_difference(&filtered, &light));
    }
}

#[test]
fn edges_and_steps_are_not_crossed() {
    let Some(mut rig) = Rig::new() else { return };
    let settings = FilterSettings { clip: 0.0, ..FilterSettings::default() };
    for (name, hit) in [("corner", corner as Hit), ("step", step as Hit)] {
        let view = still(hit);
        let light: Vec<Vec3> = is_left(&view).into_iter().map(|left| Vec3::splat(if left { 10.0 } else { 1.0 })).collect();
        rig.previous = None;
        for _ in 0..3 {
            let filtered = rig.frame(&view, settings, &light, false);
            // Right angles have the weight 0. A step of 5 m is 15 footprints at the far plane, 9 with what its tilt of 0.04 allows over 16
            // pixels: e^−9 of a difference of 9.
            assert!(largest_difference(&filtered, &light) < 1.2e-3, "{name}: {}", largest_difference(&filtered, &light));
        }
    }
}

#[test]
fn a_still_view_averages_its_frames_whatever_their_sample_positions() {
    let Some(mut rig) = Rig::new() else { return };
    let mut random = Random(5);
    let mut rms = Vec::new();
    for frame in 0..80 {
        let filtered = rig.frame(&jittered(corner, frame), only(0.95), &noise(&mut random), false);
        let squares: f32 = filtered.iter().map(|l| (*l - 0.5).length_squared() / 3.0).sum();
        rms.push((squares / filtered.len() as f32).sqrt());
    }
    // Uniform numbers scatter by 1/√12; the mean of n by 1/√n of it, and an endless one of weights 0.95ᵏ by 1/√39. A hundredth is the noise of the rms of
    // 4,608 numbers, five more for pixels along the edge, a fiftieth of all, which see either wall.
    for (frames, worth) in [(1, 1.0), (8, 8.0), (80, 39.0_f32)] {
        let expected = (1.0 / (12.0 * worth)).sqrt();
        let ratio = rms[frames - 1] / expected;
        assert!((0.96..1.06).contains(&ratio), "after {frames} frames {ratio} of the expected noise");
    }
}

#[test]
fn moving_light_leaves_a_known_ghost() {
    let Some(mut rig) = Rig::new() else { return };
    let view = still(corner);
    let light = |value| vec![Vec3::splat(value); (SIZE[0] * SIZE[1]) as usize];
    for _ in 0..25 {
        rig.frame(&view, only(0.95), &light(1.0), false);
    }
    for k in 1..=40 {
        let ghost = rig.frame(&view, only(0.95), &light(0.0), false);
        let bound = 0.95_f32.powi(k);
        for value in ghost {
            assert!((value.x - bound).abs() < 1e-3, "{k} frames after: {} for {bound}", value.x);
        }
    }
    let forgetful = rig.frame(&view, only(0.0), &light(5.0), false);
    assert!(forgetful.iter().all(|value| (value.x - 5.0).abs() < 1e-6), "without history");
}

#[test]
fn what_comes_to_sight_takes_new_light_alone() {
    let Some(mut rig) = Rig::new() else { return };
    let light_of = |view: &View, scale: f32| -> Vec<Vec3> {
        is_left(view).into_iter().map(|left| Vec3::splat(if left { 10.0 * scale } else { scale })).collect()
    };
    // The eye steps aside: the far plane comes to sight beside the near one's edge, which is brighter.
    for frame in 0..12 {
        let x = 1.5 - 0.25 * frame as f32;
        let view = view(step, Vec3::new(x, 0.2, 5.0), Vec3::new(x, 0.0, 0.0), Settings::default().jitter(frame));
        let light = light_of(&view, 1.0);
        let filtered = rig.frame(&view, only(0.95), &light, false);
        // Across the step weights are below e^−20.
        assert!(largest_difference(&filtered, &light) < 1e-4, "frame {frame}: {}", largest_difference(&filtered, &light));
    }
    // The eye turns to what it has not seen.
    let there = view(wall, Vec3::new(40.0, 0.2, 5.0), Vec3::new(40.0, 0.0, 0.0), [0.5; 2]);
    let new = vec![Vec3::splat(0.25); (SIZE[0] * SIZE[1]) as usize];
    assert_eq!(rig.frame(&there, only(0.95), &new, false), new, "nothing of it is old");
    // Forgotten history.
    rig.previous = None;
    let newer = vec![Vec3::splat(4.0); (SIZE[0] * SIZE[1]) as usize];
    assert_eq!(rig.frame(&there, only(0.95), &newer, false), newer, "what was is forgotten");
}

#[test]
fn textures_are_not_filtered_and_black_channels_say_nothing() {
    let Some(mut rig) = Rig::new() else { return };
    let mut view = still(wall);
    // 11, 11 and 10 bits; blue of the second is a quarter of white as a square root, 1/16.
    let colors =
        [(u32::MAX, Vec3::ONE), (2047 | (256 << 22), Vec3::new(1.0, 0.0, (256.0_f32 / 1023.0).powi(2))), (0, Vec3::ZERO)];
    let mut radiance = Vec::new();
    for (index, surface) in view.surface.iter_mut().enumerate() {
        let (code, color) = colors[(index / 3) % 3];
        surface[2] = code;
        radiance.push(color * Vec3::new(1.0, 2.0, 3.0));
    }
    let settings = FilterSettings { clip: 0.0, ..FilterSettings::default() };
    for _ in 0..2 {
        let filtered = rig.frame(&view, settings, &radiance, true);
        assert!(largest_difference(&filtered, &radiance) < 1e-5, "{}", largest_difference(&filtered, &radiance));
    }
    // Where the first surface is specular, radiance passes.
    view.surface[5][3] |= SPECULAR;
    radiance[5] = Vec3::splat(99.0);
    assert_eq!(rig.frame(&view, settings, &radiance, true)[5], radiance[5]);
}

/// A room on the device.
struct Room {
    executor: Executor,
    scene: GpuScene,
    camera: lightloom_passes::scene::Camera,
}

impl Room {
    fn new(scene: &lightloom_passes::scene::Scene) -> Option<Self> {
        let gpu = Gpu::for_tests()?;
        let camera = scene.camera(None).expect("it has a camera");
        let scene = GpuScene::upload(&gpu.device, &gpu.queue, scene).expect("it fits");
        Some(Self { executor: Executor::new(&gpu), scene, camera })
    }

    fn render(&mut self, pipeline: &mut Pipeline, settings: &Settings) -> Rendered {
        let observer = &mut |_: lightloom_strategies::RenderProgress<'_>| ControlFlow::Continue(());
        pipeline.render(&mut self.executor, &self.scene, &self.camera, settings, observer).expect("it renders")
    }
}

fn pipeline(strategy: &str) -> Pipeline {
    Pipeline::new(by_name(strategy).expect("it exists")).expect("its shaders are valid")
}

fn image(rendered: &Rendered, layer: Layer) -> &LayerImage {
    rendered.layer(layer).expect("the layer was asked for")
}

fn mean(image: &LayerImage) -> f64 {
    image.pixels.iter().flatten().map(|&x| f64::from(x)).sum::<f64>() / (3 * image.pixels.len()) as f64
}

/// Mean of (x − r)²/(r² + 0.01).
fn relative_mse(x: &LayerImage, r: &LayerImage) -> f64 {
    let pairs = x.pixels.iter().flatten().zip(r.pixels.iter().flatten());
    pairs.map(|(&x, &r)| f64::from((x - r).powi(2) / (r * r + 0.01))).sum::<f64>() / (3 * x.pixels.len()) as f64
}

#[test]
fn eight_filtered_frames_of_a_room_have_a_quarter_of_the_error_and_the_same_light() {
    let Some(mut room) = Room::new(&builtin::cornell()) else { return };
    let settings =
        Settings { size: [64, 48], photons: 300_000, bounces: 3, layers: vec![Layer::Indirect], ..Settings::default() };
    let reference = room.render(&mut pipeline("path"), &Settings { frames: 256, seed: 77, ..settings.clone() });
    let mut tiled = pipeline("tiled");
    let one = room.render(&mut tiled, &settings);
    let filtered = room.render(&mut tiled, &Settings { frames: 8, filter: Some(FilterSettings::default()), ..settings });
    let [reference, one, filtered] = [&reference, &one, &filtered].map(|it| image(it, Layer::Indirect));
    let (before, after) = (relative_mse(one, reference), relative_mse(filtered, reference));
    let energy = mean(filtered) / mean(reference);
    println!("relMSE of one frame {before:.5}, filtered {after:.5}, of it {:.4}; mean {energy:.4}", after / before);
    assert!(after <= 0.25 * before, "{after} of {before}");
    assert!((energy - 1.0).abs() < 0.01, "{energy} of the reference's light");
    assert!(filtered.standard_error.is_none(), "filtered frames are not independent");
}

/// Of a strategy that returns irradiance and its direction both are kept over frames, and reflected afterwards.
#[test]
fn remembered_irradiance_is_reflected_as_the_same_light() {
    const FRAMES: u32 = 4;
    let Some(mut room) = Room::new(&builtin::cornell()) else { return };
    let mut settings =
        Settings { size: [32, 24], photons: 10_000, bounces: 3, layers: vec![Layer::Indirect], ..Settings::default() };
    let mut splats = pipeline("splat-3d");
    let pixels =
        |rendered: &Rendered| -> Vec<Vec3> { image(rendered, Layer::Indirect).pixels.iter().map(|&p| p.into()).collect() };
    let (mut sum, mut last, mut remembered) = (vec![Vec3::ZERO; 32 * 24], Vec::new(), Vec::new());
    for seed in 0..FRAMES {
        last = pixels(&room.render(&mut splats, &Settings { seed, ..settings.clone() }));
        for (sum, pixel) in sum.iter_mut().zip(&last) {
            *sum += pixel;
        }
    }
    settings.filter = Some(only(0.95));
    for seed in 0..FRAMES {
        let observer = &mut |_: lightloom_strategies::RenderProgress<'_>| ControlFlow::Continue(());
        let settings = Settings { seed, ..settings.clone() };
        let next = splats.render_next(&mut room.executor, &room.scene, &room.camera, &settings, observer);
        remembered = pixels(&next.expect("it renders"));
    }
    let plain: Vec<_> = sum.iter().map(|sum| *sum / FRAMES as f32).collect();
    let apart = |image: &[Vec3]| image.iter().zip(&plain).map(|(a, b)| a.distance_squared(*b)).sum::<f32>().sqrt();
    let (remembered, last) = (apart(&remembered), apart(&last));
    println!("from the mean of {FRAMES} frames the remembered one is {remembered:.5} apart, the last alone {last:.5}");
    // The history of four frames is their plain mean. That of directions reflects all light as if it came from one; for Lambertians only the shading
    // normal's correction asks, ε / cos θ, of 10⁻⁴.
    assert!(remembered < 1e-3 * last, "{remembered} of {last}");
}

#[test]
fn motion_vectors_follow_moving_triangles() {
    let mut scene = builtin::moving();
    let Some(mut room) = Room::new(&scene) else { return };
    let mut bvh = Bvh::build(&scene.name, &scene.triangles).expect("it has triangles");
    let settings = Settings {
        size: [64, 48],
        photons: 100,
        filter: Some(FilterSettings::default()),
        layers: vec![Layer::Indirect],
        ..Settings::default()
    };
    let mut tiled = pipeline("tiled");
    room.render(&mut tiled, &settings);
    let before = scene.triangles.clone();
    scene.pose(0.2).expect("a time");
    bvh.follow(&scene.name, &scene.triangles).expect("as many triangles");
    room.scene.update(&scene, &bvh).expect("it fits");

    let info = room.scene.info();
    let camera = CameraUniform::new(&room.camera, settings.size, [0.5; 2], info.bounds_radius);
    let mut graph = Graph::new("tiled");
    let handles = room.scene.declare(&mut graph);
    let frame = Frame { scene: &handles, info: &info, camera: &camera, settings: &settings, frame_index: 0 };
    tiled.declare_frame(&mut graph, &frame, None).expect("it is sound");
    let motion = graph.tap("filter_motion", None).expect("the pass is there").readback;
    let seen = graph.tap("visibility", Some("visibility")).expect("the pass is there").readback;
    let output = room.executor.execute(graph).expect("it runs");
    let view_from_world = Mat4::from_cols_array_2d(&camera.view_from_world);
    let mut moved = 0;
    let pixels = output.cast::<[u32; 4]>(seen).into_iter().zip(output.cast::<[f32; 4]>(motion)).enumerate();
    for (index, (seen, motion)) in pixels.filter(|(_, (seen, _))| seen[0] != 0) {
        let corners = before[bvh.leaf_order()[seen[0] as usize - 1] as usize].positions_world;
        let (u, v) = (f32::from_bits(seen[1]), f32::from_bits(seen[2]));
        let was = view_from_world.transform_point3(corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v);
        let ndc = [was.x, -was.y].map(|x| x / -was.z);
        let film = [0, 1].map(|i| (0.5 * ndc[i] / camera.tan_half[i] + 0.5) * settings.size[i] as f32);
        let pixel = [index as u32 % settings.size[0], index as u32 / settings.size[0]].map(|i| i as f32 + 0.5);
        let expected = [film[0] - pixel[0], film[1] - pixel[1]];
        moved += u32::from(expected[0].abs() > 0.3);
        // Coordinates of 64 pixels in 32 bits, after a division of barycentric weights.
        assert!((motion[0] - expected[0]).abs() < 1e-2 && (motion[1] - expected[1]).abs() < 1e-2, "{motion:?} for {expected:?}");
        assert!((motion[2] + was.z).abs() < 1e-3 && motion[3] > 0.5, "{motion:?} for a depth of {}", -was.z);
    }
    assert!(moved > 20, "{moved} pixels show what moved");
}

#[test]
fn occlusion_in_a_sphere_is_known_and_darkens_the_sum_alone() {
    let Some(mut room) = Room::new(&builtin::closed_sphere(3)) else { return };
    let settings = Settings {
        size: [32, 24],
        photons: 20_000,
        layers: vec![Layer::Final, Layer::Direct, Layer::Indirect],
        ambient_occlusion: Some(AmbientOcclusionSettings { radius_m: 2.0, rays: 64 }),
        ..Settings::default()
    };
    let rendered = room.render(&mut pipeline("tiled"), &settings);
    let [all, direct, indirect] = [Layer::Final, Layer::Direct, Layer::Indirect].map(|layer| mean(image(&rendered, layer)));
    // A chord at θ from the normal of the unit sphere is 2 cos θ long, its mean by the cosine law 4/3: of 2 m two thirds.
    // 49,000 rays leave 0.002 of noise; the facets of 1,280 triangles, whose sphere is a hair larger, less than a hundredth.
    let openness = (all - direct) / indirect;
    assert!((openness - 2.0 / 3.0).abs() < 0.01, "{openness}");
}
