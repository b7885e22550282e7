//! Every kind of pass, run on a device.

use crate::{Amount, executor, fill, kernel};
use lightloom_graph::{
    BufferDesc, ComputeShader, Executor, Gpu, Graph, GraphError, Load, RasterShader, Sampler, TextureDesc, TimingSource,
    wgpu::{self, TextureFormat},
};
use std::ops::ControlFlow;

const N: u32 = 1000;

fn amount(value: f32) -> Amount {
    Amount { value, count: N }
}

#[test]
fn compute_copies_and_clears() {
    let Some(mut executor) = executor() else { return };
    let (fill, scale) = (fill(), kernel("scale", "params.value * x"));
    let mut graph = Graph::new("compute");
    let mut a = graph.buffer("a", BufferDesc::words(N.into()));
    let mut b = graph.buffer("b", BufferDesc::words(N.into()));
    let mut c = graph.buffer("c", BufferDesc::words(N.into()));
    let mut zero = graph.buffer("zero", BufferDesc::words(N.into()));
    graph.compute(&fill).params(&amount(5.0)).write("words", &mut a).dispatch_1d(N);
    graph.compute(&scale).params(&amount(2.0)).read("source_words", &a).write("target_words", &mut b).dispatch_threads([N, 1, 1]);
    graph.copy_buffer(&b, &mut c);
    graph.clear_buffer(&mut zero);
    let (read_c, read_zero) = (graph.readback_buffer(&c), graph.readback_buffer(&zero));
    let output = executor.execute(graph).unwrap();
    let expected: Vec<f32> = (0..N).map(|i| 2.0 * (5.0 + i as f32)).collect();
    assert_eq!(output.cast::<f32>(read_c), expected);
    assert_eq!(output.cast::<u32>(read_zero), vec![0; N as usize]);
    assert_eq!(output.passes.len(), 6, "two kernels, a copy, a clear, two readbacks");
}

#[test]
fn params_of_many_passes_share_a_buffer() {
    let Some(mut executor) = executor() else { return };
    let add = kernel("add", "x + params.value");
    let fill = fill();
    // More passes in the second frame, so that the uniform buffer must grow.
    for count in [3_u32, 40] {
        let mut graph = Graph::new("params");
        let mut now = graph.buffer("start", BufferDesc::words(N.into()));
        graph.compute(&fill).params(&amount(0.0)).write("words", &mut now).dispatch_1d(N);
        for i in 0..count {
            let mut next = graph.buffer("step", BufferDesc::words(N.into()));
            graph
                .compute(&add)
                .params(&amount(i as f32))
                .read("source_words", &now)
                .write("target_words", &mut next)
                .dispatch_1d(N);
            now = next;
        }
        let read = graph.readback_buffer(&now);
        let output = executor.execute(graph).unwrap();
        let sum = (0..count).sum::<u32>() as f32;
        assert_eq!(output.cast::<f32>(read), (0..N).map(|i| i as f32 + sum).collect::<Vec<_>>());
        assert_eq!(&*output.passes[1].name, "add");
        assert_eq!(&*output.passes[2].name, "add#2", "passes of one name are told apart");
    }
}

#[test]
fn atomics_need_a_cleared_buffer_and_count() {
    let Some(mut executor) = executor() else { return };
    let count = ComputeShader::from_wgsl(
        "count",
        "@group(0) @binding(0) var<storage, read_write> total: atomic<u32>;
        @compute @workgroup_size(64) fn count() { atomicAdd(&total, 1u); }",
    )
    .unwrap();
    let mut graph = Graph::new("atomics");
    let mut total = graph.buffer("total", BufferDesc::words(1));
    graph.clear_buffer(&mut total);
    graph.compute(&count).write("total", &mut total).dispatch([3, 1, 1]);
    graph.compute(&count).write("total", &mut total).dispatch([1, 2, 1]);
    let read = graph.readback_buffer(&total);
    assert_eq!(executor.execute(graph).unwrap().cast::<u32>(read), [5 * 64]);
}

fn triangles() -> RasterShader {
    // Two full-screen triangles; instance 0 is blue at depth 0.75, instance 1 is red at 0.25 and covers the left half.
    RasterShader::from_wgsl(
        "cover",
        "struct Varying { @builtin(position) position: vec4f, @location(0) @interpolate(flat) instance: u32 }
        struct Output { @location(0) color: vec4f, @location(1) id: u32 }
        @vertex fn cover_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Varying {
            let corner = vec2f(f32(vertex & 1u), f32(vertex >> 1u)) * 4.0 - 1.0;
            let right = select(corner.x, min(corner.x, 0.0), instance == 1u);
            var out: Varying;
            out.position = vec4f(select(corner.x, corner.x, instance == 0u), corner.y, select(0.25, 0.75, instance == 0u), 1.0);
            out.instance = instance;
            return out;
        }
        @fragment fn cover_fragment(v: Varying) -> Output {
            if v.instance == 1u && v.position.x > 2.0 { discard; }
            return Output(select(vec4f(1.0, 0.0, 0.0, 1.0), vec4f(0.0, 0.0, 1.0, 1.0), v.instance == 0u), v.instance + 7u);
        }",
    )
    .unwrap()
}

#[test]
fn raster_with_depth_two_targets_and_padded_rows() {
    let Some(mut executor) = executor() else { return };
    let shader = triangles();
    let mut graph = Graph::new("raster");
    let size = [5, 3];
    let mut color = graph.texture("color", TextureDesc::new_2d(size, TextureFormat::Rgba8Unorm));
    let mut id = graph.texture("id", TextureDesc::new_2d(size, TextureFormat::R32Uint));
    let mut depth = graph.texture("depth", TextureDesc::new_2d(size, TextureFormat::Depth32Float));
    graph
        .raster(&shader)
        .color("color", &mut color, Load::Clear([0.0; 4]))
        .color("id", &mut id, Load::Clear([0.0; 4]))
        .depth(&mut depth, Load::ClearDepth(1.0))
        .draw(3, 2);
    let (color, id, depth) = (graph.readback_texture(&color), graph.readback_texture(&id), graph.readback_texture(&depth));
    let output = executor.execute(graph).unwrap();
    let left = |i: usize| i % 5 < 2;
    let expected: Vec<[u8; 4]> = (0..15).map(|i| if left(i) { [255, 0, 0, 255] } else { [0, 0, 255, 255] }).collect();
    assert_eq!(output.cast::<[u8; 4]>(color), expected, "5 texels of 4 bytes: rows are 20 bytes, copied at 256");
    assert_eq!(output.cast::<u32>(id), (0..15).map(|i| if left(i) { 8 } else { 7 }).collect::<Vec<_>>());
    assert_eq!(output.cast::<f32>(depth), (0..15).map(|i| if left(i) { 0.25 } else { 0.75 }).collect::<Vec<_>>());
}

#[test]
fn a_raster_pass_can_keep_and_blend() {
    let Some(mut executor) = executor() else { return };
    let shader = RasterShader::from_wgsl(
        "add",
        "struct Output { @location(0) sum: vec4f }
        @vertex fn add_vertex(@builtin(vertex_index) v: u32) -> @builtin(position) vec4f {
            return vec4f(vec2f(f32(v & 1u), f32(v >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
        }
        @fragment fn add_fragment() -> Output { return Output(vec4f(1.0, 2.0, 3.0, 4.0)); }",
    )
    .unwrap()
    .with_blend(wgpu::BlendState {
        color: wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        },
        alpha: wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        },
    });
    let mut graph = Graph::new("blend");
    let mut sum = graph.texture("sum", TextureDesc::new_2d([2, 2], TextureFormat::Rgba16Float));
    graph.raster(&shader).color("sum", &mut sum, Load::Clear([1.0, 0.0, 0.0, 0.0])).draw(3, 2);
    graph.raster(&shader).color("sum", &mut sum, Load::Keep).draw(3, 1);
    let mut wide = graph.texture("wide", TextureDesc::new_2d([2, 2], TextureFormat::Rgba32Float));
    let widen = ComputeShader::from_wgsl(
        "widen",
        "@group(0) @binding(0) var narrow: texture_2d<f32>;
        @group(0) @binding(1) var wide: texture_storage_2d<rgba32float, write>;
        @compute @workgroup_size(8, 8) fn widen(@builtin(global_invocation_id) id: vec3u) {
            if all(id.xy < textureDimensions(narrow)) { textureStore(wide, id.xy, textureLoad(narrow, id.xy, 0)); }
        }",
    )
    .unwrap();
    graph.compute(&widen).read("narrow", &sum).write("wide", &mut wide).dispatch_threads([2, 2, 1]);
    let read = graph.readback_texture(&wide);
    assert_eq!(executor.execute(graph).unwrap().cast::<[f32; 4]>(read), [[4.0, 6.0, 9.0, 12.0]; 4]);
}

#[test]
fn cull_mode_drops_back_faces() {
    let Some(mut executor) = executor() else { return };
    // Clockwise on screen: a back face.
    let shader = RasterShader::from_wgsl(
        "back",
        "struct Output { @location(0) color: vec4f }
        @vertex fn back_vertex(@builtin(vertex_index) v: u32) -> @builtin(position) vec4f {
            return vec4f(vec2f(f32(v >> 1u), f32(v & 1u)) * 4.0 - 1.0, 0.0, 1.0);
        }
        @fragment fn back_fragment() -> Output { return Output(vec4f(1.0)); }",
    )
    .unwrap();
    for (face, expected) in [(None, 255), (Some(wgpu::Face::Front), 255), (Some(wgpu::Face::Back), 0)] {
        let mut graph = Graph::new("cull");
        let mut color = graph.texture("color", TextureDesc::new_2d([1, 1], TextureFormat::R8Unorm));
        graph.raster(&shader.clone().with_cull(face)).color("color", &mut color, Load::Clear([0.0; 4])).draw(3, 1);
        let read = graph.readback_texture(&color);
        assert_eq!(executor.execute(graph).unwrap().bytes(read), [expected], "{face:?}");
    }
}

#[test]
fn a_sampler_filters_and_overrides_apply() {
    let Some(mut executor) = executor() else { return };
    let shader = ComputeShader::from_wgsl(
        "sample",
        "override bias_value: f32 = 0.0;
        override width: u32;
        @group(0) @binding(0) var image: texture_2d<f32>;
        @group(0) @binding(1) var smooth_sampler: sampler;
        @group(1) @binding(3) var<storage, read_write> result: array<f32>;
        @compute @workgroup_size(width) fn sample(@builtin(local_invocation_index) i: u32) {
            result[i] = textureSampleLevel(image, smooth_sampler, vec2f(0.5), 0.0).x + bias_value;
        }",
    )
    .unwrap()
    .with_constant("width", 4.0)
    .unwrap()
    .with_constant("bias_value", 10.0)
    .unwrap();
    assert_eq!(shader.workgroup_size(), [4, 1, 1], "an override sets the workgroup size");
    let paint = ComputeShader::from_wgsl(
        "paint",
        "@group(0) @binding(0) var image: texture_storage_2d<rgba16float, write>;
        @compute @workgroup_size(2, 1) fn paint(@builtin(global_invocation_id) id: vec3u) {
            textureStore(image, id.xy, vec4f(f32(id.x)));
        }",
    )
    .unwrap();
    let mut graph = Graph::new("sampler");
    let mut image = graph.texture("image", TextureDesc::new_2d([2, 1], TextureFormat::Rgba16Float));
    let mut result = graph.buffer("result", BufferDesc::words(4));
    graph.compute(&paint).write("image", &mut image).dispatch([1, 1, 1]);
    graph
        .compute(&shader)
        .read("image", &image)
        .sampler("smooth_sampler", Sampler::LINEAR_CLAMP)
        .write("result", &mut result)
        .dispatch_threads([4, 1, 1]);
    let read = graph.readback_buffer(&result);
    assert_eq!(executor.execute(graph).unwrap().cast::<f32>(read), [10.5; 4], "half way between 0 and 1, plus the bias");
}

#[test]
fn a_view_in_another_format_decodes_srgb() {
    let Some(mut executor) = executor() else { return };
    let desc = TextureDesc::new_2d([2, 1], TextureFormat::Rgba8Unorm).layers(2).view_format(TextureFormat::Rgba8UnormSrgb);
    let texture = executor.device().create_texture(&wgpu::TextureDescriptor {
        label: Some("texels"),
        size: wgpu::Extent3d { width: 2, height: 1, depth_or_array_layers: 2 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[TextureFormat::Rgba8UnormSrgb],
    });
    executor.queue().write_texture(
        texture.as_image_copy(),
        &[128; 16],
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(8), rows_per_image: Some(1) },
        wgpu::Extent3d { width: 2, height: 1, depth_or_array_layers: 2 },
    );
    let shader = ComputeShader::from_wgsl(
        "both",
        "@group(0) @binding(0) var texels: texture_2d_array<f32>;
        @group(0) @binding(1) var texels_srgb: texture_2d_array<f32>;
        @group(0) @binding(2) var<storage, read_write> result: array<f32>;
        @compute @workgroup_size(1) fn both() {
            result[0] = textureLoad(texels, vec2u(1u, 0u), 1u, 0).x;
            result[1] = textureLoad(texels_srgb, vec2u(1u, 0u), 1u, 0).x;
        }",
    )
    .unwrap();
    let mut graph = Graph::new("views");
    let texels = graph.import_texture("texels", desc, texture);
    let mut result = graph.buffer("result", BufferDesc::words(2));
    graph
        .compute(&shader)
        .read("texels", &texels)
        .read_as("texels_srgb", &texels, TextureFormat::Rgba8UnormSrgb)
        .write("result", &mut result)
        .dispatch([1, 1, 1]);
    let read = graph.readback_buffer(&result);
    let values = executor.execute(graph).unwrap().cast::<f32>(read);
    let linear = ((128.0 / 255.0_f64 + 0.055) / 1.055).powf(2.4);
    assert!((f64::from(values[0]) - 128.0 / 255.0).abs() < 1e-6, "{values:?}");
    // The driver's sRGB table is allowed half a step of 8 bits.
    assert!((f64::from(values[1]) - linear).abs() < 0.5 / 255.0, "{values:?} against {linear}");
}

#[test]
fn history_is_last_frames_current() {
    let Some(mut executor) = executor() else { return };
    let add = kernel("add", "x + params.value");
    let frame = |executor: &mut Executor, words: u64| {
        let mut graph = Graph::new("history");
        let mut total = graph.history_buffer("total", BufferDesc::words(words));
        graph
            .compute(&add)
            .params(&amount(1.0))
            .read("source_words", &total.previous)
            .write("target_words", &mut total.current)
            .dispatch_1d(N);
        let read = graph.readback_buffer(&total.current);
        executor.execute(graph).unwrap().cast::<f32>(read)[0]
    };
    let words = u64::from(N);
    assert_eq!([1, 2, 3].map(|_| frame(&mut executor, words)), [1.0, 2.0, 3.0]);
    assert_eq!(frame(&mut executor, words + 1), 1.0, "a new description begins at zero");
    assert_eq!(frame(&mut executor, words + 1), 2.0);
    executor.reset_history();
    assert_eq!(frame(&mut executor, words + 1), 1.0, "reset begins at zero");
    // Another graph on the same executor has its own history of the same name, and leaves this one alone.
    let mut other = Graph::new("other");
    let mut total = other.history_buffer("total", BufferDesc::words(words + 1));
    other.clear_buffer(&mut total.current);
    executor.execute(other).unwrap();
    assert_eq!(frame(&mut executor, words + 1), 2.0);
}

#[test]
fn history_textures_survive_a_frame_that_does_not_write_them() {
    let Some(mut executor) = executor() else { return };
    let paint = ComputeShader::from_wgsl(
        "paint",
        "@group(0) @binding(0) var image: texture_storage_2d<r32float, write>;
        @compute @workgroup_size(1) fn paint() { textureStore(image, vec2u(0u), vec4f(9.0)); }",
    )
    .unwrap();
    let mut frame = |write: bool| {
        let mut graph = Graph::new("texture history");
        let mut image = graph.history_texture("image", TextureDesc::new_2d([1, 1], TextureFormat::R32Float));
        if write {
            graph.compute(&paint).write("image", &mut image.current).dispatch([1, 1, 1]);
        }
        let read = graph.readback_texture(&image.previous);
        executor.execute(graph).unwrap().cast::<f32>(read)
    };
    assert_eq!(frame(true), [0.0]);
    assert_eq!(frame(false), [9.0]);
    assert_eq!(frame(true), [9.0]);
}

#[test]
fn closures_record_their_own_commands() {
    let Some(mut executor) = executor() else { return };
    let mut called = false;
    let mut graph = Graph::new("closure");
    let mut a = graph.buffer("a", BufferDesc::words(4));
    let mut b = graph.buffer("b", BufferDesc::words(4));
    graph.clear_buffer(&mut a);
    graph.closure("by hand").read(&a).write(&mut b).record(|context| {
        called = true;
        let (a, b) = (context.buffer("a")?, context.buffer("b")?);
        assert!(context.texture("a").is_err(), "it is a buffer");
        context.encoder().copy_buffer_to_buffer(&a, 0, &b, 0, 16);
        Ok(())
    });
    graph.closure("never").read(&a).record(|_| panic!("culled passes are not called"));
    let read = graph.readback_buffer(&b);
    let output = executor.execute(graph).unwrap();
    assert_eq!(output.cast::<u32>(read), [0; 4]);
    assert_eq!(output.culled.len(), 1);
    assert!(called, "the closure ran");
}

#[test]
fn a_closure_puts_command_buffers_between_its_own_commands() {
    let Some(mut executor) = executor() else { return };
    let mut graph = Graph::new("closure");
    let [mut a, mut b, mut c, mut d] = ["a", "b", "c", "d"].map(|name| graph.buffer(name, BufferDesc::words(N.into())));
    graph.compute(&fill()).params(&amount(5.0)).write("words", &mut a).dispatch_1d(N);
    let (copies, bytes) = (wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST, 4 * u64::from(N));
    let pass = graph.closure("in three").read(&a).write_as(&mut b, copies).write_as(&mut c, copies).write(&mut d);
    pass.record(move |context| {
        let [a, b, c, d] = [context.buffer("a")?, context.buffer("b")?, context.buffer("c")?, context.buffer("d")?];
        context.encoder().copy_buffer_to_buffer(&a, 0, &b, 0, bytes);
        let mut between = context.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        between.copy_buffer_to_buffer(&b, 0, &c, 0, bytes);
        context.insert(between.finish());
        context.encoder().copy_buffer_to_buffer(&c, 0, &d, 0, bytes);
        Ok(())
    });
    let read = graph.readback_buffer(&d);
    let output = executor.execute(graph).unwrap();
    let expected: Vec<f32> = (0..N).map(|i| 5.0 + i as f32).collect();
    assert!(output.cast::<f32>(read) == expected, "each copies what the one before it wrote");
}

#[test]
fn a_closures_error_names_the_pass() {
    let Some(mut executor) = executor() else { return };
    let mut graph = Graph::new("closure");
    graph.closure("fails").side_effect().record(|_| Err("no such file".to_owned()));
    let error = executor.execute(graph).unwrap_err();
    assert!(
        matches!(&error, GraphError::Closure { at, message } if at.pass() == "fails" && message == "no such file"),
        "{error}"
    );
    // And what wgpu refuses inside a closure is an error too, not a panic.
    let mut graph = Graph::new("closure");
    let mut a = graph.buffer("a", BufferDesc::words(4));
    graph.closure("too long").write(&mut a).side_effect().record(|context| {
        let a = context.buffer("a")?;
        context.encoder().clear_buffer(&a, 0, Some(1 << 20));
        Ok(())
    });
    let error = executor.execute(graph).unwrap_err();
    assert!(matches!(&error, GraphError::Gpu { .. }), "{error}");
    let mut graph = Graph::new("closure");
    let mut a = graph.buffer("a", BufferDesc::words(4));
    graph.clear_buffer(&mut a);
    let read = graph.readback_buffer(&a);
    assert_eq!(executor.execute(graph).unwrap().cast::<u32>(read), [0; 4], "the executor still works");
}

#[test]
fn textures_copy_with_mips_and_layers() {
    let Some(mut executor) = executor() else { return };
    let paint = ComputeShader::from_wgsl(
        "paint",
        "@group(0) @binding(0) var image: texture_storage_2d_array<r32float, write>;
        @compute @workgroup_size(4, 4) fn paint(@builtin(global_invocation_id) id: vec3u) {
            textureStore(image, id.xy, id.z, vec4f(f32(id.x + 10u * id.y + 100u * id.z)));
        }",
    )
    .unwrap();
    let mut graph = Graph::new("copy");
    let desc = TextureDesc::new_2d([4, 4], TextureFormat::R32Float).layers(3);
    let mut from = graph.texture("from", desc.clone());
    let mut to = graph.texture("to", desc);
    graph.compute(&paint).write("image", &mut from).dispatch([1, 1, 3]);
    graph.copy_texture(&from, &mut to);
    let read = graph.readback_texture(&to);
    let expected: Vec<f32> = (0..48).map(|i| (i % 4 + 10 * (i / 4 % 4) + 100 * (i / 16)) as f32).collect();
    assert_eq!(executor.execute(graph).unwrap().cast::<f32>(read), expected);
}

#[test]
fn heavy_passes_report_progress_and_can_be_cancelled() {
    let Some(mut executor) = executor() else { return };
    let (fill, add) = (fill(), kernel("add", "x + params.value"));
    let build = || {
        let mut graph = Graph::new("heavy");
        let mut total = graph.history_buffer("total", BufferDesc::words(N.into()));
        let mut a = graph.buffer("a", BufferDesc::words(N.into()));
        let mut b = graph.buffer("b", BufferDesc::words(N.into()));
        graph.compute(&fill).params(&amount(0.0)).write("words", &mut a).dispatch_1d(N);
        graph
            .compute(&add)
            .name("first")
            .params(&amount(1.0))
            .read("source_words", &a)
            .write("target_words", &mut b)
            .heavy()
            .dispatch_1d(N);
        graph
            .compute(&add)
            .name("second")
            .params(&amount(1.0))
            .read("source_words", &b)
            .write("target_words", &mut total.current)
            .heavy()
            .dispatch_1d(N);
        let read = graph.readback_buffer(&total.previous);
        (graph, read)
    };
    let mut seen = Vec::new();
    let (graph, read) = build();
    executor
        .execute_observed(graph, &mut |progress| {
            seen.push((progress.done, progress.total, progress.pass.to_owned()));
            ControlFlow::Continue(())
        })
        .unwrap();
    assert_eq!(seen.len(), 3, "after each heavy pass and at the end: {seen:?}");
    assert_eq!(seen[0], (2, 4, "first".to_owned()));
    assert_eq!(seen[2].0, 4);
    let _ = read;
    let (graph, _) = build();
    let error = executor.execute_observed(graph, &mut |_| ControlFlow::Break(())).unwrap_err();
    assert_eq!(error, GraphError::Cancelled { done: 2, total: 4 });
    let (graph, read) = build();
    let previous = executor.execute(graph).unwrap().cast::<f32>(read);
    assert_eq!(previous[3], 5.0, "a cancelled frame leaves the history of the last whole one");
}

#[test]
fn passes_are_timed_from_either_source() {
    let Some(mut executor) = executor() else { return };
    let (fill, scale, shader) = (fill(), kernel("scale", "params.value * x"), triangles());
    let frame = |executor: &mut Executor| {
        let mut graph = Graph::new("times");
        let mut a = graph.buffer("a", BufferDesc::words(N.into()));
        let mut b = graph.buffer("b", BufferDesc::words(N.into()));
        let mut color = graph.texture("color", TextureDesc::new_2d([64, 64], TextureFormat::Rgba8Unorm));
        let mut id = graph.texture("id", TextureDesc::new_2d([64, 64], TextureFormat::R32Uint));
        graph.compute(&fill).params(&amount(5.0)).write("words", &mut a).dispatch_1d(N);
        graph.compute(&scale).params(&amount(2.0)).read("source_words", &a).write("target_words", &mut b).heavy().dispatch_1d(N);
        graph
            .raster(&shader)
            .color("color", &mut color, Load::Clear([0.0; 4]))
            .color("id", &mut id, Load::Clear([0.0; 4]))
            .draw(3, 2);
        graph.readback_buffer(&b);
        graph.readback_texture(&color);
        executor.execute(graph).unwrap()
    };
    for source in [TimingSource::CpuPerPass, TimingSource::Timestamps] {
        executor.set_timing_source(source);
        let output = frame(&mut executor);
        if output.timing_source == TimingSource::None {
            println!("SKIPPED: the adapter has no timestamps");
            continue;
        }
        for pass in &output.passes[..3] {
            assert!(pass.gpu_ms.is_some_and(|ms| (0.0..60_000.0).contains(&ms)), "{source:?}: {pass:?}");
        }
    }
    executor.set_timing(false);
    let output = frame(&mut executor);
    assert_eq!(output.timing_source, TimingSource::None);
    assert!(output.passes.iter().all(|pass| pass.gpu_ms.is_none()), "timing is off");
}

#[test]
fn memory_does_not_grow_over_frames() {
    let Some(mut executor) = executor() else { return };
    executor.set_timing(false);
    let (fill, scale) = (fill(), kernel("scale", "params.value * x"));
    let mut objects = Vec::new();
    for number in 0..200_u32 {
        let mut graph = Graph::new("frames");
        let mut a = graph.buffer("a", BufferDesc::words(N.into()));
        let mut b = graph.buffer("b", BufferDesc::words(N.into()));
        graph.compute(&fill).params(&amount(number as f32)).write("words", &mut a).dispatch_1d(N);
        graph.compute(&scale).params(&amount(2.0)).read("source_words", &a).write("target_words", &mut b).dispatch_1d(N);
        let read = graph.readback_buffer(&b);
        let output = executor.execute(graph).unwrap();
        assert_eq!(output.cast::<f32>(read)[1], 2.0 * (number as f32 + 1.0));
        assert_eq!(output.cached_plan, number > 0, "planned once: {}", output.plan_reason);
        objects.push((output.pool_objects, output.held_bytes));
    }
    assert_eq!(objects[0], (2, 8000));
    assert!(objects.iter().all(|o| *o == objects[0]), "the pool is steady: {:?}", objects.last());
    // Frames of ever new sizes: what is idle goes.
    for words in 1..50 {
        let mut graph = Graph::new("sizes");
        let mut a = graph.buffer("a", BufferDesc::words(words));
        graph.clear_buffer(&mut a);
        graph.readback_buffer(&a);
        let output = executor.execute(graph).unwrap();
        assert!(output.pool_objects <= 10, "{} objects", output.pool_objects);
    }
}

#[test]
fn a_lost_device_is_an_error() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut executor = Executor::new(&gpu);
    let mut second = Executor::new(&gpu);
    let frame = || {
        let mut graph = Graph::new("lost");
        let mut a = graph.buffer("a", BufferDesc::words(4));
        graph.clear_buffer(&mut a);
        graph.readback_buffer(&a);
        graph
    };
    executor.execute(frame()).unwrap();
    gpu.device.destroy();
    for _ in 0..3 {
        let error = executor.execute(frame()).unwrap_err();
        assert!(matches!(error, GraphError::DeviceLost { .. }), "{error}");
        let error = second.execute(frame()).unwrap_err();
        assert!(matches!(error, GraphError::DeviceLost { .. }), "every executor of the device knows: {error}");
    }
}

#[test]
fn a_device_lost_during_a_frame_is_an_error() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut executor = Executor::new(&gpu);
    let device = gpu.device.clone();
    let mut graph = Graph::new("lost on the way");
    let mut a = graph.buffer("a", BufferDesc::words(4));
    graph.clear_buffer(&mut a);
    graph.closure("pulls the plug").read(&a).side_effect().record(move |_| {
        device.destroy();
        Ok(())
    });
    graph.compute(&fill()).params(&amount(0.0)).write("words", &mut a).heavy().dispatch_1d(4);
    graph.readback_buffer(&a);
    let error = executor.execute(graph).unwrap_err();
    assert!(matches!(error, GraphError::DeviceLost { .. }), "{error}");
}

#[test]
fn frames_beyond_the_device_are_refused_before_anything_is_created() {
    let Some(mut executor) = executor() else { return };
    let limits = executor.device().limits();
    let mut check = |name: &str, limit: &str, declare: &mut dyn FnMut(&mut Graph<'_>)| {
        let mut graph = Graph::new("limits");
        declare(&mut graph);
        let error = executor.execute(graph).unwrap_err();
        assert!(
            matches!(&error, GraphError::Limit { what, limit: found, .. } if what.contains(name) && *found == limit),
            "{error}"
        );
    };
    check("`huge`", "max_buffer_size", &mut |graph| {
        let mut huge = graph.buffer("huge", BufferDesc::bytes(limits.max_buffer_size + 4));
        graph.clear_buffer(&mut huge);
        graph.keep(&huge);
    });
    check("`bound`", "max_storage_buffer_binding_size", &mut |graph| {
        let mut bound = graph.buffer("bound", BufferDesc::bytes(limits.max_storage_buffer_binding_size + 4));
        graph.compute(&fill()).params(&amount(0.0)).write("words", &mut bound).dispatch_1d(N);
        graph.keep(&bound);
    });
    let side = limits.max_texture_dimension_2d + 1;
    check("`wide`", "max_texture_dimension_2d", &mut |graph| {
        let mut wide = graph.texture("wide", TextureDesc::new_2d([side, 1], TextureFormat::Rgba8Unorm));
        let mut id = graph.texture("id", TextureDesc::new_2d([side, 1], TextureFormat::R32Uint));
        graph
            .raster(&triangles())
            .color("color", &mut wide, Load::Clear([0.0; 4]))
            .color("id", &mut id, Load::Clear([0.0; 4]))
            .draw(3, 1);
        graph.keep(&wide);
    });
    check("`fill`", "max_compute_workgroups_per_dimension", &mut |graph| {
        let mut words = graph.buffer("words", BufferDesc::words(4));
        graph.compute(&fill()).params(&amount(0.0)).write("words", &mut words).dispatch([
            limits.max_compute_workgroups_per_dimension + 1,
            1,
            1,
        ]);
        graph.keep(&words);
    });
    let wide = ComputeShader::from_wgsl(
        "wide",
        "override width: u32 = 4096;
        @group(0) @binding(0) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(width) fn wide(@builtin(local_invocation_index) i: u32) { words[i] = i; }",
    )
    .unwrap();
    check("`wide`", "max_compute_workgroup_size_x", &mut |graph| {
        let mut words = graph.buffer("words", BufferDesc::words(4096));
        graph.compute(&wide).write("words", &mut words).dispatch([1, 1, 1]);
        graph.keep(&words);
    });
    let lines = |line: &dyn Fn(usize) -> String| (0..9).map(line).collect::<Vec<_>>().join("\n");
    let bindings = lines(&|i| format!("@group(0) @binding({i}) var<storage, read_write> b{i}: array<u32>;"));
    let body = lines(&|i| format!("b{i}[0] = 1u;"));
    let many =
        ComputeShader::from_wgsl("many", &format!("{bindings} @compute @workgroup_size(1) fn many() {{ {body} }}")).unwrap();
    check("`many`", "max_storage_buffers_per_shader_stage", &mut |graph| {
        let mut buffers: Vec<_> = (0..9).map(|i| graph.buffer(&format!("b{i}"), BufferDesc::words(1))).collect();
        buffers
            .iter_mut()
            .enumerate()
            .fold(graph.compute(&many), |pass, (i, b)| pass.write(&format!("b{i}"), b))
            .dispatch([1, 1, 1]);
        graph.keep(&buffers[0]);
    });
    let mut graph = Graph::new("formats");
    let mut snorm = graph.texture("snorm", TextureDesc::new_2d([4, 4], TextureFormat::Rgba8Snorm));
    let shader = RasterShader::from_wgsl(
        "one",
        "struct Output { @location(0) color: vec4f }
        @vertex fn one_vertex() -> @builtin(position) vec4f { return vec4f(0.0); }
        @fragment fn one_fragment() -> Output { return Output(vec4f(0.0)); }",
    )
    .unwrap();
    graph.raster(&shader).color("color", &mut snorm, Load::Clear([0.0; 4])).draw(3, 1);
    graph.keep(&snorm);
    let error = executor.execute(graph).unwrap_err();
    assert!(matches!(&error, GraphError::FormatUsage { resource, .. } if resource == "snorm"), "{error}");
}

#[test]
fn imports_are_compared_with_their_objects() {
    let Some(mut executor) = executor() else { return };
    let buffer = |size, usage| {
        executor.device().create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
    };
    let storage = wgpu::BufferUsages::STORAGE;
    let cases: [(Option<wgpu::Buffer>, &str); 3] = [
        (None, "has no wgpu object"),
        (Some(buffer(8, storage)), "has 8"),
        (Some(buffer(4000, wgpu::BufferUsages::COPY_DST)), "STORAGE"),
    ];
    for (object, words) in cases {
        let mut graph = Graph::new("imports");
        let mut target = graph.import_buffer("target", BufferDesc::words(N.into()), object);
        graph.compute(&fill()).params(&amount(0.0)).write("words", &mut target).dispatch_1d(N);
        let error = executor.execute(graph).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("`target`") && error.contains("`fill`"), "{error}");
    }
    // What no pass uses is not compared.
    let mut graph = Graph::new("imports");
    graph.import_buffer("idle", BufferDesc::words(1), None);
    executor.execute(graph).unwrap();
}

#[test]
fn an_imported_buffer_is_written_in_place() {
    let Some(mut executor) = executor() else { return };
    let size = u64::from(N) * 4;
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    let object = executor.device().create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false });
    let mut graph = Graph::new("first");
    let mut target = graph.import_buffer("target", BufferDesc::words(N.into()), object.clone());
    graph.compute(&fill()).params(&amount(3.0)).write("words", &mut target).dispatch_1d(N);
    executor.execute(graph).unwrap();
    let mut graph = Graph::new("second");
    let target = graph.import_buffer("target", BufferDesc::words(N.into()), object);
    let read = graph.readback_buffer(&target);
    assert_eq!(executor.execute(graph).unwrap().cast::<f32>(read)[2], 5.0);
}

#[test]
fn an_empty_frame_and_an_empty_dispatch_are_fine() {
    let Some(mut executor) = executor() else { return };
    let output = executor.execute(Graph::new("empty")).unwrap();
    assert!(output.passes.is_empty(), "nothing to do");
    let mut graph = Graph::new("nothing");
    let mut a = graph.buffer("a", BufferDesc::words(4));
    graph.clear_buffer(&mut a);
    graph.compute(&fill()).params(&amount(1.0)).write("words", &mut a).dispatch_1d(0);
    let read = graph.readback_buffer(&a);
    let output = executor.execute(graph).unwrap();
    assert_eq!(output.cast::<u32>(read), [0; 4]);
    let other = executor.execute(Graph::new("empty")).unwrap();
    assert!(other.bytes(read).is_empty(), "a readback belongs to its frame");
}

#[test]
fn running_out_of_memory_is_an_error() {
    let Some(mut executor) = executor() else { return };
    let paint = ComputeShader::from_wgsl(
        "paint",
        "@group(0) @binding(0) var image: texture_storage_2d_array<rgba32float, write>;
        @compute @workgroup_size(1) fn paint() { textureStore(image, vec2u(0u), 0u, vec4f(1.0)); }",
    )
    .unwrap();
    // 256 GiB: within every single limit, beyond every device. The second time must not find the failed object.
    for _ in 0..2 {
        let mut graph = Graph::new("huge");
        let mut image = graph.texture("image", TextureDesc::new_2d([8192, 8192], TextureFormat::Rgba32Float).layers(256));
        graph.compute(&paint).write("image", &mut image).dispatch([1, 1, 1]);
        graph.keep(&image);
        let error = executor.execute(graph).unwrap_err();
        assert!(matches!(&error, GraphError::OutOfMemory { bytes: 0, .. }), "{error}");
    }
    let mut graph = Graph::new("small");
    let mut a = graph.buffer("a", BufferDesc::words(4));
    graph.clear_buffer(&mut a);
    let read = graph.readback_buffer(&a);
    assert_eq!(executor.execute(graph).unwrap().cast::<u32>(read), [0; 4], "the executor still works");
}

#[test]
fn an_executor_can_move_to_another_thread() {
    fn movable<T: Send>(value: T) -> T {
        value
    }
    let Some(mut executor) = executor().map(movable) else { return };
    let passes = std::thread::spawn(move || executor.execute(Graph::new("elsewhere")).unwrap().passes.len()).join().unwrap();
    assert_eq!(passes, 0);
}
