//! In place of the pipelines where they are not built. There are none, so nothing here is ever called.

use super::{RayList, RayPipelineScene, SceneParts};
use crate::scene::SceneHandles;
use lightloom_graph::{Buffer, Graph, Handle, ShaderError, WgslSources, wgpu};
use std::sync::Arc;

/// Whether this build has ray-tracing pipelines.
pub(crate) const AVAILABLE: bool = false;

/// See `built/mod.rs`.
#[derive(Clone, Debug)]
pub(crate) enum PipelinedTraceRays {}

impl PipelinedTraceRays {
    #[expect(clippy::unnecessary_wraps, reason = "as where there are pipelines")]
    pub(crate) fn new(_sources: &WgslSources) -> Result<Option<Self>, ShaderError> {
        Ok(None)
    }

    pub(crate) fn add(
        &self,
        _graph: &mut Graph<'_>,
        _scene: &SceneHandles,
        _structure: &RayPipelineScene,
        _list: &RayList<'_>,
        _hits: &mut Handle<Buffer>,
    ) {
        match *self {}
    }
}

/// See `built/vulkan/structure.rs`.
#[derive(Debug)]
pub(crate) enum Structure {}

impl Structure {
    pub(crate) fn new(_device: &wgpu::Device, _parts: SceneParts, _opaque: bool) -> Result<Arc<Self>, String> {
        Err("this build has no ray-tracing pipelines".to_owned())
    }

    pub(crate) fn parts(&self) -> &SceneParts {
        match *self {}
    }

    pub(crate) fn build(self: &Arc<Self>, _queue: &wgpu::Queue) -> Result<(), String> {
        match **self {}
    }
}

/// See `built/vulkan/mod.rs`.
pub(crate) fn most_triangles(_device: &wgpu::Device) -> Option<u64> {
    None
}
