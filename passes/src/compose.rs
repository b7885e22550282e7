//! The finished picture: emitted, direct and indirect light together.

use crate::radiance_desc;
use lightloom_graph::{ComputeShader, Graph, Handle, ShaderError, Texture, WgslSources, shader_struct};

shader_struct! {
    struct ComposeParams {
        size: [u32; 2],
        pad0: u32,
        pad1: u32,
    }
}

/// The pass. A thread per pixel.
#[derive(Clone, Debug)]
pub struct Compose {
    shader: ComputeShader,
}

impl Compose {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: ComputeShader::new(sources, "passes/compose.wgsl")? })
    }

    /// Declares the pass. Returns `direct + indirect` (W·m⁻²·sr⁻¹).
    pub fn add(
        &self,
        graph: &mut Graph<'_>,
        size: [u32; 2],
        direct: &Handle<Texture>,
        indirect: &Handle<Texture>,
    ) -> Handle<Texture> {
        let mut sum = graph.texture("final", radiance_desc(size));
        graph
            .compute(&self.shader)
            .params(&ComposeParams { size, pad0: 0, pad1: 0 })
            .read("direct", direct)
            .read("indirect", indirect)
            .write("final_radiance", &mut sum)
            .dispatch_threads([size[0], size[1], 1]);
        sum
    }
}
