//! Measures, on a sample of pixels and photons, what the cost of strategies hangs on.
//!
//! Reads: G-buffer, photons. Writes: `auto_counts`, a word per name. A workgroup for each of up to 108 tiles of 8 × 8 pixels, spread over
//! the image, compares them with up to 8,192 photons, spread over the store: 9·10⁵ pairs, some 0.1 s of CPU time on llvmpipe. Of n photons
//! in reach of a pixel, out of N stored, 9·10⁵ n/N pairs tell: a density of 17 out of 400,000 is known to a sixth.

use crate::{Radii, Stats, StrategyError};
use lightloom_graph::{BufferDesc, ComputeShader, Graph, WgslSources, shader_struct};
use lightloom_passes::{CameraUniform, GBuffer, Photons};

/// Edge of a tile (pixels), that of `tiled`.
pub(super) const TILE: u32 = 8;
/// Tiles sampled along the image's sides at the most.
const SAMPLES: [u32; 2] = [12, 9];

shader_struct! {
    /// Parameters of `auto_measure`.
    struct MeasureParams {
        camera: CameraUniform,
        tiles: [u32; 2],
        samples: [u32; 2],
        r_min: f32,
        r_max: f32,
        pad0: u32,
        pad1: u32,
    }
}

/// What the words of the pass count, in their order; see `auto_measure.wgsl`.
const NAMES: [&str; 12] = [
    "stored",
    "sampled",
    "gathering",
    "pixels",
    "pairs",
    "near",
    "in_rows",
    "in_tiles",
    "tiles",
    "deep_tiles",
    "seen",
    "covered",
];

/// What a frame is like, as far as the cost of strategies hangs on it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Measures {
    /// Photons in the store.
    pub(super) stored: f64,
    /// Pixels that gather.
    pub(super) pixels: f64,
    /// Photons in reach of such a pixel: the density.
    pub(super) near: f64,
    /// Photons in the rows of cells that `sorted-grid` looks through for it.
    pub(super) in_rows: f64,
    /// Tiles of 8 × 8 pixels.
    pub(super) tiles: f64,
    /// Photons that meet a tile, more than those near its pixels where its depths lie apart.
    pub(super) in_tile: f64,
    /// Part of the tiles whose depths are farther apart than the widest kernel: the depth complexity.
    pub(super) deep_tiles: f64,
    /// Photons whose kernel is in view.
    pub(super) seen: f64,
    /// Pixels that such a kernel covers, in the mean.
    pub(super) covered: f64,
}

impl Measures {
    /// From the words of the pass, for an image of `size`.
    pub(super) fn new(words: &[u32], size: [u32; 2]) -> Self {
        let word = |name: &str| {
            let at = NAMES.iter().position(|known| *known == name);
            f64::from(at.and_then(|at| words.get(at)).copied().unwrap_or(0))
        };
        let share = |part: &str, whole: &str| word(part) / word(whole).max(1.0);
        let stored = word("stored");
        let tiles = size.map(|side| f64::from(side.div_ceil(TILE)));
        let samples = samples(size).map(f64::from);
        Self {
            stored,
            pixels: f64::from(size[0]) * f64::from(size[1]) * share("gathering", "pixels"),
            near: stored * share("near", "pairs"),
            in_rows: stored * share("in_rows", "pairs"),
            tiles: tiles[0] * tiles[1],
            in_tile: stored * share("in_tiles", "sampled") / (samples[0] * samples[1]),
            deep_tiles: share("deep_tiles", "tiles"),
            seen: stored * share("seen", "sampled"),
            covered: share("covered", "seen"),
        }
    }

    /// Radius of the disc that a kernel in view covers (pixels).
    pub(super) fn kernel_radius_pixels(&self) -> f64 {
        (self.covered / std::f64::consts::PI).sqrt()
    }
}

fn samples(size: [u32; 2]) -> [u32; 2] {
    [0, 1].map(|axis| size[axis].div_ceil(TILE).clamp(1, SAMPLES[axis]))
}

/// The pass.
#[derive(Debug)]
pub(super) struct Measure {
    shader: ComputeShader,
}

impl Measure {
    /// Parses the shader.
    pub(super) fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self { shader: ComputeShader::new(sources, "strategies/auto_measure.wgsl")? })
    }

    /// Declares the pass; the words are those of [`Measures::new`].
    pub(super) fn add(
        &self,
        graph: &mut Graph<'_>,
        camera: &CameraUniform,
        gbuffer: &GBuffer,
        photons: &Photons,
        radii: Radii,
    ) -> Stats {
        let mut counts = graph.buffer("auto_counts", BufferDesc::words(NAMES.len() as u64));
        graph.clear_buffer(&mut counts);
        let samples = samples(camera.size);
        let params = MeasureParams {
            camera: *camera,
            tiles: camera.size.map(|side| side.div_ceil(TILE)),
            samples,
            r_min: radii.r_min_m,
            r_max: radii.r_max_m,
            ..MeasureParams::default()
        };
        graph
            .compute(&self.shader)
            .params(&params)
            .read("position", &gbuffer.position)
            .read("surface", &gbuffer.surface)
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .write("counts", &mut counts)
            .heavy()
            .dispatch([samples[0], samples[1], 1]);
        Stats::new(counts, &NAMES)
    }
}
