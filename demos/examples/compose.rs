//! Composes a frame in code: the pipeline's passes around a strategy, then a pass of its own on the image they make.

use lightloom_graph::wgpu::TextureFormat::Rgba32Float;
use lightloom_graph::{ComputeShader, Executor, Gpu, GpuRequest, Graph, TextureDesc};
use lightloom_passes::{CameraUniform, scene::GpuScene, scene::builtin};
use lightloom_strategies::{Frame, Pipeline, Settings, by_name};

/// Shows each pixel's share of indirect light.
const SHARE: &str = "
    @group(0) @binding(0) var sum: texture_2d<f32>;
    @group(0) @binding(1) var indirect: texture_2d<f32>;
    @group(0) @binding(2) var share: texture_storage_2d<rgba32float, write>;
    @compute @workgroup_size(8, 8) fn indirect_share(@builtin(global_invocation_id) id: vec3u) {
        let all = max(textureLoad(sum, id.xy, 0), vec4f(1e-6));
        textureStore(share, id.xy, textureLoad(indirect, id.xy, 0) / all);
    }";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let gpu = Gpu::new(&GpuRequest::default())?;
    let scene = builtin::cornell();
    let on_gpu = GpuScene::upload(&gpu.device, &gpu.queue, &scene)?;
    let info = on_gpu.info();
    let mut pipeline = Pipeline::new(by_name("hash-grid")?)?;
    let indirect_share = ComputeShader::from_wgsl("indirect_share", SHARE)?;

    // The frame, declared: nothing runs yet, and what nobody reads never will.
    let settings = Settings { size: [320, 240], photons: 100_000, ..Settings::default() };
    let camera = CameraUniform::new(&scene.camera(None)?, settings.size, [0.5; 2], info.bounds_radius);
    let mut graph = Graph::new("compose");
    let handles = on_gpu.declare(&mut graph);
    let frame = Frame { scene: &handles, info: &info, camera: &camera, settings: &settings, frame_index: 0 };
    let light = pipeline.declare_frame(&mut graph, &frame, None)?;
    let mut share = graph.texture("share", TextureDesc::new_2d(settings.size, Rgba32Float));
    graph
        .compute(&indirect_share)
        .read("sum", &light.final_radiance.mean)
        .read("indirect", &light.indirect.mean)
        .write("share", &mut share)
        .dispatch_threads([320, 240, 1]);
    let image = graph.readback_texture(&share);

    let output = Executor::new(&gpu).execute(graph)?;
    let pixels: Vec<[f32; 4]> = output.cast(image);
    let mean = pixels.iter().map(|p| p[1]).sum::<f32>() / pixels.len() as f32;
    println!("{:.0} % of what the camera sees is indirect light, on average over the pixels", 100.0 * mean);
    Ok(())
}
