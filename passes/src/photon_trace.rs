//! Emission and tracing of a frame's photons: a wavefront, bounce by bounce, in batches.
//!
//! ```text
//! for each batch of ≤ 65,536:   a PhotonSource ─▶ rays, paths
//!     for each bounce:          trace_rays ─▶ hits ─▶ photon_scatter ─▶ staging, rays, paths ─▶ photon_scan, photon_compact ─┬─▶ records
//!                                   ▲                                                                                         │
//!                                   └────────────────────────── live paths, packed ◀──────────────────────────────────────────┘
//! ```
//!
//! A bounce is a pass of its own, so that rays can be traced by whatever the device has, threads that have no path left do not
//! wait for those that have, and no dispatch runs long enough for a driver's watchdog. One kernel that follows a photon to its
//! end was the alternative; it ties shading to one way of tracing, and its threads wait for the longest path.

use crate::photon_compact::{PhotonCompact, Store};
use crate::photon_path::{MAX_BATCH, PATH_BLOCK, PathBuffers, PhotonBatch, PhotonPath, PhotonSource, PhotonTally};
use crate::photon_scatter::{BounceBuffers, PhotonScatter};
use crate::scene::{SceneHandles, SceneInfo};
use crate::{DepositCull, Photon, PhotonEmit, PhotonGrid, PhotonState, PhotonStore, Ray, RayHit, TraceRays};
use lightloom_graph::{Buffer, BufferDesc, Graph, Handle, ShaderError, WgslSources};

/// Bytes that a path in flight takes: ray and path before and after compaction, its hit and the record it leaves, and half as
/// much again, for buffers that a pass reads share no memory with those it writes.
const BYTES_PER_PATH: u64 =
    3 * (2 * (size_of::<Ray>() + size_of::<PhotonPath>()) + size_of::<RayHit>() + size_of::<Photon>()) as u64 / 2;
/// The paths in flight may take this part of the store.
const STORE_SHARE: u64 = 11;
/// A batch has at least this many paths, however small the store.
const MIN_BATCH: u32 = 20_480;

/// How many photons, and how far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhotonSettings {
    /// Photons to emit from all lights together. More: less noise, in proportion more time.
    pub emitted: u32,
    /// Records the store holds; what does not fit is dropped and counted.
    pub capacity: u32,
    /// Scatterings a photon may undergo before its last record; at most [`Self::MOST_BOUNCES`].
    pub max_bounces: u32,
    /// Seed; the same seed gives the same photons in the same order.
    pub seed: u32,
    /// Follow only paths whose first scattering is specular.
    pub caustics_only: bool,
    /// Store where light comes straight from a light, too, so that the records are all places from which light goes on to what is seen: records of
    /// 0 scatterings are added, and those of `max_bounces` left out but for caustic ones.
    pub light_vertices: bool,
    /// Store only what a camera's pixels can gather; `None` stores all.
    pub cull: Option<DepositCull>,
}

impl PhotonSettings {
    /// Largest number of scatterings: a record counts them in a byte.
    pub const MOST_BOUNCES: u32 = 254;

    /// `emitted` photons of up to `max_bounces` scatterings, all of them stored, with room for [`Self::default_capacity`].
    pub fn new(emitted: u32, max_bounces: u32, seed: u32) -> Self {
        let capacity = Self::default_capacity(emitted, max_bounces);
        Self { emitted, capacity, max_bounces, seed, caustics_only: false, light_vertices: false, cull: None }
    }

    /// Records for which a store is laid out when nothing else is said: up to four for each photon, at most what a default WebGPU
    /// binding of 128 MiB holds of the larger records.
    pub fn default_capacity(emitted: u32, max_bounces: u32) -> u32 {
        let wanted = u64::from(emitted) * u64::from(max_bounces.clamp(1, 4));
        wanted.clamp(1, (128 << 20) / size_of::<Photon>() as u64) as u32
    }

    /// Fixed-point units per watt of the flux ledger: an average photon is 2²⁰ units.
    pub fn ledger_scale(&self, info: &SceneInfo) -> f32 {
        let power = info.total_power.max_element();
        if power > 0.0 { 1_048_576.0 * self.emitted as f32 / power } else { 1.0 }
    }

    /// Photons that are in flight at once: as many as leave the memory for them below a tenth of the store's.
    fn batch(&self, store: PhotonStore) -> u32 {
        let store = u64::from(self.capacity) * store.record_bytes();
        let paths = (store / STORE_SHARE / BYTES_PER_PATH).clamp(MIN_BATCH.into(), MAX_BATCH.into()) as u32;
        paths / PATH_BLOCK * PATH_BLOCK
    }
}

/// A frame's photons.
#[derive(Debug)]
pub struct Photons {
    /// Records of [`Photon`] or [`CompactPhoton`](crate::CompactPhoton), see [`PhotonStore`]; the first `state.stored` are valid.
    pub records: Handle<Buffer>,
    /// One [`PhotonState`].
    pub state: Handle<Buffer>,
    /// Records the store holds.
    pub capacity: u32,
    /// Photons that left the lights.
    pub emitted: u32,
}

/// The passes.
#[derive(Clone, Debug)]
pub struct PhotonTracing {
    emit: PhotonEmit,
    rays: TraceRays,
    scatter: PhotonScatter,
    compact: PhotonCompact,
    store: PhotonStore,
}

impl PhotonTracing {
    /// Parses the shaders.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self {
            emit: PhotonEmit::new(sources)?,
            rays: TraceRays::new(sources)?,
            scatter: PhotonScatter::new(sources)?,
            compact: PhotonCompact::new(sources)?,
            store: PhotonStore::of(sources),
        })
    }

    /// Declares the passes for photons from the scene's lights.
    pub fn add(&self, graph: &mut Graph<'_>, scene: &SceneHandles, info: &SceneInfo, settings: &PhotonSettings) -> Photons {
        self.add_from(graph, scene, info, settings, &self.emit)
    }

    /// Declares the passes for photons from `source`.
    pub fn add_from(
        &self,
        graph: &mut Graph<'_>,
        scene: &SceneHandles,
        info: &SceneInfo,
        settings: &PhotonSettings,
        source: &dyn PhotonSource,
    ) -> Photons {
        let capacity = settings.capacity.max(1);
        let settings =
            PhotonSettings { capacity, max_bounces: settings.max_bounces.min(PhotonSettings::MOST_BOUNCES), ..*settings };
        let mut store = Store {
            records: graph.buffer("photons", self.store.desc(capacity)),
            state: graph.buffer("photon_state", BufferDesc::array_of::<PhotonState>(1)),
            tally: graph.buffer("photon_tally", BufferDesc::array_of::<PhotonTally>(1)),
            capacity,
            grid: PhotonGrid::of(info),
        };
        graph.clear_buffer(&mut store.state);
        graph.clear_buffer(&mut store.tally);
        // Light that was not scattered is direct light: without scattering there is nothing to store.
        let emitted = if settings.max_bounces == 0 { 0 } else { settings.emitted };
        if emitted == 0 {
            graph.clear_buffer(&mut store.records);
        }
        let mut first = 0;
        while first < emitted {
            let count = settings.batch(self.store).min(emitted - first);
            let batch = PhotonBatch { emitted: settings.emitted, first, count, seed: settings.seed };
            self.follow(graph, scene, info, &settings, source, batch, &mut store);
            first += count;
        }
        Photons { records: store.records, state: store.state, capacity, emitted: settings.emitted }
    }

    #[expect(clippy::too_many_arguments, reason = "what a batch is made of")]
    fn follow(
        &self,
        graph: &mut Graph<'_>,
        scene: &SceneHandles,
        info: &SceneInfo,
        settings: &PhotonSettings,
        source: &dyn PhotonSource,
        batch: PhotonBatch,
        store: &mut Store,
    ) {
        let mut paths = PathBuffers::new(graph, batch.count);
        source.add(graph, scene, info, batch, &mut paths);
        let places = batch.count.next_multiple_of(PATH_BLOCK);
        for bounce in 0..=settings.max_bounces {
            let hits = self.rays.add_live(graph, scene, &paths, places, bounce == 0);
            let mut staging = graph.buffer("photon_staging", BufferDesc::array_of::<Photon>(u64::from(places)));
            let mut buffers = BounceBuffers { hits: &hits, staging: &mut staging, tally: &mut store.tally };
            self.scatter.add(graph, scene, info, settings, &mut paths, &mut buffers);
            let mut next = PathBuffers::new(graph, batch.count);
            self.compact.add(graph, &paths, &staging, &mut next, store);
            paths = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_in_flight_take_less_than_a_tenth_of_the_store() {
        for store in PhotonStore::ALL {
            for capacity in [1_000_000, 3_000_000, 4_194_304] {
                let batch = PhotonSettings { capacity, ..PhotonSettings::new(3_000_000, 3, 0) }.batch(store);
                let bytes = u64::from(batch) * BYTES_PER_PATH;
                let fits = bytes * 10 < u64::from(capacity) * store.record_bytes();
                assert!(fits || batch == MIN_BATCH, "{capacity}: {batch} paths");
                assert!(batch.is_multiple_of(PATH_BLOCK) && batch <= MAX_BATCH, "{batch}");
            }
        }
    }
}
