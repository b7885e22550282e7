//! Ten thousand frames, with resizes, culled passes that come and go, history and two views: nothing grows.

use super::Executor;
use crate::{
    BufferDesc, ComputeShader, Graph, History, Initial, Load, Subresources, TextureDesc, error::GraphError, handle::Buffer,
};

const FRAMES: u64 = 10_000;

fn add() -> ComputeShader {
    ComputeShader::from_wgsl(
        "add",
        "@group(0) @binding(0) var<storage, read> source: array<u32>;
        @group(0) @binding(1) var<storage, read_write> sums: array<u32>;
        @compute @workgroup_size(64) fn add(@builtin(global_invocation_id) id: vec3u) {
            if id.x < arrayLength(&sums) { sums[id.x] = source[id.x] + 1u; }
        }",
    )
    .unwrap()
}

/// A frame whose size and shape depend on its number.
fn frame(executor: &mut Executor, add: &ComputeShader, number: u64) -> Result<(), GraphError> {
    let words = 64 * (1 + number / 500 % 5);
    let mut graph = Graph::new(if number.is_multiple_of(2) { "left" } else { "right" });
    let mut history: History<Buffer> = graph.history_buffer("sums", BufferDesc::words(words));
    let mut kept = graph.persistent_buffer("kept", BufferDesc::words(words), Initial::Zero);
    let mut image = graph.texture("image", TextureDesc::new_2d([words as u32, 8], wgpu::TextureFormat::Rgba8Unorm).mip_levels(2));
    graph.clear_texture_at(&mut image, Subresources::mip(1), Load::Clear([0.5; 4]));
    let mut now = graph.buffer("first", BufferDesc::words(words));
    graph.compute(add).read("source", &history.previous).write("sums", &mut now).dispatch_1d(words as u32);
    for _ in 0..number / 100 % 5 {
        let mut next = graph.buffer("next", BufferDesc::words(words));
        graph.compute(add).read("source", &now).write("sums", &mut next).dispatch_1d(words as u32);
        now = next;
    }
    graph.copy_buffer(&now, &mut history.current);
    graph.copy_buffer(&now, &mut kept);
    if number.is_multiple_of(97) {
        graph.readback_buffer(&now);
    }
    executor.execute(graph).map(|_| ())
}

/// Everything the executor holds, as counts.
fn holdings(executor: &Executor) -> [u64; 4] {
    [
        executor.pool.objects() as u64,
        executor.held_bytes(),
        executor.pipelines.len() as u64,
        executor.plans.cached_bindings() as u64,
    ]
}

/// Resident memory of the process (bytes), where it can be told.
fn resident() -> Option<u64> {
    let statm = std::fs::read_to_string("/proc/self/statm").ok()?;
    Some(statm.split(' ').nth(1)?.parse::<u64>().ok()? * 4096)
}

#[test]
fn nothing_grows_over_ten_thousand_frames() {
    let Some(gpu) = crate::Gpu::for_tests() else { return };
    let mut executor = Executor::new(&gpu);
    executor.set_timing(false);
    let add = add();
    let (mut most_early, mut most_late) = ([0; 4], [0; 4]);
    let mut early = None;
    for number in 0..FRAMES {
        frame(&mut executor, &add, number).unwrap();
        // The shapes come round every 2,500 frames, so both halves see each of them.
        let most = if number < FRAMES / 2 { &mut most_early } else { &mut most_late };
        for (most, now) in most.iter_mut().zip(holdings(&executor)) {
            *most = now.max(*most);
        }
        if number == FRAMES / 2 {
            early = resident();
        }
    }
    assert_eq!(most_early, most_late, "objects, bytes, pipelines and bind groups");
    if let (Some(early), Some(late)) = (early, resident()) {
        // An allocator's own slack; a leak of a hundred bytes a frame would be 500 kB, of a buffer 5,000 times more.
        assert!(late < early + (4 << 20), "resident memory grew from {early} to {late} bytes");
    }
}
