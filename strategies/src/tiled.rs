//! Photons are inserted into the screen tiles they may affect; each tile's pixels gather its list together.
//!
//! ```text
//! for each tile T:    bounds[T] = box and normal cone of the visible points of T
//! for each photon P:  for each tile T whose box meets the sphere of P, and whose cone P can light:
//!                         count[T] += 1                                                     # counting pass
//! offsets = prefix sum of count                                                             # allocation pass
//! for each photon P:  for each such tile T:  entries[offsets[T] + next[T]++] = P            # copy pass
//! for each tile T:    for each block of 256 photons of T:  into workgroup memory
//!                         for each pixel (x, y) of T:  image[x, y] += contribution of P at X
//! ```
//!
//! [MML13] listings 5 and 6; tiles of 8 × 8 pixels: every pixel of a tile meets all
//! photons of the tile, so that small tiles save more than the photons they fetch twice cost. Sums the photons `exact` sums, in another order.
//! Biased for any radius above 0; consistent as radii shrink and photons grow. A photon whose tiles find no room
//! in the lists is lost there: `entries_dropped` counts them, and raising `entry_capacity` is the mend.
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"

use crate::gather_sampling::{Gather, GatherPoints, SamplingParams};
use crate::parameter::Assignment;
use crate::photon_lists::{InsertLists, Insertion, ListStats, PhotonLists, SortLists, automatic_entries, parse_entry_capacity};
use crate::point_bounds::PointBounds;
use crate::{Estimate, FrameInputs, GatherSampling, KNearest, KernelRadius, Parameter, Radii, Strategy, StrategyError};
use lightloom_graph::{Buffer, BufferDesc, ComputeShader, Graph, Handle, WgslSources, shader_struct};
use lightloom_passes::scene::SceneInfo;
use lightloom_passes::{CameraUniform, Photons};

shader_struct! {
    /// Parameters of `tiled_bounds`.
    struct BoundsParams {
        camera_position_world: [f32; 3],
        tiles_x: u32,
        size: [u32; 2],
        pad0: u32,
        pad1: u32,
    }
}

shader_struct! {
    /// Parameters of `tiled_insert`.
    struct InsertParams {
        camera: CameraUniform,
        tiles: [u32; 2],
        tile_size: u32,
        entry_capacity: u32,
        r_min: f32,
        r_max: f32,
        pad0: u32,
        pad1: u32,
    }
}

shader_struct! {
    /// Parameters of `tiled_gather`.
    struct GatherParams {
        camera_position_world: [f32; 3],
        tiles_x: u32,
        size: [u32; 2],
        r_min: f32,
        r_max: f32,
        entry_capacity: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
        sampling: SamplingParams,
    }
}

/// What a user can choose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TiledConfig {
    /// Kernel radii (m).
    pub radius: KernelRadius,
    /// How much is gathered, and where.
    pub sampling: GatherSampling,
    /// Entries of all tile lists together, 4 bytes each, at most 2²⁵. Too few lose light, which is reported.
    /// Automatic: 32 per photon, at least 2²².
    pub entry_capacity: Option<u32>,
}

/// The strategy `tiled`.
#[derive(Debug)]
pub struct Tiled {
    /// Parameters; may change between frames.
    pub config: TiledConfig,
    nearest: KNearest,
    bounds: ComputeShader,
    insert: ComputeShader,
    lists: InsertLists,
    sort: SortLists,
    stats: ListStats,
    gather: Gather,
}

impl Tiled {
    /// Its name in the registry.
    pub const NAME: &'static str = "tiled";

    /// The strategy with default parameters; `sources` holds its shaders, see [`lightloom_passes::shaders`].
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            config: TiledConfig::default(),
            nearest: KNearest::new(sources),
            bounds: ComputeShader::new(sources, "strategies/tiled_bounds.wgsl")?,
            insert: ComputeShader::new(sources, "strategies/tiled_insert.wgsl")?,
            lists: InsertLists::new(sources)?,
            sort: SortLists::new(sources)?,
            stats: ListStats::new(sources)?,
            gather: Gather::new(sources, "strategies/tiled_gather.wgsl")?,
        })
    }

    /// Edge of a tile (points that gather): the workgroup's.
    fn tile_size(&self) -> u32 {
        self.bounds.workgroup_size()[0]
    }

    fn tile_bounds(
        &self,
        graph: &mut Graph<'_>,
        frame: &FrameInputs<'_>,
        points: &GatherPoints<'_>,
        tiles: [u32; 2],
    ) -> Handle<Buffer> {
        let count = u64::from(tiles[0]) * u64::from(tiles[1]);
        let mut bounds = graph.buffer("tile_bounds", BufferDesc::array_of::<PointBounds>(count));
        let params = BoundsParams {
            camera_position_world: frame.camera_position_world(),
            tiles_x: tiles[0],
            size: points.size(),
            ..BoundsParams::default()
        };
        graph
            .compute(&self.bounds)
            .params(&params)
            .read("position", points.position())
            .read("surface", points.surface())
            .write("tile_bounds", &mut bounds)
            .dispatch([tiles[0], tiles[1], 1]);
        bounds
    }

    fn lists(
        &self,
        graph: &mut Graph<'_>,
        frame: &FrameInputs<'_>,
        photons: &Photons,
        points: &GatherPoints<'_>,
        radii: Radii,
    ) -> PhotonLists {
        let tiles = points.size().map(|pixels| pixels.div_ceil(self.tile_size()));
        let lists = tiles[0] * tiles[1];
        let bounds = self.tile_bounds(graph, frame, points, tiles);
        let entry_capacity = self.config.entry_capacity.unwrap_or_else(|| automatic_entries(photons.capacity));
        let inserted = self.lists.add(graph, ["tiled_count", "tiled_insert"], lists, entry_capacity, |graph, io| {
            let Insertion { name, entry_capacity, offsets, counts, entries } = io;
            let params = InsertParams {
                camera: *frame.camera,
                tiles,
                tile_size: self.tile_size() * points.stride(),
                entry_capacity,
                r_min: radii.r_min_m,
                r_max: radii.r_max_m,
                ..InsertParams::default()
            };
            graph
                .compute(&self.insert)
                .name(name)
                .params(&params)
                .read("photons", &photons.records)
                .read("photon_state", &photons.state)
                .read("tile_bounds", &bounds)
                .read("tile_offsets", offsets)
                .write("tile_counts", counts)
                .write("tile_entries", entries)
                .dispatch_1d(photons.capacity);
        });
        inserted.lists
    }
}

impl Strategy for Tiled {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        "photons in 8 × 8 pixel tiles, gathered through workgroup memory [MML13]; biased by its radius, consistent"
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

        let mut lists = self.lists(graph, frame, photons, &points, radii);
        if frame.deterministic {
            self.sort.add(graph, &mut lists);
        }
        let mut stats =
            self.stats.add(graph, &lists, &["entries", "entries_dropped", "tiles_used", "longest_list", "pixels_cut"]);

        let mut images = points.images(graph, "tiled");
        let params = GatherParams {
            camera_position_world: frame.camera_position_world(),
            tiles_x: points.size()[0].div_ceil(self.tile_size()),
            size: points.size(),
            sampling: sampling.params(frame.seed),
            r_min: radii.r_min_m,
            r_max: radii.r_max_m,
            entry_capacity: lists.entry_capacity,
            ..GatherParams::default()
        };
        graph
            .compute(&self.gather.shader(frame, &sampling))
            .params(&params)
            .read("position", points.position())
            .read("surface", points.surface())
            .read("photons", &photons.records)
            .read("tile_offsets", &lists.offsets)
            .read("tile_entries", &lists.entries)
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
        if key == "entry_capacity" {
            self.config.entry_capacity = parse_entry_capacity(&assignment)?;
            return Ok(());
        }
        let known = self.config.radius.set(&assignment)? || self.config.sampling.set(&assignment)?;
        if known { Ok(()) } else { Err(assignment.unknown(&self.parameters())) }
    }

    fn parameters(&self) -> Vec<Parameter> {
        let doc = "entries of all tile lists (4 bytes each); too few lose light, which is reported";
        let mut parameters = self.config.radius.parameters();
        parameters.extend(self.config.sampling.parameters());
        parameters.push(Parameter::new("entry_capacity", self.config.entry_capacity, doc));
        parameters
    }
}
