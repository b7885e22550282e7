// Photons on their way, between one scattering and the next.
#import "shared/photon.wgsl"
#import "shared/ray_differential.wgsl"
#import "shared/rays.wgsl"

// Threads of the workgroups that handle paths, and paths of a block.
const PATH_BLOCK: u32 = 64u;
// Blocks of a batch at most.
const MAX_PATH_BLOCKS: u32 = 1024u;

struct PhotonPath {
    // W.
    flux: vec3f,
    // Number of the photon in its frame: names its random numbers.
    index: u32,
    // See shared/ray_differential.wgsl; in units of the scene's radius.
    differential: PackedDifferential,
    // ρ of [MML13, Eq. 5].
    path_probability: f32,
    // Bits 0–7: surfaces scattered at so far; 8–15: the PHOTON_… flags. 16–31, before the first scattering: a half, the part of the
    // flux that the photon's source expects it to keep there; 0: no guess.
    bounce_flags: u32,
}

// What the blocks of a batch add up to.
struct PhotonTally {
    // 64-bit sums as in PhotonState.
    ledger: array<atomic<u32>, 24>,
    // Records left out because they cannot be seen.
    culled: atomic<u32>,
    // Records of the frame before this bounce.
    first_record: u32,
    // Paths that go on after this bounce.
    alive_total: u32,
    pad0: u32,
    // Of each block: its records and the paths that go on; after the scan, those of the blocks before it.
    stored: array<u32, MAX_PATH_BLOCKS>,
    alive: array<u32, MAX_PATH_BLOCKS>,
}
