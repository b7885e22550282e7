//! Light as it arrives at visible points, and what their surfaces make of it.

use crate::scene::SceneHandles;
use crate::{CameraUniform, GBuffer, SceneShader, radiance_desc};
use lightloom_graph::{Graph, Handle, ShaderError, Texture, WgslSources, shader_struct};

/// Light that arrives at visible points, not yet reflected: what [SA19] sums and filters. Both images are linear in the light, so means
/// over pixels or frames are those of the light itself.
///
/// [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems chapter 24, 2019"
#[derive(Debug)]
pub struct Irradiance {
    /// Irradiance on the geometric side (W·m⁻², linear RGB).
    pub irradiance: Handle<Texture>,
    /// Sum over the light of its irradiance's luminance (W·m⁻²) times the unit direction it came from (world, away from the surface);
    /// normalised, the mean direction.
    pub direction: Handle<Texture>,
}

shader_struct! {
    struct ReflectParams {
        camera_position_world: [f32; 3],
        pad0: u32,
        size: [u32; 2],
        pad1: u32,
        pad2: u32,
    }
}

/// Reflects an [`Irradiance`] towards the eye as if all of it came from its mean direction, [SA19] Eq. 20. Reads: G-buffer, the two
/// images. A thread per pixel.
///
/// Exact for Lambertian surfaces without normal maps; elsewhere the spread of the directions is lost.
///
/// [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems chapter 24, 2019"
#[derive(Clone, Debug)]
pub struct ReflectIrradiance {
    shader: SceneShader,
}

impl ReflectIrradiance {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: SceneShader::new(sources, "passes/reflect_irradiance.wgsl")? })
    }

    /// Declares the pass. Returns radiance (W·m⁻²·sr⁻¹) in a texture called `name`, black where nothing gathers light.
    pub fn add(
        &self,
        graph: &mut Graph<'_>,
        name: &str,
        scene: &SceneHandles,
        camera: &CameraUniform,
        gbuffer: &GBuffer,
        light: &Irradiance,
    ) -> Handle<Texture> {
        let mut radiance = graph.texture(name, radiance_desc(camera.size));
        let params =
            ReflectParams { camera_position_world: camera.position_world(), size: camera.size, ..ReflectParams::default() };
        graph
            .compute(&self.shader.variant(scene))
            .params(&params)
            .read("position", &gbuffer.position)
            .read("surface", &gbuffer.surface)
            .read("irradiance", &light.irradiance)
            .read("direction", &light.direction)
            .write("radiance", &mut radiance)
            .dispatch_threads([camera.size[0], camera.size[1], 1]);
        radiance
    }
}
