//! Sums of importance, level by level.

use super::RsmMaps;
use lightloom_graph::{ComputeShader, Graph, ShaderError, Subresources, WgslSources};

/// Levels that one workgroup makes from 16² texels: as many storage textures as every WebGPU device can bind.
const TOP_LEVELS: u32 = 4;

/// The passes. Read and write the maps. A thread per sum.
#[derive(Clone, Debug)]
pub(super) struct RsmPyramid {
    level: ComputeShader,
    top: ComputeShader,
}

impl RsmPyramid {
    pub(super) fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self {
            level: ComputeShader::new(sources, "passes/rsm_pyramid.wgsl")?,
            top: ComputeShader::new(sources, "passes/rsm_pyramid_top.wgsl")?,
        })
    }

    pub(super) fn add(&self, graph: &mut Graph<'_>, size: u32, maps: &mut RsmMaps) {
        let top = size.ilog2() - TOP_LEVELS;
        for level in 1..=top {
            let groups = (size >> level).div_ceil(8);
            graph
                .compute(&self.level)
                .read_at("finer", &maps.importance, Subresources::mip(level - 1))
                .write_at("coarser", &mut maps.importance, Subresources::mip(level))
                .dispatch([groups, groups, maps.count]);
        }
        graph
            .compute(&self.top)
            .read_at("finer", &maps.importance, Subresources::mip(top))
            .write_at("sums8", &mut maps.importance, Subresources::mip(top + 1))
            .write_at("sums4", &mut maps.importance, Subresources::mip(top + 2))
            .write_at("sums2", &mut maps.importance, Subresources::mip(top + 3))
            .write_at("sums1", &mut maps.importance, Subresources::mip(top + 4))
            .dispatch([1, 1, maps.count]);
    }
}
