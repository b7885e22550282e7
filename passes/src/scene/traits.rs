//! What the surfaces of a scene ask of the shaders.

use super::{Material, Reflection, Scene};

/// Which kinds of surface occur; `shared/scene_traits.wgsl`. Kernels leave out what does not: less work where threads run in
/// lockstep, and fewer registers everywhere.
#[expect(clippy::struct_excessive_bools, reason = "each is one override of the shaders")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SceneTraits {
    /// Some surface is not plain Lambert: GGX or a mirror.
    pub glossy: bool,
    /// Glossy surfaces reflect by [`Reflection::BlinnPhong`]; never set where none is.
    pub phong: bool,
    /// Some surface transmits light.
    pub refracts: bool,
    /// Some of them through rough interfaces.
    pub rough_refraction: bool,
    /// Some material has a texture.
    pub textures: bool,
    /// Alpha lets some rays pass.
    pub alpha: bool,
    /// Light comes from the environment.
    pub environment: bool,
}

impl Default for SceneTraits {
    /// Everything that glTF describes may occur.
    fn default() -> Self {
        Self {
            glossy: true,
            phong: false,
            refracts: true,
            rough_refraction: true,
            textures: true,
            alpha: true,
            environment: true,
        }
    }
}

impl SceneTraits {
    /// Those of the materials that triangles use.
    pub fn of(scene: &Scene) -> Self {
        let mut used = vec![false; scene.materials.len()];
        for triangle in &scene.triangles {
            if let Some(used) = used.get_mut(triangle.material as usize) {
                *used = true;
            }
        }
        let any =
            |test: &dyn Fn(&Material) -> bool| scene.materials.iter().zip(&used).any(|(material, &used)| used && test(material));
        let glossy = any(&|material| !material.is_lambert() && material.transmission < 1.0);
        Self {
            glossy,
            phong: glossy && scene.reflection == Reflection::BlinnPhong,
            refracts: any(&|material| material.transmission > 0.0),
            rough_refraction: any(&Material::may_refract_roughly),
            textures: any(&Material::has_texture),
            alpha: any(&|material| material.lets_rays_pass(&scene.textures)),
            environment: scene.environment.is_some(),
        }
    }

    /// Whether some surface may be a mirror or refract: whether specular paths can occur at all.
    pub fn specular(self) -> bool {
        self.glossy || self.refracts
    }

    /// The WGSL overrides and their values.
    pub(crate) fn constants(self) -> [(&'static str, bool); 7] {
        [
            ("SCENE_GLOSSY", self.glossy),
            ("SCENE_PHONG", self.phong),
            ("SCENE_REFRACTS", self.refracts),
            ("SCENE_ROUGH_REFRACTION", self.rough_refraction),
            ("SCENE_TEXTURES", self.textures),
            ("SCENE_ALPHA", self.alpha),
            ("SCENE_ENVIRONMENT", self.environment),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    fn only_what_occurs_is_asked_for() {
        let none = SceneTraits {
            glossy: false,
            phong: false,
            refracts: false,
            rough_refraction: false,
            textures: false,
            alpha: false,
            environment: false,
        };
        assert_eq!(SceneTraits::of(&builtin::cornell()), none);
        let caustics = SceneTraits::of(&builtin::caustics());
        assert_eq!(caustics, SceneTraits { glossy: true, refracts: true, ..none });
        let [plastic, matt] =
            [builtin::caustics(), builtin::cornell()].map(|scene| Scene { reflection: Reflection::BlinnPhong, ..scene });
        assert_eq!(SceneTraits::of(&plastic), SceneTraits { phong: true, ..caustics });
        assert_eq!(SceneTraits::of(&matt), none, "Lambertian surfaces have no lobe");
        let mut frosted = builtin::caustics();
        frosted.materials.iter_mut().filter(|material| material.transmission > 0.0).for_each(|glass| glass.roughness = 0.3);
        assert_eq!(SceneTraits::of(&frosted), SceneTraits { rough_refraction: true, ..caustics });
    }
}
