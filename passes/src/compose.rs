//! The finished picture: emitted, direct and indirect light together.

use crate::radiance_desc;
use lightloom_graph::{ComputeShader, Graph, Handle, ShaderError, Texture, WgslSources, shader_struct};

shader_struct! {
    struct ComposeParams {
        size: [u32; 2],
        occluded: u32,
        pad0: u32,
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

    /// Declares the pass. Returns `direct + openness · indirect` (W·m⁻²·sr⁻¹), the openness that of
    /// [`AmbientOcclusion`](crate::AmbientOcclusion), 1 without.
    pub fn add(
        &self,
        graph: &mut Graph<'_>,
        size: [u32; 2],
        direct: &Handle<Texture>,
        indirect: &Handle<Texture>,
        openness: Option<&Handle<Texture>>,
    ) -> Handle<Texture> {
        let mut sum = graph.texture("final", radiance_desc(size));
        graph
            .compute(&self.shader)
            .params(&ComposeParams { size, occluded: u32::from(openness.is_some()), pad0: 0 })
            .read("direct", direct)
            .read("indirect", indirect)
            .read_optional("openness", openness)
            .write("final_radiance", &mut sum)
            .dispatch_threads([size[0], size[1], 1]);
        sum
    }
}
