//! The cost of each candidate, predicted from what was measured, and the choice.
//!
//! With N photons stored, P pixels that gather, n photons in reach of a pixel, m in the rows that `sorted-grid` looks through for it,
//! T tiles that t photons meet each, and F = seen · covered pixels that kernels cover:
//!
//! ```text
//!                 photons   pixels   entries   candidates   summands
//! exact                     + p P              + c P N      + s P n
//! sorted-grid       b N     + p P              + c P m      + s P n      build and search
//! tiled             b N     + p P    + e T t   + c 64 T t   + s P n      inserted twice; all photons of a tile meet all of its pixels
//! splat-2.5d        b N     + p P              + c F        + s P n      vertices, fragments, those that are blended
//! splat-compute     b N     + p P              + c F        + s P n      likewise, without the rasteriser
//! ```
//!
//! [`Costs::SOFTWARE`] were fitted to lavapipe (Mesa 22.3.6, LLVM 15, 256 bits): to the CPU time of 14 frames of five scenes, with 80 to
//! 145,000 photons stored, 14,400 to 230,400 pixels, and 0.1 to 180 photons in reach of a pixel; least of three rounds each. They predict
//! what they were fitted to within 9 % (`tiled`), 21 % (splats) and 38 % (`sorted-grid`), as the root mean square of the logarithm. In
//! 12 of the frames what was predicted to be the cheapest was; in the others it took 1.1 and 1.3 times the time of the cheapest. A thread of
//! `sorted-grid` gathered for four pixels then and now for sixteen, one of `exact` for one and now for four: both have become faster where photons are dense.
//!
//! [`Costs::HARDWARE`] were measured nowhere. They are reasoned, in loads of 16 bytes and what takes as long, for a device with raster
//! units: where few photons are near, a frame of splats costs little beyond its pixels, so that few photons and kernels of few pixels are
//! splatted; dense photons are gathered, by `tiled` where tiles are flat, for then a fetch serves 64 pixels, and by `sorted-grid` where
//! they are deep.

use super::measure::{Measures, TILE};
use lightloom_graph::wgpu::DeviceType;

/// What can be chosen. All estimate the same to the rounding of their sums.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Candidate {
    SortedGrid,
    Tiled,
    Splat25d,
    SplatCompute,
    Exact,
}

impl Candidate {
    /// All, those preferred at equal cost first.
    pub(super) const ALL: [Self; 5] = [Self::SortedGrid, Self::Tiled, Self::Splat25d, Self::SplatCompute, Self::Exact];

    /// As in the registry.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::SortedGrid => crate::SortedGrid::NAME,
            Self::Tiled => crate::Tiled::NAME,
            Self::Splat25d => crate::Splat25d::NAME,
            Self::SplatCompute => crate::SplatCompute::NAME,
            Self::Exact => crate::Exact::NAME,
        }
    }

    /// What is set of it so that it sums what the others do: 16 bits would round too much.
    pub(super) fn settings(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Splat25d => &[("precision", "float")],
            _ => &[],
        }
    }
}

/// Costs of one strategy's parts (ns, or as good as).
#[derive(Clone, Copy, Debug)]
struct Parts {
    /// Of a stored photon.
    photon: f64,
    /// Of a pixel, whatever is near it.
    pixel: f64,
    /// Of an entry in a tile's list.
    entry: f64,
    /// Of a pair that is tested.
    candidate: f64,
    /// Of a pair that is summed.
    summand: f64,
}

impl Parts {
    const fn new([photon, pixel, entry, candidate, summand]: [f64; 5]) -> Self {
        Self { photon, pixel, entry, candidate, summand }
    }
}

/// Costs on one kind of device.
#[derive(Clone, Copy, Debug)]
pub(super) struct Costs {
    exact: Parts,
    sorted_grid: Parts,
    tiled: Parts,
    splat_25d: Parts,
    splat_compute: Parts,
    /// Where the numbers come from, for people.
    pub(super) source: &'static str,
}

impl Costs {
    const SOFTWARE: Self = Self {
        exact: Parts::new([0.0, 920.0, 0.0, 35.0, 0.0]),
        sorted_grid: Parts::new([1550.0, 770.0, 0.0, 0.0, 11.0]),
        tiled: Parts::new([0.0, 1030.0, 2160.0, 0.0, 106.0]),
        splat_25d: Parts::new([4950.0, 119.0, 0.0, 39.0, 27.0]),
        splat_compute: Parts::new([0.0, 383.0, 0.0, 101.0, 333.0]),
        source: "costs measured on llvmpipe",
    };

    const HARDWARE: Self = Self {
        // A fetch serves 1,024 pixels.
        exact: Parts::new([0.0, 8.0, 0.0, 0.5, 4.0]),
        // Written and read three times; nine rows of two offsets; a fetch serves sixteen pixels.
        sorted_grid: Parts::new([12.0, 14.0, 0.0, 0.5, 4.0]),
        // Inserted twice; bounds of the tiles; a fetch serves 64 pixels.
        tiled: Parts::new([12.0, 8.0, 4.0, 0.5, 4.0]),
        // Twelve vertices; targets are cleared for nothing; a fragment reads two texels, and two targets where it is blended.
        splat_25d: Parts::new([24.0, 4.0, 0.0, 2.0, 8.0]),
        // A thread walks the pixels; twelve words to clear and to read; six atomic additions.
        splat_compute: Parts::new([6.0, 8.0, 0.0, 4.0, 12.0]),
        source: "costs reasoned, not measured on this kind of adapter",
    };

    /// Those of a kind of device.
    pub(super) fn of(kind: DeviceType) -> &'static Self {
        if kind == DeviceType::Cpu { &Self::SOFTWARE } else { &Self::HARDWARE }
    }

    /// The predicted cost of a candidate (ms, or in proportion).
    pub(super) fn predict(&self, candidate: Candidate, frame: &Measures) -> f64 {
        let Measures { stored, pixels, near, in_rows, tiles, in_tile, seen, covered, .. } = *frame;
        let (parts, entries, candidates) = match candidate {
            Candidate::Exact => (&self.exact, 0.0, pixels * stored),
            Candidate::SortedGrid => (&self.sorted_grid, 0.0, pixels * in_rows),
            Candidate::Tiled => (&self.tiled, tiles * in_tile, f64::from(TILE * TILE) * tiles * in_tile),
            Candidate::Splat25d => (&self.splat_25d, 0.0, seen * covered),
            Candidate::SplatCompute => (&self.splat_compute, 0.0, seen * covered),
        };
        let Parts { photon, pixel, entry, candidate, summand } = *parts;
        1e-6 * (photon * stored + pixel * pixels + entry * entries + candidate * candidates + summand * pixels * near)
    }

    /// All candidates with their predicted costs, the cheapest first.
    pub(super) fn ranked(&self, frame: &Measures) -> [(Candidate, f64); Candidate::ALL.len()] {
        let mut ranked = Candidate::ALL.map(|candidate| (candidate, self.predict(candidate, frame)));
        // Stable: the order of `ALL` at equal cost.
        ranked.sort_by(|a, b| a.1.total_cmp(&b.1));
        ranked
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An image of 1920 × 1080 pixels, each in reach of `near` photons, whose kernels cover discs of `radius` pixels. A tile meets the discs that touch its square, and
    /// `layers` times as many where it shows several surfaces.
    fn frame(radius: f64, near: f64, layers: f64) -> Measures {
        let pixels = 1920.0 * 1080.0;
        let covered = std::f64::consts::PI * radius * radius;
        let stored = near * pixels / covered;
        let in_tile = layers * near * (covered + 4.0 * 8.0 * radius + 64.0) / covered;
        let tiles = pixels / 64.0;
        Measures { stored, pixels, near, in_rows: 3.0 * near, tiles, in_tile, deep_tiles: 0.0, seen: stored, covered }
    }

    fn best(kind: DeviceType, frame: &Measures) -> Candidate {
        Costs::of(kind).ranked(frame)[0].0
    }

    #[test]
    fn few_photons_with_small_kernels_are_splatted() {
        for kind in [DeviceType::DiscreteGpu, DeviceType::IntegratedGpu, DeviceType::Cpu] {
            assert_eq!(best(kind, &frame(3.0, 0.05, 1.0)), Candidate::Splat25d, "{kind:?}");
        }
    }

    #[test]
    fn dense_photons_are_gathered_by_tiles_if_these_are_flat() {
        assert_eq!(best(DeviceType::DiscreteGpu, &frame(50.0, 100.0, 1.0)), Candidate::Tiled);
        assert_eq!(best(DeviceType::DiscreteGpu, &frame(50.0, 100.0, 4.0)), Candidate::SortedGrid);
    }

    #[test]
    fn a_few_photons_that_reach_everywhere_need_no_search() {
        let few = Measures {
            stored: 20.0,
            near: 10.0,
            in_rows: 20.0,
            in_tile: 20.0,
            seen: 20.0,
            covered: 65_536.0,
            ..frame(1.0, 1.0, 1.0)
        };
        assert_eq!(best(DeviceType::DiscreteGpu, &few), Candidate::Exact);
    }

    /// As measured.
    #[test]
    fn llvmpipe_gathers_what_many_pixels_have_in_reach_and_splats_what_few_have() {
        assert_eq!(best(DeviceType::Cpu, &frame(20.0, 50.0, 1.0)), Candidate::SortedGrid);
        assert_eq!(best(DeviceType::Cpu, &frame(1.0, 17.0, 1.0)), Candidate::SplatCompute);
    }

    #[test]
    fn nothing_costs_nothing_and_the_first_is_taken() {
        let ranked = Costs::of(DeviceType::Cpu).ranked(&Measures::default());
        assert_eq!(ranked.map(|(candidate, _)| candidate), Candidate::ALL);
        assert!(ranked.iter().all(|(_, cost)| cost.abs() < 1e-9), "{ranked:?}");
    }
}
