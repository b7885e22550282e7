//! Scenes: triangles, materials, textures, lights and cameras, on the CPU and on the GPU.
//!
//! ```text
//! file.glb / file.gltf ──load──▶ Scene ──Bvh::build──▶ Bvh ──┐
//! builtin::cornell() ───────────▶   │                       ├─GpuScene::upload──▶ GpuScene ──declare──▶ SceneHandles
//!                                   └────────────────────────┘
//! ```
//!
//! What the file animates moves by [`Scene::pose`]; the hierarchy then follows by [`Bvh::follow`], the GPU by [`GpuScene::update`].
//! [`GpuScene::with_rays`] adds an acceleration structure of the device's own, for ray queries or ray-tracing pipelines.
//!
//! A [`Scene`] is flat: every instance of every node becomes triangles in world space (metres), so
//! that there is one hierarchy and no transform at hit time. Units are those of [`Light`] and
//! [`Material`]: intensity in W·sr⁻¹, irradiance in W·m⁻², radiance in W·m⁻²·sr⁻¹, linear Rec. 709.

mod acceleration;
mod animation;
mod budget;
mod camera;
mod environment;
mod error;
mod guides;
mod light;
mod light_groups;
mod light_list;
mod light_views;
mod load;
mod material;
mod mesh;
mod placement;
mod reflection;
mod texture;
mod traits;

pub mod builtin;
pub mod bvh;
mod bvh_node;
pub mod gpu_types;
mod pages;
mod upload;
mod writer;

pub use animation::Animation;
pub use budget::{Lamp, PhotonBudget};
pub use bvh::{Bvh, BvhStats, Followed, Hit};
pub use camera::Camera;
pub use environment::Environment;
pub use error::SceneError;
pub use light::{Emission, Light, spot_falloff};
pub use material::{Alpha, Material};
pub use reflection::Reflection;
pub use texture::{TextureData, TextureUse, Wrap};
pub use traits::SceneTraits;
pub use upload::{GpuScene, SceneHandles};

use glam::{Vec2, Vec3};
use std::path::Path;
use std::sync::Arc;

/// A triangle in world space. Its front side shows the vertices counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Corners (m).
    pub positions_world: [Vec3; 3],
    /// Shading normals at the corners (unit).
    pub normals_world: [Vec3; 3],
    /// Texture coordinates at the corners.
    pub uvs: [Vec2; 3],
    /// Index into [`Scene::materials`].
    pub material: u32,
}

impl Triangle {
    /// Twice the area along the geometric normal: edge1 × edge2 (m²).
    pub fn cross_world(&self) -> Vec3 {
        let [a, b, c] = self.positions_world;
        (b - a).cross(c - a)
    }

    /// Area (m²).
    pub fn area(&self) -> f32 {
        0.5 * self.cross_world().length()
    }

    /// Geometric normal of the front side (unit).
    pub fn normal_world(&self) -> Vec3 {
        self.cross_world().normalize_or_zero()
    }

    /// Whether some transform gives it an area: in exact arithmetic, which 64 bits are for most corners.
    pub(crate) fn is_extended(&self) -> bool {
        let [a, b, c] = self.positions_world.map(Vec3::as_dvec3);
        (b - a).cross(c - a).length_squared() > 0.0
    }

    /// Whether it can be hit: all corners finite and of a size that arithmetic survives, area above zero.
    pub(crate) fn is_sound(&self) -> bool {
        self.is_in_range() && self.cross_world().length_squared().is_normal()
    }

    /// Whether all corners are finite and of a size that arithmetic survives.
    pub(crate) fn is_in_range(&self) -> bool {
        self.positions_world.iter().all(|p| p.is_finite() && p.abs().max_element() < LARGEST_COORDINATE_M)
    }
}

/// Coordinates beyond this (m) are refused: squares of areas would overflow 32-bit floats.
pub(crate) const LARGEST_COORDINATE_M: f32 = 1e8;

/// What is said of a scene in which nothing emits.
const DEFAULT_LIGHT: &str = "nothing in the scene emits light: added a directional light of π W/m² from above";

/// A scene on the CPU.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// File stem or name of the built-in scene.
    pub name: String,
    /// All triangles, instances flattened.
    pub triangles: Vec<Triangle>,
    /// Surfaces.
    pub materials: Vec<Material>,
    /// How glossy surfaces reflect.
    pub reflection: Reflection,
    /// Images that the materials use.
    pub textures: Vec<TextureData>,
    /// Punctual lights.
    pub lights: Vec<Light>,
    /// Their names, by the same index; a light without one is called `light` and its index.
    pub light_names: Vec<String>,
    /// Radiance from infinitely far away.
    pub environment: Option<Environment>,
    /// Factors on the number of photons that a lamp gets, by its name; see [`Self::set_photon_weight`].
    pub photon_weights: Vec<(String, f32)>,
    /// The only light is the one that was added to a dark scene; an environment replaces it.
    pub default_light: bool,
    /// Cameras in file order.
    pub cameras: Vec<Camera>,
    /// What moves; see [`Self::pose`]. `None`: nothing does.
    pub animation: Option<Arc<Animation>>,
    /// What was skipped or added while loading; to be shown to the user.
    pub warnings: Vec<String>,
}

/// What strategies need to know of a scene without touching its triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SceneInfo {
    /// Centre of a sphere that holds all triangles (m).
    pub bounds_center: Vec3,
    /// Its radius (m).
    pub bounds_radius: f32,
    /// Triangles.
    pub triangle_count: u32,
    /// Lights in the light list: punctual ones, then emissive triangles, then the environment.
    pub light_count: u32,
    /// Punctual lights; they come first in the list.
    pub punctual_count: u32,
    /// Groups of lights that maps can steer: punctual lights and pieces of emissive surfaces.
    pub light_group_count: u32,
    /// Views that show, rasterised, what points, spots and directional lights meet.
    pub light_view_count: u32,
    /// Spheres around what refracts or mirrors, which guided emission aims at.
    pub guide_count: u32,
    /// How photons leave the lights.
    pub emission: Emission,
    /// Flux of all lights together (W).
    pub total_power: Vec3,
}

impl SceneInfo {
    /// The same scene with photons that leave by `emission`. Without anything to aim at, emission stays uniform.
    pub fn with_emission(self, emission: Emission) -> Self {
        Self { emission: if self.guide_count > 0 { emission } else { Emission::Uniform }, ..self }
    }
}

impl Scene {
    /// Loads a `.gltf` or `.glb` file.
    ///
    /// Nodes are flattened, strips and fans become triangles, a scene that emits nothing gets a
    /// default light. An animated scene is at rest until [`Self::pose`] moves it. See [`Self::warnings`] for what was skipped.
    ///
    /// # Errors
    /// Names the file, the place in it and the mend; see [`SceneError`].
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        load::file(path)
    }

    /// Loads a glTF or GLB that is already in memory; `name` stands for the file in messages.
    /// Buffers and images must be embedded.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn from_slice(bytes: &[u8], name: &str) -> Result<Self, SceneError> {
        load::slice(bytes, name)
    }

    /// The camera of that name or, failing that, of that index; without a selector the first one.
    /// A scene without cameras is framed as a whole.
    ///
    /// # Errors
    /// [`SceneError::UnknownCamera`] lists the names.
    pub fn camera(&self, selector: Option<&str>) -> Result<Camera, SceneError> {
        match (selector, self.cameras.first()) {
            (Some(selector), _) => camera::select(&self.name, &self.cameras, selector).cloned(),
            (None, Some(first)) => Ok(first.clone()),
            (None, None) => {
                let (center, radius) = self.bounding_sphere();
                Ok(Camera::framing(center, radius))
            }
        }
    }

    /// Least and greatest corner of the box around all triangles (m); both zero when there are none.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let mut corners = self.triangles.iter().flat_map(|t| t.positions_world);
        let Some(first) = corners.next() else { return (Vec3::ZERO, Vec3::ZERO) };
        corners.fold((first, first), |(least, most), p| (least.min(p), most.max(p)))
    }

    /// Centre and radius (m) of a sphere that holds all triangles: the centre of [`Self::bounds`] and
    /// the farthest corner from it, a hair enlarged against rounding.
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        let (least, most) = self.bounds();
        let center = 0.5 * (least + most);
        let farthest =
            self.triangles.iter().flat_map(|t| t.positions_world).map(|p| p.distance_squared(center)).fold(0.0, f32::max);
        (center, farthest.sqrt() * 1.000_01)
    }

    /// Turns every opaque, non-metallic surface into a Lambertian of its base colour: the model to
    /// compare light transport with (`--materials lambert`). Emission and alpha stay.
    pub fn make_lambert(&mut self) {
        for material in &mut self.materials {
            material.make_lambert(&self.textures);
        }
    }

    /// Lights the scene from infinitely far away, in place of an environment or default light it had.
    pub fn set_environment(&mut self, environment: Environment) {
        if std::mem::take(&mut self.default_light) {
            self.lights.clear();
            self.light_names.clear();
            self.warnings.retain(|warning| warning != DEFAULT_LIGHT);
        }
        self.environment = Some(environment);
    }

    /// Multiplies the number of photons that the lamp `name` gets by `weight`, 1/16 to 16; the image stays the same on
    /// average. Lamps are the punctual lights, the emissive materials and `environment`.
    ///
    /// # Errors
    /// [`SceneError::UnknownLight`] lists the names, [`SceneError::PhotonWeight`] the range.
    pub fn set_photon_weight(&mut self, name: &str, weight: f32) -> Result<(), SceneError> {
        let lamps = light_list::lamp_names(self);
        if !lamps.iter().any(|lamp| lamp == name) {
            let available = lamps.iter().map(|lamp| format!("`{lamp}`")).collect::<Vec<_>>().join(", ");
            return Err(SceneError::UnknownLight { scene: self.name.clone(), name: name.to_owned(), available });
        }
        if !budget::is_weight(weight) {
            return Err(SceneError::PhotonWeight { scene: self.name.clone(), name: name.to_owned(), weight });
        }
        self.put_photon_weight(name, weight);
        Ok(())
    }

    fn put_photon_weight(&mut self, name: &str, weight: f32) {
        self.photon_weights.retain(|(lamp, _)| lamp != name);
        self.photon_weights.push((name.to_owned(), weight));
    }

    /// Whether any surface or light emits.
    fn emits(&self) -> bool {
        self.environment.as_ref().is_some_and(|environment| environment.irradiance_all_round().max_element() > 0.0)
            || self.lights.iter().any(|light| light.strength().max_element() > 0.0)
            || self.triangles.iter().any(|triangle| {
                let emissive = self.materials.get(triangle.material as usize).map(|m| m.emissive);
                emissive.is_some_and(|e| e.iter().any(|&c| c > 0.0))
            })
    }

    /// Adds a sun, and a warning, to a scene in which nothing emits.
    pub(crate) fn ensure_light(&mut self) {
        if self.emits() {
            return;
        }
        self.lights = vec![Light::Directional {
            direction_world: Vec3::new(-0.4, -1.0, -0.5).normalize(),
            irradiance: Vec3::splat(std::f32::consts::PI),
        }];
        self.light_names = vec!["default".into()];
        self.default_light = true;
        if let Some(animation) = &mut self.animation {
            Arc::make_mut(animation).release_lights();
        }
        self.warnings.push(DEFAULT_LIGHT.into());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_without_camera_is_framed() {
        let mut scene = builtin::cornell();
        scene.cameras.clear();
        let (center, radius) = scene.bounding_sphere();
        let camera = scene.camera(None).unwrap();
        assert!(camera.position_world().distance(center) > radius, "outside the bounds");
        assert!(scene.camera(Some("0")).is_err(), "no camera 0");
    }

    #[test]
    fn dark_scene_gets_a_light_and_a_warning() {
        let mut scene = builtin::cornell();
        scene.ensure_light();
        assert!(scene.lights.is_empty() && scene.warnings.is_empty(), "the quad emits");
        for material in &mut scene.materials {
            material.emissive = [0.0; 3];
        }
        scene.ensure_light();
        assert_eq!(scene.lights.len(), 1);
        assert!(scene.warnings[0].contains("nothing in the scene emits"), "{:?}", scene.warnings);
    }
}
