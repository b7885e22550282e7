//! Exclusive prefix sums of any length, in three dispatches.
//!
//! ```text
//! counts ─▶ blocks: sum of each 2,048 ─▶ scan: one workgroup ─▶ apply: scan inside each block ─▶ sums
//! ```

use lightloom_graph::{Buffer, BufferDesc, ComputeShader, Graph, Handle, ShaderError, WgslSources, shader_struct};

const BLOCK: u32 = 2048;

shader_struct! {
    struct PrefixSumParams {
        count: u32,
        blocks: u32,
        pad0: u32,
        pad1: u32,
    }
}

/// The passes.
#[derive(Clone, Debug)]
pub struct PrefixSum {
    blocks: ComputeShader,
    scan: ComputeShader,
    apply: ComputeShader,
}

impl PrefixSum {
    /// Parses the shaders.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self {
            blocks: ComputeShader::new(sources, "passes/prefix_sum_blocks.wgsl")?,
            scan: ComputeShader::new(sources, "passes/prefix_sum_scan.wgsl")?,
            apply: ComputeShader::new(sources, "passes/prefix_sum_apply.wgsl")?,
        })
    }

    /// Declares `sums[i] = counts[0] + … + counts[i − 1]` for i in 0..=count. `counts` holds at least `count` words, `sums`
    /// one more; `count` is at least 1. Sums wrap at 2³².
    pub fn add(&self, graph: &mut Graph<'_>, counts: &Handle<Buffer>, sums: &mut Handle<Buffer>, count: u32) {
        let blocks = count.div_ceil(BLOCK);
        let params = PrefixSumParams { count, blocks, pad0: 0, pad1: 0 };
        let mut block_sums = graph.buffer("block_sums", BufferDesc::words(u64::from(blocks)));
        let threads = blocks * 256;
        graph
            .compute(&self.blocks)
            .params(&params)
            .read("counts", counts)
            .write("block_sums", &mut block_sums)
            .dispatch_1d(threads);
        graph.compute(&self.scan).params(&params).write("block_sums", &mut block_sums).dispatch([1, 1, 1]);
        graph
            .compute(&self.apply)
            .params(&params)
            .read("counts", counts)
            .read("block_sums", &block_sums)
            .write("sums", sums)
            .dispatch_1d(threads);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightloom_graph::wgpu::{self, util::DeviceExt};
    use lightloom_graph::{Executor, Gpu};

    #[test]
    fn sums_equal_the_cpu_s() {
        let Some(gpu) = Gpu::for_tests() else { return };
        let pass = PrefixSum::new(&crate::shaders()).expect("the shaders are valid");
        let mut executor = Executor::new(&gpu);
        // Around one block, one run of the scanning workgroup's threads, and several.
        for count in [1, 2047, 2048, 2049, 70_001, 600_000_u32] {
            let counts: Vec<u32> = (0..count).map(|i| i.wrapping_mul(2_654_435_761) >> 29).collect();
            let contents = bytemuck::cast_slice(&counts);
            let usage = wgpu::BufferUsages::STORAGE;
            let buffer = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage });
            let mut graph = Graph::new("prefix sums");
            let input = graph.import_buffer("counts", BufferDesc::words(count.into()), buffer);
            let mut sums = graph.buffer("sums", BufferDesc::words(u64::from(count) + 1));
            pass.add(&mut graph, &input, &mut sums, count);
            let readback = graph.readback_buffer(&sums);
            let found: Vec<u32> = executor.execute(graph).expect("the graph is sound").cast(readback);
            let mut sum = 0;
            for (i, &have) in found.iter().enumerate() {
                assert_eq!(have, sum, "sums[{i}] of {count}");
                sum += counts.get(i).copied().unwrap_or(0);
            }
        }
    }
}
