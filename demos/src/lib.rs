//! The program `lightloom`, as a library so that tests and other programs can use its parts.
mod cancel;
mod cli;
mod console;
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
mod values;
mod session {
    pub(crate) fn strategy_names() -> Vec<&'static str> {
        vec!["exact", "tiled", "hash-grid", "path"]
    }
}

pub use console::report_error;
pub use error::Error;
pub use exposure::Exposure;
pub use image_io::{read_exr, write_exr};
pub use metrics::{flip, mean_ratio, relative_mse, signed_error};
pub use picture::Picture;

/// The largest width and height of an image (pixels).
pub const MAX_SIZE: u32 = 16384;
