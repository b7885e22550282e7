//! Photons splatted by compute shaders, without the rasteriser: for devices with few raster units.
//!
//! ```text
//! for each photon P:                                          # a thread each
//!     box = pixels that the kernel of P may reach
//!     if box is small:  for each pixel (x, y) of it, with visible point X:  sum[x, y] += contribution of P at X
//!     else:             blocks[P] = number of blocks of pixels in box
//! offsets = prefix sum of blocks
//! for each block of offsets:                                  # a workgroup each
//!     P = photon whose blocks hold it                         # by bisection
//!     for each pixel (x, y) of it:  sum[x, y] += contribution of P at X
//! image = sum
//! ```
//!
//! [MML13] listing 1, with loops in place of the rasteriser and atomic additions in place of blending ([SA19] section 24.6.1). Kernels and their
//! bounds are those of `splat-2.5d`: `shape=sphere` sums what `exact` sums, `shape=ellipsoid` what the drawing strategies do. Biased for any
//! radius above 0; consistent as radii shrink and photons grow, and with `ellipsoid` only for Lambertian surfaces.
//!
//! **Balance.** A splat of up to 64 pixels is a thread's; a wider one is cut into blocks of 16 × 16 pixels and more, at the most 16 × 16 of them. Nothing
//! lists the blocks: a workgroup finds its splat by bisection in the prefix sum, so that there is no room to run out of, however many and
//! however wide the splats.
//!
//! **Sums.** [`SplatSums::Fixed`]: whole numbers of 64 bits, in two words with the carry between them, which add up to the same in every order.
//! The unit is `2⁻³⁴ m`, m the mean of what is summed: the lights' flux over the area of the scene's bounding sphere, over π for radiance, to the
//! next power of two. n addends are rounded by `n 2⁻³⁵ m` in all, against `exact`, whose own sum of S is rounded by up to `n 2⁻²⁴ S`: the larger of the
//! two wherever a pixel has more than a 2,000th of the mean. Sums beyond `2²⁹ m` are cut there, and counted in `pixels_overflowed`.
//! [`SplatSums::Float`]: 32-bit floats, added in whatever order threads come.
//!
//! Bytes moved, for N photons of s = 32 or 20 bytes, X pixels, B blocks, and H pairs of a photon and a pixel it adds to, of T that are tested:
//!
//! | pass | reads | writes |
//! |---|---|---|
//! | clearing | | 52 X, or 24 X floats |
//! | `splat_small`, `splat_blocks` | s N, s + 4 log₂ N a block, 16 T, 16 H | 4 N, and 24 H by atomics, or 12 H floats; twice that for spheres of caustics |
//! | prefix sum | 8 N | 4 N |
//! | `splat_sums_resolve` | 52 X, or 24 X | 32 X |
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"
//! [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems chapter 24, 2019"

use crate::parameter::Assignment;
use crate::splat::SplatParams;
use crate::{
    DensityTiles, Estimate, FrameInputs, KNearest, Parameter, Requirements, SplatKernels, SplatShape, Stats, Strategy,
    StrategyError,
};
use lightloom_graph::wgpu::Features;
use lightloom_graph::{
    Buffer, BufferDesc, ComputePass, ComputeShader, Graph, Handle, ShaderError, Texture, WgslSources, shader_struct,
};
use lightloom_passes::scene::SceneInfo;
use lightloom_passes::{Irradiance, PhotonFlags, Photons, PrefixSum, ReflectIrradiance, SceneShader, radiance_desc};
use std::fmt;

/// The sums' file, and its stand-in for floats.
const FIXED_FILE: &str = "shared/splat_sums.wgsl";
const FLOAT_FILE: &str = "shared/splat_sums_float.wgsl";

shader_struct! {
    /// Parameters of `splat_block_arguments`.
    struct ArgumentParams {
        capacity: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

shader_struct! {
    /// Parameters of `splat_sums_resolve`.
    struct ResolveParams {
        size: [u32; 2],
        unit: f32,
        pad0: u32,
    }
}

/// What pixels are summed in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplatSums {
    /// Fixed point of 64 bits: everywhere, and the same bits in every run.
    Fixed,
    /// 32-bit floats, on devices with `SHADER_FLOAT32_ATOMIC`: fewer additions, in racing order.
    Float,
}

/// What a user can choose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplatComputeConfig {
    /// The kernels.
    pub kernels: SplatKernels,
    /// What pixels are summed in. Automatic: fixed point, for a frame is declared before its device is known. Deterministic frames are
    /// summed in fixed point in any case.
    pub sums: Option<SplatSums>,
}

/// The strategy `splat-compute`.
#[derive(Debug)]
pub struct SplatCompute {
    /// Parameters; may change between frames.
    pub config: SplatComputeConfig,
    nearest: KNearest,
    fixed: Shaders,
    float: Shaders,
    tiles: DensityTiles,
    prefix_sum: PrefixSum,
    arguments: ComputeShader,
    reflect: ReflectIrradiance,
}

/// The shaders that know what sums are.
#[derive(Debug)]
struct Shaders {
    spheres: ShapeShaders,
    ellipsoids: ShapeShaders,
    resolve: ComputeShader,
}

/// The shaders that know what a splat is.
#[derive(Debug)]
struct ShapeShaders {
    small: SceneShader,
    blocks: SceneShader,
}

/// The words of two sums of three components per pixel, by the names of their bindings.
pub(crate) struct Sums(pub(crate) Vec<(&'static str, Handle<Buffer>)>);

impl SplatSums {
    /// `sources` with what stands for these sums.
    ///
    /// # Errors
    /// If `sources` lack the file.
    pub fn shaders(self, sources: &WgslSources) -> Result<WgslSources, ShaderError> {
        match self {
            Self::Fixed => Ok(sources.clone()),
            Self::Float => sources.with_stand_in(FIXED_FILE, FLOAT_FILE),
        }
    }

    /// Buffers of zeros for `pixels`, and words of each pixel.
    pub(crate) fn add(self, graph: &mut Graph<'_>, pixels: u64) -> Sums {
        let names: &[(&'static str, u64)] = match self {
            Self::Fixed => &[("first_low", 4), ("first_high", 3), ("second_low", 3), ("second_high", 3)],
            Self::Float => &[("first_sum", 3), ("second_sum", 3)],
        };
        let zeros = |&(name, words): &(&'static str, u64)| {
            let mut buffer = graph.buffer(name, BufferDesc::words(words * pixels));
            graph.clear_buffer(&mut buffer);
            (name, buffer)
        };
        Sums(names.iter().map(zeros).collect())
    }
}

impl Shaders {
    fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        let shape = |folder: &str| {
            let pass = |pass: &str| SceneShader::new(sources, &format!("strategies/{folder}splat_{pass}.wgsl"));
            Ok::<_, StrategyError>(ShapeShaders { small: pass("small")?, blocks: pass("blocks")? })
        };
        let resolve = ComputeShader::new(sources, "strategies/splat_sums_resolve.wgsl")?;
        Ok(Self { spheres: shape("")?, ellipsoids: shape("splat_ellipsoid/")?, resolve })
    }
}

/// What the passes of one frame are declared from.
#[derive(Clone, Copy)]
struct Splatting<'a> {
    frame: &'a FrameInputs<'a>,
    photons: &'a Photons,
    params: &'a SplatParams,
    /// For ellipsoids.
    tile_photons: Option<&'a Handle<Buffer>>,
}

impl Splatting<'_> {
    /// A pass that adds photons to `sums`, with what both of them are given.
    fn pass<'p, 'g>(&self, graph: &'p mut Graph<'g>, shader: &ComputeShader, sums: &mut Sums) -> ComputePass<'p, 'g> {
        let Self { frame, photons, params, tile_photons } = *self;
        let mut pass = graph
            .compute(shader)
            .params(params)
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .read("position", &frame.gbuffer.position)
            .read("surface", &frame.gbuffer.surface);
        if let Some(tile_photons) = tile_photons {
            pass = pass.read("tile_photons", tile_photons);
        }
        for (name, words) in &mut sums.0 {
            pass = pass.write(name, words);
        }
        pass
    }
}

impl SplatCompute {
    /// Its name in the registry.
    pub const NAME: &'static str = "splat-compute";

    /// The strategy with default parameters, spheres; `sources` holds its shaders, see [`lightloom_passes::shaders`].
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            config: SplatComputeConfig { kernels: SplatKernels::new(SplatShape::Sphere), sums: None },
            nearest: KNearest::new(sources),
            fixed: Shaders::new(&SplatSums::Fixed.shaders(sources)?)?,
            float: Shaders::new(&SplatSums::Float.shaders(sources)?)?,
            tiles: DensityTiles::new(sources)?,
            prefix_sum: PrefixSum::new(sources)?,
            arguments: ComputeShader::new(sources, "strategies/splat_block_arguments.wgsl")?,
            reflect: ReflectIrradiance::new(sources)?,
        })
    }

    fn sums(&self, deterministic: bool) -> SplatSums {
        if deterministic { SplatSums::Fixed } else { self.config.sums.unwrap_or(SplatSums::Fixed) }
    }

    /// The images of both sums. `stats` takes the counts.
    fn summed(
        &self,
        graph: &mut Graph<'_>,
        sums: SplatSums,
        splatting: &Splatting<'_>,
        stats: &mut Handle<Buffer>,
    ) -> [Handle<Texture>; 2] {
        let shaders = match sums {
            SplatSums::Fixed => &self.fixed,
            SplatSums::Float => &self.float,
        };
        let of_shape = match self.config.kernels.shape {
            SplatShape::Sphere => &shaders.spheres,
            SplatShape::Ellipsoid => &shaders.ellipsoids,
        };
        let [width, height] = splatting.frame.size.map(u64::from);
        let mut sums = sums.add(graph, width * height);
        self.splat(graph, of_shape, splatting, &mut sums, stats);
        self.resolve(graph, &shaders.resolve, splatting, &sums, stats)
    }

    /// Irradiance reflected from its mean direction, and that of caustics by themselves, whose passes cost only those who ask for them.
    fn ellipsoids(
        &self,
        graph: &mut Graph<'_>,
        sums: SplatSums,
        splatting: &Splatting<'_>,
        stats: &mut Handle<Buffer>,
    ) -> Estimate {
        let Splatting { frame, params, .. } = *splatting;
        let reflected = |graph: &mut Graph<'_>, name, light: &Irradiance| {
            self.reflect.add(graph, name, frame.scene, frame.camera, frame.gbuffer, light)
        };
        let [irradiance, direction] = self.summed(graph, sums, splatting, stats);
        let light = Irradiance { irradiance, direction };
        let indirect = reflected(graph, "splat_indirect", &light);

        let params = SplatParams { flags: PhotonFlags::CAUSTIC, ..*params };
        let mut uncounted = graph.buffer("splat_caustic_stats", BufferDesc::words(2));
        graph.clear_buffer(&mut uncounted);
        let caustics = Splatting { params: &params, ..*splatting };
        let [irradiance, direction] = self.summed(graph, sums, &caustics, &mut uncounted);
        let caustic = reflected(graph, "splat_caustic", &Irradiance { irradiance, direction });
        Estimate { irradiance: Some(light), caustic: Some(caustic), ..Estimate::new(indirect) }
    }

    /// Adds all photons to `sums`. `stats` takes the number of blocks.
    fn splat(
        &self,
        graph: &mut Graph<'_>,
        shaders: &ShapeShaders,
        splatting: &Splatting<'_>,
        sums: &mut Sums,
        stats: &mut Handle<Buffer>,
    ) {
        let Splatting { frame, photons, .. } = *splatting;
        let capacity = photons.capacity;
        let mut counts = graph.buffer("splat_counts", BufferDesc::words(capacity.into()));
        let shader = shaders.small.variant(frame.scene);
        splatting.pass(graph, &shader, sums).write("splat_counts", &mut counts).heavy().dispatch_1d(capacity);

        let mut offsets = graph.buffer("splat_offsets", BufferDesc::words(u64::from(capacity) + 1));
        self.prefix_sum.add(graph, &counts, &mut offsets, capacity);
        let mut arguments = graph.buffer("splat_block_arguments", BufferDesc::words(3));
        graph
            .compute(&self.arguments)
            .params(&ArgumentParams { capacity, ..ArgumentParams::default() })
            .read("splat_offsets", &offsets)
            .write("arguments", &mut arguments)
            .write("stats", stats)
            .dispatch([1, 1, 1]);

        let shader = shaders.blocks.variant(frame.scene);
        splatting.pass(graph, &shader, sums).read("splat_offsets", &offsets).heavy().dispatch_indirect(&arguments, 0);
    }

    /// The two sums as images.
    fn resolve(
        &self,
        graph: &mut Graph<'_>,
        shader: &ComputeShader,
        splatting: &Splatting<'_>,
        sums: &Sums,
        stats: &mut Handle<Buffer>,
    ) -> [Handle<Texture>; 2] {
        let Splatting { frame, params, .. } = *splatting;
        let names = match self.config.kernels.shape {
            SplatShape::Sphere => ["splat_indirect", "splat_caustic"],
            SplatShape::Ellipsoid => ["splat_irradiance", "splat_direction"],
        };
        let [mut first, mut second] = names.map(|name| graph.texture(name, radiance_desc(frame.size)));
        let mut pass = graph
            .compute(shader)
            .params(&ResolveParams { size: frame.size, unit: 1.0 / params.scale, pad0: 0 })
            .write("first", &mut first)
            .write("second", &mut second)
            .write("stats", stats);
        for (name, words) in &sums.0 {
            pass = pass.read(name, words);
        }
        pass.dispatch_threads([frame.size[0], frame.size[1], 1]);
        [first, second]
    }
}

impl Strategy for SplatCompute {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        "each photon added to the pixels around it by atomics, without the rasteriser [MML13], [SA19]; biased by its radius, consistent"
    }

    fn requirements(&self) -> Requirements {
        let features = match self.config.sums {
            Some(SplatSums::Float) => Features::SHADER_FLOAT32_ATOMIC,
            Some(SplatSums::Fixed) | None => Features::empty(),
        };
        Requirements { features, ..Requirements::default() }
    }

    fn reach_m(&self, info: &SceneInfo, emitted: u32) -> Option<f32> {
        self.config.kernels.reach_m(info, emitted)
    }

    fn declare(&mut self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>) -> Result<Estimate, StrategyError> {
        let photons = frame.need_photons(Self::NAME)?;
        let by_neighbours = self.config.kernels.by_neighbours(&mut self.nearest, graph, frame, photons)?;
        let photons = by_neighbours.as_ref().unwrap_or(photons);
        let params = self.config.kernels.params(frame, photons)?;
        let shape = self.config.kernels.shape;
        let sums = self.sums(frame.deterministic);
        let mut stats = graph.buffer("splat_stats", BufferDesc::words(2));
        graph.clear_buffer(&mut stats);
        let splatting = Splatting { frame, photons, params: &params, tile_photons: None };
        let estimate = match shape {
            SplatShape::Sphere => {
                let [indirect, caustic] = self.summed(graph, sums, &splatting, &mut stats);
                Estimate { caustic: Some(caustic), ..Estimate::new(indirect) }
            }
            SplatShape::Ellipsoid => {
                let tile_photons = self.tiles.add(graph, photons, frame.camera, &params.kernel);
                let splatting = Splatting { tile_photons: Some(&tile_photons), ..splatting };
                self.ellipsoids(graph, sums, &splatting, &mut stats)
            }
        };
        Ok(Estimate { stats: vec![Stats::new(stats, &["pixel_blocks", "pixels_overflowed"])], ..estimate })
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        let assignment = Assignment { strategy: Self::NAME, key, value };
        match key {
            "sums" => {
                self.config.sums = match value {
                    "fixed" => Some(SplatSums::Fixed),
                    "float" => Some(SplatSums::Float),
                    "auto" => None,
                    _ => return Err(assignment.refuse("`fixed`, `float` or `auto` is needed")),
                }
            }
            _ if self.config.kernels.set(&assignment)? => {}
            _ => return Err(assignment.unknown(&self.parameters())),
        }
        Ok(())
    }

    fn parameters(&self) -> Vec<Parameter> {
        let sums = "what pixels are summed in: `fixed` point, the same in every order, or `float` where the device adds floats atomically; `auto` is `fixed`";
        let mut parameters = self.config.kernels.parameters();
        parameters.push(Parameter::new("sums", self.config.sums, sums));
        parameters
    }
}

impl fmt::Display for SplatSums {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fixed => "fixed",
            Self::Float => "float",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_out_of_range_are_refused_and_floats_ask_for_their_feature() {
        let mut strategy = SplatCompute::new(&lightloom_passes::shaders()).unwrap();
        for (key, value) in [("shape", "cube"), ("sums", "double"), ("r_max", "0"), ("s_max", "0.5"), ("precision", "half")] {
            let error = strategy.set(key, value).unwrap_err().to_string();
            assert!(error.contains(key) && (error.contains(value) || error.contains("its parameters are")), "{error}");
        }
        assert_eq!(strategy.requirements().features, Features::empty());
        strategy.set("sums", "float").unwrap();
        assert_eq!(strategy.requirements().features, Features::SHADER_FLOAT32_ATOMIC);
        assert_eq!((strategy.sums(false), strategy.sums(true)), (SplatSums::Float, SplatSums::Fixed));
        strategy.set("sums", "auto").unwrap();
        assert_eq!(strategy.sums(false), SplatSums::Fixed);
    }
}
