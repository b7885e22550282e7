//! The program `lightloom`, as a library so that tests can use its parts.
//!
//! ```text
//!   arguments ─▶ cli ─▶ commands ─▶ session ─▶ strategies, passes, graph
//!                          │           │
//!                          │           ▼
//!                          └─▶ pictures and numbers ─▶ image_io, metrics, exposure, results, report
//! ```
//!
//! Exit status 0 on success, 1 on failure, 2 on wrong usage. Results go to stdout; progress, warnings and errors to stderr.
//!
//! ```
//! use lightloom::{Picture, mean_ratio, relative_mse};
//!
//! let reference = Picture::new([2, 1], vec![[1.0; 3], [1.0; 3]]);
//! let image = Picture::new([2, 1], vec![[1.0; 3], [1.2; 3]]);
//! assert!((mean_ratio(&image, &reference).unwrap() - 1.1).abs() < 1e-6);
//! assert!((relative_mse(&image, &reference).unwrap() - 0.02 / 1.01).abs() < 1e-6);
//! ```

mod cancel;
mod cli;
mod commands;
mod console;
mod display;
mod error;
mod exposure;
mod files;
mod format;
mod image_io;
mod metrics;
mod picture;
mod progress;
mod report;
mod results;
mod session;
mod texels;
mod values;

use std::ffi::OsString;

use clap::Parser as _;

pub use console::report_error;
pub use error::Error;
pub use exposure::Exposure;
pub use image_io::{read_exr, write_exr};
pub use metrics::{flip, mean_ratio, relative_mse, signed_error};
pub use picture::Picture;
pub use results::{
    Flux, LightPhotons, Memory, PassTime, PhotonCounts, Reference, Results, SequenceImage, Settings, StrategyResult,
};

/// The largest width and height of an image (pixels).
pub const MAX_SIZE: u32 = 16384;

/// Runs the program with the arguments of its command line, the program's name first.
///
/// Help, version and mistakes that the parser finds end the process, with status 0 or 2.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> Result<(), Error> {
    commands::run(cli::Cli::parse_from(arguments))
}
