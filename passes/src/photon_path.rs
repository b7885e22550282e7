//! Photons on their way: the buffers between emission, tracing and scattering, and who fills them.

use crate::Ray;
use crate::scene::{SceneHandles, SceneInfo};
use lightloom_graph::{Buffer, BufferDesc, Graph, Handle, shader_struct};

/// Paths of a block: the threads of a workgroup.
pub(crate) const PATH_BLOCK: u32 = 64;
/// Blocks of a batch at most.
const MAX_PATH_BLOCKS: usize = 1024;
/// Paths of a batch at most.
pub(crate) const MAX_BATCH: u32 = PATH_BLOCK * MAX_PATH_BLOCKS as u32;

shader_struct! {
    /// A photon between two scatterings, beside its [`Ray`]; the struct `PhotonPath` of `shared/photon_path.wgsl`.
    pub struct PhotonPath {
        /// W.
        pub flux: [f32; 3],
        /// Number of the photon in its frame.
        pub index: u32,
        /// Ray differential: twelve half floats, in units of the scene's radius.
        pub differential: PackedDifferential,
        /// ρ of [MML13] Eq. 5.
        ///
        /// [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping, Mara, McGuire and Luebke, I3D 2013"
        pub path_probability: f32,
        /// Scatterings so far in the low byte, then flags in a byte. Then, of a photon that leaves its light, a half float: the part of
        /// its flux that its source expects the first scattering to keep, against which roulette is played there; 0 for no guess.
        pub bounce_flags: u32,
    }
}

shader_struct! {
    /// Derivatives of a ray's position and direction by two parameters.
    pub struct PackedDifferential {
        /// ∂P/∂u, ∂P/∂v, ∂D/∂u, ∂D/∂v.
        pub words: [u32; 6],
    }
}

shader_struct! {
    /// How many paths there are, as the arguments of a dispatch; the struct `LivePaths`.
    pub struct LivePaths {
        /// Workgroups.
        pub groups: u32,
        /// 1.
        pub one_y: u32,
        /// 1.
        pub one_z: u32,
        /// Paths.
        pub count: u32,
    }
}

shader_struct! {
    pub(crate) struct PhotonTally {
        pub(crate) ledger: [u32; 24],
        pub(crate) culled: u32,
        pub(crate) first_record: u32,
        pub(crate) alive_total: u32,
        pub(crate) pad0: u32,
        pub(crate) stored: [u32; MAX_PATH_BLOCKS],
        pub(crate) alive: [u32; MAX_PATH_BLOCKS],
    }
}

/// Photons to be emitted by one call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PhotonBatch {
    /// Photons of the frame, all batches together: what each one's share of the flux is computed from.
    pub emitted: u32,
    /// Number of the batch's first photon.
    pub first: u32,
    /// Photons of the batch.
    pub count: u32,
    /// Seed of the frame.
    pub seed: u32,
}

/// Rays of a batch and what they carry, in equal order.
#[derive(Debug)]
pub struct PathBuffers {
    /// [`Ray`]s; those past `live.count`, up to a whole block of 64, have `t_max` ≤ 0.
    pub rays: Handle<Buffer>,
    /// [`PhotonPath`]s.
    pub paths: Handle<Buffer>,
    /// One [`LivePaths`].
    pub live: Handle<Buffer>,
}

impl PathBuffers {
    /// Room for `count` paths.
    pub(crate) fn new(graph: &mut Graph<'_>, count: u32) -> Self {
        let places = u64::from(count.next_multiple_of(PATH_BLOCK));
        Self {
            rays: graph.buffer("photon_rays", BufferDesc::array_of::<Ray>(places)),
            paths: graph.buffer("photon_paths", BufferDesc::array_of::<PhotonPath>(places)),
            live: graph.buffer("photon_live", BufferDesc::array_of::<LivePaths>(1)),
        }
    }
}

/// Where photons come from.
pub trait PhotonSource {
    /// Declares the passes that fill `out` with the photons of `batch`.
    fn add(&self, graph: &mut Graph<'_>, scene: &SceneHandles, info: &SceneInfo, batch: PhotonBatch, out: &mut PathBuffers);
}
