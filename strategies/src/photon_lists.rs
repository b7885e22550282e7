//! Lists of photon indices, one per tile or per slot, in one buffer: what [MML13] calls the contents of tiles and buckets.
//!
//! ```text
//! offsets   0   3   3   7  …  total          list i = entries[offsets[i] .. offsets[i + 1]]
//!           |   |   |   |
//! entries   a b c   d e f g …                cut at the capacity; what lies beyond is counted as dropped
//! ```
//!
//! Threads fill a list in racing order. Where that matters, [`SortLists`] puts each list into ascending order: then sums
//! over it run in one order, and equal inputs give equal bits.
//!
//! [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"

use crate::parameter::Assignment;
use crate::{Stats, StrategyError};
use lightloom_graph::{Buffer, BufferDesc, ComputeShader, Graph, Handle, WgslSources, shader_struct};
use lightloom_passes::{Photons, PrefixSum};

/// Workgroups that share the lists: enough to fill a large device, few enough that starting them costs nothing.
const WORKGROUPS: u32 = 1024;

shader_struct! {
    /// Parameters of `sort_lists`.
    struct SortParams {
        lists: u32,
        entry_capacity: u32,
        run: u32,
        pad0: u32,
    }
}

shader_struct! {
    /// Parameters of `list_stats`.
    struct ListParams {
        lists: u32,
        entry_capacity: u32,
        pad0: u32,
        pad1: u32,
    }
}

/// Lists of photon indices.
#[derive(Debug)]
pub struct PhotonLists {
    /// Where each list begins in `entries`; `lists + 1` words, the last is the total.
    pub offsets: Handle<Buffer>,
    /// Photon indices, list after list.
    pub entries: Handle<Buffer>,
    /// Number of lists.
    pub lists: u32,
    /// Entries there is room for.
    pub entry_capacity: u32,
}

/// How many photons each list has, and where among them each photon stands.
pub(crate) struct Ranked {
    /// A word per list.
    pub(crate) counts: Handle<Buffer>,
    /// For each photon, its list and its rank there.
    pub(crate) places: Handle<Buffer>,
    /// Number of lists.
    pub(crate) lists: u32,
}

/// Makes the lists of photons that lie in one each, and know their place there: a counting sort.
#[derive(Debug)]
pub(crate) struct ScatterLists {
    prefix_sum: PrefixSum,
    shader: ComputeShader,
}

impl ScatterLists {
    /// Parses the shaders.
    pub(crate) fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        let shader = ComputeShader::new(sources, "strategies/scatter_lists.wgsl")?;
        Ok(Self { prefix_sum: PrefixSum::new(sources)?, shader })
    }

    /// Declares the passes, the last of which is called `name`. There is room for every photon.
    pub(crate) fn add(&self, graph: &mut Graph<'_>, name: &str, photons: &Photons, ranked: &Ranked) -> PhotonLists {
        let Ranked { counts, places, lists } = ranked;
        let mut offsets = graph.buffer("list_offsets", BufferDesc::words(u64::from(*lists) + 1));
        self.prefix_sum.add(graph, counts, &mut offsets, *lists);
        let mut entries = graph.buffer("list_entries", BufferDesc::words(photons.capacity.into()));
        graph
            .compute(&self.shader)
            .name(name)
            .read("photon_state", &photons.state)
            .read("photon_places", places)
            .read("offsets", &offsets)
            .write("entries", &mut entries)
            .dispatch_1d(photons.capacity);
        PhotonLists { offsets, entries, lists: *lists, entry_capacity: photons.capacity }
    }
}

/// Entries of 4 bytes in WebGPU's largest binding, 128 MiB.
const MAX_ENTRIES: u32 = 1 << 25;

/// Makes the lists of photons that may lie in several each: they are inserted twice, the first time to count them. [MML13] listing 5.
///
/// [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"
#[derive(Debug)]
pub(crate) struct InsertLists {
    prefix_sum: PrefixSum,
}

/// One of the two runs: both decide alike, for counting is inserting into lists that have no room.
pub(crate) struct Insertion<'a> {
    /// Of the pass.
    pub(crate) name: &'static str,
    /// Entries there is room for; 0 while counting.
    pub(crate) entry_capacity: u32,
    /// Where each list begins; zeros while counting.
    pub(crate) offsets: &'a Handle<Buffer>,
    /// A word per list, zero at first, and one more.
    pub(crate) counts: &'a mut Handle<Buffer>,
    /// The entries.
    pub(crate) entries: &'a mut Handle<Buffer>,
}

/// What the second run leaves.
pub(crate) struct Inserted {
    pub(crate) lists: PhotonLists,
    /// As in [`Insertion`].
    pub(crate) counts: Handle<Buffer>,
}

impl InsertLists {
    /// Parses the shaders.
    pub(crate) fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self { prefix_sum: PrefixSum::new(sources)? })
    }

    /// Declares the passes, those of `insert` under `names`.
    pub(crate) fn add(
        &self,
        graph: &mut Graph<'_>,
        names: [&'static str; 2],
        lists: u32,
        entry_capacity: u32,
        mut insert: impl FnMut(&mut Graph<'_>, Insertion<'_>),
    ) -> Inserted {
        let [count, fill] = names;
        let words = BufferDesc::words(u64::from(lists) + 1);
        let mut zeros = graph.buffer("list_zeros", words.clone());
        let mut lengths = graph.buffer("list_lengths", words.clone());
        let mut entries = graph.buffer("list_nowhere", BufferDesc::words(1));
        graph.clear_buffer(&mut zeros);
        graph.clear_buffer(&mut lengths);
        let counting = Insertion { name: count, entry_capacity: 0, offsets: &zeros, counts: &mut lengths, entries: &mut entries };
        insert(graph, counting);

        let mut offsets = graph.buffer("list_offsets", words.clone());
        self.prefix_sum.add(graph, &lengths, &mut offsets, lists);

        let mut entries = graph.buffer("list_entries", BufferDesc::words(entry_capacity.into()));
        let mut counts = graph.buffer("list_counts", words);
        graph.clear_buffer(&mut counts);
        insert(graph, Insertion { name: fill, entry_capacity, offsets: &offsets, counts: &mut counts, entries: &mut entries });
        Inserted { lists: PhotonLists { offsets, entries, lists, entry_capacity }, counts }
    }
}

/// Entries of all lists together that a user asks for.
pub(crate) fn parse_entry_capacity(assignment: &Assignment<'_>) -> Result<Option<u32>, StrategyError> {
    let fits = |count: &u32| (1..=MAX_ENTRIES).contains(count);
    assignment.parse(fits, "a number from 1 to 33554432 (2²⁵), or `auto`, is needed")
}

/// Room for 32 lists per photon, at least 2²² entries, at most what one binding holds.
pub(crate) fn automatic_entries(photons: u32) -> u32 {
    photons.saturating_mul(32).clamp(1 << 22, MAX_ENTRIES)
}

/// Puts every list into ascending order, in place.
#[derive(Debug)]
pub struct SortLists {
    shader: ComputeShader,
}

impl SortLists {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self { shader: ComputeShader::new(sources, "strategies/sort_lists.wgsl")? })
    }

    /// Declares the pass; runs nothing.
    pub fn add(&self, graph: &mut Graph<'_>, lists: &mut PhotonLists) {
        let PhotonLists { lists: count, entry_capacity, .. } = *lists;
        // As many runs as workgroups where the lists are few; longer runs pass over empty lists faster.
        let run = (count / WORKGROUPS).clamp(1, self.shader.workgroup_size()[0]);
        graph
            .compute(&self.shader)
            .params(&SortParams { lists: count, entry_capacity, run, pad0: 0 })
            .read("offsets", &lists.offsets)
            .write("entries", &mut lists.entries)
            .heavy()
            .dispatch([count.div_ceil(run).clamp(1, WORKGROUPS), 1, 1]);
    }
}

/// Counts entries, dropped entries, lists in use, and the longest list; pixels whose sum was cut.
#[derive(Debug)]
pub(crate) struct ListStats {
    shader: ComputeShader,
}

impl ListStats {
    pub(crate) fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self { shader: ComputeShader::new(sources, "strategies/list_stats.wgsl")? })
    }

    /// Declares the pass. `names` are those of the counts, in the order above; the last is the gathering pass's to count.
    pub(crate) fn add(&self, graph: &mut Graph<'_>, lists: &PhotonLists, names: &'static [&'static str; 5]) -> Stats {
        let mut stats = graph.buffer("list_stats", BufferDesc::words(names.len() as u64));
        graph.clear_buffer(&mut stats);
        graph
            .compute(&self.shader)
            .params(&ListParams { lists: lists.lists, entry_capacity: lists.entry_capacity, ..ListParams::default() })
            .read("offsets", &lists.offsets)
            .write("stats", &mut stats)
            .dispatch([lists.lists.div_ceil(64).clamp(1, WORKGROUPS), 1, 1]);
        Stats::new(stats, names)
    }
}
