//! The scene on the GPU: seven storage buffers, an array texture and the environment's map, imported into each frame's graph.

use super::acceleration::{self, Acceleration};
use super::environment::Map;
use super::gpu_types::{BvhTriangle, Light, LightGroup, LightView, Material, NONE, TriangleAttributes};
use super::light_list::LightList;
use super::light_views::views;
use super::pages::Pages;
use super::writer::{Resident, Writer};
use super::{Bvh, BvhStats, Emission, PhotonBudget, Scene, SceneError, SceneInfo, SceneTraits};
use crate::ray_pipeline::{self, SceneParts, Structure};
use crate::{RayBackend, RayBackendError, RayPipelineScene};
use lightloom_graph::{Buffer, Graph, Handle, Texture, TextureDesc, Tlas, wgpu};
use std::sync::Arc;

/// A scene in GPU memory.
#[derive(Debug)]
pub struct GpuScene {
    name: String,
    /// `None`: described only.
    gpu: Option<(wgpu::Device, wgpu::Queue)>,
    pose: Pose,
    materials: Resident,
    /// For each material, whether alpha may let a ray pass.
    alpha_tested: Vec<bool>,
    texels: (Option<wgpu::Texture>, TextureDesc),
    environment: (Option<wgpu::Texture>, TextureDesc),
    rays: RayBackend,
    /// What ray queries search, once it was built.
    acceleration: Option<Acceleration>,
    /// What ray-tracing pipelines search, once it was built.
    structure: Option<Arc<Structure>>,
    traits: SceneTraits,
    /// Its triangles may move from frame to frame.
    moves: bool,
    /// Size and cost of the hierarchy.
    pub bvh_stats: BvhStats,
}

/// What follows when the scene moves.
#[derive(Debug)]
struct Pose {
    bvh_nodes: Resident,
    bvh_triangles: Resident,
    triangles: Resident,
    lights: Resident,
    light_groups: Resident,
    light_views: Resident,
    budget: PhotonBudget,
    info: SceneInfo,
}

/// The scene's resources in one frame's graph, named as the WGSL variables.
#[derive(Debug)]
pub struct SceneHandles {
    /// `array<BvhNode>`, the root first.
    pub bvh_nodes: Handle<Buffer>,
    /// `array<BvhTriangle>` in leaf order.
    pub bvh_triangles: Handle<Buffer>,
    /// `array<TriangleAttributes>` in scene order.
    pub triangles: Handle<Buffer>,
    /// `array<Material>`.
    pub materials: Handle<Buffer>,
    /// `array<Light>`; one entry without probability when the scene has no light.
    pub lights: Handle<Buffer>,
    /// `array<LightGroup>` in the order of their lights; one empty entry where there is none.
    pub light_groups: Handle<Buffer>,
    /// `array<LightView>`; one of zeros where there is none.
    pub light_views: Handle<Buffer>,
    /// All texels, rgba8unorm; view it as rgba8unorm-srgb for `texels_srgb`.
    pub texels: Handle<Texture>,
    /// The environment's map and how to draw from it, rgba32float; see `shared/environment.wgsl`.
    pub environment: Handle<Texture>,
    /// What ray queries search; `None`: rays are traced through the hierarchy.
    pub ray_query_scene: Option<Handle<Tlas>>,
    /// What ray-tracing pipelines search; `None`: none trace.
    pub ray_pipeline_scene: Option<RayPipelineScene>,
    /// What the scene asks of the shaders.
    pub traits: SceneTraits,
    /// Its triangles may be elsewhere in the next frame.
    pub moves: bool,
}

impl GpuScene {
    /// Builds the hierarchy and uploads.
    ///
    /// # Errors
    /// Those of [`Bvh::build`], and [`SceneError::DeviceLimit`] for what the device cannot hold.
    pub fn upload(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> Result<Self, SceneError> {
        let bvh = Bvh::build(&scene.name, &scene.triangles)?;
        Self::upload_with_bvh(device, queue, scene, &bvh)
    }

    /// Uploads with a hierarchy that was built from `scene.triangles`.
    ///
    /// # Errors
    /// [`SceneError::DeviceLimit`] for what the device cannot hold.
    pub fn upload_with_bvh(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene, bvh: &Bvh) -> Result<Self, SceneError> {
        Self::write(Some((device, queue)), scene, bvh)
    }

    /// Builds the hierarchy and uploads nothing: frames of this scene can be planned without a device, and not executed.
    ///
    /// # Errors
    /// Those of [`Bvh::build`].
    pub fn describe(scene: &Scene) -> Result<Self, SceneError> {
        Self::write(None, scene, &Bvh::build(&scene.name, &scene.triangles)?)
    }

    fn write(gpu: Option<(&wgpu::Device, &wgpu::Queue)>, scene: &Scene, bvh: &Bvh) -> Result<Self, SceneError> {
        let mut to = Writer::new(gpu, &scene.name);
        let alpha_tested: Vec<bool> = scene.materials.iter().map(|material| material.lets_rays_pass(&scene.textures)).collect();
        let pose = Pose::write(&mut to, scene, bvh, &alpha_tested, None)?;
        let pages = Pages::new(&scene.textures);
        let materials =
            scene.materials.iter().map(|material| Material::new(material, |using| pages.slot(&scene.textures, using)));
        let materials = to.array("materials", None, materials)?;
        let texels = to.texels(&scene.textures, &pages)?;
        let environment = to.environment(&Map::new(scene.environment.as_ref()))?;
        to.drain();

        Ok(Self {
            name: scene.name.clone(),
            gpu: gpu.map(|(device, queue)| (device.clone(), queue.clone())),
            pose,
            materials,
            alpha_tested,
            texels,
            environment,
            rays: RayBackend::Bvh,
            acceleration: None,
            structure: None,
            traits: SceneTraits::of(scene),
            moves: scene.animation.is_some(),
            bvh_stats: bvh.stats(),
        })
    }

    /// Follows `scene` to another pose: triangles, hierarchy, lights, bounds, guides and the photons' budget; materials, textures and the
    /// environment's map stay as they were uploaded. `bvh` has followed `scene.triangles` already ([`Bvh::follow`]).
    ///
    /// Buffers are kept where their size is the same, and the acceleration structure of the rays' backend is built again. Frames
    /// submitted before still see the earlier pose. What accumulates over frames is to begin anew.
    ///
    /// # Errors
    /// [`SceneError::Refit`] if `bvh` is over another number of triangles, and those of [`Self::upload_with_bvh`] and
    /// [`Self::with_rays`] where more memory is needed than before.
    pub fn update(&mut self, scene: &Scene, bvh: &Bvh) -> Result<(), SceneError> {
        if bvh.leaf_order().len() != scene.triangles.len() {
            return Err(SceneError::Refit { built: bvh.stats().triangles, given: scene.triangles.len() as u64 });
        }
        let gpu = self.gpu.as_ref().map(|(device, queue)| (device, queue));
        let mut to = Writer::new(gpu, &scene.name);
        self.pose = Pose::write(&mut to, scene, bvh, &self.alpha_tested, Some(&self.pose))?;
        self.bvh_stats = bvh.stats();
        self.moves = true;
        if self.acceleration.is_some() {
            self.accelerate()?;
        }
        if self.structure.is_some() {
            self.structure()?;
        }
        Ok(())
    }

    /// The scene with its rays traced by `backend` in every pass that can; a new scene's are by [`RayBackend::Bvh`]. Ray queries and
    /// pipelines each take an acceleration structure, which is built the first time they are asked for.
    ///
    /// # Errors
    /// [`SceneError::Rays`] where this build has no `backend` or the device was opened without what it needs, [`SceneError::DeviceLimit`] for more triangles
    /// than its structures hold.
    pub fn with_rays(mut self, backend: RayBackend) -> Result<Self, SceneError> {
        if !backend.is_built() {
            return Err(SceneError::Rays(RayBackendError::NotBuilt { backend }));
        }
        if backend == RayBackend::RayQuery && self.acceleration.is_none() {
            self.accelerate()?;
        }
        if backend == RayBackend::Pipeline && self.structure.is_none() {
            self.structure()?;
        }
        self.rays = backend;
        Ok(self)
    }

    /// Builds the acceleration structure; a scene that is only described has none.
    fn accelerate(&mut self) -> Result<(), SceneError> {
        let (Some((device, queue)), Some(buffer)) = (&self.gpu, &self.pose.bvh_triangles.buffer) else { return Ok(()) };
        RayBackend::RayQuery.check(device).map_err(SceneError::Rays)?;
        let triangles = self.pose.info.triangle_count;
        let (vertices, most) = (acceleration::vertices(triangles), device.limits().max_blas_primitive_count);
        let within = Writer::new(Some((device, queue)), &self.name);
        within.allow("ray_query_scene", vertices, "vertices", most.into(), "max_blas_primitive_count")?;
        let fitting = self.acceleration.take().filter(|old| old.triangles() == triangles);
        let acceleration = fitting.unwrap_or_else(|| Acceleration::new(device, triangles, !self.traits.alpha));
        acceleration.build(device, queue, buffer);
        self.acceleration = Some(acceleration);
        Ok(())
    }

    /// Builds the structure of ray-tracing pipelines; a scene that is only described has none.
    fn structure(&mut self) -> Result<(), SceneError> {
        let Some((device, queue)) = &self.gpu else { return Ok(()) };
        let Pose { bvh_triangles, triangles, .. } = &self.pose;
        let buffers = (&bvh_triangles.buffer, &triangles.buffer, &self.materials.buffer, &self.texels.0);
        let (Some(bvh_triangles), Some(triangles), Some(materials), Some(texels)) = buffers else { return Ok(()) };
        RayBackend::Pipeline.check(device).map_err(SceneError::Rays)?;
        let most = ray_pipeline::most_triangles(device).unwrap_or_default();
        let within = Writer::new(Some((device, queue)), &self.name);
        let count = self.pose.info.triangle_count.into();
        within.allow("ray_pipeline_scene", count, "triangles", most, "maxPrimitiveCount")?;
        let parts = SceneParts {
            bvh_triangles: bvh_triangles.clone(),
            triangles: triangles.clone(),
            materials: materials.clone(),
            texels: texels.clone(),
        };
        let refused = |message| SceneError::Rays(RayBackendError::Refused { backend: RayBackend::Pipeline, message });
        let fitting = self.structure.take().filter(|old| *old.parts() == parts);
        let made = || Structure::new(device, parts, !self.traits.alpha);
        let structure = fitting.map_or_else(made, Ok).map_err(refused)?;
        structure.build(queue).map_err(refused)?;
        self.structure = Some(structure);
        Ok(())
    }

    /// What traces the scene's rays.
    pub fn rays(&self) -> RayBackend {
        self.rays
    }

    /// Imports the scene into a frame's graph.
    pub fn declare(&self, graph: &mut Graph<'_>) -> SceneHandles {
        let mut import = |resident: &Resident| graph.import_buffer(resident.name, resident.desc.clone(), resident.buffer.clone());
        let Pose { bvh_nodes, bvh_triangles, triangles, lights, light_groups, light_views, .. } = &self.pose;
        let (bvh_nodes, bvh_triangles) = (import(bvh_nodes), import(bvh_triangles));
        let (triangles, materials) = (import(triangles), import(&self.materials));
        let (lights, light_groups, light_views) = (import(lights), import(light_groups), import(light_views));
        let (texture, desc) = &self.texels;
        let texels = graph.import_texture("texels", desc.clone(), texture.clone());
        let (texture, desc) = &self.environment;
        let environment = graph.import_texture("environment", desc.clone(), texture.clone());
        let tlas = || self.acceleration.as_ref().map(|acceleration| acceleration.tlas.clone());
        let ray_query_scene = (self.rays == RayBackend::RayQuery).then(|| graph.import_tlas("ray_query_scene", tlas()));
        let ray_pipeline_scene = (self.rays == RayBackend::Pipeline).then(|| RayPipelineScene(self.structure.clone()));
        SceneHandles {
            bvh_nodes,
            bvh_triangles,
            triangles,
            materials,
            lights,
            light_groups,
            light_views,
            texels,
            environment,
            ray_query_scene,
            ray_pipeline_scene,
            traits: self.traits,
            moves: self.moves,
        }
    }

    /// Bounds, counts and flux: what strategies need to know.
    pub fn info(&self) -> SceneInfo {
        self.pose.info
    }

    /// The lamps and how photons are shared among them.
    pub fn budget(&self) -> &PhotonBudget {
        &self.pose.budget
    }

    /// Bytes that the scene takes on the GPU, less the acceleration structure, whose size wgpu does not tell.
    pub fn bytes(&self) -> u64 {
        let Pose { bvh_nodes, bvh_triangles, triangles, lights, light_groups, light_views, .. } = &self.pose;
        [bvh_nodes, bvh_triangles, triangles, &self.materials, lights, light_groups, light_views]
            .iter()
            .map(|resident| resident.desc.size)
            .sum::<u64>()
            + self.texels.1.bytes()
            + self.environment.1.bytes()
    }
}

impl Pose {
    /// Into the buffers of `old` where they have the right size.
    fn write(
        to: &mut Writer<'_>,
        scene: &Scene,
        bvh: &Bvh,
        alpha_tested: &[bool],
        old: Option<&Self>,
    ) -> Result<Self, SceneError> {
        let (bounds_center, bounds_radius) = scene.bounding_sphere();
        let mut list = LightList::new(scene, bounds_radius);
        let all_views = views(&mut list.groups, &list.lights, bounds_center, bounds_radius);
        let light_of = |index: usize| list.of_triangle.get(index).copied().unwrap_or(NONE);
        let bvh_nodes = to.array("bvh_nodes", old.map(|old| &old.bvh_nodes), bvh.nodes())?;
        let in_leaf_order = bvh.leaf_order().iter().map(|&index| {
            let triangle = &scene.triangles[index as usize];
            let alpha = alpha_tested.get(triangle.material as usize).is_some_and(|&a| a);
            BvhTriangle::new(triangle, index, alpha, light_of(index as usize))
        });
        let bvh_triangles = to.array("bvh_triangles", old.map(|old| &old.bvh_triangles), in_leaf_order)?;
        let mut leaf_of = vec![0; scene.triangles.len()];
        for (leaf, &index) in bvh.leaf_order().iter().enumerate() {
            leaf_of[index as usize] = leaf as u32;
        }
        let in_scene_order = scene
            .triangles
            .iter()
            .zip(leaf_of)
            .enumerate()
            .map(|(index, (triangle, leaf))| TriangleAttributes::new(triangle, light_of(index), leaf));
        let triangles = to.array("triangles", old.map(|old| &old.triangles), in_scene_order)?;
        // Bindings must not be empty.
        let none = Light { material: NONE, triangle: NONE, ..Light::default() };
        let all: &[Light] = if list.lights.is_empty() { &[none] } else { &list.lights };
        let lights = to.array("lights", old.map(|old| &old.lights), all.iter().copied())?;
        let groups: &[LightGroup] = if list.groups.is_empty() { &[LightGroup::default()] } else { &list.groups };
        let light_groups = to.array("light_groups", old.map(|old| &old.light_groups), groups.iter().copied())?;
        let light_view_count = all_views.len() as u32;
        let light_views: &[LightView] = if all_views.is_empty() { &[LightView::default()] } else { &all_views };
        let light_views = to.array("light_views", old.map(|old| &old.light_views), light_views.iter().copied())?;
        let info = SceneInfo {
            bounds_center,
            bounds_radius,
            triangle_count: scene.triangles.len() as u32,
            light_count: list.light_count,
            punctual_count: list.punctual_count,
            light_group_count: list.groups.len() as u32,
            light_view_count,
            guide_count: list.guide_count,
            emission: Emission::Uniform,
            total_power: list.total_power,
        };
        Ok(Self { bvh_nodes, bvh_triangles, triangles, lights, light_groups, light_views, budget: list.budget, info })
    }
}

#[cfg(test)]
mod tests;
