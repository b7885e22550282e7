//! Mips and layers, merged render passes, indirect calls, persistent and optional resources, results in flight, threads.

use crate::{Amount, executor, fill, kernel};
use lightloom_graph::{
    BufferDesc, ComputeShader, Executor, Gpu, Graph, GraphError, Handle, Initial, Load, PlanOptions, RasterShader, Subresources,
    Texture, TextureDesc, TimingSource,
    wgpu::{self, TextureFormat},
};

const WORDS: u64 = 64;
const PARAMS: Amount = Amount { value: 1.0, count: WORDS as u32 };

/// Halves a mip level: each texel is the sum of four.
fn reduce() -> ComputeShader {
    ComputeShader::from_wgsl(
        "reduce",
        "@group(0) @binding(0) var fine: texture_2d<f32>;
        @group(0) @binding(1) var coarse: texture_storage_2d<r32float, write>;
        @compute @workgroup_size(8, 8) fn reduce(@builtin(global_invocation_id) id: vec3u) {
            if any(id.xy >= textureDimensions(coarse)) { return; }
            var sum = 0.0;
            for (var i = 0u; i < 4u; i++) { sum += textureLoad(fine, id.xy * 2u + vec2u(i & 1u, i >> 1u), 0).x; }
            textureStore(coarse, id.xy, vec4f(sum));
        }",
    )
    .unwrap()
}

/// Writes x + 16 y.
fn ramp() -> ComputeShader {
    ComputeShader::from_wgsl(
        "ramp",
        "@group(0) @binding(0) var image: texture_storage_2d<r32float, write>;
        @compute @workgroup_size(8, 8) fn ramp(@builtin(global_invocation_id) id: vec3u) {
            if all(id.xy < textureDimensions(image)) { textureStore(image, id.xy, vec4f(f32(id.x + 16u * id.y))); }
        }",
    )
    .unwrap()
}

/// One texel of a level, or of a layer, as a buffer.
fn probe() -> ComputeShader {
    ComputeShader::from_wgsl(
        "probe",
        "@group(0) @binding(0) var image: texture_2d<f32>;
        @group(0) @binding(1) var<storage, read_write> words: array<f32>;
        @compute @workgroup_size(1) fn probe() {
            words[0] = textureLoad(image, vec2u(0u), 0).x;
            words[1] = f32(textureDimensions(image).x);
            words[2] = f32(textureNumLevels(image));
        }",
    )
    .unwrap()
}

/// A 16 × 16 ramp and its sums in mips 1 to 4.
fn pyramid(graph: &mut Graph<'_>) -> Handle<Texture> {
    let mut pyramid = graph.texture("pyramid", TextureDesc::new_2d([16, 16], TextureFormat::R32Float).mip_levels(5));
    graph.compute(&ramp()).write_at("image", &mut pyramid, Subresources::mip(0)).dispatch_threads([16, 16, 1]);
    for level in 1..5 {
        graph
            .compute(&reduce())
            .read_at("fine", &pyramid, Subresources::mip(level - 1))
            .write_at("coarse", &mut pyramid, Subresources::mip(level))
            .dispatch_threads([16 >> level, 16 >> level, 1]);
    }
    pyramid
}

#[test]
fn a_mip_chain_is_one_texture() {
    let Some(mut executor) = executor() else { return };
    let mut graph = Graph::new("pyramid");
    let pyramid = pyramid(&mut graph);
    let mut words = graph.buffer("words", BufferDesc::words(4));
    graph.compute(&probe()).read_at("image", &pyramid, Subresources::mip(4)).write("words", &mut words).dispatch([1, 1, 1]);
    let read = graph.readback_buffer(&words);
    let plan = graph.plan(&PlanOptions::default()).unwrap();
    assert_eq!(plan.order.len(), 7, "every level is needed: {:?}", plan.culled);
    let output = executor.execute(graph).unwrap();
    let sum = (0..16).map(|y| (0..16).map(|x| x + 16 * y).sum::<u32>()).sum::<u32>();
    assert_eq!(output.cast::<f32>(read)[..3], [sum as f32, 1.0, 1.0], "the last level holds the sum, and is a view of one level");
}

#[test]
fn levels_nothing_reads_are_culled_and_unwritten_ones_refused() {
    let mut graph = Graph::new("pyramid");
    let pyramid = pyramid(&mut graph);
    let mut words = graph.buffer("words", BufferDesc::words(4));
    graph.compute(&probe()).read_at("image", &pyramid, Subresources::mip(2)).write("words", &mut words).dispatch([1, 1, 1]);
    graph.readback_buffer(&words);
    let plan = graph.plan(&PlanOptions::default()).unwrap();
    let culled: Vec<&str> = plan.culled.iter().map(|culled| &*culled.pass).collect();
    assert_eq!(culled, ["reduce#3", "reduce#4"], "levels 3 and 4");
    assert_eq!(plan.culled[0].reason, "writes `pyramid`, read only by `reduce#4`, which writes `pyramid`, which nothing reads");

    let mut graph = Graph::new("hole");
    let mut texture = graph.texture("t", TextureDesc::new_2d([4, 4], TextureFormat::R32Float).mip_levels(3));
    let mut words = graph.buffer("words", BufferDesc::words(4));
    graph.compute(&ramp()).write_at("image", &mut texture, Subresources::mip(0)).dispatch_threads([4, 4, 1]);
    graph.compute(&probe()).read_at("image", &texture, Subresources::mip(1)).write("words", &mut words).dispatch([1, 1, 1]);
    graph.readback_buffer(&words);
    let error = graph.plan(&PlanOptions::default()).unwrap_err().to_string();
    assert!(error.contains("reads `t` (image, mip 1), which nothing wrote"), "{error}");
}

#[test]
fn layers_are_attached_and_read_apart() {
    let Some(mut executor) = executor() else { return };
    let mut graph = Graph::new("layers");
    let mut layers = graph.texture("layers", TextureDesc::new_2d([8, 8], TextureFormat::R32Float).layers(3).mip_levels(2));
    for layer in 0..3 {
        let part = Subresources::mip(1).layer(layer);
        graph.clear_texture_at(&mut layers, part, Load::Clear([f64::from(layer) + 5.0, 0.0, 0.0, 0.0]));
    }
    let mut reads = Vec::new();
    for layer in [2, 0] {
        let mut words = graph.buffer("words", BufferDesc::words(4));
        let part = Subresources::mip(1).layer(layer);
        graph.compute(&probe()).read_at("image", &layers, part).write("words", &mut words).dispatch([1, 1, 1]);
        reads.push(graph.readback_buffer(&words));
    }
    let output = executor.execute(graph).unwrap();
    assert_eq!(output.cast::<f32>(reads[0])[..2], [7.0, 4.0]);
    assert_eq!(output.cast::<f32>(reads[1])[..2], [5.0, 4.0]);
    assert_eq!(output.culled.len(), 1, "the clear of layer 1: {:?}", output.culled);
}

/// Draws a strip from x = `from` (in −1…1) to the right edge, adding 1 to what is there.
fn strip(from: f32) -> RasterShader {
    RasterShader::from_wgsl(
        "strip",
        &format!(
            "struct Output {{ @location(0) color: vec4f }}
            @vertex fn strip_vertex(@builtin(vertex_index) v: u32) -> @builtin(position) vec4f {{
                let corner = vec2f(f32(v & 1u), f32((v >> 1u) & 1u)) * 2.0 - 1.0;
                return vec4f(select({from:?}, 1.0, corner.x > 0.0), corner.y, 0.5, 1.0);
            }}
            @fragment fn strip_fragment() -> Output {{ return Output(vec4f(1.0)); }}"
        ),
    )
    .unwrap()
    .with_blend(wgpu::BlendState {
        color: wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        },
        alpha: wgpu::BlendComponent::REPLACE,
    })
}

#[test]
fn draws_into_one_target_are_one_render_pass_and_clears_are_its_loads() {
    let Some(mut executor) = executor() else { return };
    let mut images = Vec::new();
    for transient in [false, true] {
        executor.set_transient_attachments(transient);
        let mut graph = Graph::new("merged");
        let desc = TextureDesc::new_2d([8, 8], TextureFormat::Rgba16Float);
        let mut image = graph.texture("image", desc.clone());
        let mut depth = graph.texture("depth", TextureDesc::new_2d([8, 8], TextureFormat::Depth32Float));
        graph.clear_texture(&mut image, Load::Clear([4.0, 0.0, 0.0, 0.0]));
        graph.clear_texture(&mut depth, Load::ClearDepth(1.0));
        for (from, vertices) in [(-1.0, 3), (0.0, 3), (0.5, 3)] {
            let always = strip(from).with_depth_compare(wgpu::CompareFunction::Always);
            graph.raster(&always).color("color", &mut image, Load::Keep).depth(&mut depth, Load::Keep).draw(vertices, 1);
        }
        let read = graph.readback_texture(&image);
        let plan = graph.plan(&PlanOptions::default()).unwrap();
        assert_eq!(plan.steps, [0..5, 5..6], "two clears and three draws, then the readback");
        let output = executor.execute(graph).unwrap();
        let halves = output.cast::<u16>(read);
        let red = |x: usize, y: usize| halves[(y * 8 + x) * 4];
        // Below the diagonal of the last triangle: 4 and the draws that reach there. 0x4400 is 4.0, 0x4500 5.0, 0x4700 7.0.
        assert_eq!(
            (red(0, 0), red(0, 7), red(7, 0)),
            (0x4400, 0x4500, 0x4400),
            "upper left, lower left, upper right: {halves:x?}"
        );
        images.push(halves);
    }
    assert_eq!(images[0], images[1], "attachments in transient memory change nothing");
}

/// Adds 1 to every texel of a 32-bit image, which holds 2²⁴ − 1: with 16 bits it would not fit.
#[test]
fn floats_of_32_bits_blend_where_the_device_can() {
    let declare = || {
        let mut graph = Graph::new("wide");
        let mut image = graph.texture("image", TextureDesc::new_2d([4, 4], TextureFormat::Rgba32Float));
        graph.clear_texture(&mut image, Load::Clear([16_777_215.0, 0.0, 0.0, 0.0]));
        graph.raster(&strip(-1.0)).color("color", &mut image, Load::Keep).draw(3, 1);
        let read = graph.readback_texture(&image);
        (graph, read)
    };
    let Some(mut executor) = executor() else { return };
    let refused = executor.execute(declare().0).map(|_| ()).unwrap_err();
    assert!(matches!(&refused, GraphError::FormatUsage { resource, .. } if resource == "image"), "{refused}");
    assert!(refused.to_string().contains("rgba32float") && refused.to_string().contains("FLOAT32_BLENDABLE"), "{refused}");

    let Some(gpu) = Gpu::for_tests_with(wgpu::Features::FLOAT32_BLENDABLE) else { return };
    let (graph, read) = declare();
    let output = Executor::new(&gpu).execute(graph).unwrap();
    assert_eq!(output.cast::<[f32; 4]>(read)[12][0], 16_777_216.0, "the triangle covers the lower left texel");
}

#[test]
fn arguments_of_indirect_calls_come_from_earlier_passes() {
    let Some(mut executor) = executor() else { return };
    let arguments = ComputeShader::from_wgsl(
        "arguments",
        "@group(0) @binding(0) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(1) fn arguments() {
            words[1] = 1u; words[2] = 1u; words[3] = 1u;
            words[4] = 3u; words[5] = 1u; words[6] = 0u; words[7] = 0u;
        }",
    )
    .unwrap();
    let mut graph = Graph::new("indirect");
    let mut counts = graph.buffer("counts", BufferDesc::words(8));
    let mut words = graph.buffer("words", BufferDesc::words(WORDS));
    let mut image = graph.texture("image", TextureDesc::new_2d([4, 4], TextureFormat::Rgba16Float));
    graph.compute(&arguments).write("words", &mut counts).dispatch([1, 1, 1]);
    graph.compute(&fill()).params(&PARAMS).write("words", &mut words).dispatch_indirect(&counts, 4);
    graph.raster(&strip(-1.0)).color("color", &mut image, Load::Clear([0.0; 4])).draw_indirect(&counts, 16);
    let reads = (graph.readback_buffer(&words), graph.readback_texture(&image));
    let output = executor.execute(graph).unwrap();
    assert_eq!(output.cast::<f32>(reads.0)[63], 64.0, "one workgroup of 64 ran");
    assert_eq!(output.cast::<u16>(reads.1)[4 * 12], 0x3c00, "the triangle covers the lower left texel");
}

#[test]
fn persistent_resources_go_on_from_what_they_hold() {
    let Some(mut executor) = executor() else { return };
    let add = ComputeShader::from_wgsl(
        "add",
        "@group(0) @binding(0) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(64) fn add(@builtin(global_invocation_id) id: vec3u) { words[id.x] += 1u; }",
    )
    .unwrap();
    let first: Vec<u32> = (0..64).map(|i| i * 10).collect();
    let mut frame = |words: u64| {
        let mut graph = Graph::new("persistent");
        let bytes: Vec<u8> = first[..words as usize].iter().flat_map(|word| word.to_le_bytes()).collect();
        let mut sum = graph.persistent_buffer("sum", BufferDesc::words(words), Initial::Bytes(bytes.into()));
        graph.compute(&add).write("words", &mut sum).dispatch([1, 1, 1]);
        let read = graph.readback_buffer(&sum);
        let output = executor.execute(graph).unwrap();
        (output.cast::<u32>(read)[3], output.held_bytes)
    };
    assert_eq!([frame(64), frame(64), frame(64)], [(31, 256), (32, 256), (33, 256)], "one object, no copy");
    assert_eq!([frame(32), frame(32)], [(31, 128), (32, 128)], "another size begins anew");
    assert_eq!(executor.why_replanned(), "");
    executor.reset_history();
    let mut graph = Graph::new("textures");
    let desc = TextureDesc::new_2d([2, 1], TextureFormat::R32Float);
    let texels: Vec<u8> = [3.0_f32, 4.0].iter().flat_map(|texel| texel.to_le_bytes()).collect();
    let image = graph.history_texture_from("image", desc.clone(), Initial::Bytes(texels.clone().into()));
    let kept = graph.persistent_texture("kept", desc, Initial::Bytes(texels.into()));
    let reads = (graph.readback_texture(&image.previous), graph.readback_texture(&kept));
    let output = executor.execute(graph).unwrap();
    assert_eq!(output.cast::<f32>(reads.0), [3.0, 4.0]);
    assert_eq!(output.cast::<f32>(reads.1), [3.0, 4.0]);
}

#[test]
fn an_optional_input_that_is_not_there_is_zero() {
    let Some(mut executor) = executor() else { return };
    let join = ComputeShader::from_wgsl(
        "join",
        "@group(0) @binding(0) var<storage, read_write> words: array<f32>;
        @group(0) @binding(1) var<storage, read> more: array<f32>;
        @group(0) @binding(2) var image: texture_2d<f32>;
        @group(0) @binding(3) var indices: texture_2d_array<u32>;
        @compute @workgroup_size(1) fn join() {
            words[0] = 1.0 + more[0] + textureLoad(image, vec2u(0u), 0).x + f32(textureLoad(indices, vec2u(0u), 0, 0).x);
            words[1] = f32(arrayLength(&more));
        }",
    )
    .unwrap();
    for present in [false, true] {
        let mut graph = Graph::new("optional");
        let mut words = graph.buffer("words", BufferDesc::words(WORDS));
        let more = present.then(|| {
            let mut more = graph.buffer("more", BufferDesc::words(WORDS));
            graph.compute(&fill()).params(&Amount { value: 7.0, ..PARAMS }).write("words", &mut more).dispatch_1d(64);
            more
        });
        graph
            .compute(&join)
            .write("words", &mut words)
            .read_optional("more", more.as_ref())
            .read_optional("image", None::<&Handle<Texture>>)
            .read_optional("indices", None::<&Handle<Texture>>)
            .dispatch([1, 1, 1]);
        let read = graph.readback_buffer(&words);
        let expected = if present { [8.0, 64.0] } else { [1.0, 1.0] };
        assert_eq!(executor.execute(graph).unwrap().cast::<f32>(read)[..2], expected);
    }
}

#[test]
fn results_can_be_awaited_while_other_frames_run() {
    let Some(mut executor) = executor() else { return };
    let double = kernel("double", "x * 2.0");
    let mut frames = Vec::new();
    for value in [1.0, 100.0, 1000.0] {
        let mut graph = Graph::new("in flight");
        let mut a = graph.buffer("a", BufferDesc::words(WORDS));
        let mut b = graph.buffer("b", BufferDesc::words(WORDS));
        graph.compute(&fill()).params(&Amount { value, ..PARAMS }).write("words", &mut a).dispatch_1d(64);
        graph.compute(&double).params(&PARAMS).read("source_words", &a).write("target_words", &mut b).dispatch_1d(64);
        let read = graph.readback_buffer(&b);
        frames.push((read, executor.submit(graph).unwrap()));
    }
    let mut sums = Vec::new();
    for (number, (read, frame)) in frames.into_iter().enumerate() {
        let output = if number == 1 { pollster::block_on(frame) } else { frame.wait() }.unwrap();
        sums.push(output.cast::<f32>(read)[1]);
    }
    assert_eq!(sums, [4.0, 202.0, 2002.0]);
}

#[test]
fn threads_change_nothing() {
    let Some(mut executor) = executor() else { return };
    let add = kernel("add", "x * params.value + 1.0");
    let mut run = |threads: usize| {
        executor.set_threads(threads);
        let mut graph = Graph::new("threads");
        let mut now = graph.buffer("first", BufferDesc::words(WORDS));
        graph.compute(&fill()).params(&PARAMS).write("words", &mut now).dispatch_1d(64);
        for i in 0..300 {
            let mut next = graph.buffer("next", BufferDesc::words(WORDS));
            let params = Amount { value: (i % 2) as f32, ..PARAMS };
            graph.compute(&add).params(&params).read("source_words", &now).write("target_words", &mut next).dispatch_1d(64);
            now = next;
            if i == 150 {
                graph.closure("between").read(&now).side_effect().record(|_| Ok(()));
            }
        }
        let read = graph.readback_buffer(&now);
        executor.execute(graph).unwrap().bytes(read).to_vec()
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn two_views_share_a_plan_and_keep_their_own_history() {
    let Some(mut executor) = executor() else { return };
    let add = kernel("add", "x + params.value");
    let mut frame = |name: &str, value: f32| {
        let mut graph = Graph::new(name);
        let mut sum = graph.history_buffer("sum", BufferDesc::words(WORDS));
        let params = Amount { value, ..PARAMS };
        let (from, to) = (&sum.previous, &mut sum.current);
        graph.compute(&add).params(&params).read("source_words", from).write("target_words", to).dispatch_1d(64);
        let read = graph.readback_buffer(&sum.current);
        let output = executor.execute(graph).unwrap();
        (output.cast::<f32>(read)[0], output.cached_plan)
    };
    assert_eq!(frame("left eye", 1.0), (1.0, false));
    assert_eq!(frame("right eye", 10.0), (10.0, true), "the structure is known");
    assert_eq!([frame("left eye", 1.0).0, frame("right eye", 10.0).0, frame("left eye", 1.0).0], [2.0, 20.0, 3.0]);
}

#[test]
fn closures_and_copies_are_left_untimed_where_encoders_write_no_timestamps() {
    let Some(gpu) = Gpu::for_tests() else { return };
    if !gpu.adapter.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
        println!("SKIPPED: no timestamps");
        return;
    }
    // WebGPU's own timestamps: around passes, and nowhere else.
    let descriptor = wgpu::DeviceDescriptor { required_features: wgpu::Features::TIMESTAMP_QUERY, ..Default::default() };
    let (device, queue) = pollster::block_on(gpu.adapter.request_device(&descriptor)).unwrap();
    let mut executor = Executor::from_device(device, queue);
    executor.set_timing_source(TimingSource::Timestamps);
    let mut graph = Graph::new("portable");
    let mut words = graph.buffer("words", BufferDesc::words(WORDS));
    graph.clear_buffer(&mut words);
    graph.compute(&fill()).params(&PARAMS).write("words", &mut words).dispatch_1d(64);
    graph.closure("by hand").read(&words).side_effect().record(|_| Ok(()));
    let read = graph.readback_buffer(&words);
    let output = executor.execute(graph).unwrap();
    assert_eq!(output.cast::<f32>(read)[0], 1.0);
    let timed: Vec<bool> = output.passes.iter().map(|pass| pass.gpu_ms.is_some()).collect();
    assert_eq!(timed, [false, true, false, false], "only the dispatch is a pass");
}
