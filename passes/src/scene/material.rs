//! Surfaces: metallic-roughness with transmission, as glTF describes them.

use super::texture::{TextureData, TextureUse};
use glam::Vec3;

/// As in `shared/brdf.wgsl`: narrower GGX is smooth.
const MIN_ALPHA: f32 = 1.0e-3;
/// As in `shared/dielectric.wgsl`.
const MIN_CONTRAST: f32 = 0.01;
/// As in `shared/surface.wgsl`.
const MIRROR_ROUGHNESS: f32 = 0.03;
const MIRROR_METALLIC: f32 = 0.95;

/// How alpha is read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Alpha {
    /// Ignored.
    #[default]
    Opaque,
    /// Below the cutoff the surface is not there, otherwise it is solid.
    Mask(
        /// The cutoff, in `[0, 1]`.
        f32,
    ),
    /// Alpha is the probability that the surface is there.
    Blend,
}

/// A surface of the metallic-roughness model. Every surface scatters light on both sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file, for messages.
    pub name: String,
    /// Linear base colour and alpha, each in `[0, 1]`.
    pub base_color: [f32; 4],
    /// Multiplies `base_color`; sRGB with linear alpha.
    pub base_color_texture: Option<TextureUse>,
    /// 0 dielectric, 1 metal.
    pub metallic: f32,
    /// Perceptual roughness in `[0, 1]`; GGX α is its square. What is transmitted is scattered by it as well.
    pub roughness: f32,
    /// Multiplies roughness by G and metallic by B; linear.
    pub metallic_roughness_texture: Option<TextureUse>,
    /// Tangent-space normal map (linear) and the scale of its x and y.
    pub normal_texture: Option<(TextureUse, f32)>,
    /// Radiance emitted from the front side (W·m⁻²·sr⁻¹): factor × strength.
    pub emissive: [f32; 3],
    /// Emits from the back side as well.
    pub double_sided: bool,
    /// Multiplies `emissive`; sRGB.
    pub emissive_texture: Option<TextureUse>,
    /// Share of the light that enters the surface and is refracted instead of scattered back, in `[0, 1]`; through facets of
    /// `roughness`, smooth below α = 10⁻³.
    pub transmission: f32,
    /// Index of refraction of the inside.
    pub ior: f32,
    /// Above zero the surface bounds a solid dielectric (m); zero is a thin wall.
    pub thickness_m: f32,
    /// Colour that white light takes on after `attenuation_distance_m` inside.
    pub attenuation_color: [f32; 3],
    /// Distance of `attenuation_color` (m); infinite without absorption.
    pub attenuation_distance_m: f32,
    /// How alpha is read.
    pub alpha: Alpha,
}

impl Default for Material {
    /// A white Lambertian.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: [1.0; 4],
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            emissive: [0.0; 3],
            double_sided: false,
            emissive_texture: None,
            transmission: 0.0,
            ior: 1.5,
            thickness_m: 0.0,
            attenuation_color: [1.0; 3],
            attenuation_distance_m: f32::INFINITY,
            alpha: Alpha::Opaque,
        }
    }
}

impl Material {
    /// A Lambertian of linear albedo `albedo`.
    pub fn lambert(name: &str, albedo: Vec3) -> Self {
        Self { name: name.into(), base_color: albedo.extend(1.0).to_array(), ..Self::default() }
    }

    /// A black surface that emits `radiance` (W·m⁻²·sr⁻¹) from its front.
    pub fn emitter(name: &str, radiance: Vec3) -> Self {
        Self { emissive: radiance.to_array(), ..Self::lambert(name, Vec3::ZERO) }
    }

    /// A smooth, clear, solid dielectric.
    pub fn glass(name: &str, ior: f32, thickness_m: f32) -> Self {
        Self { roughness: 0.0, transmission: 1.0, ior, thickness_m, ..Self::lambert(name, Vec3::ONE) }
    }

    /// A metal of that reflectance at normal incidence; `roughness` 0 is a mirror.
    pub fn metal(name: &str, reflectance: Vec3, roughness: f32) -> Self {
        Self { metallic: 1.0, roughness, ..Self::lambert(name, reflectance) }
    }

    /// Whether this is plain Lambert: rough, no metal, nothing transmitted and no texture that changes it.
    pub fn is_lambert(&self) -> bool {
        self.metallic == 0.0 && self.roughness >= 1.0 && self.metallic_roughness_texture.is_none() && self.transmission == 0.0
    }

    /// Whether some point of it may be a rough dielectric, `Surface.rough_dielectric` in `shared/surface.wgsl`: textures only
    /// make it smoother.
    pub(crate) fn may_refract_roughly(&self) -> bool {
        let bends = self.thickness_m <= 0.0 || self.ior >= 1.0 + MIN_CONTRAST;
        self.transmission > 0.0 && self.roughness * self.roughness >= MIN_ALPHA && bends
    }

    /// Whether some point of it may scatter light into single directions: a mirror, or a smooth dielectric. Textures only make it
    /// smoother.
    pub(crate) fn may_be_specular(&self) -> bool {
        let textured = self.metallic_roughness_texture.is_some();
        let mirror = self.metallic >= MIRROR_METALLIC && (self.roughness <= MIRROR_ROUGHNESS || textured) && !self.is_lambert();
        let smooth = !self.may_refract_roughly() || textured;
        mirror || (self.transmission > 0.0 && smooth)
    }

    /// Whether any texture belongs to it.
    pub(crate) fn has_texture(&self) -> bool {
        self.base_color_texture.is_some()
            || self.metallic_roughness_texture.is_some()
            || self.normal_texture.is_some()
            || self.emissive_texture.is_some()
    }

    /// Absorption coefficient `σ_a` = −ln(colour)/distance (1/m) per channel; zero at infinite distance.
    pub fn absorption(&self) -> Vec3 {
        if !(self.attenuation_distance_m.is_finite() && self.attenuation_distance_m > 0.0) {
            return Vec3::ZERO;
        }
        // A channel of exactly zero would absorb infinitely; 1e-6 is as black after one distance.
        let color = Vec3::from_array(self.attenuation_color).clamp(Vec3::splat(1e-6), Vec3::ONE);
        // `+ 0.0` turns the −0 of ln 1 into 0.
        -color.map(f32::ln) / self.attenuation_distance_m + 0.0
    }

    /// Mean of the metallic value over its texture.
    pub(crate) fn mean_metallic(&self, textures: &[TextureData]) -> f32 {
        let mean = self
            .metallic_roughness_texture
            .and_then(|slot| textures.get(slot.texture as usize))
            .map_or(1.0, |data| data.channel_mean(2));
        self.metallic * mean
    }

    /// Whether a ray may pass through because of alpha, judged from the texture as well: a mask
    /// that cuts nothing and a blend that is solid everywhere are opaque.
    pub(crate) fn lets_rays_pass(&self, textures: &[TextureData]) -> bool {
        let least =
            self.base_color_texture.and_then(|slot| textures.get(slot.texture as usize)).map_or(1.0, TextureData::least_alpha)
                * self.base_color[3];
        match self.alpha {
            Alpha::Opaque => false,
            Alpha::Mask(cutoff) => least < cutoff,
            Alpha::Blend => least < 1.0,
        }
    }

    /// Turns an opaque, non-metallic surface (mean metallic below one half) into a Lambertian of its
    /// base colour, without normal map. Glass and metal stay.
    pub(crate) fn make_lambert(&mut self, textures: &[TextureData]) {
        if self.transmission > 0.0 || self.mean_metallic(textures) >= 0.5 {
            return;
        }
        self.metallic = 0.0;
        self.roughness = 1.0;
        self.metallic_roughness_texture = None;
        self.normal_texture = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absorption_gives_the_colour_back_after_the_distance() {
        let mut glass = Material::glass("g", 1.5, 1.0);
        assert_eq!(glass.absorption(), Vec3::ZERO);
        glass.attenuation_color = [0.5, 1.0, 0.25];
        glass.attenuation_distance_m = 2.0;
        let left = (-glass.absorption() * 2.0).map(f32::exp);
        assert!(left.abs_diff_eq(Vec3::new(0.5, 1.0, 0.25), 1e-6), "{left}");
    }

    #[test]
    fn lambert_spares_metal_and_glass() {
        let mut plastic = Material { metallic: 0.1, roughness: 0.3, ..Material::default() };
        plastic.make_lambert(&[]);
        assert!(plastic.is_lambert(), "plastic becomes Lambert");
        let mut metal = Material::metal("m", Vec3::ONE, 0.2);
        let mut glass = Material::glass("g", 1.5, 1.0);
        let before = (metal.clone(), glass.clone());
        metal.make_lambert(&[]);
        glass.make_lambert(&[]);
        assert_eq!((metal, glass), before);
    }

    #[test]
    fn limits_are_those_of_the_shaders() {
        let ours = [
            ("MIN_ALPHA", MIN_ALPHA),
            ("MIN_CONTRAST", MIN_CONTRAST),
            ("MIRROR_ROUGHNESS", MIRROR_ROUGHNESS),
            ("MIRROR_METALLIC", MIRROR_METALLIC),
        ];
        for (name, value) in ours {
            let declared = format!("const {name}: f32 = ");
            let lines = lightloom_shaders::FILES.iter().flat_map(|(_, text)| text.lines());
            let theirs: Vec<&str> = lines.filter_map(|line| line.strip_prefix(&declared)?.strip_suffix(';')).collect();
            assert_eq!(theirs.len(), 1, "`{name}` is declared once: {theirs:?}");
            assert_eq!(theirs[0].parse(), Ok(value), "{name}");
        }
    }

    #[test]
    fn metallic_is_judged_with_its_texture() {
        let black = TextureData { name: "b".into(), width: 1, height: 1, rgba8: vec![0, 255, 0, 255] };
        let mut cloth = Material { metallic: 1.0, metallic_roughness_texture: Some(TextureUse::new(0)), ..Material::default() };
        cloth.make_lambert(&[black]);
        assert!(cloth.is_lambert(), "factor 1 times texture 0 is no metal");
    }

    #[test]
    fn a_mask_that_cuts_nothing_is_opaque() {
        let solid = TextureData { name: "s".into(), width: 1, height: 1, rgba8: vec![9, 9, 9, 200] };
        let mut leaf = Material { base_color_texture: Some(TextureUse::new(0)), alpha: Alpha::Mask(0.5), ..Material::default() };
        let textures = [solid];
        assert!(!leaf.lets_rays_pass(&textures), "200/255 is above the cutoff");
        leaf.alpha = Alpha::Blend;
        assert!(leaf.lets_rays_pass(&textures), "blend below one lets light pass");
        leaf.alpha = Alpha::Mask(0.9);
        assert!(leaf.lets_rays_pass(&textures), "the mask cuts");
    }
}
