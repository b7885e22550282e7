//! Rays by a ray-tracing pipeline, below wgpu's interface: some drivers, those of data centres among them, have pipelines and no
//! ray queries.
//!
//! wgpu 30 has no ray-tracing pipelines, and makes acceleration structures only where ray queries are enabled. Its hal layer has
//! both. So everything here is made through hal on Vulkan, and wgpu knows none of it:
//!
//! ```text
//! bvh_triangles ──copied──▶ vertices ──built──▶ bottom level ──built──▶ top level      `Structure`: with the scene
//!                                                                          │
//!            shader binding table: │ trace_rays │ miss │ closest and any hit │         `Pipeline`: per device and traits
//!                                                                          │
//! submit([ …wgpu: what wrote the rays; states,    ours: barrier, trace_rays, barrier,    wgpu: what reads the hits… ])
//! ```
//!
//! **Order.** The pass is a closure of the graph, which declares what it reads and writes. Its commands are a command buffer of
//! their own, between two of wgpu's. Before it, wgpu is told the states in which the shaders find the buffers and textures, and
//! that the hits are written (it would clear them otherwise, when it first sees them read). wgpu's barriers know no ray-tracing
//! stage: so the command buffer begins with a barrier from everything to that stage, and ends with one back.
//!
//! **Lifetimes.** Every object holds its device and is destroyed when the last command buffer that uses it has run: a callback of
//! that submission holds it until then.
//!
//! **Alpha.** WGSL has no word by which an any-hit shader lets a ray pass, and tracing again from behind each hit would miss what
//! coincides with it. So an empty function of the shader is replaced in the SPIR-V by the instruction that does; see `built/shader.rs`.
//!
//! Only [`TraceRays`](crate::TraceRays) goes this way, and with it every photon's path. Kernels that trace and shade in one, such
//! as the path tracer, traverse the hierarchy: as pipelines each would have to be cut at every ray.

#[cfg(all(feature = "ray-pipeline", any(windows, target_os = "linux", target_os = "android", target_os = "freebsd")))]
mod built;
#[cfg(not(all(feature = "ray-pipeline", any(windows, target_os = "linux", target_os = "android", target_os = "freebsd"))))]
#[path = "absent.rs"]
mod built;

pub(crate) use built::{AVAILABLE, PipelinedTraceRays, Structure, most_triangles};

use lightloom_graph::{Buffer, Handle, wgpu};
use std::sync::Arc;

/// What ray-tracing pipelines search of a scene: nothing yet, where the scene is described only.
#[derive(Clone, Debug)]
#[allow(dead_code, reason = "never read where there are no pipelines")]
pub struct RayPipelineScene(pub(crate) Option<Arc<Structure>>);

/// The rays of a pass.
#[derive(Debug)]
#[allow(dead_code, reason = "never read where there are no pipelines")]
pub(crate) struct RayList<'a> {
    /// [`Ray`](crate::Ray)s.
    pub(crate) rays: &'a Handle<Buffer>,
    /// One [`LivePaths`](crate::LivePaths): how many there are. `None`: as many as there are places.
    pub(crate) live: Option<&'a Handle<Buffer>>,
    /// Rays at most.
    pub(crate) places: u32,
    /// Submit the pass by itself.
    pub(crate) heavy: bool,
}

/// The resources of a scene that the shaders read, and that the structure is built from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct SceneParts {
    pub(crate) bvh_triangles: wgpu::Buffer,
    pub(crate) triangles: wgpu::Buffer,
    pub(crate) materials: wgpu::Buffer,
    pub(crate) texels: wgpu::Texture,
}
