//! A declarative render graph on wgpu.
//!
//! A frame is declared by plain code, every frame. Passes name what they read and write; the graph checks that against the
//! WGSL, leaves out what nothing needs, lets transient resources share memory, and runs the rest.
//!
//! ```text
//!   Graph ──────────► Declaration ──────────► Plan ──────────► Executor
//!   handles, passes   plain data,             pure function:   device: pipelines,
//!   checked by naga   hashed, as JSON         cull, merge,     pool, history, times,
//!   against WGSL                              order, place     readback
//! ```
//!
//! A frame can be looked at as an HTML page ([`to_html`]), a Chrome trace ([`to_chrome_trace`]), DOT ([`to_dot`]) and JSON
//! ([`to_json`]), and any pass's output by [`Graph::tap`].
//!
//! Planning needs no device:
//!
//! ```
//! use lightloom_graph::{BufferDesc, ComputeShader, Graph, PlanOptions};
//!
//! let double = ComputeShader::from_wgsl("double", "
//!     @group(0) @binding(0) var<storage, read> source: array<f32>;
//!     @group(0) @binding(1) var<storage, read_write> target_values: array<f32>;
//!     @compute @workgroup_size(64) fn double(@builtin(global_invocation_id) id: vec3u) {
//!         if id.x < arrayLength(&source) { target_values[id.x] = 2.0 * source[id.x]; }
//!     }")?;
//!
//! let mut graph = Graph::new("example");
//! let source = graph.import_buffer("source", BufferDesc::words(1000), None);
//! let mut doubled = graph.buffer("doubled", BufferDesc::words(1000));
//! graph.compute(&double).read("source", &source).write("target_values", &mut doubled).dispatch_1d(1000);
//! graph.readback_buffer(&doubled);
//!
//! let plan = graph.plan(&PlanOptions::default())?;
//! assert_eq!(plan.order.len(), 2);
//! assert_eq!(plan.memory.unshared_bytes, 4000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A sub-graph is a plain function: what it reads it takes as `&Handle`, what it makes it returns. A mip chain, each level
//! read and written apart:
//!
//! ```
//! use lightloom_graph::{ComputeShader, Graph, Handle, Subresources, Texture, TextureDesc, wgpu::TextureFormat};
//!
//! /// `image` and what `reduce` makes of it, level by level.
//! fn pyramid(graph: &mut Graph<'_>, reduce: &ComputeShader, image: &Handle<Texture>, levels: u32) -> Handle<Texture> {
//!     let [width, height, _] = image.desc().size;
//!     let desc = TextureDesc::new_2d([width / 2, height / 2], TextureFormat::R32Float).mip_levels(levels);
//!     let mut pyramid = graph.texture("pyramid", desc);
//!     for level in 0..levels {
//!         let pass = graph.compute(reduce);
//!         let pass = if level == 0 { pass.read("fine", image) } else { pass.read_at("fine", &pyramid, Subresources::mip(level - 1)) };
//!         let size = [width, height].map(|side| (side >> (level + 1)).max(1));
//!         pass.write_at("coarse", &mut pyramid, Subresources::mip(level)).dispatch_threads([size[0], size[1], 1]);
//!     }
//!     pyramid
//! }
//! ```
//!
//! Frames of equal structure share a plan, whatever their name: a graph for each view costs one plan, and each view keeps its
//! own history.
//!
//! # Features
//!
//! - `placement`: [`Sharing::Placed`] puts transient textures and buffers at offsets of shared memory on Vulkan, through
//!   wgpu's hal layer. It needs `unsafe`, which is fenced in one module. Without it, and on other backends, such frames are
//!   pooled, and [`FrameOutput::sharing_note`] says why.

extern crate self as lightloom_graph;

mod closure;
mod copy;
mod declaration;
mod dot;
mod error;
mod executor;
mod format;
mod frame;
mod gpu;
mod graph;
mod handle;
mod hash;
mod indirect;
mod layout;
mod pass;
mod plan;
mod raster;
mod reflect;
mod reload;
mod resource;
mod shader;
mod show;
mod sources;
mod subresource;
mod tap;
mod verify;
mod wgsl;

/// Compiles the README's example.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub use bytemuck;
pub use closure::ClosureContext;
pub use declaration::{Access, Attachment, Declaration, Origin, PassDecl, PassKind, ResourceDecl, ResourceKind, Write};
pub use dot::{to_dot, to_json};
pub use error::{GraphError, PassPlace, ShaderError, ShaderPlace};
pub use executor::{Executor, FrameOutput, InFlight, PassTime, PlanCache, Planned, Progress, TimingSource};
pub use gpu::{AdapterSummary, Gpu, GpuError, GpuRequest, adapters};
pub use graph::{Graph, Initial, Readback};
pub use handle::{Buffer, Handle, History, Resource, Texture, Tlas};
pub use layout::{Field, ShaderStruct, StructLayout};
pub use pass::{ClosurePass, ComputePass, Load, RasterPass, Sampler};
pub use plan::{Culled, Lifetime, Memory, Need, PassOrder, Plan, PlanOptions, Sharing, Slot, SlotKind, plan, plan_with_needs};
pub use reflect::chain as error_chain;
pub use reload::Reload;
pub use resource::{BufferDesc, TextureDesc};
pub use shader::{ComputeShader, RasterShader};
pub use show::{FrameProfile, Profile, to_chrome_trace, to_html};
pub use sources::WgslSources;
pub use subresource::Subresources;
pub use tap::Tap;
pub use wgpu;
pub use wgsl::FlatWgsl;
