//! Rasterises which triangle each pixel sees.
//!
//! A visibility buffer, not a fat G-buffer: the attributes follow in [`GBufferPass`](crate::GBufferPass) from the same WGSL
//! that evaluates the surfaces rays meet, so that both see the same material. Vertices are pulled from the ray tracer's
//! triangles; there is no second copy of the geometry. Reads: scene. Writes: `visibility`.

use crate::CameraUniform;
use crate::scene::SceneHandles;
use lightloom_graph::wgpu::{CompareFunction, TextureFormat};
use lightloom_graph::{Graph, Handle, Load, RasterShader, ShaderError, Texture, TextureDesc, WgslSources, shader_struct};

shader_struct! {
    struct VisibilityParams {
        camera: CameraUniform,
    }
}

/// The pass.
#[derive(Clone, Debug)]
pub struct Visibility {
    shader: RasterShader,
}

impl Visibility {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        let shader = RasterShader::new(sources, "passes/visibility.wgsl")?.with_depth_compare(CompareFunction::Greater);
        Ok(Self { shader })
    }

    /// Declares the pass. The texture holds, per pixel: index into the BVH's triangles + 1 (0: nothing), barycentric
    /// weights of the second and third corner as bits, unused.
    pub fn add(
        &self,
        graph: &mut Graph<'_>,
        scene: &SceneHandles,
        camera: &CameraUniform,
        triangle_count: u32,
    ) -> Handle<Texture> {
        let mut visibility = graph.texture("visibility", TextureDesc::new_2d(camera.size, TextureFormat::Rgba32Uint));
        let mut depth = graph.texture("visibility_depth", TextureDesc::new_2d(camera.size, TextureFormat::Depth32Float));
        scene
            .bind_raster(graph.raster(&self.shader).params(&VisibilityParams { camera: *camera }))
            .color("visibility", &mut visibility, Load::Clear([0.0; 4]))
            .depth(&mut depth, Load::ClearDepth(0.0))
            .draw(3 * triangle_count, 1);
        visibility
    }
}
