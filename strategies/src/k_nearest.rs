//! Radii by the photons' own neighbours, whatever strategy gathers them: the variable kernel estimator.
//!
//! ```text
//! for each photon P:                                          # a thread each, in the order of a grid's cells
//!     d = distance to the k-th nearest photon on the surface of P, at most r_max
//!     r = the least of the 64 radii from r_min to r_max that is not below d
//!     copy of P, with ρ such that r = r_min + (r_max − r_min) √(1 − ρ)
//! ```
//!
//! Each photon has the bandwidth that the density around it asks for ([Breiman77]; [Silverman86] section 5.3): caustics stay sharp and sparse
//! light is calm. A gather of the k nearest photons, which [Jensen01] section 7.2 does at each point, has its bandwidth at the point instead; its
//! kernels do not integrate to 1 over the surface, so that it gains and loses flux where density changes. Here each photon's kernel does,
//! and since photons carry their radius, gathers and splats find the same.
//!
//! On the surface of P is what has its normal within 60° of that of P, as where light is gathered; the other side of a wall is not. A photon
//! with fewer than k neighbours within `r_max` has the radius `r_max`. Photons in the same place are neighbours at the distance 0.
//!
//! The radius is kept as a path probability, which is what all strategies read. 64 radii are what the compact store has of it, a 63rd of
//! `r_max − r_min` apart; d itself, found from k photons, is uncertain by 1/(2√k) of itself. The larger record keeps ρ as a half float, which is
//! finer, but up to half a step off for the three radii next to `r_min`. Ellipsoidal splats have sizes of their own and no use for ρ.
//!
//! The neighbours are those stored. The pipeline leaves out photons that no pixel gathers; with [`KernelRadius::nearest`] it keeps them within
//! twice `r_max` of the view, but for neighbours on surfaces that bend away from the eye by 60° more within `r_max`.
//!
//! The grid is that of `sorted-grid`. The search costs what a gather at every stored photon would, less what it saves: it ends once k photons lie within
//! `r_min`, and looks no farther than the k-th found so far. A driver that ends loops early (llvmpipe, after 65,535 turns of up to eight candidates)
//! leaves a radius too wide, never too narrow, and no light is lost.
//!
//! [Breiman77]: https://doi.org/10.1080/00401706.1977.10489521 "Variable kernel estimates of multivariate densities, Breiman, Meisel and Purcell, Technometrics 19(2), 1977"
//! [Silverman86]: https://doi.org/10.1201/9781315140919 "Density estimation for statistics and data analysis, Silverman, 1986"
//! [Jensen01]: https://doi.org/10.1201/b10685 "Realistic image synthesis using photon mapping, Jensen, 2001"

use crate::sorted_grid::{Grid, SortByCell, photon_grid, reach, sorted_texels};
use crate::{KernelRadius, StrategyError};
use lightloom_graph::{ComputeShader, Graph, TextureDesc, WgslSources, shader_struct, wgpu::TextureFormat};
use lightloom_passes::Photons;
use lightloom_passes::scene::SceneInfo;

/// Steps from `r_min` to `r_max`: `LEVELS` of the shader, less one.
const STEPS: f32 = 63.0;

shader_struct! {
    /// Parameters of `k_nearest_search`.
    struct SearchParams {
        grid: Grid,
        r_min: f32,
        step: f32,
        reach: f32,
        wanted: u32,
    }
}

/// The passes, parsed when first asked for.
#[derive(Debug)]
pub struct KNearest {
    sources: WgslSources,
    passes: Option<Passes>,
}

#[derive(Debug)]
struct Passes {
    cells: SortByCell,
    pack: ComputeShader,
    search: ComputeShader,
}

impl KNearest {
    /// The passes with the shaders of `sources`.
    pub fn new(sources: &WgslSources) -> Self {
        Self { sources: sources.clone(), passes: None }
    }

    /// Declares the passes and returns the photons with their radii, in the same order; `None` if `radius` asks for none, or allows but one.
    ///
    /// # Errors
    /// If radii or shaders are unsound.
    pub fn add(
        &mut self,
        graph: &mut Graph<'_>,
        info: &SceneInfo,
        photons: &Photons,
        radius: &KernelRadius,
    ) -> Result<Option<Photons>, StrategyError> {
        let Some(nearest) = radius.nearest else { return Ok(None) };
        let radii = radius.resolve(info, photons.emitted)?;
        if radii.r_min_m >= radii.r_max_m {
            return Ok(None);
        }
        let passes = match &mut self.passes {
            Some(passes) => passes,
            none => none.insert(Passes::new(&self.sources)?),
        };
        let reach = reach(info, radii);
        let params = SearchParams {
            grid: photon_grid(info, photons, reach, None, None),
            r_min: radii.r_min_m,
            step: (radii.r_max_m - radii.r_min_m) / STEPS,
            reach,
            // And itself.
            wanted: nearest.get().saturating_add(1),
        };
        Ok(Some(passes.add(graph, photons, &params)))
    }
}

impl Passes {
    fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        let shader = |name: &str| ComputeShader::new(sources, &format!("strategies/{name}.wgsl"));
        Ok(Self { cells: SortByCell::new(sources)?, pack: shader("k_nearest_pack")?, search: shader("k_nearest_search")? })
    }

    fn add(&self, graph: &mut Graph<'_>, photons: &Photons, params: &SearchParams) -> Photons {
        let lists = self.cells.add(graph, ["k_nearest_count", "k_nearest_scatter"], photons, params.grid);
        let points = TextureDesc::new_2d(sorted_texels(photons), TextureFormat::Rgba32Uint);
        let mut points = graph.texture("k_nearest_points", points);
        graph
            .compute(&self.pack)
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .read("bucket_entries", &lists.entries)
            .write("sorted_points", &mut points)
            .dispatch_1d(photons.capacity);

        let mut records = graph.buffer("k_nearest_photons", photons.records.desc().clone());
        graph
            .compute(&self.search)
            .params(params)
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .read("sorted_points", &points)
            .read("bucket_offsets", &lists.offsets)
            .read("bucket_entries", &lists.entries)
            .write("nearest_photons", &mut records)
            .heavy()
            .dispatch_1d(photons.capacity);
        let mut state = graph.buffer("k_nearest_state", photons.state.desc().clone());
        graph.copy_buffer(&photons.state, &mut state);
        Photons { records, state, capacity: photons.capacity, emitted: photons.emitted }
    }
}
