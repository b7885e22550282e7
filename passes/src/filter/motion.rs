//! Motion vectors: where the previous image showed what each pixel shows.

use super::FilterInputs;
use crate::{CameraUniform, radiance_desc};
use lightloom_graph::{
    Buffer, BufferDesc, ComputeShader, Graph, Handle, Initial, ShaderError, Texture, WgslSources, shader_struct,
};

/// Bytes of a triangle's corners.
const CORNERS: u64 = 48;
/// A buffer that shaders see holds no more (WebGPU's guarantee): corners of 2.8 million triangles.
const LARGEST_BINDING: u64 = 128 << 20;

shader_struct! {
    struct MotionParams {
        camera: CameraUniform,
        previous: CameraUniform,
    }
}

shader_struct! {
    struct PositionsParams {
        count: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

/// Writes motion vectors as [`GBuffer::motion`](crate::GBuffer::motion) describes them.
///
/// The camera's motion comes from the G-buffer's positions; that of a scene that [moves](crate::scene::SceneHandles::moves) from the corners its
/// triangles had, which a second pass keeps from frame to frame (48 B a triangle). Scenes of more than 2.8 million triangles are taken to
/// stand still: their moving surfaces find no history where they differ in depth or normal from what was there. Reads: G-buffer,
/// scene. A thread per pixel, and one per triangle.
#[derive(Clone, Debug)]
pub(super) struct MotionPass {
    motion: ComputeShader,
    positions: ComputeShader,
}

impl MotionPass {
    /// Parses the shaders.
    pub(super) fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self {
            motion: ComputeShader::new(sources, "passes/filter_motion.wgsl")?,
            positions: ComputeShader::new(sources, "passes/filter_positions.wgsl")?,
        })
    }

    /// Declares the passes; what nothing reads of them is culled.
    pub(super) fn add(&self, graph: &mut Graph<'_>, inputs: &FilterInputs<'_>) -> Handle<Texture> {
        let FilterInputs { scene, info, camera, .. } = *inputs;
        let mut motion = graph.texture("filter_motion", radiance_desc(camera.size));
        let corners = CORNERS * u64::from(info.triangle_count);
        let follows = scene.moves
            && inputs.gbuffer.motion.is_none()
            && inputs.visibility.is_some()
            && (1..=LARGEST_BINDING).contains(&corners);
        let mut positions: Option<Handle<Buffer>> =
            follows.then(|| graph.persistent_buffer("filter_positions", BufferDesc::words(corners / 4), Initial::Zero));
        let params = MotionParams { camera: *camera, previous: *inputs.previous.unwrap_or(camera) };
        scene
            .bind(graph.compute(&self.motion).params(&params))
            .read("position", &inputs.gbuffer.position)
            .read_optional("visibility", inputs.visibility)
            .read_optional("positions", positions.as_ref())
            .write("motion", &mut motion)
            .dispatch_threads([camera.size[0], camera.size[1], 1]);
        if let Some(positions) = &mut positions {
            let params = PositionsParams { count: info.triangle_count, ..PositionsParams::default() };
            scene
                .bind(graph.compute(&self.positions).params(&params))
                .write("positions", positions)
                .dispatch_1d(info.triangle_count);
        }
        motion
    }
}
