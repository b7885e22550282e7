//! `SortLists` sorts lists of any length, and nothing beyond its capacity.

mod common;

use common::Random;
use lightloom_graph::wgpu::{self, util::DeviceExt};
use lightloom_graph::{BufferDesc, Executor, Gpu, Graph, bytemuck};
use lightloom_strategies::{PhotonLists, SortLists};

#[test]
fn lists_of_any_length_are_sorted_in_place() {
    assert_sorted(&[0, 1, 2, 3, 5, 63, 64, 65, 0, 127, 128, 129, 1000, 1, 0, 2049, 7]);
}

/// So many lists that a workgroup looks at several together.
#[test]
fn many_lists_are_sorted_among_empty_ones() {
    let mut random = Random(5);
    let lengths: Vec<u32> = (0..7001).map(|_| if random.unit() < 0.9 { 0 } else { random.word() as u32 % 40 }).collect();
    assert_sorted(&lengths);
}

fn assert_sorted(lengths: &[u32]) {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut executor = Executor::new(&gpu);
    let mut random = Random(3);
    let mut offsets = vec![0_u32];
    for length in lengths {
        offsets.push(offsets[offsets.len() - 1] + length);
    }
    // A last list that begins inside the capacity and ends beyond it: only its head may be sorted.
    let capacity = offsets[offsets.len() - 1] + 40;
    offsets.push(capacity + 60);
    let entries: Vec<u32> = (0..capacity + 10).map(|_| random.word() as u32 % 5000).collect();

    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    let mut graph = Graph::new("sort");
    let mut import = |name: &str, words: &[u32]| {
        let contents = bytemuck::cast_slice(words);
        let buffer = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(name), contents, usage });
        graph.import_buffer(name, BufferDesc::words(words.len() as u64), buffer)
    };
    let lists = offsets.len() as u32 - 1;
    let mut photon_lists = PhotonLists {
        offsets: import("offsets", &offsets),
        entries: import("entries", &entries),
        lists,
        entry_capacity: capacity,
    };
    SortLists::new(&lightloom_passes::shaders()).expect("the shader is sound").add(&mut graph, &mut photon_lists);
    let readback = graph.readback_buffer(&photon_lists.entries);
    let sorted = executor.execute(graph).expect("the frame runs").cast::<u32>(readback);

    let mut expected = entries;
    for list in offsets.windows(2) {
        let (begin, end) = (list[0].min(capacity) as usize, list[1].min(capacity) as usize);
        expected[begin..end].sort_unstable();
    }
    assert!(sorted == expected, "lists of lengths {lengths:?} are not sorted as the CPU does");
}
