//! Sharing memory changes no image, saves memory, and is never relied upon.

use crate::{Amount, executor, fill, kernel};
use lightloom_graph::{
    BufferDesc, ComputeShader, Executor, FrameOutput, Graph, GraphError, Load, RasterShader, Readback, Sharing, TextureDesc,
    wgpu::TextureFormat,
};

const SIZE: [u32; 2] = [37, 23];

/// A blur that reads one texture and writes another, with the step as an override.
fn blur() -> ComputeShader {
    ComputeShader::from_wgsl(
        "blur",
        "@group(0) @binding(0) var image: texture_2d<f32>;
        @group(0) @binding(1) var<storage, read> weights: array<f32>;
        @group(0) @binding(2) var blurred: texture_storage_2d<rgba32float, write>;
        @compute @workgroup_size(8, 8) fn blur(@builtin(global_invocation_id) id: vec3u) {
            let size = textureDimensions(image);
            if any(id.xy >= size) { return; }
            var sum = vec4f(0.0);
            for (var i = 0u; i < 9u; i++) {
                let at = vec2i(id.xy) + vec2i(i32(i % 3u), i32(i / 3u)) - 1;
                sum += weights[i] * textureLoad(image, clamp(at, vec2i(0), vec2i(size) - 1), 0);
            }
            textureStore(blurred, id.xy, sum);
        }",
    )
    .unwrap()
}

fn pattern() -> RasterShader {
    RasterShader::from_wgsl(
        "pattern",
        "struct Output { @location(0) color: vec4f }
        @vertex fn pattern_vertex(@builtin(vertex_index) v: u32) -> @builtin(position) vec4f {
            return vec4f(vec2f(f32(v & 1u), f32(v >> 1u)) * 4.0 - 1.0, 0.5, 1.0);
        }
        @fragment fn pattern_fragment(@builtin(position) p: vec4f) -> Output {
            let cell = u32(p.x) * 7u + u32(p.y) * 13u;
            return Output(vec4f(f32(cell % 5u), f32(cell % 11u), f32(cell % 3u), 1.0));
        }",
    )
    .unwrap()
}

/// A raster pass, six blurs through textures and weight buffers of equal descriptions, and a readback.
fn declare(graph: &mut Graph<'_>) -> Readback {
    let (blur, weigh, pattern) = (blur(), fill(), pattern());
    let scale = kernel("normalise", "(x + params.value) / 45.0");
    let desc = TextureDesc::new_2d(SIZE, TextureFormat::Rgba32Float);
    let mut image = graph.texture("pattern", desc.clone());
    let mut depth = graph.texture("depth", TextureDesc::new_2d(SIZE, TextureFormat::Depth32Float));
    graph.raster(&pattern).color("color", &mut image, Load::Clear([0.0; 4])).depth(&mut depth, Load::ClearDepth(1.0)).draw(3, 1);
    for step in 0..6 {
        let params = Amount { value: 0.0, count: 9 };
        let mut raw = graph.buffer("raw weights", BufferDesc::words(9));
        let mut weights = graph.buffer("weights", BufferDesc::words(9));
        graph.compute(&weigh).params(&Amount { value: step as f32, ..params }).write("words", &mut raw).dispatch_1d(9);
        graph.compute(&scale).params(&params).read("source_words", &raw).write("target_words", &mut weights).dispatch_1d(9);
        let mut next = graph.texture("blurred", desc.clone());
        graph
            .compute(&blur)
            .read("image", &image)
            .read("weights", &weights)
            .write("blurred", &mut next)
            .dispatch_threads([SIZE[0], SIZE[1], 1]);
        image = next;
    }
    graph.readback_texture(&image)
}

pub(crate) fn run(executor: &mut Executor, sharing: Sharing) -> (Vec<u8>, FrameOutput) {
    executor.set_sharing(sharing);
    let mut graph = Graph::new("image");
    let read = declare(&mut graph);
    let output = executor.execute(graph).unwrap();
    (output.bytes(read).to_vec(), output)
}

#[test]
fn the_image_is_the_same_bit_for_bit_and_takes_less_memory() {
    let Some(mut executor) = executor() else { return };
    let (alone, off) = run(&mut executor, Sharing::Off);
    let mut fresh = Executor::from_device(executor.device().clone(), executor.queue().clone());
    let (shared, pool) = run(&mut fresh, Sharing::Merged);
    let (again, _) = run(&mut fresh, Sharing::Merged);
    assert_eq!(alone.len(), 37 * 23 * 16);
    assert!(alone.iter().any(|byte| *byte != 0), "the image is not empty");
    assert_eq!(alone, shared, "sharing changes nothing");
    assert_eq!(alone, again, "nor does what an earlier frame left in the memory");
    // Seven images, twelve buffers of 9 words and a depth texture, against two images, two or three buffers and depth.
    assert_eq!(off.memory.allocated_bytes, 7 * 37 * 23 * 16 + 12 * 36 + 37 * 23 * 4);
    assert_eq!(pool.memory.pooled_bytes, pool.memory.allocated_bytes);
    assert!(pool.memory.allocated_bytes * 3 < off.memory.allocated_bytes, "{:?} against {:?}", pool.memory, off.memory);
    assert_eq!(pool.held_bytes, pool.memory.allocated_bytes, "and the pool really holds no more");
    assert_eq!(off.held_bytes, off.memory.allocated_bytes);
    assert_eq!((off.pool_objects, pool.pool_objects), (20, 5));
}

#[test]
fn shared_memory_really_is_garbage_at_first() {
    // Without this the refusals below would guard against nothing: a texture nothing wrote shows another's texels.
    let Some(mut executor) = executor() else { return };
    let write_one = ComputeShader::from_wgsl(
        "write_one",
        "@group(0) @binding(0) var<storage, read_write> words: array<f32>;
        @compute @workgroup_size(1) fn write_one() { words[0] = 1.0; }",
    )
    .unwrap();
    let mut graph = Graph::new("garbage");
    let mut a = graph.buffer("a", BufferDesc::words(64));
    let mut b = graph.buffer("b", BufferDesc::words(64));
    graph.compute(&fill()).params(&Amount { value: 7.0, count: 64 }).write("words", &mut a).dispatch_1d(64);
    graph.readback_buffer(&a);
    graph.compute(&write_one).write("words", &mut b).dispatch([1, 1, 1]);
    let read = graph.readback_buffer(&b);
    let output = executor.execute(graph).unwrap();
    assert_eq!(output.pool_objects, 1, "one object serves both");
    assert_eq!(output.cast::<f32>(read)[..3], [1.0, 8.0, 9.0], "what `write_one` left alone is what `fill` wrote");
}

#[test]
#[cfg(not(feature = "placement"))]
fn without_the_feature_placed_is_pooled_and_says_so() {
    let Some(mut executor) = executor() else { return };
    let (pooled, merged) = run(&mut executor, Sharing::Merged);
    assert_eq!((merged.sharing, merged.sharing_note.as_str()), (Sharing::Merged, ""));
    for _ in 0..2 {
        let (image, placed) = run(&mut executor, Sharing::Placed);
        assert_eq!(placed.sharing, Sharing::Merged);
        assert_eq!(placed.sharing_note, "lightloom-graph was built without its feature `placement`");
        assert!(placed.cached_plan && placed.memory == merged.memory && image == pooled, "the pool's own plan");
    }
}

#[test]
fn a_pass_that_relies_on_stale_contents_is_refused() {
    let accumulate = ComputeShader::from_wgsl(
        "accumulate",
        "@group(0) @binding(0) var<storage, read_write> sum: array<f32>;
        @compute @workgroup_size(64) fn accumulate(@builtin(global_invocation_id) id: vec3u) { sum[id.x] += 1.0; }",
    )
    .unwrap();
    // Nothing wrote `sum` in this frame: what the pass would add to is whatever shared its memory last.
    let mut graph = Graph::new("stale");
    let mut sum = graph.buffer("sum", BufferDesc::words(64));
    graph.compute(&accumulate).write("sum", &mut sum).dispatch([1, 1, 1]);
    graph.readback_buffer(&sum);
    let error = graph.plan(&lightloom_graph::PlanOptions::default()).unwrap_err();
    assert!(
        matches!(&error, GraphError::StaleRead { at, resource, .. } if at.pass() == "accumulate" && resource == "sum"),
        "{error}"
    );
    assert!(error.to_string().contains("sharing.rs:"), "the Rust line is named: {error}");
    if let Some(mut executor) = executor() {
        let mut graph = Graph::new("stale");
        let mut sum = graph.buffer("sum", BufferDesc::words(64));
        graph.compute(&accumulate).write("sum", &mut sum).dispatch([1, 1, 1]);
        graph.readback_buffer(&sum);
        assert_eq!(
            executor.execute(graph).unwrap_err().to_string().replace(|c: char| c.is_ascii_digit(), ""),
            error.to_string().replace(|c: char| c.is_ascii_digit(), "")
        );
        // The mends of the message work: clear it, or keep it as history.
        let mut graph = Graph::new("mended");
        let mut sum = graph.buffer("sum", BufferDesc::words(64));
        graph.clear_buffer(&mut sum);
        graph.compute(&accumulate).write("sum", &mut sum).dispatch([1, 1, 1]);
        let read = graph.readback_buffer(&sum);
        assert_eq!(executor.execute(graph).unwrap().cast::<f32>(read), [1.0; 64]);
        let mut frame = || {
            let mut graph = Graph::new("history");
            let mut sum = graph.history_buffer("sum", BufferDesc::words(64));
            graph.copy_buffer(&sum.previous, &mut sum.current);
            graph.compute(&accumulate).write("sum", &mut sum.current).dispatch([1, 1, 1]);
            let read = graph.readback_buffer(&sum.current);
            executor.execute(graph).unwrap().cast::<f32>(read)[5]
        };
        assert_eq!([frame(), frame()], [1.0, 2.0]);
    }
}
