//! The scene's structs as shaders see them, named as in `shaders/shared/scene.wgsl`, which documents
//! each field's unit.

use super::{Alpha, Material as CpuMaterial, TextureUse, Triangle};
use glam::Vec3;
use lightloom_graph::shader_struct;

/// Marks an empty texture slot, a triangle that does not emit, or a light without triangle.
pub const NONE: u32 = u32::MAX;
/// Bit of [`BvhTriangle::id`]: alpha may let a ray pass.
pub const ALPHA_TESTED: u32 = 1 << 31;
/// Bit of [`Material::flags`]: Lambert of the base colour.
pub const MATERIAL_LAMBERT: u32 = 1;
/// Bit of [`Material::flags`]: emits from its back side too.
pub const MATERIAL_TWO_SIDED: u32 = 2;

shader_struct! {
    /// A node of the hierarchy, its children's boxes on a grid of 8 bits (80 bytes).
    pub struct BvhNode {
        /// Least corner of the node, where the grid begins (m, world, bits of f32), and the grid's steps in x, y and z (m), from the
        /// lowest byte up: the biased exponents of powers of two.
        pub grid: [u32; 4],
        /// Index of the node that is child 0, and other inner children follow; index of the first triangle in leaf order; bits of the
        /// children, 24 + c: child c is a node, 3 c to 3 c + 2: as many triangles lie in child c; unused.
        pub links: [u32; 4],
        /// Least x of the eight children, then their greatest, in steps of the grid, a byte each.
        pub x_planes: [u32; 4],
        /// The same of y.
        pub y_planes: [u32; 4],
        /// The same of z.
        pub z_planes: [u32; 4],
    }
}

shader_struct! {
    /// A triangle as rays meet it, in leaf order (48 bytes).
    pub struct BvhTriangle {
        /// First corner (m, world).
        pub v0: [f32; 3],
        /// Index of the triangle; [`ALPHA_TESTED`] where alpha may let a ray pass.
        pub id: u32,
        /// Second corner (m, world).
        pub v1: [f32; 3],
        /// Index into the materials.
        pub material: u32,
        /// Third corner (m, world).
        pub v2: [f32; 3],
        /// Index into the lights, or [`NONE`].
        pub light: u32,
    }
}

/// Bytes from one corner of a [`BvhTriangle`] to the next: to a device, triangles are vertices so far apart.
pub(crate) const CORNER_BYTES: u64 = 16;
const _: () = assert!(size_of::<BvhTriangle>() as u64 == 3 * CORNER_BYTES, "a triangle is three corners");

shader_struct! {
    /// What shading needs of a triangle beyond its corners, in scene order (48 bytes).
    pub struct TriangleAttributes {
        /// Shading normals of the corners (world), see [`octahedral`].
        pub normals: [u32; 3],
        /// Index into the materials.
        pub material: u32,
        /// Texture coordinates of the first corner.
        pub uv0: [f32; 2],
        /// Of the second.
        pub uv1: [f32; 2],
        /// Of the third.
        pub uv2: [f32; 2],
        /// Index into the lights, or [`NONE`].
        pub light: u32,
        /// Index of the same triangle among those in leaf order.
        pub leaf: u32,
    }
}

shader_struct! {
    /// Where a texture lies among the texels and how it is looked up (48 bytes).
    pub struct TextureSlot {
        /// Index of its first texel, or [`NONE`].
        pub first_texel: u32,
        /// Texels across.
        pub width: u32,
        /// Texels down.
        pub height: u32,
        /// Bits 0–1 for u, 2–3 for v; codes of [`Wrap`](super::Wrap).
        pub wrap: u32,
        /// Row of the affine map that gives u on the image.
        pub uv_x: [f32; 3],
        /// Unused.
        pub pad0: u32,
        /// Row of the affine map that gives v on the image.
        pub uv_y: [f32; 3],
        /// Unused.
        pub pad1: u32,
    }
}

shader_struct! {
    /// A surface (272 bytes).
    pub struct Material {
        /// Linear colour and alpha.
        pub base_color: [f32; 4],
        /// Radiance from the front side (W·m⁻²·sr⁻¹).
        pub emissive: [f32; 3],
        /// Perceptual roughness.
        pub roughness: f32,
        /// `σ_a` of the inside (1/m).
        pub absorption: [f32; 3],
        /// 0 dielectric, 1 metal.
        pub metallic: f32,
        /// Share of the light that is refracted.
        pub transmission: f32,
        /// Index of refraction of the inside.
        pub ior: f32,
        /// Above 0 a solid (m), 0 a thin wall.
        pub thickness: f32,
        /// 0 opaque, above 0 the cutoff, −1 blend.
        pub alpha_cutoff: f32,
        /// Scale of the normal map's x and y.
        pub normal_scale: f32,
        /// [`MATERIAL_LAMBERT`], [`MATERIAL_TWO_SIDED`].
        pub flags: u32,
        /// Unused.
        pub pad0: u32,
        /// Unused.
        pub pad1: u32,
        /// sRGB.
        pub base_color_texture: TextureSlot,
        /// Linear.
        pub metallic_roughness_texture: TextureSlot,
        /// Linear.
        pub normal_texture: TextureSlot,
        /// sRGB.
        pub emissive_texture: TextureSlot,
    }
}

shader_struct! {
    /// A light (128 bytes).
    pub struct Light {
        /// Position, or first corner (m, world).
        pub position: [f32; 3],
        /// A code of [`LightKind`].
        pub kind: u32,
        /// Direction in which light travels, or the triangle's normal (unit).
        pub direction: [f32; 3],
        /// Area of the triangle, or of the disc of a directional light or the environment (m²).
        pub area: f32,
        /// Intensity, irradiance or mean radiance, by kind.
        pub intensity: [f32; 3],
        /// Probability that this light or an earlier one is selected as a sample of direct light.
        pub cdf: f32,
        /// Second corner − first (m).
        pub edge1: [f32; 3],
        /// Cosine up to which a spot is full.
        pub cos_inner: f32,
        /// Third corner − first (m).
        pub edge2: [f32; 3],
        /// Cosine from which on a spot is dark.
        pub cos_outer: f32,
        /// The guide that photons are aimed at (m, world).
        pub guide_center: [f32; 3],
        /// Its radius (m); 0: there is none.
        pub guide_radius: f32,
        /// Probability that this light is selected.
        pub probability: f32,
        /// Index into the materials, or [`NONE`].
        pub material: u32,
        /// Index of the triangle, or [`NONE`].
        pub triangle: u32,
        /// 1: a triangle that emits from both sides.
        pub two_sided: u32,
        /// Share of the photons that earlier lights have (2⁻³²), or [`NONE`] where no photon is left; for uniform
        /// and guided emission.
        pub photon_start: [u32; 2],
        /// Share of the photons that this light has.
        pub photon_probability: [f32; 2],
    }
}

shader_struct! {
    /// Lights that follow one map: a punctual light, or a piece of an emissive surface (32 bytes).
    pub struct LightGroup {
        /// Unit: normal of the piece's first triangle; zero of a punctual light.
        pub axis: [f32; 3],
        /// Index of its first light.
        pub first: u32,
        /// Lights.
        pub count: u32,
        /// Share of the photons that they have together.
        pub photon_probability: f32,
        /// Index of the first of its [`LightView`]s.
        pub first_view: u32,
        /// Its views; 0: it is not rasterised.
        pub view_count: u32,
    }
}

shader_struct! {
    /// What a light sees, as one picture (64 bytes).
    pub struct LightView {
        /// World to clip space; depth 1 is nearest.
        pub clip_from_world: [[f32; 4]; 4],
    }
}

/// Values of [`Light::kind`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum LightKind {
    /// A point.
    Point = 0,
    /// A cone.
    Spot = 1,
    /// Infinitely far away.
    Directional = 2,
    /// An emissive triangle.
    Triangle = 3,
    /// Infinitely far away in every direction.
    Environment = 4,
}

impl LightKind {
    /// A word for reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Spot => "spot",
            Self::Directional => "directional",
            Self::Triangle => "emissive",
            Self::Environment => "environment",
        }
    }
}

impl BvhTriangle {
    /// Triangle `index` of the scene.
    pub(crate) fn new(triangle: &Triangle, index: u32, alpha_tested: bool, light: u32) -> Self {
        let [a, b, c] = triangle.positions_world;
        Self {
            v0: a.to_array(),
            id: if alpha_tested { index | ALPHA_TESTED } else { index },
            v1: b.to_array(),
            material: triangle.material,
            v2: c.to_array(),
            light,
        }
    }
}

impl TriangleAttributes {
    pub(crate) fn new(triangle: &Triangle, light: u32, leaf: u32) -> Self {
        let [uv0, uv1, uv2] = triangle.uvs.map(|uv| uv.to_array());
        Self { normals: triangle.normals_world.map(octahedral), material: triangle.material, uv0, uv1, uv2, light, leaf }
    }
}

impl Material {
    /// `slot` places a texture among the texels.
    pub(crate) fn new(material: &CpuMaterial, slot: impl Fn(Option<TextureUse>) -> TextureSlot) -> Self {
        Self {
            base_color: material.base_color,
            emissive: material.emissive,
            roughness: material.roughness,
            absorption: material.absorption().to_array(),
            metallic: material.metallic,
            transmission: material.transmission,
            ior: material.ior,
            thickness: material.thickness_m,
            alpha_cutoff: match material.alpha {
                Alpha::Opaque => 0.0,
                Alpha::Mask(cutoff) => cutoff.max(0.0),
                Alpha::Blend => -1.0,
            },
            normal_scale: material.normal_texture.map_or(1.0, |(_, scale)| scale),
            flags: if material.is_lambert() { MATERIAL_LAMBERT } else { 0 }
                | if material.double_sided { MATERIAL_TWO_SIDED } else { 0 },
            pad0: 0,
            pad1: 0,
            base_color_texture: slot(material.base_color_texture),
            metallic_roughness_texture: slot(material.metallic_roughness_texture),
            normal_texture: slot(material.normal_texture.map(|(using, _)| using)),
            emissive_texture: slot(material.emissive_texture),
        }
    }
}

/// A unit vector in 32 bits: octahedral map, two 16-bit snorms, x in the low half. The zero vector
/// becomes +z.
pub fn octahedral(v: Vec3) -> u32 {
    let sum = v.x.abs() + v.y.abs() + v.z.abs();
    if !(sum > 0.0 && sum.is_finite()) {
        return 0;
    }
    let (mut x, mut y) = (v.x / sum, v.y / sum);
    if v.z < 0.0 {
        (x, y) = ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y));
    }
    let snorm = |value: f32| u32::from((value.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16);
    snorm(x) | snorm(y) << 16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_those_of_the_wgsl() {
        assert_eq!(size_of::<BvhNode>(), 80);
        assert_eq!(size_of::<BvhTriangle>(), 48);
        assert_eq!(size_of::<TriangleAttributes>(), 48);
        assert_eq!(size_of::<TextureSlot>(), 48);
        assert_eq!(size_of::<Material>(), 80 + 4 * 48);
        assert_eq!(size_of::<Light>(), 128);
        assert_eq!(size_of::<LightGroup>(), 32);
        // WGSL aligns vec3 and structs that hold one to 16 bytes.
        assert_eq!(std::mem::offset_of!(Material, base_color_texture) % 16, 0);
        assert_eq!(std::mem::offset_of!(Light, guide_center) % 16, 0);
    }

    #[test]
    fn octahedral_comes_back() {
        let snorm = |bits: u32| f32::from(bits as u16 as i16).max(-32767.0) / 32767.0;
        for i in 0..1000_u32 {
            let turn = i as f32 * 2.399_963;
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 1000.0;
            let v = Vec3::new((1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z);
            let bits = octahedral(v);
            let (x, y) = (snorm(bits), snorm(bits >> 16));
            let mut back = Vec3::new(x, y, 1.0 - x.abs() - y.abs());
            let fold = (-back.z).max(0.0);
            back.x -= fold.copysign(back.x);
            back.y -= fold.copysign(back.y);
            assert!(back.normalize().distance(v) < 1e-4, "{v} came back as {back}");
        }
        assert_eq!(octahedral(Vec3::Z), 0);
        assert_eq!(octahedral(Vec3::X), 32767);
    }
}
