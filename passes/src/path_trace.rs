//! The unbiased path tracer: one path per pixel and frame.
//!
//! Next-event estimation and multiple importance sampling from the eye; what only light tracing can find comes in as
//! [`Splats`]. Light of a point or directional light that is seen by the eye through a mirror or refractor *after* a
//! caustic on a diffuse surface (eye – specular – diffuse – specular – light) is found by neither and missing.

use crate::scene::{SceneHandles, SceneInfo};
use crate::scene_shader::SceneShader;
use crate::{CameraUniform, LightInfo, Splats, radiance_desc};
use lightloom_graph::{BufferDesc, Graph, Handle, ShaderError, Texture, WgslSources, shader_struct};

/// Pixels a dispatch covers at most, for drivers that end long ones.
const MAX_PIXELS: u32 = 1 << 17;

shader_struct! {
    struct PathTraceParams {
        camera: CameraUniform,
        lights: LightInfo,
        seed: u32,
        frame: u32,
        max_bounces: u32,
        first_row: u32,
        row_count: u32,
        splat_unit: f32,
        pad0: u32,
        pad1: u32,
    }
}

/// How paths are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathSettings {
    /// Seed of the random numbers.
    pub seed: u32,
    /// Frame, so that frames differ.
    pub frame: u32,
    /// Surfaces that light may be scattered at before it reaches what the eye sees.
    pub max_bounces: u32,
}

/// What the eye receives, apart (W·m⁻²·sr⁻¹).
#[derive(Debug)]
pub struct PathLayers {
    /// Emitted, or straight from a light.
    pub direct: Handle<Texture>,
    /// All other.
    pub indirect: Handle<Texture>,
    /// The part of `indirect` that only specular surfaces scattered before.
    pub caustic: Handle<Texture>,
}

/// The pass, in bands of rows. Reads: scene, splats. Writes: three layers. A thread per pixel.
#[derive(Clone, Debug)]
pub struct PathTrace {
    shader: SceneShader,
}

impl PathTrace {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: SceneShader::new(sources, "passes/path_trace.wgsl")? })
    }

    /// Declares the passes.
    pub fn add(
        &self,
        graph: &mut Graph<'_>,
        scene: &SceneHandles,
        info: &SceneInfo,
        camera: &CameraUniform,
        splats: Option<&Splats>,
        settings: PathSettings,
    ) -> PathLayers {
        let mut layers = PathLayers {
            direct: graph.texture("path_direct", radiance_desc(camera.size)),
            indirect: graph.texture("path_indirect", radiance_desc(camera.size)),
            caustic: graph.texture("path_caustic", radiance_desc(camera.size)),
        };
        let mut none = graph.buffer("no_splats", BufferDesc::words(1));
        graph.clear_buffer(&mut none);
        let (splats, splat_unit) = splats.map_or((&none, 0.0), |splats| (&splats.buffer, splats.unit));
        let [width, height] = camera.size;
        let rows = (MAX_PIXELS / width.max(1)).max(1);
        let mut first_row = 0;
        while first_row < height {
            let row_count = rows.min(height - first_row);
            let params = PathTraceParams {
                camera: *camera,
                lights: info.into(),
                seed: settings.seed,
                frame: settings.frame,
                max_bounces: settings.max_bounces,
                first_row,
                row_count,
                splat_unit,
                pad0: 0,
                pad1: 0,
            };
            scene
                .bind(graph.compute(&self.shader.variant(scene)).params(&params))
                .read("splats", splats)
                .write("direct", &mut layers.direct)
                .write("indirect", &mut layers.indirect)
                .write("caustic", &mut layers.caustic)
                .heavy()
                .dispatch_threads([width, row_count, 1]);
            first_row += row_count;
        }
        layers
    }
}
