//! The scene on the GPU: five storage buffers, an array texture and the environment's map, imported into each frame's graph.

use super::environment::Map;
use super::gpu_types::{BvhTriangle, Light, Material, NONE, TriangleAttributes};
use super::light_list::LightList;
use super::pages::Pages;
use super::writer::{Resident, Writer};
use super::{Bvh, BvhStats, Emission, PhotonBudget, Scene, SceneError, SceneInfo, SceneTraits, acceleration};
use crate::{RayBackend, RayBackendError};
use lightloom_graph::{Buffer, Graph, Handle, Texture, TextureDesc, Tlas, wgpu};

/// A scene in GPU memory.
#[derive(Debug)]
pub struct GpuScene {
    name: String,
    /// `None`: described only.
    gpu: Option<(wgpu::Device, wgpu::Queue)>,
    bvh_nodes: Resident,
    bvh_triangles: Resident,
    triangles: Resident,
    materials: Resident,
    lights: Resident,
    texels: (Option<wgpu::Texture>, TextureDesc),
    environment: (Option<wgpu::Texture>, TextureDesc),
    rays: RayBackend,
    /// What ray queries search, once it was built.
    acceleration: Option<wgpu::Tlas>,
    budget: PhotonBudget,
    info: SceneInfo,
    traits: SceneTraits,
    /// Size and cost of the hierarchy.
    pub bvh_stats: BvhStats,
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
    /// All texels, rgba8unorm; view it as rgba8unorm-srgb for `texels_srgb`.
    pub texels: Handle<Texture>,
    /// The environment's map and how to draw from it, rgba32float; see `shared/environment.wgsl`.
    pub environment: Handle<Texture>,
    /// What ray queries search; `None`: rays are traced through the hierarchy.
    pub ray_query_scene: Option<Handle<Tlas>>,
    /// What the scene asks of the shaders.
    pub traits: SceneTraits,
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
        let (bounds_center, bounds_radius) = scene.bounding_sphere();
        let list = LightList::new(scene, bounds_radius);
        let pages = Pages::new(&scene.textures);
        let mut to = Writer::new(gpu, &scene.name);

        let alpha_tested: Vec<bool> = scene.materials.iter().map(|material| material.lets_rays_pass(&scene.textures)).collect();
        let light_of = |index: usize| list.of_triangle.get(index).copied().unwrap_or(NONE);
        let bvh_nodes = to.array("bvh_nodes", bvh.nodes())?;
        let in_leaf_order = bvh.leaf_order().iter().map(|&index| {
            let triangle = &scene.triangles[index as usize];
            let alpha = alpha_tested.get(triangle.material as usize).is_some_and(|&a| a);
            BvhTriangle::new(triangle, index, alpha, light_of(index as usize))
        });
        let bvh_triangles = to.array("bvh_triangles", in_leaf_order)?;
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
        let triangles = to.array("triangles", in_scene_order)?;
        let materials =
            scene.materials.iter().map(|material| Material::new(material, |using| pages.slot(&scene.textures, using)));
        let materials = to.array("materials", materials)?;
        // Bindings must not be empty.
        let none = Light { material: NONE, triangle: NONE, ..Light::default() };
        let all: &[Light] = if list.lights.is_empty() { &[none] } else { &list.lights };
        let lights = to.array("lights", all.iter().copied())?;
        let texels = to.texels(&scene.textures, &pages)?;
        let environment = to.environment(&Map::new(scene.environment.as_ref()))?;
        to.drain();

        Ok(Self {
            name: scene.name.clone(),
            gpu: gpu.map(|(device, queue)| (device.clone(), queue.clone())),
            bvh_nodes,
            bvh_triangles,
            triangles,
            materials,
            lights,
            texels,
            environment,
            rays: RayBackend::Bvh,
            acceleration: None,
            budget: list.budget,
            info: SceneInfo {
                bounds_center,
                bounds_radius,
                triangle_count: scene.triangles.len() as u32,
                light_count: list.light_count,
                punctual_count: list.punctual_count,
                guide_count: list.guide_count,
                emission: Emission::Uniform,
                total_power: list.total_power,
            },
            traits: SceneTraits::of(scene),
            bvh_stats: bvh.stats(),
        })
    }

    /// The scene with its rays traced by `backend` in every pass; a new scene's are by [`RayBackend::Bvh`]. Ray queries take an
    /// acceleration structure, which is built the first time they are asked for.
    ///
    /// # Errors
    /// [`SceneError::Rays`] where the device was opened without ray queries, [`SceneError::DeviceLimit`] for more triangles than its
    /// structures hold.
    pub fn with_rays(mut self, backend: RayBackend) -> Result<Self, SceneError> {
        if backend == RayBackend::RayQuery && self.acceleration.is_none() {
            self.acceleration = self.accelerate()?;
        }
        self.rays = backend;
        Ok(self)
    }

    /// The acceleration structure, or `None` for a scene that is only described.
    fn accelerate(&self) -> Result<Option<wgpu::Tlas>, SceneError> {
        let (Some((device, queue)), Some(buffer)) = (&self.gpu, &self.bvh_triangles.buffer) else { return Ok(None) };
        if !device.features().contains(RayBackend::RayQuery.features()) {
            return Err(SceneError::Rays(RayBackendError::NotEnabled));
        }
        let triangles = self.info.triangle_count;
        let (vertices, most) = (acceleration::vertices(triangles), device.limits().max_blas_primitive_count);
        let within = Writer::new(Some((device, queue)), &self.name);
        within.allow("ray_query_scene", vertices, "vertices", most.into(), "max_blas_primitive_count")?;
        Ok(Some(acceleration::build(device, queue, buffer, triangles, !self.traits.alpha)))
    }

    /// What traces the scene's rays.
    pub fn rays(&self) -> RayBackend {
        self.rays
    }

    /// Imports the scene into a frame's graph.
    pub fn declare(&self, graph: &mut Graph<'_>) -> SceneHandles {
        let mut import = |resident: &Resident| graph.import_buffer(resident.name, resident.desc.clone(), resident.buffer.clone());
        let (bvh_nodes, bvh_triangles) = (import(&self.bvh_nodes), import(&self.bvh_triangles));
        let (triangles, materials) = (import(&self.triangles), import(&self.materials));
        let lights = import(&self.lights);
        let (texture, desc) = &self.texels;
        let texels = graph.import_texture("texels", desc.clone(), texture.clone());
        let (texture, desc) = &self.environment;
        let environment = graph.import_texture("environment", desc.clone(), texture.clone());
        let ray_query_scene =
            (self.rays == RayBackend::RayQuery).then(|| graph.import_tlas("ray_query_scene", self.acceleration.clone()));
        let traits = self.traits;
        SceneHandles { bvh_nodes, bvh_triangles, triangles, materials, lights, texels, environment, ray_query_scene, traits }
    }

    /// Bounds, counts and flux: what strategies need to know.
    pub fn info(&self) -> SceneInfo {
        self.info
    }

    /// The lamps and how photons are shared among them.
    pub fn budget(&self) -> &PhotonBudget {
        &self.budget
    }

    /// Bytes that the scene takes on the GPU, less the acceleration structure, whose size wgpu does not tell.
    pub fn bytes(&self) -> u64 {
        [&self.bvh_nodes, &self.bvh_triangles, &self.triangles, &self.materials, &self.lights]
            .iter()
            .map(|resident| resident.desc.size)
            .sum::<u64>()
            + self.texels.1.bytes()
            + self.environment.1.bytes()
    }
}

#[cfg(test)]
mod tests;
