//! Taps bring back what a pass wrote, whatever becomes of it afterwards.

use crate::{Amount, executor};
use lightloom_graph::{ComputeShader, Graph, Handle, Profile, Sharing, Texture, TextureDesc, to_chrome_trace, to_html, wgpu};

fn paint() -> ComputeShader {
    ComputeShader::from_wgsl(
        "paint",
        "struct Amount { value: f32, count: u32 }
        @group(0) @binding(0) var<uniform> params: Amount;
        @group(0) @binding(1) var image: texture_storage_2d<r32float, write>;
        @compute @workgroup_size(8, 8) fn paint(@builtin(global_invocation_id) id: vec3u) {
            textureStore(image, id.xy, vec4f(params.value + f32(id.x)));
        }",
    )
    .unwrap()
}

fn image(graph: &mut Graph<'_>, name: &str) -> Handle<Texture> {
    graph.texture(name, TextureDesc::new_2d([4, 2], wgpu::TextureFormat::R32Float))
}

/// `paint` writes `a`, `paint#2` overwrites it, and `paint#3` writes `b`, which may lie in the same memory.
fn frame(paint: &ComputeShader) -> Graph<'static> {
    let mut graph = Graph::new("taps");
    let (mut a, mut b) = (image(&mut graph, "a"), image(&mut graph, "b"));
    let mut write = |value: f32, target: &mut Handle<Texture>| {
        graph.compute(paint).params(&Amount { value, count: 0 }).write("image", target).dispatch([1, 1, 1]);
    };
    write(10.0, &mut a);
    write(20.0, &mut a);
    write(30.0, &mut b);
    graph.readback_texture(&b);
    graph
}

#[test]
fn a_tap_sees_neither_later_writes_nor_shared_memory() {
    let Some(mut executor) = executor() else { return };
    let paint = paint();
    for sharing in [Sharing::Off, Sharing::Exact, Sharing::Merged] {
        executor.set_sharing(sharing);
        for (pass, first) in [("paint", 10.0), ("paint#2", 20.0), ("paint#3", 30.0)] {
            let mut graph = frame(&paint);
            let tap = graph.tap(pass, None).unwrap();
            let output = executor.execute(graph).unwrap();
            let row: Vec<f32> = (0..4).map(|x| first + x as f32).collect();
            assert_eq!(output.cast::<f32>(tap.readback), row.repeat(2), "{pass} with {sharing:?}");
            assert!(output.passes.iter().any(|ran| *ran.name == *format!("tap {pass}")), "{:?}", output.passes);
        }
    }
}

#[test]
fn executed_frames_have_a_page_and_a_trace() {
    let Some(mut executor) = executor() else { return };
    let paint = paint();
    let declaration = frame(&paint).declaration().unwrap();
    let plan = frame(&paint).plan(&lightloom_graph::PlanOptions::default()).unwrap();
    let mut profile = Profile::new("the adapter");
    for _ in 0..3 {
        profile.add("taps", &executor.execute(frame(&paint)).unwrap());
    }
    let page = to_html(&declaration, &plan, Some(&profile));
    assert!(page.contains("the adapter") && page.contains("median of 3 frames") || profile.medians().is_empty(), "no times");
    let trace = to_chrome_trace(&profile);
    let events = trace["traceEvents"].as_array().unwrap();
    let plans: Vec<&str> = events.iter().filter(|e| e["name"] == "plan").filter_map(|e| e["args"]["from"].as_str()).collect();
    assert_eq!(plans.len(), 3);
    assert_eq!(plans[1..], ["the cache"; 2], "the second and the third frame are as the first: {plans:?}");
}
