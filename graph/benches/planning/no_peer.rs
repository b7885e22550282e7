//! In the place of `peer.rs` where there is no peer.

use lightloom_graph::Declaration;

/// Nothing was compiled.
pub(crate) struct Compiled {
    /// NaN.
    pub(crate) record_us: f64,
    /// NaN.
    pub(crate) compile_us: f64,
    /// 0.
    pub(crate) bytes: u64,
}

/// Compiles nothing.
pub(crate) fn compile(_frame: &Declaration) -> Compiled {
    Compiled { record_us: f64::NAN, compile_us: f64::NAN, bytes: 0 }
}
