//! Frames that are planned and fail when they run. `None`: there is no adapter to run them on.

use super::frames::one;
use lightloom_graph::{BufferDesc, Executor, Gpu, Graph, GraphError, Load, RasterShader, TextureDesc, wgpu};
use std::ops::ControlFlow;

pub(super) const FILE: &str = file!();

/// The error with which the frame fails on a device of its own.
fn run(declare: impl FnOnce(&mut Graph<'_>, &wgpu::Device)) -> Option<GraphError> {
    let mut executor = Executor::new(&Gpu::for_tests()?);
    let mut graph = Graph::new("frame");
    declare(&mut graph, executor.device());
    Some(executor.execute_observed(graph, &mut |_| ControlFlow::Break(())).expect_err("the frame is wrong"))
}

pub(super) fn import_missing() -> Option<GraphError> {
    run(|graph, _| {
        let words = graph.import_buffer("words", BufferDesc::words(4), None);
        graph.readback_buffer(&words);
    })
}

pub(super) fn import_mismatch() -> Option<GraphError> {
    run(|graph, device| {
        let usage = wgpu::BufferUsages::COPY_SRC;
        let object = device.create_buffer(&wgpu::BufferDescriptor { label: None, size: 8, usage, mapped_at_creation: false });
        let words = graph.import_buffer("words", BufferDesc::words(4), object);
        graph.readback_buffer(&words);
    })
}

pub(super) fn limit() -> Option<GraphError> {
    run(|graph, _| {
        let mut words = graph.buffer("words", BufferDesc::bytes((256 << 20) + 4));
        graph.clear_buffer(&mut words);
        graph.keep(&words);
    })
}

pub(super) fn format_usage() -> Option<GraphError> {
    let draw = RasterShader::from_wgsl(
        "draw",
        "struct Output { @location(0) color: vec4f }
        @vertex fn draw_vertex() -> @builtin(position) vec4f { return vec4f(0.0); }
        @fragment fn draw_fragment() -> Output { return Output(vec4f(0.0)); }",
    );
    run(|graph, _| {
        let mut snorm = graph.texture("snorm", TextureDesc::new_2d([4, 4], wgpu::TextureFormat::Rgba8Snorm));
        graph.raster(&draw.unwrap()).color("color", &mut snorm, Load::Clear([0.0; 4])).draw(3, 1);
        graph.keep(&snorm);
    })
}

pub(super) fn ray_query() -> Option<GraphError> {
    run(|graph, _| {
        let structure = graph.import_tlas("scene", None);
        graph.closure("trace").read(&structure).side_effect().record(|_| Ok(()));
    })
}

pub(super) fn closure() -> Option<GraphError> {
    run(|graph, _| graph.closure("fails").side_effect().record(|_| Err("no such file".to_owned())))
}

pub(super) fn gpu() -> Option<GraphError> {
    run(|graph, _| {
        let mut words = graph.buffer("words", BufferDesc::words(4));
        graph.closure("too long").write(&mut words).side_effect().record(|context| {
            let words = context.buffer("words")?;
            context.encoder().clear_buffer(&words, 0, Some(1 << 20));
            Ok(())
        });
    })
}

/// A device that is gone: here it was destroyed.
pub(super) fn device_lost() -> Option<GraphError> {
    run(|graph, device| {
        device.destroy();
        let mut words = graph.buffer("words", BufferDesc::words(4));
        graph.clear_buffer(&mut words);
        graph.readback_buffer(&words);
    })
}

pub(super) fn cancelled() -> Option<GraphError> {
    let shader = one("@group(0) @binding(0) var<storage, read_write> words: array<u32>; fn body() { words[0] = 1u; }");
    run(|graph, _| {
        let mut words = graph.buffer("words", BufferDesc::words(4));
        graph.compute(&shader).write("words", &mut words).heavy().dispatch([1, 1, 1]);
        graph.readback_buffer(&words);
    })
}
