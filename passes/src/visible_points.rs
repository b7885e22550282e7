//! Where light is gathered for each pixel, also by way of mirrors and glass: the visible points of [HJ09].
//!
//! ```text
//! for each pixel whose first surface gathers:  X = that point, throughput 1, seen 0
//! for each other pixel:                        # a mirror, or something that transmits
//!     follow the eye's ray: at each surface one direction of its scattering, by chance
//!         seen += what emits on the way;  at a rough dielectric also light straight from the lights
//!     X = the first surface that gathers;  seen += light straight from the lights at X
//! after gathering:  radiance = throughput · gathered(X) + seen
//! ```
//!
//! The points lie in the layout of the G-buffer, so that whatever gathers at a [`GBuffer`] by `visible_point` of `shared/gbuffer.wgsl` gathers at them,
//! unchanged; they are next to one another in the image but not in space, and have a direction in place of their distance, so that neither
//! filters nor upsampling make sense of them. One sample a frame: the mean over frames with their own [`PathSettings::frame`] and jitter of the camera
//! has all directions and the whole of the pixel.
//!
//! **Each path of light counts once.** The eye's part of it ends at the first surface that gathers, the photons' part begins with two scatterings
//! before it, and what comes straight from a light is in `seen`; [`DirectLight`](crate::DirectLight) has the emission of the first surface and leaves all
//! else of such pixels alone. Of a surface that transmits in part, either part is seen with its probability.
//!
//! **Rough dielectrics** do not gather, since a G-buffer knows one side of a surface: the path goes on through them as a path tracer's does, with next-event
//! estimation. A caustic of a point light that falls on one and is seen there is found by neither.
//!
//! The eye's part may be as long as [`PathSettings::max_bounces`] says, and the photons' part again.
//!
//! [HJ09]: https://doi.org/10.1145/1618452.1618487 "Stochastic progressive photon mapping, Hachisuka and Jensen, 2009"

use crate::scene::{SceneHandles, SceneInfo};
use crate::scene_shader::SceneShader;
use crate::{CameraUniform, GBuffer, LightInfo, PathSettings, radiance_desc};
use lightloom_graph::wgpu::TextureFormat;
use lightloom_graph::{ComputeShader, Graph, Handle, ShaderError, Texture, TextureDesc, WgslSources, shader_struct};

shader_struct! {
    struct VisiblePointsParams {
        camera: CameraUniform,
        lights: LightInfo,
        seed: u32,
        frame: u32,
        max_bounces: u32,
        pad0: u32,
    }
}

shader_struct! {
    struct VisiblePointsResolveParams {
        size: [u32; 2],
        pad0: u32,
        pad1: u32,
    }
}

/// Points to gather at, and what the eye receives of them.
#[derive(Debug)]
pub struct VisiblePoints {
    /// The points; none of them is specular. In place of [`GBuffer::emission`] there is what the eye sees besides what is gathered
    /// (W·m⁻²·sr⁻¹), without the emission of first surfaces.
    pub gbuffer: GBuffer,
    /// `rgba32float`: part of a point's radiance that the eye receives, and 1 where it sees the point itself, 0 elsewhere.
    pub throughput: Handle<Texture>,
}

/// Finds visible points, and brings what is gathered at them to the eye. A thread per pixel.
#[derive(Clone, Debug)]
pub struct VisiblePointsPass {
    follow: SceneShader,
    resolve: ComputeShader,
}

impl VisiblePointsPass {
    /// Parses the shaders.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self {
            follow: SceneShader::new(sources, "passes/visible_points.wgsl")?,
            resolve: ComputeShader::new(sources, "passes/visible_points_resolve.wgsl")?,
        })
    }

    /// Declares the pass that finds the points. Reads: scene, G-buffer.
    pub fn add(
        &self,
        graph: &mut Graph<'_>,
        scene: &SceneHandles,
        info: &SceneInfo,
        camera: &CameraUniform,
        gbuffer: &GBuffer,
        settings: PathSettings,
    ) -> VisiblePoints {
        let surfaces = TextureDesc::new_2d(camera.size, TextureFormat::Rgba32Uint);
        let mut points = VisiblePoints {
            gbuffer: GBuffer {
                position: graph.texture("visible_position", radiance_desc(camera.size)),
                surface: graph.texture("visible_surface", surfaces),
                emission: graph.texture("visible_seen", radiance_desc(camera.size)),
                motion: None,
            },
            throughput: graph.texture("visible_throughput", radiance_desc(camera.size)),
        };
        let params = VisiblePointsParams {
            camera: *camera,
            lights: info.into(),
            seed: settings.seed,
            frame: settings.frame,
            max_bounces: settings.max_bounces,
            pad0: 0,
        };
        scene
            .bind(graph.compute(&self.follow.variant(scene)).params(&params))
            .read("position", &gbuffer.position)
            .read("surface", &gbuffer.surface)
            .write("visible_position", &mut points.gbuffer.position)
            .write("visible_surface", &mut points.gbuffer.surface)
            .write("throughput", &mut points.throughput)
            .write("seen", &mut points.gbuffer.emission)
            .heavy()
            .dispatch_threads([camera.size[0], camera.size[1], 1]);
        points
    }

    /// Declares the pass that brings light to the eye. `gathered`: radiance of the points, and its caustic part. Returns indirect light and
    /// its caustic part for all pixels (W·m⁻²·sr⁻¹); those whose first surface is specular have no caustics, as a diffuse surface stands
    /// before it.
    pub fn resolve(
        &self,
        graph: &mut Graph<'_>,
        points: &VisiblePoints,
        gathered: [&Handle<Texture>; 2],
        size: [u32; 2],
    ) -> [Handle<Texture>; 2] {
        let [mut indirect, mut caustic] =
            ["visible_indirect", "visible_caustic"].map(|name| graph.texture(name, radiance_desc(size)));
        graph
            .compute(&self.resolve)
            .params(&VisiblePointsResolveParams { size, ..VisiblePointsResolveParams::default() })
            .read("throughput", &points.throughput)
            .read("seen", &points.gbuffer.emission)
            .read("gathered_indirect", gathered[0])
            .read("gathered_caustic", gathered[1])
            .write("indirect", &mut indirect)
            .write("caustic", &mut caustic)
            .dispatch_threads([size[0], size[1], 1]);
        [indirect, caustic]
    }
}
