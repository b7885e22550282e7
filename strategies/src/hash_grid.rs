//! Photons lie in the cells of a sparse grid kept in a hash table; each pixel gathers the cells around its visible point.
//!
//! ```text
//! for each photon P:  b = slot of the cell of P, found or claimed by probing;  rank[P] = count[b]++
//! offsets = prefix sum of count
//! for each photon P:  entries[offsets[b] + rank[P]] = P;  then copy the photons into that order
//! for each pixel (x, y) with visible point X:
//!     for cell = ⌊(X − r_max)/s⌋ to ⌊(X + r_max)/s⌋:     # at most 8
//!         b = probe(cell);  image[x, y] += contribution of P at X, for each photon P of b
//! ```
//!
//! [MML13] listing 3, without subsampling: open addressing, quadratic (triangular) probing, a power-of-two table of at least twice as many
//! slots as photons, cells of edge s a little above `2 r_max`. All three cell coordinates are compared. Sums the photons `exact` sums, in another
//! order. Biased for any radius above 0; consistent as radii shrink and photons grow. Depends on the eye nowhere before
//! the gathering, so one grid serves any number of views.
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"

use crate::gather_sampling::{Gather, SamplingParams};
use crate::parameter::Assignment;
use crate::photon_lists::{ListStats, PhotonLists, Ranked, ScatterLists, SortLists};
use crate::{Estimate, FrameInputs, GatherSampling, KNearest, KernelRadius, Parameter, Radii, Strategy, StrategyError};
use glam::Vec3;
use lightloom_graph::{Buffer, BufferDesc, ComputeShader, Graph, Handle, WgslSources, shader_struct};
use lightloom_passes::Photons;
use lightloom_passes::scene::SceneInfo;

/// Cells are this much wider than `2 r_max`, so that rounding never makes the search cube touch a third cell.
const CELL_SLACK: f32 = 1.0001;
/// Cells per axis at the most: their coordinates keep whole numbers of an f32.
const MAX_CELLS: f32 = 1e6;

shader_struct! {
    /// Where the cells lie and how many slots the table has.
    struct Grid {
        origin_world: [f32; 3],
        cells_per_m: f32,
        slot_mask: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

shader_struct! {
    /// Parameters of `hash_grid_insert`.
    struct InsertParams {
        grid: Grid,
    }
}

shader_struct! {
    /// Parameters of `hash_grid_gather`.
    struct GatherParams {
        grid: Grid,
        camera_position_world: [f32; 3],
        r_min: f32,
        r_max: f32,
        pad0: u32,
        size: [u32; 2],
        sampling: SamplingParams,
    }
}

/// What a user can choose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HashGridConfig {
    /// Kernel radii (m). The cells follow `r_max`.
    pub radius: KernelRadius,
    /// How much is gathered, and where.
    pub sampling: GatherSampling,
}

/// The strategy `hash-grid`.
#[derive(Debug)]
pub struct HashGrid {
    /// Parameters; may change between frames.
    pub config: HashGridConfig,
    nearest: KNearest,
    insert: ComputeShader,
    scatter: ScatterLists,
    sort: SortLists,
    stats: ListStats,
    pack: ComputeShader,
    gather: Gather,
}

impl HashGrid {
    /// Its name in the registry.
    pub const NAME: &'static str = "hash-grid";

    /// The strategy with default parameters; `sources` holds its shaders, see [`lightloom_passes::shaders`].
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            config: HashGridConfig::default(),
            nearest: KNearest::new(sources),
            insert: ComputeShader::new(sources, "strategies/hash_grid_insert.wgsl")?,
            scatter: ScatterLists::new(sources)?,
            sort: SortLists::new(sources)?,
            stats: ListStats::new(sources)?,
            pack: ComputeShader::new(sources, "strategies/hash_grid_pack.wgsl")?,
            gather: Gather::new(sources, "strategies/hash_grid_gather.wgsl")?,
        })
    }

    fn lists(&self, graph: &mut Graph<'_>, photons: &Photons, grid: Grid) -> PhotonLists {
        let slots = grid.slot_mask + 1;
        let mut owners = graph.buffer("slot_owners", BufferDesc::words(slots.into()));
        let mut counts = graph.buffer("slot_counts", BufferDesc::words(slots.into()));
        let mut places = graph.buffer("photon_places", BufferDesc::words(2 * u64::from(photons.capacity)));
        graph.clear_buffer(&mut owners);
        graph.clear_buffer(&mut counts);
        graph
            .compute(&self.insert)
            .params(&InsertParams { grid })
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .write("slot_owners", &mut owners)
            .write("slot_counts", &mut counts)
            .write("photon_places", &mut places)
            .dispatch_1d(photons.capacity);
        self.scatter.add(graph, "hash_grid_scatter", photons, &Ranked { counts, places, lists: slots })
    }

    fn pack(&self, graph: &mut Graph<'_>, photons: &Photons, lists: &PhotonLists) -> Handle<Buffer> {
        let mut cell_photons = graph.buffer("cell_photons", photons.records.desc().clone());
        graph
            .compute(&self.pack)
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .read("slot_entries", &lists.entries)
            .write("cell_photons", &mut cell_photons)
            .dispatch_1d(photons.capacity);
        cell_photons
    }
}

impl Strategy for HashGrid {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        "photons in a hashed grid of cells, eight cells gathered per pixel [MML13]; biased by its radius, consistent"
    }

    fn reach_m(&self, info: &SceneInfo, emitted: u32) -> Option<f32> {
        self.config.radius.reach_m(info, emitted)
    }

    fn declare(&mut self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>) -> Result<Estimate, StrategyError> {
        let photons = frame.need_photons(Self::NAME)?;
        let by_neighbours = self.nearest.add(graph, frame.info, photons, &self.config.radius)?;
        let photons = by_neighbours.as_ref().unwrap_or(photons);
        let radii = self.config.radius.resolve(frame.info, photons.emitted)?;
        let sampling = self.config.sampling;
        let points = self.gather.points(graph, frame, &sampling);
        let grid = grid(frame.info, radii, photons.capacity);

        let mut lists = self.lists(graph, photons, grid);
        if frame.deterministic {
            self.sort.add(graph, &mut lists);
        }
        let mut stats =
            self.stats.add(graph, &lists, &["entries", "entries_dropped", "cells_used", "longest_list", "pixels_cut"]);
        let cell_photons = self.pack(graph, photons, &lists);

        let mut images = points.images(graph, "hash_grid");
        let params = GatherParams {
            grid,
            camera_position_world: frame.camera_position_world(),
            r_min: radii.r_min_m,
            r_max: radii.r_max_m,
            size: points.size(),
            sampling: sampling.params(frame.seed),
            ..GatherParams::default()
        };
        graph
            .compute(&self.gather.shader(frame, &sampling))
            .params(&params)
            .read("position", points.position())
            .read("surface", points.surface())
            .read("cell_photons", &cell_photons)
            .read("slot_offsets", &lists.offsets)
            .write("indirect", &mut images.indirect)
            .write("caustic", &mut images.caustic)
            .read("photon_state", &photons.state)
            .write("stats", &mut stats.buffer)
            .heavy()
            .dispatch_threads(self.gather.threads(&points, &sampling));
        Ok(self.gather.estimate(graph, &points, images, stats))
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        let assignment = Assignment { strategy: Self::NAME, key, value };
        let known = self.config.radius.set(&assignment)? || self.config.sampling.set(&assignment)?;
        if known { Ok(()) } else { Err(assignment.unknown(&self.parameters())) }
    }

    fn parameters(&self) -> Vec<Parameter> {
        let mut parameters = self.config.radius.parameters();
        parameters.extend(self.config.sampling.parameters());
        parameters
    }
}

/// The grid for photons of radius up to `r_max`, with the table at most half full.
fn grid(scene: &SceneInfo, radii: Radii, photons: u32) -> Grid {
    let extent = 2.0 * scene.bounds_radius;
    // Radii far below a millionth of the scene would overflow the coordinates; wider cells only cost time.
    let cell_m = (2.0 * CELL_SLACK * radii.r_max_m).max(extent / MAX_CELLS);
    // The table is never above 2³⁰ slots: 4 GiB of photons are beyond any binding long before.
    let slots = photons.clamp(1, 1 << 29).saturating_mul(2).next_power_of_two();
    Grid {
        origin_world: (scene.bounds_center - Vec3::splat(scene.bounds_radius)).into(),
        cells_per_m: 1.0 / cell_m,
        slot_mask: slots - 1,
        ..Grid::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::unit_scene;

    #[test]
    fn tables_are_powers_of_two_at_most_half_full() {
        let radii = Radii { r_min_m: 0.1, r_max_m: 0.1 };
        for (photons, slots) in [(0, 2), (1, 2), (2, 4), (3, 8), (1000, 2048), (1 << 20, 1 << 21)] {
            assert_eq!(grid(&unit_scene(), radii, photons).slot_mask + 1, slots, "{photons} photons");
        }
    }

    #[test]
    fn cells_hold_the_search_cube_and_stay_countable() {
        let scene = unit_scene();
        let cell = 1.0 / grid(&scene, Radii { r_min_m: 0.1, r_max_m: 0.1 }, 10).cells_per_m;
        assert!(cell > 0.2 && cell < 0.201, "{cell}");
        let tiny = grid(&scene, Radii { r_min_m: 1e-30, r_max_m: 1e-30 }, 10);
        assert!(tiny.cells_per_m * 2.0 * scene.bounds_radius <= 1.01 * MAX_CELLS, "{tiny:?}");
    }
}
