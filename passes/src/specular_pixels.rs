//! Pixels whose first surface is a mirror or transmits light.
//!
//! Light leaves mirrors and smooth dielectrics in single directions and no photon density helps there (as Mara et al. 2013 say
//! of all their methods); rough dielectrics scatter light of both sides, of which a G-buffer knows one. Each such pixel follows a few
//! paths per frame instead. Other pixels keep what the strategy gathered.

use crate::scene::{SceneHandles, SceneInfo};
use crate::scene_shader::SceneShader;
use crate::{CameraUniform, GBuffer, LightInfo, PathSettings, radiance_desc};
use lightloom_graph::{Graph, Handle, ShaderError, Texture, WgslSources, shader_struct};

/// Paths per pixel and frame: such pixels are few, and one path is noise beside an estimate from hundreds of photons.
const PATHS: u32 = 4;

shader_struct! {
    struct SpecularPixelsParams {
        camera: CameraUniform,
        lights: LightInfo,
        seed: u32,
        frame: u32,
        max_bounces: u32,
        index: u32,
        weight: f32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

/// The pass. Reads: scene, G-buffer, gathered radiance. Writes: indirect radiance. A thread per pixel.
#[derive(Clone, Debug)]
pub struct SpecularPixels {
    shader: SceneShader,
}

impl SpecularPixels {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: SceneShader::new(sources, "passes/specular_pixels.wgsl")? })
    }

    /// Declares the pass. Returns indirect radiance (W·m⁻²·sr⁻¹).
    #[expect(clippy::too_many_arguments, reason = "the data flow of one pass, each argument a different thing")]
    pub fn add(
        &self,
        graph: &mut Graph<'_>,
        scene: &SceneHandles,
        info: &SceneInfo,
        camera: &CameraUniform,
        gbuffer: &GBuffer,
        gathered: &Handle<Texture>,
        settings: PathSettings,
    ) -> Handle<Texture> {
        let shader = self.shader.variant(scene);
        let add_path = |graph: &mut Graph<'_>, before: &Handle<Texture>, index| {
            let mut indirect = graph.texture("indirect", radiance_desc(camera.size));
            let params = SpecularPixelsParams {
                camera: *camera,
                lights: info.into(),
                seed: settings.seed,
                frame: settings.frame,
                max_bounces: settings.max_bounces,
                index,
                weight: 1.0 / PATHS as f32,
                ..SpecularPixelsParams::default()
            };
            scene
                .bind(graph.compute(&shader).params(&params))
                .read("surface", &gbuffer.surface)
                .read("gathered", before)
                .write("indirect", &mut indirect)
                .heavy()
                .dispatch_threads([camera.size[0], camera.size[1], 1]);
            indirect
        };
        let mut sum = add_path(graph, gathered, 0);
        for index in 1..PATHS {
            sum = add_path(graph, &sum, index);
        }
        sum
    }
}
