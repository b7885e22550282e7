//! How much is gathered, and where: one meaning for all strategies that gather at pixels.
//!
//! ```text
//! selection p      each pixel takes each photon with probability p, on its own draw, and weighs it 1/p       (noise, no bias)
//! subsampling k    one pixel of each k × k gathers; the others get its light by joint bilateral upsampling   (blur, no noise)
//! ```
//!
//! [MML13] section 2.3.2. Both divide the work, by 1/p and by k². Selection adds `Σ c² (1 − p)/p` to the variance of a sum of
//! contributions c, and leaves its mean; subsampling loses what is smaller than k pixels.
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"

use crate::parameter::Assignment;
use crate::{Estimate, FrameInputs, Parameter, Stats, StrategyError};
use lightloom_graph::{ComputeShader, Graph, Handle, Texture, WgslSources, shader_struct};
use lightloom_passes::{SceneShader, Subsample, SubsampledPoints, Upsample, radiance_desc};

/// Below this, what is passed over between two photons, drawn from 24 bits, would be too coarse.
const MIN_SELECTION: f32 = 1.0 / 1024.0;
/// Squares so wide that a screen has a few thousand of them.
const MAX_SUBSAMPLING: u32 = 16;

shader_struct! {
    /// The struct `GatherSampling` of `shared/gather_sampling.wgsl`.
    pub(crate) struct SamplingParams {
        seed: u32,
        inverse_log: f32,
        weight: f32,
        pad0: u32,
    }
}

/// How much of the photons, and at how many of the pixels, a strategy gathers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GatherSampling {
    /// Probability with which a pixel takes a photon, 1/1024 to 1. Less: more noise, in proportion less work. Automatic: 1.
    pub selection: Option<f32>,
    /// Edge (pixels) of the squares of which one pixel gathers for all, 1 to 16. More: more blur, quadratically less work.
    /// Automatic: 1.
    pub subsampling: Option<u32>,
}

impl GatherSampling {
    /// Sets `selection` or `subsampling`; `false` if the key is another.
    pub(crate) fn set(&mut self, assignment: &Assignment<'_>) -> Result<bool, StrategyError> {
        match assignment.key {
            "selection" => {
                let fits = |p: &f32| (MIN_SELECTION..=1.0).contains(p);
                self.selection = assignment.parse(fits, "a probability from 1/1024 (0.0009765625) to 1, or `auto`, is needed")?;
            }
            "subsampling" => {
                let fits = |k: &u32| (1..=MAX_SUBSAMPLING).contains(k);
                self.subsampling = assignment.parse(fits, "a number from 1 to 16, or `auto`, is needed")?;
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    pub(crate) fn parameters(&self) -> [Parameter; 2] {
        let selection =
            "probability with which a pixel takes a photon, which then weighs 1/selection; less is noisier and faster";
        let subsampling = "edge (pixels) of the squares of which one pixel gathers for all; more is blurrier and faster";
        [Parameter::new("selection", self.selection, selection), Parameter::new("subsampling", self.subsampling, subsampling)]
    }

    fn stochastic(&self) -> bool {
        self.selection.is_some_and(|p| p < 1.0)
    }

    /// What the gathering shader is told.
    pub(crate) fn params(&self, seed: u32) -> SamplingParams {
        let p = self.selection.unwrap_or(1.0);
        let inverse_log = if self.stochastic() { (1.0 / (-p).ln_1p()).max(f32::MIN) } else { 0.0 };
        SamplingParams { seed, inverse_log, weight: 1.0 / p, pad0: 0 }
    }
}

/// The shader of a gathering pass, with selection and without, and the passes around it.
#[derive(Debug)]
pub(crate) struct Gather {
    every_photon: SceneShader,
    some_photons: SceneShader,
    /// Edge (points) of the squares that a thread of `every_photon` gathers for.
    edge: u32,
    subsample: Subsample,
    upsample: Upsample,
}

impl Gather {
    /// Parses the shaders; `path` is that of the gathering one, a point to a thread.
    pub(crate) fn new(sources: &WgslSources, path: &str) -> Result<Self, StrategyError> {
        let shader = SceneShader::new(sources, path)?;
        Self::with_shaders(sources, shader.clone(), shader, 1)
    }

    /// As [`Self::new`]; the shader in `blocks` takes its place where every photon is gathered, with 4 × 4 points to a thread.
    pub(crate) fn with_blocks(sources: &WgslSources, path: &str, blocks: &str) -> Result<Self, StrategyError> {
        Self::with_shaders(sources, SceneShader::new(sources, blocks)?, SceneShader::new(sources, path)?, 4)
    }

    fn with_shaders(sources: &WgslSources, every: SceneShader, some: SceneShader, edge: u32) -> Result<Self, StrategyError> {
        Ok(Self {
            every_photon: every,
            some_photons: some.with_constant("STOCHASTIC", 1.0)?,
            edge,
            subsample: Subsample::new(sources)?,
            upsample: Upsample::new(sources)?,
        })
    }

    /// The gathering shader.
    pub(crate) fn shader(&self, frame: &FrameInputs<'_>, sampling: &GatherSampling) -> ComputeShader {
        let shader = if sampling.stochastic() { &self.some_photons } else { &self.every_photon };
        shader.variant(frame.scene)
    }

    /// Its threads along each axis.
    pub(crate) fn threads(&self, points: &GatherPoints<'_>, sampling: &GatherSampling) -> [u32; 3] {
        let edge = if sampling.stochastic() { 1 } else { self.edge };
        let [x, y] = points.size().map(|points| points.div_ceil(edge));
        [x, y, 1]
    }

    /// The points that gather.
    pub(crate) fn points<'a>(
        &self,
        graph: &mut Graph<'_>,
        frame: &FrameInputs<'a>,
        sampling: &GatherSampling,
    ) -> GatherPoints<'a> {
        let stride = sampling.subsampling.unwrap_or(1);
        let few = (stride > 1).then(|| self.subsample.add(graph, frame.gbuffer, frame.size, stride));
        GatherPoints { frame: *frame, few }
    }

    /// Carries what was gathered over to all pixels.
    pub(crate) fn estimate(
        &self,
        graph: &mut Graph<'_>,
        points: &GatherPoints<'_>,
        sums: GatheredImages,
        stats: Stats,
    ) -> Estimate {
        let mut everywhere = |name: &str, image: Handle<Texture>| match &points.few {
            Some(few) => self.upsample.add(graph, name, points.frame.camera, points.frame.gbuffer, few, &image),
            None => image,
        };
        let indirect = everywhere("upsample_indirect", sums.indirect);
        let caustic = everywhere("upsample_caustic", sums.caustic);
        Estimate { caustic: Some(caustic), stats: vec![stats], ..Estimate::new(indirect) }
    }
}

/// The points that gather: all pixels, or one of each square.
#[derive(Debug)]
pub(crate) struct GatherPoints<'a> {
    frame: FrameInputs<'a>,
    few: Option<SubsampledPoints>,
}

impl GatherPoints<'_> {
    /// As [`GBuffer::position`](lightloom_passes::GBuffer::position).
    pub(crate) fn position(&self) -> &Handle<Texture> {
        self.few.as_ref().map_or(&self.frame.gbuffer.position, |few| &few.position)
    }

    /// As [`GBuffer::surface`](lightloom_passes::GBuffer::surface).
    pub(crate) fn surface(&self) -> &Handle<Texture> {
        self.few.as_ref().map_or(&self.frame.gbuffer.surface, |few| &few.surface)
    }

    /// Points along each axis.
    pub(crate) fn size(&self) -> [u32; 2] {
        self.few.as_ref().map_or(self.frame.size, |few| few.size)
    }

    /// Pixels of the image from one point to the next.
    pub(crate) fn stride(&self) -> u32 {
        self.few.as_ref().map_or(1, |few| few.stride)
    }

    /// Images for the sums at these points; `name` is the strategy's.
    pub(crate) fn images(&self, graph: &mut Graph<'_>, name: &str) -> GatheredImages {
        GatheredImages {
            indirect: graph.texture(&format!("{name}_indirect"), radiance_desc(self.size())),
            caustic: graph.texture(&format!("{name}_caustic"), radiance_desc(self.size())),
        }
    }
}

/// Radiance (W·m⁻²·sr⁻¹) at the points that gather.
#[derive(Debug)]
pub(crate) struct GatheredImages {
    pub(crate) indirect: Handle<Texture>,
    pub(crate) caustic: Handle<Texture>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skips_follow_the_probability() {
        let half = GatherSampling { selection: Some(0.5), subsampling: None }.params(7);
        // A uniform number u passes over floor(ln u / ln(1 − p)) photons: none for u > ½, one for u > ¼.
        assert_eq!([0.6_f32, 0.3, 0.2].map(|u| (u.ln() * half.inverse_log) as u32), [0, 1, 2]);
        assert_eq!((half.seed, half.weight), (7, 2.0));
        assert!(!GatherSampling::default().stochastic());
    }

    #[test]
    fn values_out_of_range_are_refused() {
        let mut sampling = GatherSampling::default();
        for (key, value) in
            [("selection", "0"), ("selection", "1.1"), ("selection", "nan"), ("subsampling", "0"), ("subsampling", "17")]
        {
            let error = sampling.set(&Assignment { strategy: "tiled", key, value }).unwrap_err().to_string();
            assert!(error.contains(key) && error.contains(value) && error.contains("needed"), "{error}");
        }
        assert!(!sampling.set(&Assignment { strategy: "tiled", key: "radius", value: "1" }).unwrap());
        assert!(sampling.set(&Assignment { strategy: "tiled", key: "selection", value: "0.25" }).unwrap());
        assert!(sampling.set(&Assignment { strategy: "tiled", key: "subsampling", value: "4" }).unwrap());
        assert_eq!(sampling, GatherSampling { selection: Some(0.25), subsampling: Some(4) });
        let shown = sampling.parameters().map(|parameter| (parameter.name, parameter.value));
        assert_eq!(shown, [("selection".into(), "0.25".to_owned()), ("subsampling".into(), "4".to_owned())]);
    }
}
