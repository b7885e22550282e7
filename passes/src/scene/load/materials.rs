//! glTF materials → [`Material`].

use super::images::Images;
use super::{SceneError, Source, label};
use crate::scene::{Alpha, Material, Scene, TextureUse, Wrap};
use glam::{Vec2, Vec3};
use gltf::material::AlphaMode;
use gltf::texture::WrappingMode;

/// Reads all materials and the textures they use, and appends glTF's default material.
pub(super) fn load(source: &Source<'_>, scene: &mut Scene) -> Result<(), SceneError> {
    let mut images = Images::default();
    for gltf in source.document.materials() {
        let material = read(source, &gltf, &mut images, &mut scene.warnings)?;
        scene.materials.push(material);
    }
    scene.materials.push(Material { name: "default".into(), metallic: 1.0, ..Material::default() });
    scene.textures = images.textures;
    Ok(())
}

/// The set of texture coordinates that a material uses: that of its first texture.
pub(super) fn uv_set(material: &gltf::Material<'_>) -> u32 {
    let pbr = material.pbr_metallic_roughness();
    let of = |info: gltf::texture::Info<'_>| info.texture_transform().and_then(|t| t.tex_coord()).unwrap_or(info.tex_coord());
    pbr.base_color_texture()
        .or_else(|| pbr.metallic_roughness_texture())
        .or_else(|| material.emissive_texture())
        .map(of)
        .or_else(|| material.normal_texture().map(|normal| normal.tex_coord()))
        .unwrap_or(0)
}

fn read(
    source: &Source<'_>,
    gltf: &gltf::Material<'_>,
    images: &mut Images,
    warnings: &mut Vec<String>,
) -> Result<Material, SceneError> {
    let place = label("material", gltf.index().unwrap_or_default(), gltf.name());
    let set = uv_set(gltf);
    let mut other_sets = false;
    let mut slot = |info: gltf::texture::Info<'_>| -> Result<TextureUse, SceneError> {
        let transform = info.texture_transform();
        let over = transform.as_ref().and_then(gltf::texture::TextureTransform::tex_coord);
        let own = over.unwrap_or(info.tex_coord());
        other_sets |= own != set;
        let mut using = texture_use(source, &info.texture(), images)?;
        if let Some(t) = transform {
            let (scale, offset) = (Vec2::from(t.scale()), Vec2::from(t.offset()));
            using = using.with_transform(scale, t.rotation(), offset);
        }
        Ok(using)
    };
    let pbr = gltf.pbr_metallic_roughness();
    let base_color_texture = pbr.base_color_texture().map(&mut slot).transpose()?;
    let metallic_roughness_texture = pbr.metallic_roughness_texture().map(&mut slot).transpose()?;
    let emissive_texture = gltf.emissive_texture().map(&mut slot).transpose()?;
    let normal_texture = gltf
        .normal_texture()
        .map(|normal| {
            other_sets |= normal.tex_coord() != set;
            let using = texture_use(source, &normal.texture(), images)?;
            Ok((normal_transform(&normal, using), normal.scale()))
        })
        .transpose()?;
    if other_sets {
        warnings.push(format!("{place} uses several sets of texture coordinates; all its textures use set {set}"));
    }
    let mut unread = |what: &str, present: bool| {
        if present {
            warnings.push(format!("{place} has a {what} texture, which is ignored: its factor holds"));
        }
    };
    let transmission = gltf.transmission();
    let volume = gltf.volume();
    unread("transmission", transmission.as_ref().is_some_and(|t| t.transmission_texture().is_some()));
    unread("thickness", volume.as_ref().is_some_and(|v| v.thickness_texture().is_some()));

    let strength = gltf.emissive_strength().unwrap_or(1.0);
    let material = Material {
        name: gltf.name().unwrap_or_default().to_owned(),
        base_color: pbr.base_color_factor().map(|c| c.clamp(0.0, 1.0)),
        base_color_texture,
        metallic: pbr.metallic_factor().clamp(0.0, 1.0),
        roughness: pbr.roughness_factor().clamp(0.0, 1.0),
        metallic_roughness_texture,
        normal_texture,
        emissive: (Vec3::from(gltf.emissive_factor()) * strength).max(Vec3::ZERO).to_array(),
        double_sided: gltf.double_sided(),
        emissive_texture,
        transmission: transmission.map_or(0.0, |t| t.transmission_factor().clamp(0.0, 1.0)),
        // The extension gives 0 the meaning "reflects everything"; below 1 makes no sense otherwise.
        ior: gltf.ior().map_or(1.5, |ior| if ior == 0.0 { 1e4 } else { ior.max(1.0) }),
        thickness_m: volume.as_ref().map_or(0.0, |v| v.thickness_factor().max(0.0)),
        attenuation_color: volume.as_ref().map_or([1.0; 3], gltf::material::Volume::attenuation_color),
        attenuation_distance_m: volume.map_or(f32::INFINITY, |v| v.attenuation_distance()),
        alpha: match gltf.alpha_mode() {
            AlphaMode::Opaque => Alpha::Opaque,
            AlphaMode::Mask => Alpha::Mask(gltf.alpha_cutoff().unwrap_or(0.5)),
            AlphaMode::Blend => Alpha::Blend,
        },
    };
    let numbers = [material.metallic, material.roughness, material.ior, material.thickness_m];
    if numbers.iter().chain(&material.base_color).chain(&material.emissive).any(|n| !n.is_finite()) {
        return Err(source.malformed(place, "a factor is not a finite number"));
    }
    Ok(material)
}

/// The crate hands the transform of a normal texture out as plain JSON only.
fn normal_transform(normal: &gltf::material::NormalTexture<'_>, using: TextureUse) -> TextureUse {
    let Some(json) = normal.extension_value("KHR_texture_transform") else { return using };
    let number = |value: Option<&gltf::json::Value>| value.and_then(gltf::json::Value::as_f64);
    let pair = |key: &str, default: f32| {
        let at = |i| json.get(key).and_then(|v| number(v.get(i))).map_or(default, |n| n as f32);
        Vec2::new(at(0), at(1))
    };
    let rotation = number(json.get("rotation")).unwrap_or(0.0) as f32;
    using.with_transform(pair("scale", 1.0), rotation, pair("offset", 0.0))
}

fn texture_use(source: &Source<'_>, texture: &gltf::Texture<'_>, images: &mut Images) -> Result<TextureUse, SceneError> {
    let image = source.document.as_json().textures[texture.index()].source.value();
    let sampler = texture.sampler();
    let wrap = [sampler.wrap_s(), sampler.wrap_t()].map(|mode| match mode {
        WrappingMode::ClampToEdge => Wrap::Clamp,
        WrappingMode::MirroredRepeat => Wrap::Mirror,
        WrappingMode::Repeat => Wrap::Repeat,
    });
    Ok(TextureUse::new(images.texture(source, image)?).with_wrap(wrap))
}
