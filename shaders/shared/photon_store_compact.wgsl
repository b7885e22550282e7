// How photons lie in a frame's store: 20 bytes each, as many as in [MML13, §2.4]. Where the paper keeps positions whole and has
// no room for a normal, positions are whole numbers here, on the frame's grid, and every field of the larger record is kept, coarsely.
//
// [MML13]: "Toward practical real-time photon mapping", Mara, McGuire and Luebke, I3D 2013.
#import "shared/photon.wgsl"

struct CompactPhoton {
    // x in 21 bits, the low 11 of y.
    position_low: u32,
    // The high 10 bits of y, z in 21; bit 31: PHOTON_LIGHT_ONLY.
    position_high: u32,
    // As in Photon.
    flux: u32,
    // Direction, octahedral, 12 + 12 bits; √(1 − ρ) in 6; surfaces scattered at before this one in 2: 3 is three or more.
    direction: u32,
    // Normal, octahedral, 8 + 8 bits; length of the last segment and footprint, 7 bits each, by their logarithms; PHOTON_GLOSSY, PHOTON_DIFFUSE.
    normal: u32,
}

alias StoredPhoton = CompactPhoton;

const GRID_BITS: u32 = 21u;
// Lengths of 1 to 2²² steps of the grid are kept within a factor of 2^(22/126/2) = 1.06; 0 stays 0.
const LENGTH_CODES: f32 = 126.0;
const LENGTH_OCTAVES: f32 = 22.0;

// A pair of snorm16 as a pair of snorms of `bits`, low component first. Both ends and 0 stay what they are.
fn octahedral_narrow(octahedral: u32, bits: u32) -> u32 {
    let largest = f32((1u << (bits - 1u)) - 1u);
    let code = bitcast<vec2u>(vec2i(round(max(unpack2x16snorm(octahedral), vec2f(-1.0)) * largest)));
    return extractBits(code.x, 0u, bits) | (extractBits(code.y, 0u, bits) << bits);
}

// The reverse.
fn octahedral_widen(code: u32, bits: u32) -> u32 {
    let largest = f32((1u << (bits - 1u)) - 1u);
    let signed = bitcast<vec2i>(vec2u(code, code >> bits));
    let p = vec2f(f32(extractBits(signed.x, 0u, bits)), f32(extractBits(signed.y, 0u, bits)));
    return pack2x16snorm(p / largest);
}

fn length_encode(length: f32, grid: PhotonGrid) -> u32 {
    let octave = log2(max(length / grid.step, 1.0));
    return select(0u, 1u + u32(round(min(octave / LENGTH_OCTAVES, 1.0) * LENGTH_CODES)), length > 0.0);
}

fn length_decode(code: u32, grid: PhotonGrid) -> f32 {
    return select(0.0, grid.step * exp2((f32(code) - 1.0) * (LENGTH_OCTAVES / LENGTH_CODES)), code > 0u);
}

fn photon_store(photon: Photon, grid: PhotonGrid) -> StoredPhoton {
    let last = f32((1u << GRID_BITS) - 1u);
    let place = vec3u(clamp(round((photon.position - grid.origin) / grid.step), vec3f(0.0), vec3f(last)));
    let length_probability = unpack2x16float(photon.length_probability);
    let footprint = unpack2x16float(photon.bounce_flags >> 16u).x;
    let reach = u32(round(sqrt(saturate(1.0 - length_probability.y)) * 63.0));
    let bounces = min(photon.bounce_flags & 0xffu, 3u);
    return CompactPhoton(
        place.x | (place.y << 21u),
        (place.y >> 11u) | (place.z << 10u) | select(0u, 0x80000000u, (photon.bounce_flags & PHOTON_LIGHT_ONLY) != 0u),
        photon.flux,
        octahedral_narrow(photon.direction, 12u) | (reach << 24u) | (bounces << 30u),
        octahedral_narrow(photon.normal, 8u) | (length_encode(length_probability.x, grid) << 16u)
            | (length_encode(footprint, grid) << 23u) | select(0u, 0x40000000u, (photon.bounce_flags & PHOTON_GLOSSY) != 0u)
            | select(0u, 0x80000000u, (photon.bounce_flags & PHOTON_DIFFUSE) != 0u),
    );
}

// World (m). Exact: see PhotonGrid.
fn photon_position(stored: StoredPhoton, grid: PhotonGrid) -> vec3f {
    let place = vec3u(
        extractBits(stored.position_low, 0u, GRID_BITS),
        (stored.position_low >> 21u) | (extractBits(stored.position_high, 0u, 10u) << 11u),
        extractBits(stored.position_high, 10u, GRID_BITS),
    );
    return grid.origin + vec3f(place) * grid.step;
}

fn photon_load(stored: StoredPhoton, grid: PhotonGrid) -> Photon {
    let reach = f32(extractBits(stored.direction, 24u, 6u)) / 63.0;
    let scattered = select(0u, PHOTON_GLOSSY, (stored.normal & 0x40000000u) != 0u)
        | select(0u, PHOTON_DIFFUSE, (stored.normal & 0x80000000u) != 0u);
    // Caustic is what was scattered by nothing but mirrors and refractors.
    let bounces = stored.direction >> 30u;
    let flags = scattered | select(0u, PHOTON_CAUSTIC, (scattered == 0u) & (bounces > 0u))
        | select(0u, PHOTON_LIGHT_ONLY, (stored.position_high & 0x80000000u) != 0u);
    let footprint = length_decode(extractBits(stored.normal, 23u, 7u), grid);
    let last_segment = length_decode(extractBits(stored.normal, 16u, 7u), grid);
    return Photon(
        photon_position(stored, grid),
        stored.flux,
        octahedral_widen(stored.direction, 12u),
        octahedral_widen(stored.normal, 8u),
        pack2x16float(vec2f(min(last_segment, 65504.0), 1.0 - reach * reach)),
        bounces | flags | (pack2x16float(vec2f(min(footprint, 65504.0), 0.0)) << 16u),
    );
}

// The photon with another path probability ρ = 1 − share²: the kernel radius r_min + (r_max − r_min) share.
fn photon_with_radius(stored: StoredPhoton, share: f32) -> StoredPhoton {
    var photon = stored;
    photon.direction = insertBits(stored.direction, u32(round(share * 63.0)), 24u, 6u);
    return photon;
}
