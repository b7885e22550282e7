//! The embedded shaders, as the graph takes them.

use crate::StrategyError;
use lightloom_graph::{ComputeShader, WgslSources};

/// The compute shader at `strategies/<stem>.wgsl`, parsed and checked.
pub(crate) fn compute(stem: &str) -> Result<ComputeShader, StrategyError> {
    let sources = WgslSources::new().with(lightloom_shaders::FILES);
    Ok(ComputeShader::new(&sources, &format!("strategies/{stem}.wgsl"))?)
}
