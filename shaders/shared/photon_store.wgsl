// How photons lie in a frame's store: as they are, 32 bytes each. `photon_store_compact.wgsl` stands in for this file where
// memory matters more.
#import "shared/photon.wgsl"

alias StoredPhoton = Photon;

fn photon_store(photon: Photon, grid: PhotonGrid) -> StoredPhoton {
    return photon;
}

fn photon_load(stored: StoredPhoton, grid: PhotonGrid) -> Photon {
    return stored;
}

// World (m).
fn photon_position(stored: StoredPhoton, grid: PhotonGrid) -> vec3f {
    return stored.position;
}
