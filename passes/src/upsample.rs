//! Light gathered at one pixel of each square, and carried over to the others: [MML13] section 2.3.2, "Regular".
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"

use crate::{CameraUniform, GBuffer, radiance_desc};
use lightloom_graph::wgpu::TextureFormat;
use lightloom_graph::{ComputeShader, Graph, Handle, ShaderError, Texture, TextureDesc, WgslSources, shader_struct};

/// What is seen through one pixel of each square of `stride` × `stride` pixels; encoded as in [`GBuffer`].
#[derive(Debug)]
pub struct SubsampledPoints {
    /// As [`GBuffer::position`].
    pub position: Handle<Texture>,
    /// As [`GBuffer::surface`].
    pub surface: Handle<Texture>,
    /// Squares along each axis.
    pub size: [u32; 2],
    /// Edge of a square (pixels).
    pub stride: u32,
}

shader_struct! {
    struct SubsampleParams {
        size: [u32; 2],
        stride: u32,
        pad0: u32,
    }
}

shader_struct! {
    struct UpsampleParams {
        camera_position_world: [f32; 3],
        stride: u32,
        size: [u32; 2],
        square_m: f32,
        pad0: u32,
    }
}

/// Chooses the pixels that gather. Reads: G-buffer. A thread per square.
#[derive(Clone, Debug)]
pub struct Subsample {
    shader: ComputeShader,
}

impl Subsample {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: ComputeShader::new(sources, "passes/subsample.wgsl")? })
    }

    /// Declares the pass. `size`: the G-buffer's (pixels).
    pub fn add(&self, graph: &mut Graph<'_>, gbuffer: &GBuffer, size: [u32; 2], stride: u32) -> SubsampledPoints {
        let squares = size.map(|pixels| pixels.div_ceil(stride));
        let mut points = SubsampledPoints {
            position: graph.texture("subsampled_position", radiance_desc(squares)),
            surface: graph.texture("subsampled_surface", TextureDesc::new_2d(squares, TextureFormat::Rgba32Uint)),
            size: squares,
            stride,
        };
        graph
            .compute(&self.shader)
            .params(&SubsampleParams { size, stride, pad0: 0 })
            .read("position", &gbuffer.position)
            .read("surface", &gbuffer.surface)
            .write("small_position", &mut points.position)
            .write("small_surface", &mut points.surface)
            .dispatch_threads([squares[0], squares[1], 1]);
        points
    }
}

/// Joint bilateral upsampling [Kopf07] by geometry, of light before its reflection, so that textures stay sharp. Reads: G-buffer, the
/// points, their radiance. A thread per pixel.
///
/// [Kopf07]: https://doi.org/10.1145/1276377.1276497 "Joint bilateral upsampling, Kopf, Cohen, Lischinski and Uyttendaele, 2007"
#[derive(Clone, Debug)]
pub struct Upsample {
    shader: ComputeShader,
}

impl Upsample {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self { shader: ComputeShader::new(sources, "passes/upsample.wgsl")? })
    }

    /// Declares the pass. `radiance` is that of `points` (W·m⁻²·sr⁻¹); returns that of all pixels in a texture called `name`, black
    /// where nothing gathers light.
    pub fn add(
        &self,
        graph: &mut Graph<'_>,
        name: &str,
        camera: &CameraUniform,
        gbuffer: &GBuffer,
        points: &SubsampledPoints,
        radiance: &Handle<Texture>,
    ) -> Handle<Texture> {
        let mut all = graph.texture(name, radiance_desc(camera.size));
        let params = UpsampleParams {
            camera_position_world: camera.position_world(),
            stride: points.stride,
            size: camera.size,
            square_m: points.stride as f32 * camera.pixel_angle(),
            pad0: 0,
        };
        graph
            .compute(&self.shader)
            .name(name)
            .params(&params)
            .read("position", &gbuffer.position)
            .read("surface", &gbuffer.surface)
            .read("small_position", &points.position)
            .read("small_surface", &points.surface)
            .read("small_radiance", radiance)
            .write("radiance", &mut all)
            .dispatch_threads([camera.size[0], camera.size[1], 1]);
        all
    }
}
