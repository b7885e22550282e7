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
