//! After a bounce: records are packed behind the earlier ones, live paths for the next bounce, in the order of the paths.
//!
//! Each path writes to a place of its own and a scan packs what is there, so that the same seed gives the same photons in the same
//! order whatever the threads' race; appending by an atomic counter would be a dispatch less and would not.

use crate::PhotonGrid;
use crate::photon_path::PathBuffers;
use lightloom_graph::{Buffer, ComputeShader, Graph, Handle, ShaderError, WgslSources, shader_struct};

shader_struct! {
    struct PhotonScanParams {
        grid: PhotonGrid,
        capacity: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

shader_struct! {
    struct PhotonCompactParams {
        grid: PhotonGrid,
        capacity: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

/// The passes: `photon_scan` by one workgroup over the blocks' sums, then `photon_compact`, a thread per path.
#[derive(Clone, Debug)]
pub(crate) struct PhotonCompact {
    scan: ComputeShader,
    compact: ComputeShader,
}

/// The store of a frame.
pub(crate) struct Store {
    pub(crate) records: Handle<Buffer>,
    pub(crate) state: Handle<Buffer>,
    pub(crate) tally: Handle<Buffer>,
    pub(crate) capacity: u32,
    pub(crate) grid: PhotonGrid,
}

impl PhotonCompact {
    pub(crate) fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        Ok(Self {
            scan: ComputeShader::new(sources, "passes/photon_scan.wgsl")?,
            compact: ComputeShader::new(sources, "passes/photon_compact.wgsl")?,
        })
    }

    /// Moves `staging` to the store and the live ones of `paths` to `next`.
    pub(crate) fn add(
        &self,
        graph: &mut Graph<'_>,
        paths: &PathBuffers,
        staging: &Handle<Buffer>,
        next: &mut PathBuffers,
        store: &mut Store,
    ) {
        let (capacity, grid) = (store.capacity, store.grid);
        graph
            .compute(&self.scan)
            .params(&PhotonScanParams { grid, capacity, pad0: 0, pad1: 0, pad2: 0 })
            .read("live", &paths.live)
            .write("tally", &mut store.tally)
            .write("next_live", &mut next.live)
            .write("state", &mut store.state)
            .dispatch([1, 1, 1]);
        graph
            .compute(&self.compact)
            .params(&PhotonCompactParams { grid, capacity, pad0: 0, pad1: 0, pad2: 0 })
            .read("rays", &paths.rays)
            .read("paths", &paths.paths)
            .read("staging", staging)
            .read("tally", &store.tally)
            .write("next_rays", &mut next.rays)
            .write("next_paths", &mut next.paths)
            .write("records", &mut store.records)
            .dispatch_indirect(&paths.live, 0);
    }
}
