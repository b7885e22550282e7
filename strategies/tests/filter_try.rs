use lightloom_graph::{Executor, Gpu};
use lightloom_passes::FilterSettings;
use lightloom_passes::scene::{GpuScene, builtin};
use lightloom_strategies::{Layer, Pipeline, Settings, by_name};
use std::ops::ControlFlow;

#[test]
fn tryit() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let scene = builtin::cornell();
    let camera = scene.camera(None).unwrap();
    let on = GpuScene::upload(&gpu.device, &gpu.queue, &scene).unwrap();
    let mut executor = Executor::new(&gpu);
    let mut pipeline = Pipeline::new(by_name("tiled").unwrap()).unwrap();
    let settings = Settings { size: [160, 120], photons: 100_000, frames: 3, filter: Some(FilterSettings::default()), layers: vec![Layer::Final, Layer::Indirect, Layer::Caustic], ..Settings::default() };
    let r = pipeline.render(&mut executor, &on, &camera, &settings, &mut |_| ControlFlow::Continue(())).unwrap();
    for l in &r.layers { println!("{:?} {}", l.layer, l.pixels.iter().flatten().map(|&x| f64::from(x)).sum::<f64>() / (3*l.pixels.len()) as f64); }
    for p in &r.passes { println!("{} {:?}", p.name, p.gpu_ms); }
}
