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

// The photon with another path probability ρ = 1 − share²: the kernel radius r_min + (r_max − r_min) share.
fn photon_with_radius(stored: StoredPhoton, share: f32) -> StoredPhoton {
    var photon = stored;
    photon.length_probability = (stored.length_probability & 0xffffu) | (pack2x16float(vec2f(1.0 - share * share, 0.0)) << 16u);
    return photon;
}
