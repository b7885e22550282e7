//! How photons lie in the store of a frame: whole, 32 bytes each, or compact, 20 bytes.
//!
//! Which of the two is a property of a set of shaders: all passes and strategies made from one set agree. A buffer of the other
//! kind is refused where it is bound, as any other struct would be.

use crate::photon::octahedral_direction;
use crate::scene::SceneInfo;
use crate::{Photon, PhotonFlags};
use glam::{Vec2, Vec3};
use lightloom_graph::{BufferDesc, WgslSources, shader_struct};

const WHOLE_FILE: &str = "shared/photon_store.wgsl";
const COMPACT_FILE: &str = "shared/photon_store_compact.wgsl";

/// How photons lie in memory between their tracing and their gathering.
///
/// ```
/// use lightloom_passes::{PhotonStore, PhotonTracing};
/// let sources = PhotonStore::Compact.shaders();
/// assert_eq!(PhotonStore::of(&sources), PhotonStore::Compact);
/// let tracing = PhotonTracing::new(&sources)?;
/// # Ok::<(), lightloom_graph::ShaderError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PhotonStore {
    /// [`Photon`] records, 32 bytes.
    #[default]
    Whole,
    /// [`CompactPhoton`] records, 20 bytes: positions to 2⁻²¹ of the scene's diameter, the rest coarser too, flux the same.
    Compact,
}

impl PhotonStore {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Whole, Self::Compact];

    /// Lightloom's shaders for this store.
    pub fn shaders(self) -> WgslSources {
        let shaders = crate::shaders();
        match self {
            Self::Whole => shaders,
            // Both files are embedded; without them the shaders would be told of as incomplete when they are parsed.
            Self::Compact => shaders.with_stand_in(WHOLE_FILE, COMPACT_FILE).unwrap_or(shaders),
        }
    }

    /// The store that shaders made from `sources` keep photons in.
    pub fn of(sources: &WgslSources) -> Self {
        if sources.imported(WHOLE_FILE) == COMPACT_FILE { Self::Compact } else { Self::Whole }
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Whole => "whole",
            Self::Compact => "compact",
        }
    }

    /// Bytes of a record.
    pub fn record_bytes(self) -> u64 {
        match self {
            Self::Whole => size_of::<Photon>() as u64,
            Self::Compact => size_of::<CompactPhoton>() as u64,
        }
    }

    /// The buffer that holds `capacity` records.
    pub fn desc(self, capacity: u32) -> BufferDesc {
        match self {
            Self::Whole => BufferDesc::array_of::<Photon>(capacity.into()),
            Self::Compact => BufferDesc::array_of::<CompactPhoton>(capacity.into()),
        }
    }
}

shader_struct! {
    /// The grid on which a compact store keeps positions: cell `p` is at `origin + p · step`.
    ///
    /// The step is a power of two and the origin a multiple of it, both such that every position is exact in 32-bit floats.
    pub struct PhotonGrid {
        /// World (m).
        pub origin: [f32; 3],
        /// m.
        pub step: f32,
    }
}

impl PhotonGrid {
    /// Cells along an axis.
    const CELLS: f32 = 2_097_152.0;

    /// The grid over the scene's bounding sphere.
    pub fn of(info: &SceneInfo) -> Self {
        let SceneInfo { bounds_center, bounds_radius, .. } = *info;
        let radius = bounds_radius.max(f32::MIN_POSITIVE);
        // The multiple of the step next below the sphere's corner takes up to a cell, hence a few cells to spare. Floats hold multiples
        // of a step up to 2²⁴ of them exactly.
        let farthest = bounds_center.abs().max_element() + radius;
        let wanted = (2.0 * radius / (Self::CELLS - 4.0)).max(farthest / 8_388_608.0).max(2.0_f32.powi(-100));
        let step = 2.0_f32.powi(wanted.log2().ceil() as i32);
        let origin = ((bounds_center - radius) / step).floor() * step;
        Self { origin: origin.to_array(), step }
    }
}

shader_struct! {
    /// One photon in 20 bytes; `shared/photon_store_compact.wgsl` says what lies where.
    pub struct CompactPhoton {
        /// x, and the low bits of y, on the grid.
        pub position_low: u32,
        /// The high bits of y, z, and whether the path is [`PhotonFlags::LIGHT_ONLY`].
        pub position_high: u32,
        /// Flux (W), as in [`Photon::flux`].
        pub flux: u32,
        /// Direction, path probability, bounces.
        pub direction: u32,
        /// Normal, length of the last segment, footprint, flags.
        pub normal: u32,
    }
}

impl CompactPhoton {
    /// World (m), within half a step of `grid` of what was stored.
    pub fn position(&self, grid: &PhotonGrid) -> Vec3 {
        const CELL: u32 = (1 << 21) - 1;
        let y = (self.position_low >> 21) | ((self.position_high & 0x3ff) << 11);
        let cells = [self.position_low & CELL, y, (self.position_high >> 10) & CELL];
        Vec3::from_array(grid.origin) + Vec3::from_array(cells.map(|cell| cell as f32)) * grid.step
    }

    /// Direction of travel (unit), within 10⁻³ rad.
    pub fn direction(&self) -> Vec3 {
        octahedral(self.direction, 12)
    }

    /// Geometric normal on the side it came from (unit), within 2·10⁻² rad.
    pub fn normal(&self) -> Vec3 {
        octahedral(self.normal, 8)
    }

    /// Surfaces that scattered it before this one; 3 stands for more, too.
    pub fn bounces(&self) -> u32 {
        self.direction >> 30
    }

    /// Its [`PhotonFlags`].
    pub fn flags(&self) -> u32 {
        let flag = |word: u32, bit: u32, flag: u32| if word & (1 << bit) == 0 { 0 } else { flag };
        let scattered = flag(self.normal, 30, PhotonFlags::GLOSSY) | flag(self.normal, 31, PhotonFlags::DIFFUSE);
        let caustic = if scattered == 0 && self.bounces() > 0 { PhotonFlags::CAUSTIC } else { 0 };
        scattered | caustic | flag(self.position_high, 31, PhotonFlags::LIGHT_ONLY)
    }

    /// Path probability ρ [MML13] Eq. 5; √(1 − ρ) within 1/126.
    ///
    /// [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping, Mara, McGuire and Luebke, I3D 2013"
    pub fn path_probability(&self) -> f32 {
        let reach = ((self.direction >> 24) & 63) as f32 / 63.0;
        1.0 - reach * reach
    }

    /// Length of the last segment (m), within 6.5 %.
    pub fn ray_length(&self, grid: &PhotonGrid) -> f32 {
        length(self.normal >> 16, grid)
    }

    /// As [`Photon::footprint_radius`] (m), within 6.5 %; below a step of `grid`, the step.
    pub fn footprint_radius(&self, grid: &PhotonGrid) -> f32 {
        length(self.normal >> 23, grid)
    }
}

/// The unit vector of an octahedral code of two signed components of `bits`.
fn octahedral(code: u32, bits: u32) -> Vec3 {
    let largest = ((1 << (bits - 1)) - 1) as f32;
    let component = |code: u32| ((code << (32 - bits)).cast_signed() >> (32 - bits)) as f32 / largest;
    octahedral_direction(Vec2::new(component(code), component(code >> bits)))
}

/// The length (m) of a code of seven bits.
fn length(code: u32, grid: &PhotonGrid) -> f32 {
    match code & 127 {
        0 => 0.0,
        code => grid.step * ((code - 1) as f32 * (22.0 / 126.0)).exp2(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_of_a_grid_is_exact_and_the_sphere_lies_within() {
        let spheres = [(Vec3::ZERO, 1.0), (Vec3::new(3.0, -70.0, 0.1), 18.3), (Vec3::splat(5.0e4), 0.5), (Vec3::ZERO, 0.0)];
        for (bounds_center, bounds_radius) in spheres {
            let grid = PhotonGrid::of(&SceneInfo { bounds_center, bounds_radius, ..SceneInfo::default() });
            let PhotonGrid { origin, step } = grid;
            assert_eq!(step.to_bits() & 0x7f_ffff, 0, "{step}: a power of two");
            for axis in 0..3 {
                let last = f64::from(origin[axis]) + 2_097_151.0 * f64::from(step);
                let (low, high) = (bounds_center[axis] - bounds_radius, bounds_center[axis] + bounds_radius);
                assert!(origin[axis] <= low && last >= f64::from(high), "{grid:?} holds {low}…{high}");
                for cell in [0_u32, 1, 12_345, 1_048_575, 2_097_151] {
                    let exact = f64::from(origin[axis]) + f64::from(cell) * f64::from(step);
                    assert_eq!(f64::from(exact as f32).to_bits(), exact.to_bits(), "{grid:?}, cell {cell}: {exact}");
                }
            }
        }
    }

    #[test]
    fn a_grid_is_fine() {
        let grid = PhotonGrid::of(&SceneInfo { bounds_center: Vec3::ONE, bounds_radius: 10.0, ..SceneInfo::default() });
        assert!(grid.step <= 2.0 * 20.0 / 2_097_152.0, "{grid:?}: less than twice the diameter over 2²¹");
    }

    #[test]
    fn sets_of_shaders_know_their_store() {
        for store in PhotonStore::ALL {
            assert_eq!(PhotonStore::of(&store.shaders()), store);
        }
        assert_eq!(PhotonStore::ALL.map(PhotonStore::record_bytes), [32, 20]);
    }
}
