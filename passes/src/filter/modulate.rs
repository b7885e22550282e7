//! Between radiance that leaves a surface and the light that came to it.

use crate::{CameraUniform, GBuffer, radiance_desc};
use lightloom_graph::{ComputeShader, Graph, Handle, ShaderError, Texture, WgslSources, shader_struct};

shader_struct! {
    struct ModulateParams {
        camera_position_world: [f32; 3],
        pad0: u32,
        size: [u32; 2],
        pad1: u32,
        pad2: u32,
    }
}

/// Two passes, one the other's inverse: radiance (W·m⁻²·sr⁻¹) over the surface's reflectance, the share of even light from all around that
/// it reflects to the eye, and back. Of Lambertian surfaces that is the base colour; of glTF's model the fit of [Karis14] is added for
/// the specular part.
///
/// A channel that a surface does not reflect tells nothing of the light: it is marked as unknown, filters take it from no pixel, and its
/// radiance stays 0. Reads: G-buffer. A thread per pixel.
///
/// [Karis14]: https://www.unrealengine.com/blog/physically-based-shading-on-mobile "Physically based shading on mobile, Karis, 2014"
#[derive(Clone, Debug)]
pub(super) struct Modulate {
    divide: ComputeShader,
    multiply: ComputeShader,
}

impl Modulate {
    /// Parses the shaders.
    pub(super) fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self {
            divide: ComputeShader::new(sources, "passes/filter_demodulate.wgsl")?,
            multiply: ComputeShader::new(sources, "passes/filter_remodulate.wgsl")?,
        })
    }

    /// Declares the division of `radiance`. Returns the light (W·m⁻²·sr⁻¹).
    pub(super) fn divide(
        &self,
        graph: &mut Graph<'_>,
        camera: &CameraUniform,
        gbuffer: &GBuffer,
        radiance: &Handle<Texture>,
    ) -> Handle<Texture> {
        let mut light = graph.texture("filter_light", radiance_desc(camera.size));
        graph
            .compute(&self.divide)
            .params(&ModulateParams::new(camera))
            .read("position", &gbuffer.position)
            .read("surface", &gbuffer.surface)
            .read("radiance", radiance)
            .write("light", &mut light)
            .dispatch_threads([camera.size[0], camera.size[1], 1]);
        light
    }

    /// Declares the multiplication of `light`; where nothing gathers light the result is `radiance`.
    pub(super) fn multiply(
        &self,
        graph: &mut Graph<'_>,
        camera: &CameraUniform,
        gbuffer: &GBuffer,
        light: &Handle<Texture>,
        radiance: &Handle<Texture>,
    ) -> Handle<Texture> {
        let mut filtered = graph.texture("filtered", radiance_desc(camera.size));
        graph
            .compute(&self.multiply)
            .params(&ModulateParams::new(camera))
            .read("position", &gbuffer.position)
            .read("surface", &gbuffer.surface)
            .read("radiance", radiance)
            .read("light", light)
            .write("filtered", &mut filtered)
            .dispatch_threads([camera.size[0], camera.size[1], 1]);
        filtered
    }
}

impl ModulateParams {
    fn new(camera: &CameraUniform) -> Self {
        Self { camera_position_world: camera.position_world(), size: camera.size, ..Self::default() }
    }
}
