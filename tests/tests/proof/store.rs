//! What photons take in memory, and what a compact store loses.

use glam::Vec3;
use lightloom_graph::{Graph, PlanOptions, ShaderStruct};
use lightloom_passes::scene::{GpuScene, builtin};
use lightloom_passes::{
    CompactPhoton, Photon, PhotonSettings, PhotonState, PhotonStore, PhotonTracing, decode_octahedral, shaders,
};
use lightloom_strategies::{Layer, Pipeline, Settings, by_name_with};
use lightloom_tests::{Image, Lab};
use std::ops::ControlFlow;

/// 32 bytes a stored photon, and a tenth of that for all that is in flight.
#[test]
fn three_million_photons_take_their_store_and_a_tenth() {
    const EMITTED: u32 = 3_000_000;
    let Some(mut lab) = Lab::open() else { return };
    let gpu_scene = lab.upload(&builtin::cornell());
    let settings = |emitted, capacity| PhotonSettings { capacity, ..PhotonSettings::new(emitted, 3, 1) };
    // A store as large as what is stored, which a 30th of the photons tells to 1 / √70,000.
    let stored = 30 * lab.photons(&gpu_scene, &settings(EMITTED / 30, 1)).state.total;
    let tracing = PhotonTracing::new(&shaders()).expect("the shaders are valid");
    let mut graph = Graph::new("store");
    let handles = gpu_scene.declare(&mut graph);
    let photons = tracing.add(&mut graph, &handles, &gpu_scene.info(), &settings(EMITTED, stored));
    graph.readback_buffer(&photons.state);
    let memory = graph.plan(&PlanOptions::default()).expect("the frame is sound").memory;
    let store = u64::from(stored) * size_of::<Photon>() as u64;
    let share = memory.allocated_bytes as f64 / store as f64;
    println!("{stored} photons: {store} bytes, allocated {} ({share:.3})", memory.allocated_bytes);
    assert!(memory.allocated_bytes >= store, "the store is part of it");
    assert!(share <= 1.1, "{share} of the store");
}

#[test]
fn a_compact_store_takes_20_bytes_and_a_tenth() {
    let capacity = 5_700_000;
    let gpu_scene = GpuScene::describe(&builtin::cornell()).expect("the scene is sound");
    let tracing = PhotonTracing::new(&PhotonStore::Compact.shaders()).expect("the shaders are valid");
    let mut graph = Graph::new("store");
    let handles = gpu_scene.declare(&mut graph);
    let settings = PhotonSettings { capacity, ..PhotonSettings::new(3_000_000, 3, 1) };
    let photons = tracing.add(&mut graph, &handles, &gpu_scene.info(), &settings);
    assert_eq!(photons.records.desc().size, 20 * u64::from(capacity));
    graph.readback_buffer(&photons.state);
    let memory = graph.plan(&PlanOptions::default()).expect("the frame is sound").memory;
    let share = memory.allocated_bytes as f64 / (20.0 * f64::from(capacity));
    println!("a compact store of {capacity} photons: allocated {} ({share:.3})", memory.allocated_bytes);
    assert!((1.0..=1.1).contains(&share), "{share} of the store");
}

fn trace<Record: ShaderStruct>(lab: &mut Lab, scene: &GpuScene, store: PhotonStore) -> (Vec<Record>, PhotonState) {
    let tracing = PhotonTracing::new(&store.shaders()).expect("the shaders are valid");
    let mut graph = Graph::new("store");
    let handles = scene.declare(&mut graph);
    let photons = tracing.add(&mut graph, &handles, &scene.info(), &PhotonSettings::new(20_000, 6, 3));
    let reads = [graph.readback_buffer(&photons.records), graph.readback_buffer(&photons.state)];
    let output = lab.run(graph);
    let state = output.cast::<PhotonState>(reads[1])[0];
    let mut records = output.cast::<Record>(reads[0]);
    records.truncate(state.stored as usize);
    (records, state)
}

/// The same seed gives the same photons in the same order, so that records compare one by one. Bounds are half a step of each
/// field's code: of positions the grid's, and half an ulp of
/// the diameter for their distance from its origin; of directions, octahedral steps of 1/2047 and 1/127, which the map stretches by up to 3; of
/// √(1 − ρ) 1/126; of logarithms 22/126 octaves. Half floats and 16-bit directions add their own roundings.
#[test]
fn compact_records_are_the_whole_ones_rounded() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = lab.upload(&builtin::caustics());
    let (whole, state) = trace::<Photon>(&mut lab, &scene, PhotonStore::Whole);
    let (compact, compact_state) = trace::<CompactPhoton>(&mut lab, &scene, PhotonStore::Compact);
    assert_eq!(state, compact_state, "counts and ledger");
    let grid = state.grid;
    let rounding = scene.info().bounds_radius * f32::EPSILON;
    let (mut flags, mut footprints, mut deep) = (0, 0, 0);
    for (whole, compact) in whole.iter().zip(&compact) {
        let offset = Vec3::from(whole.position) - compact.position(&grid);
        assert!(offset.abs().max_element() <= 0.5 * grid.step + rounding, "{offset} of steps of {}", grid.step);
        assert_eq!(whole.flux, compact.flux);
        let turned = |a: Vec3, b: Vec3| (a - b).length();
        let turn = turned(decode_octahedral(whole.direction), compact.direction());
        assert!(turn < 3.0 * 0.5_f32.sqrt() / 2047.0 + 8.0e-5, "direction off by {turn}");
        let turn = turned(decode_octahedral(whole.normal), compact.normal());
        assert!(turn < 3.0 * 0.5_f32.sqrt() / 127.0 + 8.0e-5, "normal off by {turn}");
        assert_eq!(whole.bounces().min(3), compact.bounces());
        assert_eq!(whole.bounce_flags & 0xff00, compact.flags());
        let [length, probability] = whole.length_and_probability();
        let reach = [probability, compact.path_probability()].map(|p| (1.0 - p).max(0.0).sqrt());
        assert!((reach[0] - reach[1]).abs() < 1.0 / 126.0 + 1.0e-3, "{reach:?}");
        let within = |whole: f32, compact: f32| {
            let low = grid.step * 1.07;
            (whole == 0.0 && compact == 0.0)
                || (whole < low && compact < low)
                || (whole / compact).log2().abs() < 11.0 / 126.0 + 2.0e-3
        };
        assert!(within(length, compact.ray_length(&grid)), "{length} as {}", compact.ray_length(&grid));
        let [wide, narrow] = [whole.footprint_radius(), compact.footprint_radius(&grid)];
        assert!(within(wide, narrow), "{wide} as {narrow}");
        flags |= whole.bounce_flags & 0xff00;
        footprints += u32::from(wide > 0.0);
        deep += u32::from(whole.bounces() > 3);
    }
    assert!(whole.len() > 10_000 && whole.len() == compact.len(), "{} records", whole.len());
    assert!(footprints > 100 && deep > 100, "{footprints} footprints, {deep} photons of many bounces");
    assert_eq!(flags, 0xb00, "caustic, light-only and diffuse records occur");
}

fn indirect(lab: &mut Lab, scene: &GpuScene, strategy: &str, store: PhotonStore) -> Image {
    let sources = store.shaders();
    let mut strategy = by_name_with(strategy, &sources).expect("the strategy exists");
    strategy.set("radius", "0.1").expect("it is a parameter");
    let mut pipeline = Pipeline::with_shaders(strategy, &sources).expect("the shaders are valid");
    let camera = builtin::caustics().cameras[0].clone();
    let settings = Settings { size: [80, 45], photons: 20_000, layers: vec![Layer::Indirect], ..Settings::default() };
    let rendered = pipeline.render(&mut lab.executor, scene, &camera, &settings, &mut |_| ControlFlow::Continue(()));
    let rendered = rendered.unwrap_or_else(|error| panic!("{error}"));
    assert!(rendered.warnings.is_empty(), "{:?}", rendered.warnings);
    Image::from_rgb(settings.size, &rendered.layers[0].pixels)
}

/// A photon moves by at most √3/2 steps, 2·10⁻⁶ m, against a radius of 0.1 m, and its weight by 10⁻⁴ of a kernel's height. Directions
/// matter where shading normals differ from geometric ones, by 10⁻³. What is left are photons on the edge between gathered and not, by
/// their kernel, where it is 0, or their normal, which in this scene is far from that edge or beyond it.
#[test]
fn strategies_see_the_same_light_in_either_store() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = lab.upload(&builtin::caustics());
    let [exact, compact] = PhotonStore::ALL.map(|store| indirect(&mut lab, &scene, "exact", store));
    let mean = |image: &Image| image.pixels.as_flattened().iter().sum::<f64>() / image.pixels.as_flattened().len() as f64;
    println!("the compact store's mean is {:.7} of the whole one's", mean(&compact) / mean(&exact));
    assert!((mean(&compact) / mean(&exact) - 1.0).abs() < 2.0e-4, "{} and {}", mean(&compact), mean(&exact));
    let differing = |a: &Image, b: &Image, share: f64| {
        let pairs = a.pixels.as_flattened().iter().zip(b.pixels.as_flattened());
        pairs.filter(|(a, b)| (*a - *b).abs() > share * b.max(**a)).count()
    };
    let differ = differing(&compact, &exact, 5.0e-3);
    assert!(differ * 200 < exact.pixels.len(), "{differ} values of {} differ by half a percent", 3 * exact.pixels.len());
    // Whoever decodes a record gets the same position, so that lists and sums agree to rounding.
    for name in ["tiled", "hash-grid", "sorted-grid", "view-grid", "splat-compute"] {
        let found = indirect(&mut lab, &scene, name, PhotonStore::Compact);
        assert_eq!(
            differing(&found, &compact, 816.0 / 16_777_216.0),
            0,
            "{name}: as in `equality`, for up to 400 photons a pixel"
        );
    }
}

/// Shaders of one store and photons of the other: refused before anything runs.
#[test]
fn stores_cannot_be_mixed() {
    let strategy = by_name_with("exact", &PhotonStore::Compact.shaders()).expect("the strategy exists");
    let mut pipeline = Pipeline::new(strategy).expect("the shaders are valid");
    let scene = builtin::cornell();
    let Some(mut lab) = Lab::open() else { return };
    let gpu_scene = lab.upload(&scene);
    let settings = Settings { size: [8, 8], photons: 64, ..Settings::default() };
    let result = pipeline.render(&mut lab.executor, &gpu_scene, &scene.cameras[0], &settings, &mut |_| ControlFlow::Continue(()));
    let error = result.expect_err("the records differ").to_string();
    assert!(error.contains("`photons`") && error.contains("CompactPhoton"), "{error}");
}
