//! The mean of a layer over frames, and how sure it is.

use crate::radiance_desc;
use lightloom_graph::{ComputeShader, Graph, Handle, ShaderError, Texture, WgslSources, shader_struct};

shader_struct! {
    struct AccumulateParams {
        size: [u32; 2],
        share: f32,
        pad0: u32,
    }
}

/// A layer over several frames.
#[derive(Debug)]
pub struct Accumulated {
    /// Weighted mean over the frames so far.
    pub mean: Handle<Texture>,
    /// Sum of squared deviations from it; over n frames of one weight the standard error of the mean is √(deviations / (n (n − 1))).
    pub deviations: Handle<Texture>,
}

/// The pass. Its state is two history textures per layer. A thread per pixel.
#[derive(Clone, Debug)]
pub struct Accumulate {
    shader: ComputeShader,
}

impl Accumulate {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: ComputeShader::new(sources, "passes/accumulate.wgsl")? })
    }

    /// Declares the pass. `layer` names the history; `share` is this frame's weight over that of all with it: 1/n in
    /// the nth for a plain mean, 1 to begin anew.
    pub fn add(&self, graph: &mut Graph<'_>, layer: &str, size: [u32; 2], value: &Handle<Texture>, share: f32) -> Accumulated {
        let mut mean = graph.history_texture(&format!("{layer}_mean"), radiance_desc(size));
        let mut deviations = graph.history_texture(&format!("{layer}_deviations"), radiance_desc(size));
        graph
            .compute(&self.shader)
            .name(&format!("accumulate_{layer}"))
            .params(&AccumulateParams { size, share, pad0: 0 })
            .read("value", value)
            .read("previous_mean", &mean.previous)
            .read("previous_deviations", &deviations.previous)
            .write("mean", &mut mean.current)
            .write("deviations", &mut deviations.current)
            .dispatch_threads([size[0], size[1], 1]);
        Accumulated { mean: mean.current, deviations: deviations.current }
    }
}
