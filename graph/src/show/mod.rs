//! Frames for people and for other programs to look at: an HTML page, and traces.
//!
//! ```text
//!   Declaration, Plan ──▶ flow ──▶ layers, place ──▶ dag ─┐
//!           │                                             ├─▶ html
//!           └──────────▶ timeline, tables, facts ─────────┘
//!   FrameOutput ──▶ profile ──▶ html, trace
//! ```

mod dag;
mod facts;
mod flow;
mod html;
mod layers;
mod place;
mod profile;
mod tables;
mod text;
mod timeline;
mod trace;

pub use html::to_html;
pub use profile::{FrameProfile, Profile};
pub use trace::to_chrome_trace;
