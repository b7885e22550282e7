//! The stages of Lightloom's frame, each a pass or a few of a render graph.
//!
//! ```text
//! scene ─▶ visibility ─▶ G-buffer ─▶ direct light ───────────────────────┐
//!   │                        │                                           ▼
//!   └──▶ photon tracing ──▶ photons ─▶ (a strategy) ─▶ specular pixels ─▶ compose ─▶ accumulate
//! ```
//!
//! A pass knows no strategy. Each is one Rust file and one WGSL file of the same name; `new` parses its shader (no device
//! needed), `add` declares it in a [`Graph`](lightloom_graph::Graph) and runs nothing.
//!
//! # Features
//!
//! - `ray-pipeline`: [`RayBackend::Pipeline`], rays by ray-tracing pipelines on Vulkan, through wgpu's hal layer. It needs `unsafe`, which
//!   is fenced in one folder. Without it, that backend is refused by an error.
//!
//! Units: positions in m, flux in W, radiance in W·m⁻²·sr⁻¹, linear Rec. 709 RGB. Images have their first row on top.

mod accumulate;
mod ambient_occlusion;
mod camera;
mod compose;
mod deposit_cull;
mod direct;
mod filter;
mod gbuffer;
mod irradiance;
mod light_info;
mod path_trace;
mod photon;
mod photon_compact;
mod photon_emit;
mod photon_path;
mod photon_scatter;
mod photon_splat;
mod photon_store;
mod photon_trace;
mod prefix_sum;
mod ray_backend;
mod ray_pipeline;
mod rsm;
pub mod scene;
mod scene_bind;
mod scene_shader;
mod specular_pixels;
mod trace_rays;
mod upsample;
mod visibility;
mod visible_points;

pub use accumulate::{Accumulate, Accumulated};
pub use ambient_occlusion::{AmbientOcclusion, AmbientOcclusionSettings};
pub use camera::CameraUniform;
pub use compose::Compose;
pub use deposit_cull::DepositCull;
pub use direct::{DirectLight, DirectSettings};
pub use filter::{Filter, FilterError, FilterFrame, FilterInputs, FilterParameter, FilterSettings};
pub use gbuffer::{GBuffer, GBufferPass};
pub use irradiance::{Irradiance, ReflectIrradiance};
pub use light_info::LightInfo;
pub use path_trace::{PathLayers, PathSettings, PathTrace};
pub use photon::{FluxLedger, Photon, PhotonFlags, PhotonState, decode_flux, decode_octahedral};
pub use photon_emit::PhotonEmit;
pub use photon_path::{LivePaths, PackedDifferential, PathBuffers, PhotonBatch, PhotonPath, PhotonSource};
pub use photon_splat::{PhotonSplat, Splats};
pub use photon_store::{CompactPhoton, PhotonGrid, PhotonStore};
pub use photon_trace::{PhotonSettings, PhotonTracing, Photons};
pub use prefix_sum::PrefixSum;
pub use ray_backend::{RayBackend, RayBackendError};
pub use ray_pipeline::RayPipelineScene;
pub use rsm::{FirstHit, MapsBy, Rsm, RsmMaps, RsmSettings, RsmSource};
pub use scene_shader::{SceneRasterShader, SceneShader};
pub use specular_pixels::SpecularPixels;
pub use trace_rays::{Ray, RayHit, TraceRays};
pub use upsample::{Subsample, SubsampledPoints, Upsample};
pub use visibility::Visibility;
pub use visible_points::{VisiblePoints, VisiblePointsPass};

use lightloom_graph::{TextureDesc, WgslSources, wgpu::TextureFormat};

/// The shaders of Lightloom, for [`ComputeShader::new`](lightloom_graph::ComputeShader::new) and for crates that add
/// passes or strategies of their own: `shaders().with(&[("mine/gather.wgsl", "…")])`.
pub fn shaders() -> WgslSources {
    WgslSources::new().with(lightloom_shaders::FILES)
}

/// A picture of 32-bit floats: what every layer of radiance is.
pub fn radiance_desc(size: [u32; 2]) -> TextureDesc {
    TextureDesc::new_2d(size, TextureFormat::Rgba32Float)
}
