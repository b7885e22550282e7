//! The pass over a list of rays.

mod shader;
mod vulkan;

pub(crate) use vulkan::{Structure, most_triangles};

use super::{RayList, RayPipelineScene};
use crate::LivePaths;
use crate::scene::{SceneHandles, SceneTraits};
use lightloom_graph::wgpu::util::{BufferInitDescriptor, DeviceExt as _};
use lightloom_graph::wgpu::{self, BufferUsages, BufferUses, TextureUsages, TextureUses};
use lightloom_graph::{Buffer, ClosureContext, Graph, Handle, ShaderError, WgslSources, bytemuck};
use shader::{PATH, Shader};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use vulkan::{Batch, Pipeline};

/// Whether this build has ray-tracing pipelines.
pub(crate) const AVAILABLE: bool = true;

type Pipelines = HashMap<(wgpu::Device, SceneTraits), Arc<Pipeline>>;

/// The pass. Reads: scene, rays, live count. Writes: hits. An invocation per place.
#[derive(Clone, Debug)]
pub(crate) struct PipelinedTraceRays {
    shader: Shader,
    pipelines: Arc<Mutex<Pipelines>>,
}

impl PipelinedTraceRays {
    /// `None` where `sources` lack the shaders.
    pub(crate) fn new(sources: &WgslSources) -> Result<Option<Self>, ShaderError> {
        if !sources.paths().iter().any(|path| path == PATH) {
            return Ok(None);
        }
        Ok(Some(Self { shader: Shader::new(sources)?, pipelines: Arc::default() }))
    }

    /// Declares the pass. `hits` has as many places as `list`.
    pub(crate) fn add(
        &self,
        graph: &mut Graph<'_>,
        scene: &SceneHandles,
        structure: &RayPipelineScene,
        list: &RayList<'_>,
        hits: &mut Handle<Buffer>,
    ) {
        let name = |handle: &Handle<Buffer>| handle.name().to_owned();
        let names = (name(list.rays), list.live.map(name), name(hits));
        let (this, structure, traits, places) = (self.clone(), structure.0.clone(), scene.traits, list.places);
        let mut pass = graph
            .closure("trace_rays")
            .read_as(&scene.bvh_triangles, BufferUsages::STORAGE)
            .read_as(&scene.triangles, BufferUsages::STORAGE)
            .read_as(&scene.materials, BufferUsages::STORAGE)
            .read_as(&scene.texels, TextureUsages::TEXTURE_BINDING)
            .read_as(list.rays, BufferUsages::STORAGE);
        if let Some(live) = list.live {
            pass = pass.read_as(live, BufferUsages::STORAGE);
        }
        if list.heavy {
            pass = pass.heavy();
        }
        pass.write_as(hits, BufferUsages::STORAGE | BufferUsages::COPY_DST).record(move |context| {
            let structure = structure.ok_or("the scene is described only")?;
            let (rays, live, hits) = names;
            let live = match live {
                Some(live) => context.buffer(&live)?,
                None => count_of(context.device(), places),
            };
            let batch = Batch { live, rays: context.buffer(&rays)?, hits: context.buffer(&hits)?, places };
            this.record(context, traits, &structure, &batch)
        });
    }

    fn record(
        &self,
        context: &mut ClosureContext<'_>,
        traits: SceneTraits,
        structure: &Arc<Structure>,
        batch: &Batch,
    ) -> Result<(), String> {
        let pipeline = self.pipeline(context.device(), traits)?;
        let commands = pipeline.trace(structure, batch)?;
        let parts = structure.parts();
        // To wgpu a clear is what writes the hits: without it, it would clear them when it first sees them read.
        context.encoder().clear_buffer(&batch.hits, 0, None);
        let read = [&batch.live, &batch.rays, &parts.bvh_triangles, &parts.triangles, &parts.materials];
        let read = read.map(|buffer| (buffer, BufferUses::STORAGE_READ_ONLY));
        let buffers = read.into_iter().chain([(&batch.hits, BufferUses::STORAGE_READ_WRITE)]);
        let texels = wgpu::TextureTransition { texture: &parts.texels, selector: None, state: TextureUses::RESOURCE };
        context.encoder().transition_resources(
            buffers.map(|(buffer, state)| wgpu::BufferTransition { buffer, state }),
            std::iter::once(texels),
        );
        context.insert(commands);
        Ok(())
    }

    fn pipeline(&self, device: &wgpu::Device, traits: SceneTraits) -> Result<Arc<Pipeline>, String> {
        let mut pipelines = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (device.clone(), traits);
        if let Some(found) = pipelines.get(&key) {
            return Ok(Arc::clone(found));
        }
        let spirv = self.shader.compile(traits, &vulkan::bindings())?;
        let made = Pipeline::new(device, &spirv, traits.alpha)?;
        pipelines.insert(key, Arc::clone(&made));
        Ok(made)
    }
}

/// A [`LivePaths`] of `count` rays.
fn count_of(device: &wgpu::Device, count: u32) -> wgpu::Buffer {
    let live = LivePaths { groups: 0, one_y: 1, one_z: 1, count };
    let (contents, usage) = (bytemuck::bytes_of(&live), BufferUsages::STORAGE);
    device.create_buffer_init(&BufferInitDescriptor { label: Some("ray_count"), contents, usage })
}
