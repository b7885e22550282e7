//! Every estimator of Lightloom, by what decides which answers are right: its kernel, and what its sums are rounded to.

use crate::Lab;
use crate::kernel::Kernel;
use lightloom_graph::WgslSources;
use lightloom_graph::wgpu::Features;
use lightloom_strategies::{Strategy, by_name_with};
use std::fmt;

/// What the contributions to a pixel are summed in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sums {
    /// 32-bit floats.
    Float,
    /// Whole numbers of 64 bits.
    Fixed,
    /// Blended 16-bit floats. Each photon rounds a pixel's sum to 11 bits, by up to [`Self::HALF_ULP`] of it: devices may round towards
    /// zero, as Mesa's do, which loses light.
    Half,
}

impl Sums {
    /// What one photon may change in a sum of 16 bits beside its own light, in parts of the sum.
    pub const HALF_ULP: f64 = 1.0 / 1024.0;

    /// Bound of the relative error of a sum of `terms` of one sign, added in random or in symmetric order, so that partial sums are half the
    /// whole on average; `full` is that of sums of 32 bits and more. A term is rounded too.
    pub fn rounding(self, terms: f64, full: f64) -> f64 {
        if self == Self::Half { (0.5 * terms + 1.5) * Self::HALF_ULP } else { full }
    }
}

/// A strategy with the settings that change what it computes.
#[derive(Clone, Copy, Debug)]
pub struct Estimator {
    /// Its name in the registry.
    pub strategy: &'static str,
    /// How it spreads a photon.
    pub kernel: Kernel,
    /// What it sums in.
    pub sums: Sums,
}

impl Estimator {
    /// All of them: those that search for photons, the oracle first; splatted spheres; splatted ellipsoids.
    pub const ALL: [Self; 15] = [
        Self { strategy: "exact", kernel: Kernel::Cone, sums: Sums::Float },
        Self { strategy: "tiled", kernel: Kernel::Cone, sums: Sums::Float },
        Self { strategy: "hash-grid", kernel: Kernel::Cone, sums: Sums::Float },
        Self { strategy: "sorted-grid", kernel: Kernel::Cone, sums: Sums::Float },
        Self { strategy: "view-grid", kernel: Kernel::Cone, sums: Sums::Float },
        Self { strategy: "splat-compute", kernel: Kernel::Cone, sums: Sums::Fixed },
        Self { strategy: "splat-3d", kernel: Kernel::Cone, sums: Sums::Float },
        Self { strategy: "splat-2.5d", kernel: Kernel::Cone, sums: Sums::Float },
        Self { strategy: "splat-3d", kernel: Kernel::Cone, sums: Sums::Half },
        Self { strategy: "splat-2.5d", kernel: Kernel::Cone, sums: Sums::Half },
        Self { strategy: "splat-compute", kernel: Kernel::Disc, sums: Sums::Fixed },
        Self { strategy: "splat-3d", kernel: Kernel::Disc, sums: Sums::Float },
        Self { strategy: "splat-2.5d", kernel: Kernel::Disc, sums: Sums::Float },
        Self { strategy: "splat-3d", kernel: Kernel::Disc, sums: Sums::Half },
        Self { strategy: "splat-2.5d", kernel: Kernel::Disc, sums: Sums::Half },
    ];

    /// Whether the lab's device can run it; if not, it is named.
    pub fn runs_on(&self, lab: &Lab) -> bool {
        let blends = self.splats() && self.sums == Sums::Float;
        let able = !blends || lab.gpu.device.features().contains(Features::FLOAT32_BLENDABLE);
        if !able {
            println!("SKIPPED: {self}: the device does not blend 32-bit floats");
        }
        able
    }

    /// Whether it draws or scatters photons instead of searching for them.
    pub fn splats(&self) -> bool {
        self.strategy.starts_with("splat")
    }

    /// The strategy with kernels of these radii (m). Discs are as large for rays of every length from a millimetre; where light grazes, they
    /// are stretched towards it, up to four times.
    ///
    /// # Panics
    /// If it refuses its shaders or radii.
    pub fn build(&self, sources: &WgslSources, r_min: f64, r_max: f64) -> Box<dyn Strategy> {
        let mut strategy = by_name_with(self.strategy, sources).unwrap_or_else(|error| panic!("{self}: {error}"));
        let (r_min, r_max) = (r_min.to_string(), r_max.to_string());
        let mut settings = match self.kernel {
            Kernel::Cone => vec![("r_max", &*r_max), ("r_min", &*r_min)],
            Kernel::Disc => vec![("disc_max", &*r_max), ("disc_min", &*r_min), ("n_tile", "1"), ("l_max", "0.001")],
        };
        if self.splats() {
            settings.push(("shape", if self.kernel == Kernel::Cone { "sphere" } else { "ellipsoid" }));
        }
        match (self.splats(), self.sums) {
            (true, Sums::Float) => settings.push(("precision", "float")),
            (true, Sums::Half) => settings.push(("precision", "half")),
            _ => {}
        }
        for (key, value) in settings {
            strategy.set(key, value).unwrap_or_else(|error| panic!("{self}: {error}"));
        }
        strategy
    }
}

impl fmt::Display for Estimator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({:?}, {:?} sums)", self.strategy, self.kernel, self.sums)
    }
}
