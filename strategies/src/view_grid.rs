//! The search turned round: a grid over the visible points, and photons scattered into it.
//!
//! ```text
//! for each visible point X:  b = bucket of the cell of X;  rank[X] = points[b]++            # counting sort
//!                            if rank[X] is a multiple of 64:  chunks[b] += 1
//! point_offsets, chunk_offsets = prefix sums of points, chunks
//! for each visible point X:  sorted[point_offsets[b] + rank[X]] = X
//! for each chunk C of up to 64 points of a bucket:  bounds[C] = box and normal cone of its points
//! for each photon P:  for each row of cells within r of P:                                  # along the world's x axis
//!     first, last = buckets where the row enters and leaves the sphere of P
//!     for each chunk C of chunk_offsets[first] .. chunk_offsets[last + 1]:
//!         if its box meets the sphere of P, and P can light its cone:  add P to the list of C   # counted first, as in `tiled`
//! for each chunk C:   for each block of 256 photons of C:  into workgroup memory
//!                         for each point X of C:  image[pixel of X] += contribution of P at X
//! ```
//!
//! Cost follows photons times nearby points, as with `tiled`, and not what lies around every pixel. Clusters of visible points to which
//! lights are assigned are those of [OBA12]; cut by cells in world space, they are small wherever surfaces are, where a tile of the screen
//! over the edge of a surface holds everything between near and far. The grid is that of `sorted-grid`, with cubes for cells: buckets of a row, and so
//! their chunks, are one run, and no photon meets a bucket twice, however small the table; two cells in one bucket only make wide boxes.
//! Points are numbered tile by tile, so that the points of a chunk are neighbours on the screen where a cell holds many.
//!
//! There is room for every chunk: of n points in B buckets, `n/64 + min(n, B)`. A photon whose chunks find no room in the lists is lost
//! there: `entries_dropped` counts them, and raising `entry_capacity` is the mend. Sums the photons `exact` sums, in another order. Biased for any
//! radius above 0; consistent as radii shrink and photons grow.
//!
//! Bytes moved, for n points, c chunks, N photons of s = 32 or 20 bytes and E entries:
//!
//! | pass | reads | writes |
//! |---|---|---|
//! | `view_grid_count` | 32 n | 8 n, and 4 n by atomics |
//! | prefix sums | 16 B | 8 B |
//! | `view_grid_scatter` | 16 n | 4 n |
//! | `view_grid_bounds` | 36 n | 48 c |
//! | `view_grid_insert`, twice | s N, 8 a row, 48 a chunk met | 4 E by atomics; then 4 E |
//! | `view_grid_gather` | 36 n, (4 + s) E | 32 n |
//!
//! [OBA12]: https://doi.org/10.2312/EGGH/HPG12/087-096 "Clustered deferred and forward shading, Olsson, Billeter and Assarsson, High Performance Graphics, 2012"

use crate::gather_sampling::{Gather, GatherPoints, GatheredImages, SamplingParams};
use crate::parameter::Assignment;
use crate::photon_lists::{
    InsertLists, Inserted, Insertion, ListStats, PhotonLists, SortLists, automatic_entries, parse_entry_capacity,
};
use crate::point_bounds::PointBounds;
use crate::sorted_grid::{self, Grid};
use crate::{Estimate, FrameInputs, GatherSampling, KNearest, KernelRadius, Parameter, Radii, Strategy, StrategyError};
use lightloom_graph::{Buffer, BufferDesc, ComputeShader, Graph, Handle, WgslSources, shader_struct};
use lightloom_passes::scene::SceneInfo;
use lightloom_passes::{Photons, PrefixSum};

/// Points of a chunk at the most, and of a tile: the threads of a workgroup.
const CHUNK: u32 = 64;
const TILE_EDGE: u32 = 8;
/// Cells across the widest kernel: automatic, and at the most.
const AUTO_CELLS: u32 = 1;
const MAX_CELLS: u32 = 4;
/// Bits of the number of buckets: enough that the rows of a neighbourhood lie apart, and few enough that the workgroups of all chunks
/// there may be cost nothing.
const MIN_BUCKET_BITS: u32 = 12;
const MAX_BUCKET_BITS: u32 = 18;

shader_struct! {
    /// Parameters of `view_grid_count`.
    struct CountParams {
        grid: Grid,
        size: [u32; 2],
        tiles_x: u32,
        pad0: u32,
    }
}

shader_struct! {
    /// Parameters of `view_grid_bounds`.
    struct BoundsParams {
        camera_position_world: [f32; 3],
        tiles_x: u32,
    }
}

shader_struct! {
    /// Parameters of `view_grid_insert`.
    struct InsertParams {
        grid: Grid,
        r_min: f32,
        r_max: f32,
        reach: f32,
        entry_capacity: u32,
    }
}

shader_struct! {
    /// Parameters of `view_grid_gather`.
    struct GatherParams {
        camera_position_world: [f32; 3],
        tiles_x: u32,
        r_min: f32,
        r_max: f32,
        entry_capacity: u32,
        pad0: u32,
        sampling: SamplingParams,
    }
}

/// What a user can choose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ViewGridConfig {
    /// Kernel radii (m). The cells follow `r_max`.
    pub radius: KernelRadius,
    /// How much is gathered, and where.
    pub sampling: GatherSampling,
    /// Cells across the widest kernel, 1 to 4. More make smaller chunks, which test fewer photons in vain, but more of them, with fewer points to
    /// share a photon. Automatic: 1.
    pub cells: Option<u32>,
    /// Entries of all chunks' lists together, 4 bytes each, at most 2²⁵. Too few lose light, which is reported.
    /// Automatic: 32 per photon, at least 2²².
    pub entry_capacity: Option<u32>,
}

/// The strategy `view-grid`.
#[derive(Debug)]
pub struct ViewGrid {
    /// Parameters; may change between frames.
    pub config: ViewGridConfig,
    nearest: KNearest,
    count: ComputeShader,
    scatter: ComputeShader,
    bounds: ComputeShader,
    insert: ComputeShader,
    prefix_sum: PrefixSum,
    lists: InsertLists,
    sort: SortLists,
    stats: ListStats,
    gather: Gather,
}

/// The visible points in the order of the buckets, in chunks.
struct Chunks {
    /// Where each bucket's chunks begin.
    offsets: Handle<Buffer>,
    /// Numbers of points.
    points: Handle<Buffer>,
    /// First and end of each chunk's points; empty past the last chunk.
    ranges: Handle<Buffer>,
    bounds: Handle<Buffer>,
    /// Chunks there may be.
    capacity: u32,
}

impl ViewGrid {
    /// Its name in the registry.
    pub const NAME: &'static str = "view-grid";

    /// The strategy with default parameters; `sources` holds its shaders, see [`lightloom_passes::shaders`].
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            config: ViewGridConfig::default(),
            nearest: KNearest::new(sources),
            count: ComputeShader::new(sources, "strategies/view_grid_count.wgsl")?,
            scatter: ComputeShader::new(sources, "strategies/view_grid_scatter.wgsl")?,
            bounds: ComputeShader::new(sources, "strategies/view_grid_bounds.wgsl")?,
            insert: ComputeShader::new(sources, "strategies/view_grid_insert.wgsl")?,
            prefix_sum: PrefixSum::new(sources)?,
            lists: InsertLists::new(sources)?,
            sort: SortLists::new(sources)?,
            stats: ListStats::new(sources)?,
            gather: Gather::new(sources, "strategies/view_grid_gather.wgsl")?,
        })
    }

    /// Sorts the points into chunks; blackens the others in `images`.
    fn chunks(
        &self,
        graph: &mut Graph<'_>,
        frame: &FrameInputs<'_>,
        points: &GatherPoints<'_>,
        grid: Grid,
        images: &mut GatheredImages,
    ) -> Chunks {
        let [tiles_x, tiles_y] = tiles(points);
        let slots = tiles_x * tiles_y * CHUNK;
        let buckets = grid.buckets();
        let mut point_counts = graph.buffer("point_counts", BufferDesc::words(buckets.into()));
        let mut chunk_counts = graph.buffer("chunk_counts", BufferDesc::words(buckets.into()));
        let mut places = graph.buffer("point_places", BufferDesc::words(2 * u64::from(slots)));
        graph.clear_buffer(&mut point_counts);
        graph.clear_buffer(&mut chunk_counts);
        graph
            .compute(&self.count)
            .params(&CountParams { grid, size: points.size(), tiles_x, pad0: 0 })
            .read("position", points.position())
            .read("surface", points.surface())
            .write("point_counts", &mut point_counts)
            .write("chunk_counts", &mut chunk_counts)
            .write("point_places", &mut places)
            .write("indirect", &mut images.indirect)
            .write("caustic", &mut images.caustic)
            .dispatch([tiles_x, tiles_y, 1]);

        let words = BufferDesc::words(u64::from(buckets) + 1);
        let mut point_offsets = graph.buffer("point_offsets", words.clone());
        let mut chunk_offsets = graph.buffer("chunk_offsets", words);
        self.prefix_sum.add(graph, &point_counts, &mut point_offsets, buckets);
        self.prefix_sum.add(graph, &chunk_counts, &mut chunk_offsets, buckets);

        let capacity = chunk_capacity(points.size(), buckets);
        let mut sorted = graph.buffer("points", BufferDesc::words(slots.into()));
        let mut ranges = graph.buffer("chunks", BufferDesc::words(2 * u64::from(capacity)));
        graph.clear_buffer(&mut ranges);
        graph
            .compute(&self.scatter)
            .read("point_places", &places)
            .read("point_offsets", &point_offsets)
            .read("chunk_offsets", &chunk_offsets)
            .write("points", &mut sorted)
            .write("chunks", &mut ranges)
            .dispatch_1d(slots);
        if frame.deterministic {
            // Which points share a chunk decides which photons a point draws from.
            let mut lists = PhotonLists { offsets: point_offsets, entries: sorted, lists: buckets, entry_capacity: slots };
            self.sort.add(graph, &mut lists);
            sorted = lists.entries;
        }

        let mut bounds = graph.buffer("chunk_bounds", BufferDesc::array_of::<PointBounds>(capacity.into()));
        graph
            .compute(&self.bounds)
            .params(&BoundsParams { camera_position_world: frame.camera_position_world(), tiles_x })
            .read("position", points.position())
            .read("surface", points.surface())
            .read("points", &sorted)
            .read("chunks", &ranges)
            .write("chunk_bounds", &mut bounds)
            .dispatch_1d(capacity * CHUNK);
        Chunks { offsets: chunk_offsets, points: sorted, ranges, bounds, capacity }
    }

    /// The loop over photons, twice. The word after the last list's count is that of the photons whose insertion was cut.
    fn lists(&self, graph: &mut Graph<'_>, photons: &Photons, chunks: &Chunks, params: &InsertParams) -> Inserted {
        let names = ["view_grid_lengths", "view_grid_insert"];
        self.lists.add(graph, names, chunks.capacity, params.entry_capacity, |graph, io| {
            let Insertion { name, entry_capacity, offsets, counts, entries } = io;
            graph
                .compute(&self.insert)
                .name(name)
                .params(&InsertParams { entry_capacity, ..*params })
                .read("photons", &photons.records)
                .read("photon_state", &photons.state)
                .read("chunk_offsets", &chunks.offsets)
                .read("chunk_bounds", &chunks.bounds)
                .read("list_offsets", offsets)
                .write("list_counts", counts)
                .write("entries", entries)
                .dispatch_1d(photons.capacity);
        })
    }
}

impl Strategy for ViewGrid {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        "photons scattered to clusters of visible points in world space [OBA12]; biased by its radius, consistent"
    }

    fn reach_m(&self, info: &SceneInfo, emitted: u32) -> Option<f32> {
        self.config.radius.reach_m(info, emitted)
    }

    fn declare(&mut self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>) -> Result<Estimate, StrategyError> {
        let photons = frame.need_photons(Self::NAME)?;
        let by_neighbours = self.nearest.add(graph, frame.info, photons, &self.config.radius)?;
        let photons = by_neighbours.as_ref().unwrap_or(photons);
        let Radii { r_min_m: r_min, r_max_m: r_max } = self.config.radius.resolve(frame.info, photons.emitted)?;
        let sampling = self.config.sampling;
        let points = self.gather.points(graph, frame, &sampling);
        let reach = sorted_grid::reach(frame.info, Radii { r_min_m: r_min, r_max_m: r_max });
        let bits = automatic_bits(points.size());
        let grid = sorted_grid::grid(frame.info, reach, self.config.cells.unwrap_or(AUTO_CELLS), 1.0, bits);

        let mut images = points.images(graph, "view_grid");
        let chunks = self.chunks(graph, frame, &points, grid, &mut images);
        let entry_capacity = self.config.entry_capacity.unwrap_or_else(|| automatic_entries(photons.capacity));
        let params = InsertParams { grid, r_min, r_max, reach, entry_capacity };
        let Inserted { mut lists, counts } = self.lists(graph, photons, &chunks, &params);
        if frame.deterministic {
            self.sort.add(graph, &mut lists);
        }
        let mut stats =
            self.stats.add(graph, &lists, &["entries", "entries_dropped", "chunks_used", "longest_list", "pixels_cut"]);

        let params = GatherParams {
            camera_position_world: frame.camera_position_world(),
            tiles_x: tiles(&points)[0],
            r_min,
            r_max,
            entry_capacity,
            sampling: sampling.params(frame.seed),
            ..GatherParams::default()
        };
        graph
            .compute(&self.gather.shader(frame, &sampling))
            .params(&params)
            .read("position", points.position())
            .read("surface", points.surface())
            .read("photons", &photons.records)
            .read("photon_state", &photons.state)
            .read("points", &chunks.points)
            .read("chunks", &chunks.ranges)
            .read("list_offsets", &lists.offsets)
            .read("list_counts", &counts)
            .read("entries", &lists.entries)
            .write("indirect", &mut images.indirect)
            .write("caustic", &mut images.caustic)
            .write("stats", &mut stats.buffer)
            .heavy()
            .dispatch_1d(chunks.capacity * CHUNK);
        Ok(self.gather.estimate(graph, &points, images, stats))
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        let assignment = Assignment { strategy: Self::NAME, key, value };
        match key {
            "cells" => {
                let fits = |cells: &u32| (1..=MAX_CELLS).contains(cells);
                self.config.cells = assignment.parse(fits, "a number from 1 to 4, or `auto`, is needed")?;
            }
            "entry_capacity" => {
                self.config.entry_capacity = parse_entry_capacity(&assignment)?;
            }
            _ if self.config.radius.set(&assignment)? || self.config.sampling.set(&assignment)? => {}
            _ => return Err(assignment.unknown(&self.parameters())),
        }
        Ok(())
    }

    fn parameters(&self) -> Vec<Parameter> {
        let cells = "cells across the widest kernel; more test fewer photons in vain, in more chunks of fewer points";
        let capacity = "entries of all chunks' lists (4 bytes each); too few lose light, which is reported";
        let mut parameters = self.config.radius.parameters();
        parameters.extend(self.config.sampling.parameters());
        parameters.push(Parameter::new("cells", self.config.cells, cells));
        parameters.push(Parameter::new("entry_capacity", self.config.entry_capacity, capacity));
        parameters
    }
}

/// Tiles along each axis.
fn tiles(points: &GatherPoints<'_>) -> [u32; 2] {
    points.size().map(|points| points.div_ceil(TILE_EDGE))
}

/// Chunks that so many points in so many buckets may make: all that are full, and one more for each bucket that has points.
fn chunk_capacity([width, height]: [u32; 2], buckets: u32) -> u32 {
    let points = width * height;
    (points / CHUNK + points.min(buckets)).max(1)
}

/// A bucket for 16 to 32 points: the workgroups of chunks that there might be cost more than cells that share a bucket.
fn automatic_bits([width, height]: [u32; 2]) -> u32 {
    (width * height / 32).clamp(1 << MIN_BUCKET_BITS, 1 << MAX_BUCKET_BITS).next_power_of_two().trailing_zeros()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_room_for_every_chunk() {
        // The most chunks: one point to each bucket, and the rest in full chunks of one bucket.
        assert_eq!(chunk_capacity([80, 80], 100), 6400 / 64 + 100);
        assert_eq!(chunk_capacity([5, 5], 4096), 25, "points alone in their buckets");
        assert_eq!(chunk_capacity([0, 5], 4096), 1, "a buffer is never empty");
        for size in [[1, 1], [480, 270], [1920, 1080], [16_384, 16_384]] {
            assert!((MIN_BUCKET_BITS..=MAX_BUCKET_BITS).contains(&automatic_bits(size)), "{size:?}");
        }
    }

    #[test]
    fn parameters_out_of_range_are_refused() {
        let mut strategy = ViewGrid::new(&lightloom_passes::shaders()).unwrap();
        for (key, value) in [("cells", "0"), ("cells", "5"), ("entry_capacity", "0"), ("entry_capacity", "33554433")] {
            let error = strategy.set(key, value).unwrap_err().to_string();
            assert!(error.contains(key) && error.contains(value) && error.contains("a number from"), "{error}");
        }
        strategy.set("cells", "4").unwrap();
        strategy.set("entry_capacity", "33554432").unwrap();
        assert_eq!((strategy.config.cells, strategy.config.entry_capacity), (Some(4), Some(33_554_432)));
        strategy.set("cells", "auto").unwrap();
        assert_eq!(strategy.config.cells, None);
    }
}
