//! The photon record and what a frame's photons add up to, as they lie in GPU memory.

use crate::photon_store::PhotonGrid;
use glam::{Vec2, Vec3};
use lightloom_graph::shader_struct;

shader_struct! {
    /// One photon where it met a surface, 32 bytes.
    pub struct Photon {
        /// World (m).
        pub position: [f32; 3],
        /// Flux (W), RGB with a shared exponent; see [`decode_flux`].
        pub flux: u32,
        /// Direction of travel; see [`decode_octahedral`].
        pub direction: u32,
        /// Geometric normal on the side it came from; see [`decode_octahedral`].
        pub normal: u32,
        /// Two half floats: length of the last segment (m), path probability.
        pub length_probability: u32,
        /// Scatterings before this hit in the low byte, then [`PhotonFlags`], then a half float: see [`Photon::footprint_radius`].
        pub bounce_flags: u32,
    }
}

/// Bits of [`Photon::bounce_flags`].
#[derive(Clone, Copy, Debug)]
pub struct PhotonFlags;

impl PhotonFlags {
    /// Every earlier scattering was specular, and there was one.
    pub const CAUSTIC: u32 = 0x100;
    /// The first scattering was specular and the light punctual: the eye cannot sample such paths.
    pub const LIGHT_ONLY: u32 = 0x200;
    /// Some earlier scattering was glossy.
    pub const GLOSSY: u32 = 0x400;
    /// Some earlier scattering was diffuse.
    pub const DIFFUSE: u32 = 0x800;
}

impl Photon {
    /// Surfaces that scattered it before this one.
    pub fn bounces(&self) -> u32 {
        self.bounce_flags & 0xff
    }

    /// Radius of the disc that its beam lights here (m), from ray differentials [Igehy99]; 0 for photons that were scattered
    /// other than specularly. Rounded to a half float.
    ///
    /// [Igehy99]: https://doi.org/10.1145/311535.311555 "Tracing ray differentials, Igehy, SIGGRAPH 1999"
    pub fn footprint_radius(&self) -> f32 {
        half_to_f32((self.bounce_flags >> 16) as u16)
    }

    /// Length of the last segment (m) and path probability ρ [MML13] Eq. 5, both rounded to half floats.
    ///
    /// [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping, Mara, McGuire and Luebke, I3D 2013"
    pub fn length_and_probability(&self) -> [f32; 2] {
        [half_to_f32(self.length_probability as u16), half_to_f32((self.length_probability >> 16) as u16)]
    }
}

/// A half float that is finite and not negative.
fn half_to_f32(bits: u16) -> f32 {
    let (exponent, mantissa) = (i32::from(bits >> 10), f32::from(bits & 0x3ff));
    if exponent == 0 { mantissa * 2.0_f32.powi(-24) } else { (1024.0 + mantissa) * 2.0_f32.powi(exponent - 25) }
}

shader_struct! {
    /// What the photons of one frame add up to.
    pub struct PhotonState {
        /// Records in the buffer.
        pub stored: u32,
        /// Records that found no place.
        pub dropped: u32,
        /// Stored and dropped.
        pub total: u32,
        /// Records left out because no pixel could gather them; see [`DepositCull`](crate::DepositCull).
        pub culled: u32,
        /// Where a compact store's positions lie.
        pub grid: PhotonGrid,
        /// Flux in fixed point: emitted, absorbed, escaped, terminated; RGB; (low, high) words.
        pub ledger: [u32; 24],
    }
}

/// Where a frame's flux went, in fixed point: `emitted = absorbed + escaped + terminated`, to the last bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FluxLedger {
    /// What left the lights.
    pub emitted: [i64; 3],
    /// What surfaces took.
    pub absorbed: [i64; 3],
    /// What left the scene.
    pub escaped: [i64; 3],
    /// What roulette and the bounce limit ended.
    pub terminated: [i64; 3],
}

impl FluxLedger {
    /// Whether the books balance.
    pub fn balances(&self) -> bool {
        (0..3).all(|c| self.emitted[c] == self.absorbed[c] + self.escaped[c] + self.terminated[c])
    }
}

impl PhotonState {
    /// The ledger as integers.
    pub fn flux_ledger(&self) -> FluxLedger {
        let word = |kind: usize, channel: usize| {
            let at = 2 * (3 * kind + channel);
            (u64::from(self.ledger[at]) | (u64::from(self.ledger[at + 1]) << 32)).cast_signed()
        };
        let kind = |k: usize| [word(k, 0), word(k, 1), word(k, 2)];
        FluxLedger { emitted: kind(0), absorbed: kind(1), escaped: kind(2), terminated: kind(3) }
    }
}

/// Flux (W) of a packed photon; `flux_decode` of `shared/photon.wgsl`.
pub fn decode_flux(bits: u32) -> Vec3 {
    let scale = 2.0_f32.powi((bits >> 24).cast_signed() - 136);
    Vec3::new((bits & 0xff) as f32, ((bits >> 8) & 0xff) as f32, ((bits >> 16) & 0xff) as f32) * scale
}

/// Unit vector of an octahedral code (two 16-bit signed components; Cigolle et al. 2014, JCGT 3(2)).
pub fn decode_octahedral(bits: u32) -> Vec3 {
    let snorm = |half: u32| (f32::from((half & 0xffff) as u16 as i16) / 32767.0).max(-1.0);
    octahedral_direction(Vec2::new(snorm(bits), snorm(bits >> 16)))
}

/// The unit vector at `p` of the octahedral map, in [−1, 1]².
pub(crate) fn octahedral_direction(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let fold = (-z).max(0.0);
    Vec3::new(p.x - fold.copysign(p.x), p.y - fold.copysign(p.y), z).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flux_words_decode_to_watts() {
        // 128 · 2^(128 − 136) = 0.5 W in red, half of that in green.
        assert_eq!(decode_flux(128 | (64 << 8) | (128 << 24)), Vec3::new(0.5, 0.25, 0.0));
        assert_eq!(decode_flux(0), Vec3::ZERO);
    }

    #[test]
    fn halves_decode() {
        let expected = [1.0, 0.333_251_95, 65504.0, 2.0_f32.powi(-24)];
        assert_eq!([0x3c00, 0x3555, 0x7bff, 1].map(|bits| half_to_f32(bits).to_bits()), expected.map(f32::to_bits));
    }

    #[test]
    fn octahedral_axes_decode_to_unit_vectors() {
        assert_eq!(decode_octahedral(0), Vec3::Z);
        assert!((decode_octahedral(0x7fff) - Vec3::X).length() < 1e-4, "+x is the corner (1, 0)");
        assert!((decode_octahedral(0x7fff_7fff) + Vec3::Z).length() < 1e-4, "the outer corners fold to −z");
    }

    #[test]
    fn ledgers_read_both_words() {
        let mut state = PhotonState::default();
        state.ledger[0] = 5;
        state.ledger[1] = 1;
        // Absorbed may be negative for a channel that roulette raises.
        state.ledger[6] = u32::MAX;
        state.ledger[7] = u32::MAX;
        let ledger = state.flux_ledger();
        assert_eq!((ledger.emitted[0], ledger.absorbed[0]), ((1 << 32) + 5, -1));
        assert!(!ledger.balances(), "nothing says where the light went");
    }
}
