// Caustic photons that some light sees, as the splat passes take them.

struct CausticPlace {
    // Of the record in the store.
    photon: u32,
    // The light's views: the first in the low half, how many in the high one.
    views: u32,
    // Of the splat (texels).
    diameter: f32,
    // Diameter that it would have if nothing had been met before (texels).
    unrefracted: f32,
}

// Smallest splat: it reaches the four texels around any point.
const LEAST_DIAMETER: f32 = 3.0;
