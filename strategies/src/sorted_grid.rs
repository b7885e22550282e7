//! Photons sorted by the cells of a grid whose rows are contiguous; each pixel gathers runs of them.
//!
//! ```text
//! for each photon P:  b = bucket of the cell of P;  rank[P] = count[b]++             # counting sort
//! offsets = prefix sum of count
//! for each photon P:  entries[offsets[b] + rank[P]] = P;  then copy the photons into that order
//! for each 4 × 4 pixels (x, y) with visible points X, as far as they lie together:
//!     for each row of cells within r_max of an X:                                    # along the world's x axis
//!         first, last = cells where the row enters and leaves the search sphere
//!         image[x, y] += contribution of P at each X, for each P of offsets[bucket(first)] .. offsets[bucket(last) + 1]
//! ```
//!
//! The counting sort of [Hoetzlein14]: no lists to link, no slots to probe, no room to run out of. A grid over a whole scene is mostly
//! empty, so the rows are laid over one another in a table no longer than there are photons:
//!
//! ```text
//! bucket(x, y, z) = (y · stride_y + z · stride_z) mod 2ᵏ + x
//!
//!         0                      2ᵏ          2ᵏ + cells of a row
//! table   |------[row (4, 7)  ]--|----------|
//!         |---------[row (9, 2)  ]----------|     rows overlap; where they do, buckets hold photons of both
//! ```
//!
//! The strides generate a rank-1 lattice [Niederreiter92, chapter 5], which keeps rows of a neighbourhood apart: no pixel meets a
//! photon twice, which a hash of cells could not promise, and what other rows leave in a bucket fails the test of distance. Cells are
//! four times as long across the rows as along them: thinner cells fit the sphere better, and along a row they cost no look-up.
//!
//! Sixteen pixels to a thread: neighbours see nearly the same photons, and a photon is fetched and decoded once for all of them. Stochastic
//! selection, which each pixel draws for itself, has a thread for each (`sorted_grid_gather`).
//!
//! Sums the photons `exact` sums, in another order. Biased for any radius above 0; consistent as radii shrink and photons grow. Depends on
//! the eye nowhere before the gathering.
//!
//! Bytes moved, for N photons of s = 32 or 20 bytes and B buckets:
//!
//! | pass | reads | writes |
//! |---|---|---|
//! | `sorted_grid_count` | s N | 8 N, and 4 N by atomics |
//! | prefix sum | 8 B | 4 B |
//! | `sorted_grid_scatter` | 12 N | 4 N |
//! | `sorted_grid_pack` | (4 + s) N | 32 N |
//! | `sorted_grid_gather_blocks` | per sixteen pixels 8 a row, 16 a candidate, 32 a summand | 32 a pixel |
//!
//! [Hoetzlein14]: https://ramakarl.com/fluids3/ "Fast fixed-radius nearest neighbors: interactive million-particle fluids, Hoetzlein, GPU Technology Conference, 2014"
//! [Niederreiter92, chapter 5]: https://doi.org/10.1137/1.9781611970081 "Random number generation and quasi-Monte Carlo methods, Niederreiter, 1992"

use crate::gather_sampling::{Gather, SamplingParams};
use crate::parameter::Assignment;
use crate::photon_lists::{ListStats, PhotonLists, Ranked, ScatterLists, SortLists};
use crate::{Estimate, FrameInputs, GatherSampling, KNearest, KernelRadius, Parameter, Radii, Strategy, StrategyError};
use glam::Vec3;
use lightloom_graph::{
    BufferDesc, ComputeShader, Graph, Handle, Texture, TextureDesc, WgslSources, shader_struct, wgpu::TextureFormat,
};
use lightloom_passes::scene::SceneInfo;
use lightloom_passes::{Photons, radiance_desc};

/// Covers the rounding of distances at the kernel's edge.
const REACH_SLACK: f32 = 1.00001;
/// Rows are this much wider than their share of the search sphere, so that rounding never makes it touch one more.
const CELL_SLACK: f32 = 1.0001;
/// Cells along a row to the width of the row.
const CELLS_PER_WIDTH: f32 = 4.0;
/// Cells per axis at the most: their coordinates keep whole numbers of an f32.
const MAX_CELLS: f32 = 1e6;
/// Two cell coordinates are rounded by 2 · 2⁻²⁴ of their size each, and by half of that where they are subtracted.
const ROUNDING: f32 = 5.0 / 16_777_216.0;
/// Width of the search sphere in rows: automatic, and at the most. More rows test fewer photons in vain, but runs of a few photons
/// leave threads that run in lockstep waiting for one another.
const AUTO_ROWS: u32 = 2;
const MAX_ROWS: u32 = 4;
/// Width of the textures that hold the sorted photons, as in `sorted_texel` of `shared/sorted_grid.wgsl`.
const PHOTONS_PER_ROW: u32 = 4096;
/// Bits of the number of buckets: enough that the rows of a neighbourhood lie apart, and 64 MiB of offsets.
const MIN_BUCKET_BITS: u32 = 12;
const MAX_BUCKET_BITS: u32 = 24;

shader_struct! {
    /// Where the cells lie and how rows lie in the table.
    pub(crate) struct Grid {
        origin_world: [f32; 3],
        row_mask: u32,
        cells_per_m: [f32; 3],
        last_x: f32,
        row_strides: [u32; 2],
        rounding_cells: f32,
        pad0: u32,
    }
}

shader_struct! {
    /// Parameters of `sorted_grid_count`.
    struct CountParams {
        grid: Grid,
    }
}

shader_struct! {
    /// Parameters of `sorted_grid_pack`.
    struct PackParams {
        r_min: f32,
        r_max: f32,
        pad0: u32,
        pad1: u32,
    }
}

shader_struct! {
    /// Parameters of `sorted_grid_gather`.
    struct GatherParams {
        grid: Grid,
        camera_position_world: [f32; 3],
        reach: f32,
        size: [u32; 2],
        pad0: u32,
        pad1: u32,
        sampling: SamplingParams,
    }
}

/// What a user can choose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SortedGridConfig {
    /// Kernel radii (m). The cells follow `r_max`.
    pub radius: KernelRadius,
    /// How much is gathered, and where.
    pub sampling: GatherSampling,
    /// Rows of cells across the widest kernel, 1 to 4; a thread looks up to one row more along either axis. More rows test fewer photons
    /// in vain, make more look-ups, and need more buckets. Automatic: 2.
    pub rows: Option<u32>,
    /// The table has 2 to this power of buckets, 12 to 24, 8 bytes each, and one row more. Fewer mix more cells in one bucket, which
    /// costs time and nothing else. Automatic: a bucket for one to two emitted photons.
    pub bucket_bits: Option<u32>,
}

/// The strategy `sorted-grid`.
#[derive(Debug)]
pub struct SortedGrid {
    /// Parameters; may change between frames.
    pub config: SortedGridConfig,
    nearest: KNearest,
    cells: SortByCell,
    sort: SortLists,
    stats: ListStats,
    pack: ComputeShader,
    gather: Gather,
}

/// Sorts photons by the cells of a grid.
#[derive(Debug)]
pub(crate) struct SortByCell {
    count: ComputeShader,
    scatter: ScatterLists,
}

impl SortByCell {
    /// Parses the shaders.
    pub(crate) fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        let count = ComputeShader::new(sources, "strategies/sorted_grid_count.wgsl")?;
        Ok(Self { count, scatter: ScatterLists::new(sources)? })
    }

    /// Declares the passes, the first and the last called as in `names`. A list for each bucket of `grid`.
    pub(crate) fn add(&self, graph: &mut Graph<'_>, names: [&str; 2], photons: &Photons, grid: Grid) -> PhotonLists {
        let buckets = grid.buckets();
        let mut counts = graph.buffer("bucket_counts", BufferDesc::words(buckets.into()));
        let mut places = graph.buffer("photon_places", BufferDesc::words(2 * u64::from(photons.capacity)));
        graph.clear_buffer(&mut counts);
        graph
            .compute(&self.count)
            .name(names[0])
            .params(&CountParams { grid })
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .write("bucket_counts", &mut counts)
            .write("photon_places", &mut places)
            .dispatch_1d(photons.capacity);
        self.scatter.add(graph, names[1], photons, &Ranked { counts, places, lists: buckets })
    }
}

/// The photons in the order of the buckets.
struct SortedPhotons {
    spheres: Handle<Texture>,
    light: Handle<Texture>,
}

impl SortedGrid {
    /// Its name in the registry.
    pub const NAME: &'static str = "sorted-grid";

    /// The strategy with default parameters; `sources` holds its shaders, see [`lightloom_passes::shaders`].
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            config: SortedGridConfig::default(),
            nearest: KNearest::new(sources),
            cells: SortByCell::new(sources)?,
            sort: SortLists::new(sources)?,
            stats: ListStats::new(sources)?,
            pack: ComputeShader::new(sources, "strategies/sorted_grid_pack.wgsl")?,
            gather: Gather::with_blocks(
                sources,
                "strategies/sorted_grid_gather.wgsl",
                "strategies/sorted_grid_gather_blocks.wgsl",
            )?,
        })
    }

    fn pack(&self, graph: &mut Graph<'_>, photons: &Photons, lists: &PhotonLists, radii: Radii) -> SortedPhotons {
        let size = sorted_texels(photons);
        let mut spheres = graph.texture("sorted_spheres", radiance_desc(size));
        let mut light = graph.texture("sorted_light", TextureDesc::new_2d(size, TextureFormat::Rgba32Uint));
        graph
            .compute(&self.pack)
            .params(&PackParams { r_min: radii.r_min_m, r_max: radii.r_max_m, ..PackParams::default() })
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .read("bucket_entries", &lists.entries)
            .write("sorted_spheres", &mut spheres)
            .write("sorted_light", &mut light)
            .dispatch_1d(photons.capacity);
        SortedPhotons { spheres, light }
    }
}

impl Strategy for SortedGrid {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        "photons counting-sorted by grid cells, runs of rows gathered per pixel [Hoetzlein14]; biased by its radius, consistent"
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
        let reach = reach(frame.info, radii);
        let grid = photon_grid(frame.info, photons, reach, self.config.rows, self.config.bucket_bits);

        let mut lists = self.cells.add(graph, ["sorted_grid_count", "sorted_grid_scatter"], photons, grid);
        if frame.deterministic {
            self.sort.add(graph, &mut lists);
        }
        let mut stats =
            self.stats.add(graph, &lists, &["entries", "entries_dropped", "buckets_used", "longest_list", "pixels_cut"]);
        let sorted = self.pack(graph, photons, &lists, radii);

        let mut images = points.images(graph, "sorted_grid");
        let params = GatherParams {
            grid,
            camera_position_world: frame.camera_position_world(),
            reach,
            size: points.size(),
            sampling: sampling.params(frame.seed),
            ..GatherParams::default()
        };
        graph
            .compute(&self.gather.shader(frame, &sampling))
            .params(&params)
            .read("position", points.position())
            .read("surface", points.surface())
            .read("sorted_spheres", &sorted.spheres)
            .read("sorted_light", &sorted.light)
            .read("bucket_offsets", &lists.offsets)
            .write("indirect", &mut images.indirect)
            .write("caustic", &mut images.caustic)
            .write("stats", &mut stats.buffer)
            .heavy()
            .dispatch_threads(self.gather.threads(&points, &sampling));
        Ok(self.gather.estimate(graph, &points, images, stats))
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        let assignment = Assignment { strategy: Self::NAME, key, value };
        match key {
            "rows" => {
                let fits = |rows: &u32| (1..=MAX_ROWS).contains(rows);
                self.config.rows = assignment.parse(fits, "a number from 1 to 4, or `auto`, is needed")?;
            }
            "bucket_bits" => {
                let fits = |bits: &u32| (MIN_BUCKET_BITS..=MAX_BUCKET_BITS).contains(bits);
                self.config.bucket_bits = assignment.parse(fits, "a number from 12 to 24, or `auto`, is needed")?;
            }
            _ if self.config.radius.set(&assignment)? || self.config.sampling.set(&assignment)? => {}
            _ => return Err(assignment.unknown(&self.parameters())),
        }
        Ok(())
    }

    fn parameters(&self) -> Vec<Parameter> {
        let rows = "rows of cells across the widest kernel; more test fewer photons in vain and make more look-ups";
        let bits = "the table has 2 to this power of buckets (8 bytes each); fewer mix more cells, which only costs time";
        let mut parameters = self.config.radius.parameters();
        parameters.extend(self.config.sampling.parameters());
        parameters.push(Parameter::new("rows", self.config.rows, rows));
        parameters.push(Parameter::new("bucket_bits", self.config.bucket_bits, bits));
        parameters
    }
}

impl Grid {
    /// Length of the table.
    pub(crate) fn buckets(&self) -> u32 {
        // A row is at most a million cells.
        self.row_mask + 1 + self.last_x as u32 + 1
    }
}

/// Distance (m) within which a pixel looks for photons. Nothing is farther than the scene is wide, however wide the kernel.
pub(crate) fn reach(scene: &SceneInfo, radii: Radii) -> f32 {
    (radii.r_max_m * REACH_SLACK).min(2.0 * extent(scene))
}

/// Width of the scene (m). A scene without extent has cells, too.
fn extent(scene: &SceneInfo) -> f32 {
    (2.0 * scene.bounds_radius).max(1e-20)
}

/// A bucket for one to two photons.
fn automatic_bits(photons: u32) -> u32 {
    (photons / 2).clamp(1 << MIN_BUCKET_BITS, 1 << MAX_BUCKET_BITS).next_power_of_two().trailing_zeros()
}

/// The grid for photons within `reach_m` of a point; `None` is automatic.
pub(crate) fn photon_grid(
    scene: &SceneInfo,
    photons: &Photons,
    reach_m: f32,
    rows: Option<u32>,
    bucket_bits: Option<u32>,
) -> Grid {
    let bits = bucket_bits.unwrap_or_else(|| automatic_bits(photons.emitted.min(photons.capacity)));
    grid(scene, reach_m, rows.unwrap_or(AUTO_ROWS), CELLS_PER_WIDTH, bits)
}

/// Size of textures that hold a texel for each photon of the store.
pub(crate) fn sorted_texels(photons: &Photons) -> [u32; 2] {
    [PHOTONS_PER_ROW, photons.capacity.div_ceil(PHOTONS_PER_ROW).max(1)]
}

/// The grid for a search sphere `rows` rows wide, cells `cells_per_width` times thinner along a row, and 2 to the power `bucket_bits` places where rows begin.
pub(crate) fn grid(scene: &SceneInfo, reach_m: f32, rows: u32, cells_per_width: f32, bucket_bits: u32) -> Grid {
    let extent = extent(scene);
    // Radii far below a millionth of the scene would overflow the coordinates; wider cells only cost time.
    let width_m = (2.0 * CELL_SLACK * reach_m / rows as f32).max(extent * cells_per_width / MAX_CELLS);
    let rows_per_m = 1.0 / width_m;
    let cells_per_m = cells_per_width * rows_per_m;
    Grid {
        origin_world: (scene.bounds_center - Vec3::splat(scene.bounds_radius)).into(),
        row_mask: (1 << bucket_bits) - 1,
        cells_per_m: [cells_per_m, rows_per_m, rows_per_m],
        last_x: (extent * cells_per_m).ceil(),
        row_strides: row_strides(bucket_bits),
        rounding_cells: ROUNDING * (extent * rows_per_m).ceil(),
        ..Grid::default()
    }
}

/// Odd strides nearest to 2ᵏ/p and 2ᵏ/p², p³ = p + 1: a plane's generalisation of the golden ratio, no multiple of which comes near
/// a whole number before many rows have passed.
fn row_strides(bucket_bits: u32) -> [u32; 2] {
    const P: f64 = 1.324_717_957_244_746;
    let buckets = f64::from(1_u32 << bucket_bits);
    [buckets / P, buckets / (P * P)].map(|stride| stride as u32 | 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::unit_scene;

    /// Rows that one pixel looks at never overlap where it looks, whatever the table's size.
    #[test]
    fn rows_of_a_neighbourhood_lie_apart() {
        // Search spheres `rows` wide around points up to a quarter of that apart touch at most one row more per axis than they are
        // wide together, and one cell more along a row.
        let apart = (MAX_ROWS + MAX_ROWS / 4) as i32;
        let cells = (MAX_ROWS + MAX_ROWS / 4) * CELLS_PER_WIDTH as u32 + 1;
        for bits in MIN_BUCKET_BITS..=MAX_BUCKET_BITS {
            let [stride_y, stride_z] = row_strides(bits).map(|stride| stride as i32);
            for (y, z) in (-apart..=apart).flat_map(|y| (-apart..=apart).map(move |z| (y, z))).filter(|&row| row != (0, 0)) {
                let start = y.wrapping_mul(stride_y).wrapping_add(z.wrapping_mul(stride_z)) as u32 & ((1 << bits) - 1);
                let distance = start.min((1 << bits) - start);
                assert!(distance >= cells, "{bits} bits: rows ({y}, {z}) apart begin {distance} buckets apart");
            }
        }
    }

    #[test]
    fn rows_hold_their_share_of_the_search_sphere_and_stay_countable() {
        let scene = unit_scene();
        let rows = grid(&scene, 0.1, 1, CELLS_PER_WIDTH, 12);
        let width = 1.0 / rows.cells_per_m[1];
        assert!(width > 0.2 && width < 0.201, "{width}");
        assert!(rows.last_x >= 2.0 * scene.bounds_radius * rows.cells_per_m[0], "{rows:?}: a row spans the scene");
        assert_eq!(rows.buckets(), 4096 + rows.last_x as u32 + 1);
        let tiny = grid(&scene, 1e-30, 4, CELLS_PER_WIDTH, 24);
        assert!(tiny.last_x <= 1.01 * MAX_CELLS && tiny.rounding_cells < 0.1, "{tiny:?}");
    }

    #[test]
    fn kernels_wider_than_the_scene_and_scenes_without_extent_have_finite_grids() {
        let widest = Radii { r_min_m: f32::MAX, r_max_m: f32::MAX };
        let point = SceneInfo { bounds_radius: 0.0, ..unit_scene() };
        for scene in [unit_scene(), point] {
            let reach = reach(&scene, widest);
            let grid = grid(&scene, reach, 1, CELLS_PER_WIDTH, 10);
            assert!(reach > 2.0 * scene.bounds_radius, "{reach}: everything is in reach");
            assert!(grid.cells_per_m.iter().all(|cells| cells.is_finite() && *cells > 0.0), "{grid:?}");
            assert!((1.0..100.0).contains(&grid.last_x), "{grid:?}");
        }
    }

    #[test]
    fn tables_follow_the_photons() {
        for (photons, bits) in [(0, 12), (1, 12), (8192, 12), (8194, 13), (1_000_000, 19), (u32::MAX, 24)] {
            assert_eq!(automatic_bits(photons), bits, "{photons} photons");
        }
    }

    #[test]
    fn parameters_out_of_range_are_refused() {
        let mut strategy = SortedGrid::new(&lightloom_passes::shaders()).unwrap();
        for (key, value) in [("rows", "0"), ("rows", "5"), ("bucket_bits", "11"), ("bucket_bits", "25"), ("rows", "two")] {
            let error = strategy.set(key, value).unwrap_err().to_string();
            assert!(error.contains(key) && error.contains(value) && error.contains("a number from"), "{error}");
        }
        strategy.set("rows", "4").unwrap();
        strategy.set("bucket_bits", "24").unwrap();
        assert_eq!((strategy.config.rows, strategy.config.bucket_bits), (Some(4), Some(24)));
        strategy.set("rows", "auto").unwrap();
        assert_eq!(strategy.config.rows, None);
    }
}
