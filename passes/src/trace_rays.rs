//! Any list of rays against the scene: those of the photons, those that engines bring, and those by which the traversal is measured.
//!
//! It is the one pass that knows all of [`RayBackend`](crate::RayBackend): the two versions of its kernel, and a pipeline.

use crate::photon_path::PathBuffers;
use crate::ray_pipeline::{PipelinedTraceRays, RayList};
use crate::scene::SceneHandles;
use crate::scene_shader::SceneShader;
use lightloom_graph::{Buffer, BufferDesc, Graph, Handle, ShaderError, WgslSources, shader_struct};

shader_struct! {
    struct TraceRaysParams {
        count: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

shader_struct! {
    /// A ray.
    pub struct Ray {
        /// World (m).
        pub origin: [f32; 3],
        /// Length in units of `direction`; 0 or less: there is no ray here.
        pub t_max: f32,
        /// World; need not be unit.
        pub direction: [f32; 3],
        /// Triangle in the order of the BVH, + 1, which is taken to be the first if the ray meets it at all; 0: none is known.
        pub seen: u32,
    }
}

shader_struct! {
    /// Where a ray met the scene first.
    pub struct RayHit {
        /// Distance in units of the ray's direction; its `t_max` on a miss.
        pub t: f32,
        /// Triangle of the scene, [`RayHit::NONE`] on a miss.
        pub triangle: u32,
        /// Barycentric weights of the second and third corner.
        pub bary: [f32; 2],
    }
}

impl RayHit {
    /// No triangle.
    pub const NONE: u32 = u32::MAX;
}

/// The pass. Reads: scene, rays. Writes: hits. A thread per ray.
#[derive(Clone, Debug)]
pub struct TraceRays {
    shader: SceneShader,
    /// `None`: not built, or the sources have no such shaders.
    pipelined: Option<PipelinedTraceRays>,
}

impl TraceRays {
    /// Parses the shader.
    pub fn new(sources: &WgslSources) -> Result<Self, ShaderError> {
        let shader = SceneShader::new(sources, "passes/trace_rays.wgsl")?;
        Ok(Self { shader, pipelined: PipelinedTraceRays::new(sources)? })
    }

    /// Declares the pass over `count` [`Ray`]s. Returns as many [`RayHit`]s.
    pub fn add(&self, graph: &mut Graph<'_>, scene: &SceneHandles, rays: &Handle<Buffer>, count: u32) -> Handle<Buffer> {
        let mut hits = graph.buffer("ray_hits", BufferDesc::array_of::<RayHit>(u64::from(count)));
        if let (Some(pipelined), Some(structure)) = (&self.pipelined, &scene.ray_pipeline_scene) {
            let list = RayList { rays, live: None, places: count, heavy: true };
            pipelined.add(graph, scene, structure, &list, &mut hits);
            return hits;
        }
        scene
            .bind(graph.compute(&self.shader.variant(scene)).params(&TraceRaysParams { count, pad0: 0, pad1: 0, pad2: 0 }))
            .read("rays", rays)
            .write("hits", &mut hits)
            .heavy()
            .dispatch_1d(count);
        hits
    }

    /// Declares the pass over the live rays of `paths`, which has `places` places. `heavy` submits it by itself.
    pub(crate) fn add_live(
        &self,
        graph: &mut Graph<'_>,
        scene: &SceneHandles,
        paths: &PathBuffers,
        places: u32,
        heavy: bool,
    ) -> Handle<Buffer> {
        let mut hits = graph.buffer("ray_hits", BufferDesc::array_of::<RayHit>(u64::from(places)));
        if let (Some(pipelined), Some(structure)) = (&self.pipelined, &scene.ray_pipeline_scene) {
            let list = RayList { rays: &paths.rays, live: Some(&paths.live), places, heavy };
            pipelined.add(graph, scene, structure, &list, &mut hits);
            return hits;
        }
        let params = TraceRaysParams { count: places, pad0: 0, pad1: 0, pad2: 0 };
        let pass = scene
            .bind(graph.compute(&self.shader.variant(scene)).params(&params))
            .read("rays", &paths.rays)
            .write("hits", &mut hits);
        let pass = if heavy { pass.heavy() } else { pass };
        pass.dispatch_indirect(&paths.live, 0);
        hits
    }
}
