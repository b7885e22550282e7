// The photon record, 32 bytes, and its packing. How records lie in the store of a frame: `photon_store.wgsl`.
#import "shared/math.wgsl"
#import "shared/rng.wgsl"

struct Photon {
    // World space (m).
    position: vec3f,
    // W, RGB with one shared exponent (8 bits each), rounded by chance so that sums are unbiased.
    flux: u32,
    // Direction of travel, octahedral.
    direction: u32,
    // Geometric normal on the side the photon came from, octahedral.
    normal: u32,
    // Two halves: length of the last segment (m), path probability ρ [MML13, Eq. 5].
    length_probability: u32,
    // Bits 0–7: surfaces scattered at before this one; 8–15: the PHOTON_… flags; 16–31: a half, the radius (m) of the disc that
    // the photon's beam lights here, 0 after any scattering that was not specular.
    bounce_flags: u32,
}

// Every earlier scattering was specular, and there was one.
const PHOTON_CAUSTIC: u32 = 0x100u;
// The first scattering was specular and the light is a point or a direction: the eye cannot sample such paths.
const PHOTON_LIGHT_ONLY: u32 = 0x200u;
// Some earlier scattering was glossy.
const PHOTON_GLOSSY: u32 = 0x400u;
// Some earlier scattering was diffuse.
const PHOTON_DIFFUSE: u32 = 0x800u;
// All flags of a record.
const PHOTON_RECORD_FLAGS: u32 = 0xf00u;
// Of a path on its way only: the light is a point or a direction.
const PHOTON_DELTA: u32 = 0x1000u;
// In place of bounce and flags: no record.
const NO_RECORD: u32 = 0xffffffffu;

// The grid on which a compact store keeps positions: cell `p` is at origin + p · step. The step is a power of two and the origin
// a multiple of it, both such that every sum is a 32-bit float: whoever computes it gets the same position to the last bit.
struct PhotonGrid {
    // World (m).
    origin: vec3f,
    // m.
    step: f32,
}

// What the photons of one frame add up to.
struct PhotonState {
    // Records that lie in the buffer.
    stored: u32,
    // Records that found no place.
    dropped: u32,
    // Records of all batches so far, stored or not.
    total: u32,
    // Records left out because no pixel could gather them.
    culled: u32,
    // Where a compact store's positions lie.
    grid: PhotonGrid,
    // Flux in fixed point, 64 bits each as (low, high): emitted, absorbed, escaped, terminated; red, green, blue in each.
    ledger: array<u32, 24>,
}

fn flux_encode(flux: vec3f, dither: vec3f) -> u32 {
    let largest = max_component(flux);
    if !(largest > 1.0e-37) {
        return 0u;
    }
    // largest = m · 2^e with m in [½, 1); the mantissa keeps below 255 so that rounding up has room.
    var e = frexp(largest).exp;
    if ldexp(largest, 8 - e) > 254.0 {
        e += 1;
    }
    let m = vec3u(vec3f(ldexp(flux.x, 8 - e), ldexp(flux.y, 8 - e), ldexp(flux.z, 8 - e)) + dither);
    return m.x | (m.y << 8u) | (m.z << 16u) | (u32(clamp(e + 128, 0, 255)) << 24u);
}

fn flux_decode(bits: u32) -> vec3f {
    let scale = ldexp(1.0, i32(bits >> 24u) - 136);
    return vec3f(f32(bits & 0xffu), f32((bits >> 8u) & 0xffu), f32((bits >> 16u) & 0xffu)) * scale;
}

// Packs a record. Lengths in m; `dither` in [0, 1)³ rounds the flux.
fn photon_record(position: vec3f, flux: vec3f, dither: vec3f, direction: vec3f, normal: vec3f, ray_length: f32,
    path_probability: f32, bounce_flags: u32, footprint_radius: f32) -> Photon {
    return Photon(
        position,
        flux_encode(flux, dither),
        octahedral_encode(direction),
        octahedral_encode(normal),
        pack2x16float(vec2f(min(ray_length, 65504.0), path_probability)),
        bounce_flags | (pack2x16float(vec2f(min(footprint_radius, 65504.0), 0.0)) << 16u),
    );
}

fn photon_path_probability(photon: Photon) -> f32 {
    return unpack2x16float(photon.length_probability).y;
}
