//! Photon density estimation strategies behind one trait, and the pipeline that renders a frame with one of them.
//!
//! ```text
//!            scene ──▶ G-buffer ──────────────┐
//!                      photons (emit, trace) ─┼─▶ Strategy::declare ──▶ indirect, caustic
//!                                             │                              │
//!                      direct light ──────────┴──────────▶ composition ◀─────┘ ──▶ mean over frames
//! ```
//!
//! [`registry()`] lists the strategies of this crate; a third party adds its own by implementing [`Strategy`] in its own
//! crate and handing it to [`Pipeline::new`].
//!
//! ```
//! # fn main() -> Result<(), lightloom_strategies::StrategyError> {
//! let mut strategy = lightloom_strategies::by_name("tiled")?;
//! strategy.set("radius", "0.05")?;
//! assert_eq!(strategy.name(), "tiled");
//! assert!(strategy.parameters().iter().any(|p| p.name == "r_max" && p.value == "0.05"));
//! # Ok(())
//! # }
//! ```

mod auto;
mod caustic_map;
mod composed;
mod density_tiles;
mod device_traits;
mod error;
mod exact;
mod gather_sampling;
mod hash_grid;
mod instant_radiosity;
mod k_nearest;
mod kernel_radius;
mod parameter;
mod path;
mod photon_lists;
mod pipeline;
mod point_bounds;
mod progressive;
mod registry;
mod requirements;
mod screen_space;
mod sorted_grid;
mod splat;
mod splat_25d;
mod splat_3d;
mod splat_compute;
mod splat_kernel;
mod strategy;
mod surface_layers;
#[cfg(test)]
mod test_scene;
mod tiled;
mod view_grid;

pub use auto::{Auto, AutoConfig};
pub use caustic_map::{CausticMap, CausticMapConfig, SplatSize};
pub use composed::Composed;
pub use density_tiles::DensityTiles;
pub use device_traits::DeviceTraits;
pub use error::StrategyError;
pub use exact::{Exact, ExactConfig};
pub use gather_sampling::GatherSampling;
pub use hash_grid::{HashGrid, HashGridConfig};
pub use instant_radiosity::{InstantRadiosity, InstantRadiosityConfig, InstantRadiosityMode};
pub use k_nearest::KNearest;
pub use kernel_radius::{KernelRadius, Radii};
pub use parameter::Parameter;
pub use path::{Path, PathConfig};
pub use photon_lists::{PhotonLists, SortLists};
pub use pipeline::{
    Flux, Frame, FrameLayers, Layer, LayerImage, LightLayer, PassReport, PhotonReport, Pipeline, RenderProgress, Rendered,
    Settings,
};
pub use progressive::{Progressive, ProgressiveConfig};
pub use registry::{Entry, by_name, by_name_with, registry};
pub use requirements::Requirements;
pub use screen_space::{Denoiser, ScreenSpace, ScreenSpaceConfig};
pub use sorted_grid::{SortedGrid, SortedGridConfig};
pub use splat::{SplatConfig, SplatKernels, SplatPrecision, SplatResolution, SplatShape};
pub use splat_3d::Splat3d;
pub use splat_25d::{Splat25d, Splat25dConfig};
pub use splat_compute::{SplatCompute, SplatComputeConfig, SplatSums};
pub use splat_kernel::{SplatKernel, SplatKernelUniform};
pub use strategy::{Estimate, FrameInputs, Stats, Strategy};
pub use surface_layers::SurfaceImages;
pub use tiled::{Tiled, TiledConfig};
pub use view_grid::{ViewGrid, ViewGridConfig};
