//! What the graph costs the CPU: declaring, finding the plan, recording and submitting a frame, beside wgpu code written
//! by hand that does the same work with everything it can keep kept. `cargo bench -p lightloom-graph`.
//!
//! The work is a chain of small dispatches, each with its params, an input and an output; the GPU's time is left out by
//! waiting for it between frames. By hand means: pipelines, buffers and bind groups made once, params written to one
//! uniform buffer, one encoder, one submission; with a compute pass for each dispatch, as code is mostly written, and with
//! one compute pass for all, which is the least that wgpu can be asked to do and of which nothing can be timed.

#![allow(clippy::unwrap_used, reason = "a benchmark fails loudly")]

use lightloom_graph::{BufferDesc, ComputeShader, Executor, Gpu, GpuRequest, Graph, Sharing, shader_struct, wgpu};
use std::time::Instant;

shader_struct! {
    /// Params of the kernel.
    struct Amount {
        value: f32,
        count: u32,
    }
}

const WORDS: u64 = 64;
const ALIGN: u64 = 256;
const WGSL: &str = "struct Amount { value: f32, count: u32 }
    @group(0) @binding(0) var<uniform> params: Amount;
    @group(0) @binding(1) var<storage, read> source_words: array<f32>;
    @group(0) @binding(2) var<storage, read_write> target_words: array<f32>;
    @compute @workgroup_size(64) fn step(@builtin(global_invocation_id) id: vec3u) {
        if id.x < params.count { target_words[id.x] = source_words[id.x] + params.value; }
    }";

/// The frame written by hand.
struct ByHand {
    pipeline: wgpu::ComputePipeline,
    params: wgpu::Buffer,
    groups: Vec<wgpu::BindGroup>,
}

impl ByHand {
    fn new(gpu: &Gpu, passes: usize) -> Self {
        let device = &gpu.device;
        let source = wgpu::ShaderSource::Wgsl(WGSL.into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let buffer =
            |size, usage| device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false });
        let params = buffer(passes as u64 * ALIGN, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST);
        // A chain needs two buffers, used in turn.
        let words = [0, 1].map(|_| buffer(WORDS * 4, wgpu::BufferUsages::STORAGE));
        let layout = pipeline.get_bind_group_layout(0);
        let groups = (0..passes)
            .map(|pass| {
                let offset = pass as u64 * ALIGN;
                let size = wgpu::BufferSize::new(8);
                let params = wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer: &params, offset, size });
                let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
                device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: None,
                    layout: &layout,
                    entries: &[
                        entry(0, params),
                        entry(1, words[pass % 2].as_entire_binding()),
                        entry(2, words[(pass + 1) % 2].as_entire_binding()),
                    ],
                })
            })
            .collect();
        Self { pipeline, params, groups }
    }

    fn frame(&self, gpu: &Gpu, one_pass: bool) {
        let mut bytes = vec![0; self.groups.len() * ALIGN as usize];
        for (pass, bytes) in bytes.chunks_mut(ALIGN as usize).enumerate() {
            bytes[..4].copy_from_slice(&(pass as f32).to_le_bytes());
            bytes[4..8].copy_from_slice(&(WORDS as u32).to_le_bytes());
        }
        gpu.queue.write_buffer(&self.params, 0, &bytes);
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = None;
        for group in &self.groups {
            if !one_pass {
                pass = None;
            }
            let pass = pass.get_or_insert_with(|| {
                let descriptor = wgpu::ComputePassDescriptor { label: Some("step"), timestamp_writes: None };
                let mut pass = encoder.begin_compute_pass(&descriptor).forget_lifetime();
                pass.set_pipeline(&self.pipeline);
                pass
            });
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(1, 1, 1);
        }
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
    }
}

fn by_graph(executor: &mut Executor, step: &ComputeShader, names: &[String]) -> [f64; 3] {
    let started = Instant::now();
    let mut graph = Graph::new("frame");
    let mut now = graph.import_buffer("first", BufferDesc::words(WORDS), FIRST.with(|first| first.borrow().clone()));
    for (pass, name) in names.iter().enumerate() {
        let mut next = graph.buffer(name, BufferDesc::words(WORDS));
        graph
            .compute(step)
            .name(name)
            .params(&Amount { value: pass as f32, count: WORDS as u32 })
            .read("source_words", &now)
            .write("target_words", &mut next)
            .dispatch([1, 1, 1]);
        now = next;
    }
    graph.keep(&now);
    let declared = started.elapsed().as_secs_f64() * 1e6;
    let output = executor.execute(graph).unwrap();
    [declared, output.plan_us, output.record_us]
}

thread_local! {
    static FIRST: std::cell::RefCell<Option<wgpu::Buffer>> = const { std::cell::RefCell::new(None) };
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn main() {
    let gpu = Gpu::new(&GpuRequest::default()).unwrap();
    println!("{}", gpu.adapter_name());
    let step = ComputeShader::from_wgsl("step", WGSL).unwrap();
    FIRST.with(|first| {
        *first.borrow_mut() = Some(gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: WORDS * 4,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        }));
    });
    let wait = || gpu.device.poll(wgpu::PollType::wait_indefinitely()).map(|_| ()).unwrap();
    println!("passes  threads  by hand µs  in one pass  graph µs (declare + plan + record)   ratio  to one pass");
    for passes in [100, 1000] {
        let hand = ByHand::new(&gpu, passes);
        let names: Vec<String> = (0..passes).map(|pass| format!("step {pass}")).collect();
        for threads in [1, 2] {
            let mut executor = Executor::new(&gpu);
            executor.set_timing(false);
            executor.set_sharing(Sharing::Merged);
            executor.set_threads(threads);
            let (mut times, mut parts) = ([Vec::new(), Vec::new(), Vec::new()], [Vec::new(), Vec::new(), Vec::new()]);
            // One after the other, so that all see the same machine.
            for round in 0..400 {
                let by_hand = [false, true].map(|one_pass| {
                    let started = Instant::now();
                    hand.frame(&gpu, one_pass);
                    let us = started.elapsed().as_secs_f64() * 1e6;
                    wait();
                    us
                });
                let frame = by_graph(&mut executor, &step, &names);
                wait();
                if round >= 20 {
                    times[0].push(by_hand[0]);
                    times[1].push(by_hand[1]);
                    times[2].push(frame.iter().sum());
                    parts.iter_mut().zip(frame).for_each(|(all, one)| all.push(one));
                }
            }
            let ratio = |to: &[f64]| median(times[2].iter().zip(to).map(|(graph, hand)| graph / hand).collect());
            let ratios = [ratio(&times[0]), ratio(&times[1])];
            let [hand, one, graph] = times.map(median);
            let [declare, plan, record] = parts.map(median);
            println!(
                "{passes:6}  {threads:7}  {hand:10.0}  {one:11.0}  {graph:8.0} ({declare:.0} + {plan:.0} + {record:.0})   {:.2}  {:.2}",
                ratios[0], ratios[1]
            );
        }
    }
}
