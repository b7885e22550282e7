//! What the lights see, rasterised.

use crate::scene::{SceneHandles, SceneInfo};
use lightloom_graph::wgpu::{CompareFunction, TextureFormat};
use lightloom_graph::{
    Graph, Handle, Load, RasterShader, ShaderError, Subresources, Texture, TextureDesc, WgslSources, shader_struct,
};

shader_struct! {
    struct RsmViewParams {
        view: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

/// The pass, one for each view of a light. Reads: scene. Writes: which triangle each texel sees.
///
/// Vertices are pulled as in [`Visibility`](crate::Visibility). One pass for all faces, by instances and layers chosen in the vertex
/// shader, is not in WebGPU.
#[derive(Clone, Debug)]
pub(super) struct RsmViews {
    shader: RasterShader,
}

/// What they show.
#[derive(Debug)]
pub(super) struct Views {
    /// `r32uint`, a layer for each of [`SceneHandles::light_views`]; index into the BVH's triangles + 1, 0 where nothing is.
    pub(super) seen: Handle<Texture>,
    /// Something was drawn.
    pub(super) drawn: bool,
}

impl Views {
    /// For shaders that look nothing up, and bind a texture all the same.
    pub(super) fn none(graph: &mut Graph<'_>) -> Self {
        let mut seen = graph.texture("rsm_seen", TextureDesc::new_2d([1; 2], TextureFormat::R32Uint));
        graph.clear_texture(&mut seen, Load::Clear([0.0; 4]));
        Self { seen, drawn: false }
    }
}

impl RsmViews {
    pub(super) fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        let shader = RasterShader::new(sources, "passes/rsm_view.wgsl")?.with_depth_compare(CompareFunction::Greater);
        Ok(Self { shader })
    }

    /// Draws all views, `side` texels across and down.
    pub(super) fn add(&self, graph: &mut Graph<'_>, scene: &SceneHandles, info: &SceneInfo, side: u32) -> Views {
        let desc = TextureDesc::new_2d([side; 2], TextureFormat::R32Uint).layers(info.light_view_count);
        let mut seen = graph.texture("rsm_seen", desc);
        let mut depth = graph.texture("rsm_depth", TextureDesc::new_2d([side; 2], TextureFormat::Depth32Float));
        for view in 0..info.light_view_count {
            scene
                .bind_raster(graph.raster(&self.shader).params(&RsmViewParams { view, pad0: 0, pad1: 0, pad2: 0 }))
                .color_at("seen", &mut seen, Subresources::mip(0).layer(view), Load::Clear([0.0; 4]))
                .depth(&mut depth, Load::ClearDepth(0.0))
                .draw(3 * info.triangle_count, 1);
        }
        Views { seen, drawn: true }
    }
}
