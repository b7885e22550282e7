//! What the strategies that draw photons have in common: all but the geometry that each draws around a photon.
//!
//! ```text
//! sphere:     for each photon P:                          # one instance of the draw
//!                 for each pixel (x, y) that the geometry covers, with visible point X:
//!                     image[x, y] += contribution of P at X                 # blending; 0 beyond the radius of P
//!
//! ellipsoid:  for each photon P in the view:  tile_photons[tile of P] += 1
//!             for each photon P:
//!                 for each such pixel whose X the kernel of P holds:
//!                     irradiance[x, y] += Φ / a;  direction[x, y] += luminance(Φ / a) ω
//!             image = irradiance reflected from the mean direction
//! ```
//!
//! Caustics of ellipsoids are the same sums over the caustic photons alone, with the same kernels, reflected from their own mean direction.
//!
//! The first is [MML13] listing 1, the sum that `exact` makes; the second is [SA19] section 24.3.2.
//!
//! **Depth.** There is none: what is drawn covers every pixel whose visible point may lie in the kernel, and the fragment stage tests
//! that point itself. Hulls show their back faces, which no eye inside a hull and no near plane takes away.
//!
//! **Sums.** WebGPU blends 16-bit floats everywhere. They hold light in units of its mean over the scene, so that sums of 1/16,000 to
//! 65,504 times the mean have all of their 11 bits: the mean irradiance is taken as the lights' flux over the area of the scene's bounding
//! sphere, the mean radiance as a π-th of that, to the nearest power of two. Brighter pixels are cut there, and counted in
//! `pixels_overflowed`. Photons are blended in the order of the store, for rasterisation keeps the order of primitives: two runs give the
//! same bits.
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"
//! [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems chapter 24, 2019"

mod options;

pub use options::{SplatConfig, SplatKernels, SplatPrecision, SplatResolution, SplatShape};

use crate::splat_kernel::SplatKernelUniform;
use crate::{DensityTiles, Estimate, FrameInputs, KNearest, Requirements, Stats, StrategyError};
use lightloom_graph::wgpu::{BlendComponent, BlendFactor, BlendOperation, BlendState, Face, Features, TextureFormat};
use lightloom_graph::{
    Buffer, BufferDesc, ComputeShader, Graph, Handle, Load, RasterShader, Texture, TextureDesc, WgslSources, shader_struct,
};
use lightloom_passes::scene::SceneInfo;
use lightloom_passes::{CameraUniform, Irradiance, PhotonFlags, Photons, ReflectIrradiance, SceneRasterShader, radiance_desc};
use std::f32::consts::PI;

/// Sums are what is blended.
const ADD: BlendComponent =
    BlendComponent { src_factor: BlendFactor::One, dst_factor: BlendFactor::One, operation: BlendOperation::Add };

shader_struct! {
    /// The struct `SplatParams` of `shared/splat_target.wgsl`.
    pub(crate) struct SplatParams {
        pub(crate) camera: CameraUniform,
        pub(crate) kernel: SplatKernelUniform,
        pub(crate) r_min: f32,
        pub(crate) r_max: f32,
        pub(crate) scale: f32,
        pub(crate) texel: u32,
        pub(crate) film_size: [f32; 2],
        pub(crate) corners: u32,
        pub(crate) flags: u32,
    }
}

shader_struct! {
    /// Parameters of `splat_arguments`.
    struct ArgumentParams {
        vertices: u32,
        capacity: u32,
        pad0: u32,
        pad1: u32,
    }
}

shader_struct! {
    /// Parameters of `splat_downscale`.
    struct DownscaleParams {
        size: [u32; 2],
        pad0: u32,
        pad1: u32,
    }
}

shader_struct! {
    /// Parameters of `splat_resolve_spheres`.
    struct SphereParams {
        size: [u32; 2],
        unit: f32,
        largest: f32,
    }
}

shader_struct! {
    /// Parameters of `splat_resolve_ellipsoids`.
    struct EllipsoidParams {
        camera: CameraUniform,
        unit: f32,
        largest: f32,
        texel: u32,
        pad0: u32,
    }
}

/// What is drawn around a photon, of either shape.
#[derive(Debug)]
pub(crate) struct SplatGeometry {
    /// Shaders without their endings: `<stem>_sphere.wgsl` and `<stem>_ellipsoid.wgsl`.
    pub(crate) stem: &'static str,
    /// Faces that are not drawn.
    pub(crate) cull: Option<Face>,
}

/// Vertices of one photon, and the polygon's corners if they make one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outline {
    pub(crate) vertices: u32,
    pub(crate) corners: u32,
}

/// Draws photons and makes an estimate of the sums.
#[derive(Debug)]
pub(crate) struct Splat {
    nearest: KNearest,
    sphere: SceneRasterShader,
    ellipsoid: RasterShader,
    arguments: ComputeShader,
    tiles: DensityTiles,
    downscale: ComputeShader,
    resolve_spheres: ComputeShader,
    resolve_ellipsoids: ComputeShader,
    reflect: ReflectIrradiance,
}

/// What the passes of one frame are declared from.
#[derive(Clone, Copy)]
struct Draw<'a> {
    frame: &'a FrameInputs<'a>,
    photons: &'a Photons,
    params: &'a SplatParams,
    arguments: &'a Handle<Buffer>,
    precision: SplatPrecision,
}

/// The surfaces that a target's texels show.
struct Surfaces<'a> {
    nearest: &'a Handle<Texture>,
    farthest: &'a Handle<Texture>,
    surface: &'a Handle<Texture>,
}

impl Splat {
    pub(crate) fn new(sources: &WgslSources, geometry: &SplatGeometry) -> Result<Self, StrategyError> {
        let SplatGeometry { stem, cull } = *geometry;
        let draw = |shape: &str| {
            let shader = RasterShader::new(sources, &format!("strategies/{stem}_{shape}.wgsl"))?;
            Ok::<_, StrategyError>(shader.with_cull(cull).with_blend(BlendState { color: ADD, alpha: ADD }))
        };
        let compute = |name: &str| ComputeShader::new(sources, &format!("strategies/{name}.wgsl"));
        Ok(Self {
            nearest: KNearest::new(sources),
            sphere: SceneRasterShader::new(draw("sphere")?),
            ellipsoid: draw("ellipsoid")?,
            arguments: compute("splat_arguments")?,
            tiles: DensityTiles::new(sources)?,
            downscale: compute("splat_downscale")?,
            resolve_spheres: compute("splat_resolve_spheres")?,
            resolve_ellipsoids: compute("splat_resolve_ellipsoids")?,
            reflect: ReflectIrradiance::new(sources)?,
        })
    }

    /// Declares the passes; `name` labels what is returned.
    pub(crate) fn declare(
        &mut self,
        graph: &mut Graph<'_>,
        name: &'static str,
        frame: &FrameInputs<'_>,
        config: &SplatConfig,
        outline: Outline,
    ) -> Result<Estimate, StrategyError> {
        let photons = frame.need_photons(name)?;
        let by_neighbours = config.kernels.by_neighbours(&mut self.nearest, graph, frame, photons)?;
        let photons = by_neighbours.as_ref().unwrap_or(photons);
        let texel = config.texel()?;
        let target = frame.size.map(|pixels| pixels.div_ceil(texel));
        let film_size = target.map(|texels| (texels * texel) as f32);
        let params = SplatParams { texel, film_size, corners: outline.corners, ..config.kernels.params(frame, photons)? };
        let arguments = self.arguments(graph, photons, outline.vertices);
        let draw = Draw { frame, photons, params: &params, arguments: &arguments, precision: config.precision() };
        let mut overflowed = graph.buffer("splat_overflowed", BufferDesc::words(1));
        graph.clear_buffer(&mut overflowed);
        let estimate = match config.kernels.shape {
            SplatShape::Sphere => self.spheres(graph, &draw, &mut overflowed),
            SplatShape::Ellipsoid => self.ellipsoids(graph, &draw, &mut overflowed),
        };
        Ok(Estimate { stats: vec![Stats::new(overflowed, &["pixels_overflowed"])], ..estimate })
    }

    fn arguments(&self, graph: &mut Graph<'_>, photons: &Photons, vertices: u32) -> Handle<Buffer> {
        let mut arguments = graph.buffer("splat_arguments", BufferDesc::words(4));
        graph
            .compute(&self.arguments)
            .params(&ArgumentParams { vertices, capacity: photons.capacity, ..ArgumentParams::default() })
            .read("photon_state", &photons.state)
            .write("arguments", &mut arguments)
            .dispatch([1, 1, 1]);
        arguments
    }

    fn spheres(&self, graph: &mut Graph<'_>, draw: &Draw<'_>, overflowed: &mut Handle<Buffer>) -> Estimate {
        let Draw { frame, photons, params, arguments, precision } = draw;
        let [format, _] = precision.formats();
        let mut indirect_sum = graph.texture("splat_indirect_sum", TextureDesc::new_2d(frame.size, format));
        let mut caustic_sum = graph.texture("splat_caustic_sum", TextureDesc::new_2d(frame.size, format));
        graph
            .raster(&self.sphere.variant(frame.scene))
            .params(*params)
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .read("position", &frame.gbuffer.position)
            .read("surface", &frame.gbuffer.surface)
            .color("indirect", &mut indirect_sum, Load::Clear([0.0; 4]))
            .color("caustic", &mut caustic_sum, Load::Clear([0.0; 4]))
            .heavy()
            .draw_indirect(arguments, 0);

        let mut indirect = graph.texture("splat_indirect", radiance_desc(frame.size));
        let mut caustic = graph.texture("splat_caustic", radiance_desc(frame.size));
        graph
            .compute(&self.resolve_spheres)
            .params(&SphereParams { size: frame.size, unit: 1.0 / params.scale, largest: precision.largest() })
            .read("indirect_sum", &indirect_sum)
            .read("caustic_sum", &caustic_sum)
            .write("indirect", &mut indirect)
            .write("caustic", &mut caustic)
            .write("overflowed", overflowed)
            .dispatch_threads([frame.size[0], frame.size[1], 1]);
        Estimate { caustic: Some(caustic), ..Estimate::new(indirect) }
    }

    fn ellipsoids(&self, graph: &mut Graph<'_>, draw: &Draw<'_>, overflowed: &mut Handle<Buffer>) -> Estimate {
        let Draw { frame, photons, params, .. } = *draw;
        let target = frame.size.map(|pixels| pixels.div_ceil(params.texel));
        let coarse = (params.texel > 1).then(|| self.downscaled(graph, frame, target));
        let gbuffer = frame.gbuffer;
        let full = Surfaces { nearest: &gbuffer.position, farthest: &gbuffer.position, surface: &gbuffer.surface };
        let seen = coarse.as_ref().map_or(full, |[nearest, farthest, surface]| Surfaces { nearest, farthest, surface });
        let tile_photons = self.tiles.add(graph, photons, frame.camera, &params.kernel);
        let light = self.ellipsoid_light(graph, draw, &seen, &tile_photons, overflowed);
        let indirect = self.reflect.add(graph, "splat_indirect", frame.scene, frame.camera, gbuffer, &light);

        // Caustics are drawn by themselves: more targets for every photon would cost those who ask for no caustics, and these passes do not.
        let caustics = SplatParams { flags: PhotonFlags::CAUSTIC, ..*params };
        let mut uncounted = graph.buffer("splat_caustic_overflowed", BufferDesc::words(1));
        graph.clear_buffer(&mut uncounted);
        let draw = Draw { params: &caustics, ..*draw };
        let caustic = self.ellipsoid_light(graph, &draw, &seen, &tile_photons, &mut uncounted);
        let caustic = self.reflect.add(graph, "splat_caustic", frame.scene, frame.camera, gbuffer, &caustic);
        Estimate { irradiance: Some(light), caustic: Some(caustic), ..Estimate::new(indirect) }
    }

    /// The light of the photons that have the flags of `draw`.
    fn ellipsoid_light(
        &self,
        graph: &mut Graph<'_>,
        draw: &Draw<'_>,
        seen: &Surfaces<'_>,
        tile_photons: &Handle<Buffer>,
        overflowed: &mut Handle<Buffer>,
    ) -> Irradiance {
        let Draw { frame, photons, params, arguments, precision } = draw;
        let target = frame.size.map(|pixels| pixels.div_ceil(params.texel));
        let [four, two] = precision.formats();
        let mut irradiance_x = graph.texture("splat_irradiance_x", TextureDesc::new_2d(target, four));
        let mut direction_yz = graph.texture("splat_direction_yz", TextureDesc::new_2d(target, two));
        graph
            .raster(&self.ellipsoid)
            .params(*params)
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .read("tile_photons", tile_photons)
            .read("position", seen.farthest)
            .read("surface", seen.surface)
            .read("nearest", seen.nearest)
            .color("irradiance_x", &mut irradiance_x, Load::Clear([0.0; 4]))
            .color("direction_yz", &mut direction_yz, Load::Clear([0.0; 4]))
            .heavy()
            .draw_indirect(arguments, 0);

        let mut irradiance = graph.texture("splat_irradiance", radiance_desc(frame.size));
        let mut direction = graph.texture("splat_direction", radiance_desc(frame.size));
        let (unit, largest) = (1.0 / params.scale, precision.largest());
        graph
            .compute(&self.resolve_ellipsoids)
            .params(&EllipsoidParams { camera: *frame.camera, unit, largest, texel: params.texel, pad0: 0 })
            .read("position", &frame.gbuffer.position)
            .read("surface", &frame.gbuffer.surface)
            .read("nearest", seen.nearest)
            .read("farthest", seen.farthest)
            .read("farthest_surface", seen.surface)
            .read("irradiance_x", &irradiance_x)
            .read("direction_yz", &direction_yz)
            .write("irradiance", &mut irradiance)
            .write("direction", &mut direction)
            .write("overflowed", overflowed)
            .dispatch_threads([frame.size[0], frame.size[1], 1]);
        Irradiance { irradiance, direction }
    }

    /// Nearest and farthest points of each texel, and the surfaces of the farthest.
    fn downscaled(&self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>, target: [u32; 2]) -> [Handle<Texture>; 3] {
        let mut nearest = graph.texture("splat_nearest", radiance_desc(target));
        let mut farthest = graph.texture("splat_farthest", radiance_desc(target));
        let mut surface = graph.texture("splat_surface", TextureDesc::new_2d(target, TextureFormat::Rgba32Uint));
        graph
            .compute(&self.downscale)
            .params(&DownscaleParams { size: frame.size, ..DownscaleParams::default() })
            .read("position", &frame.gbuffer.position)
            .read("surface", &frame.gbuffer.surface)
            .write("nearest", &mut nearest)
            .write("farthest", &mut farthest)
            .write("farthest_surface", &mut surface)
            .dispatch_threads([target[0], target[1], 1]);
        [nearest, farthest, surface]
    }
}

impl SplatConfig {
    /// What the targets ask of a device.
    pub(crate) fn requirements(&self) -> Requirements {
        let features = match self.precision() {
            SplatPrecision::Half => Features::empty(),
            SplatPrecision::Float => Features::FLOAT32_BLENDABLE,
        };
        Requirements { features, ..Requirements::default() }
    }
}

/// One over the mean of what is summed, as far as the scene tells: a power of two, which rounds nothing.
pub(crate) fn scale(info: &SceneInfo, shape: SplatShape) -> f32 {
    let irradiance = info.total_power.max_element() / (4.0 * PI * info.bounds_radius * info.bounds_radius);
    let mean = match shape {
        SplatShape::Sphere => irradiance / PI,
        SplatShape::Ellipsoid => irradiance,
    };
    inverse_power_of_two(mean)
}

/// One over the power of two nearest to `mean`: 1 where there is none.
pub(crate) fn inverse_power_of_two(mean: f32) -> f32 {
    // Far beyond any scene, and within what a float can say of its inverse.
    if mean.is_finite() && mean > 0.0 { (-mean.log2().round().clamp(-100.0, 100.0)).exp2() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Assignment;
    use crate::test_scene::unit_scene;
    use glam::Vec3;

    #[test]
    fn targets_hold_light_in_units_of_its_mean() {
        // 4π R² = 9.42 m².
        let scene = SceneInfo { total_power: Vec3::new(1.0, 942.0, 3.0), ..unit_scene() };
        assert_eq!(scale(&scene, SplatShape::Ellipsoid).to_bits(), 2.0_f32.powi(-7).to_bits(), "100 W/m²");
        assert_eq!(scale(&scene, SplatShape::Sphere).to_bits(), 2.0_f32.powi(-5).to_bits(), "32 W/(m² sr)");
        for total_power in [Vec3::ZERO, Vec3::splat(f32::NAN), Vec3::splat(f32::INFINITY)] {
            let scale = scale(&SceneInfo { total_power, ..unit_scene() }, SplatShape::Sphere);
            assert_eq!(scale.to_bits(), 1.0_f32.to_bits(), "{total_power}");
        }
        for power in [1e-38, 3e38] {
            let scale = scale(&SceneInfo { total_power: Vec3::splat(power), ..unit_scene() }, SplatShape::Sphere);
            assert!(scale.is_normal() && (1.0 / scale).is_normal(), "{power}: {scale}");
        }
    }

    #[test]
    fn options_out_of_range_are_refused() {
        let mut config = SplatConfig::new(SplatShape::Sphere);
        for (key, value) in
            [("shape", "cube"), ("shape", "auto"), ("precision", "double"), ("resolution", "quarter"), ("s_max", "0")]
        {
            let error = config.set(&Assignment { strategy: "splat-3d", key, value }).unwrap_err().to_string();
            assert!(error.contains(key) && error.contains(value) && error.contains("is needed"), "{error}");
        }
        let mut set = |key, value| config.set(&Assignment { strategy: "splat-3d", key, value }).unwrap();
        assert!(set("precision", "float") && set("resolution", "half") && set("r_max", "2") && set("tile", "8"));
        assert!(!set("colour", "red"), "an unknown key is left to others");
        let error = config.texel().unwrap_err().to_string();
        assert!(error.contains("resolution") && error.contains("shape=ellipsoid"), "{error}");
        assert_eq!(config.requirements().features, Features::FLOAT32_BLENDABLE);
        config.kernels.shape = SplatShape::Ellipsoid;
        assert_eq!(config.texel().unwrap(), 2);
    }
}
