//! What the tests that cross Lightloom's crates share. The proofs themselves are in `tests/proof/`.
//!
//! ```text
//! lab         an adapter, the passes, and one call for each experiment
//! estimators  every strategy by its kernel and the rounding of its sums
//! image       pictures in f64: means, standard errors, what lies within three of them
//! kernel      the kernels' moments and shares inside edges, in closed form
//! microfacet  scattering in f64, as the papers write it
//! sphere      the sphere in cells that resolve narrow lobes
//! statistics  χ² and its threshold
//! synthetic   photons and G-buffers made by hand, as an engine would bring its own
//! waves       photons drawn at random from waves of light on a plane, and what estimates of it are off by
//! reference   pictures by an independent renderer, where they are present
//! ```
//!
//! Everything here computes in f64 and by other formulas than the shaders, so that a proof does not check code
//! against itself.

mod estimators;
mod image;
pub mod kernel;
mod lab;
pub mod microfacet;
pub mod reference;
mod sphere;
mod statistics;
pub mod synthetic;
mod waves;

pub use estimators::{Estimator, Sums};
pub use image::{Image, Mean, Pixels};
pub use lab::{Estimates, Frame, Lab, PathImages, Traced, View, strategies};
pub use sphere::Cells;
pub use statistics::ChiSquare;
pub use waves::Waves;
