//! Images of a scene and how a material looks them up.

use glam::{Vec2, Vec3};

/// What lies beyond the unit square of texture coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The image repeats (glTF's default).
    #[default]
    Repeat,
    /// The border texel continues.
    Clamp,
    /// The image repeats, every second time mirrored.
    Mirror,
}

impl Wrap {
    /// The code that shaders use: 0 repeat, 1 clamp, 2 mirror.
    pub fn code(self) -> u32 {
        match self {
            Self::Repeat => 0,
            Self::Clamp => 1,
            Self::Mirror => 2,
        }
    }

    /// Moves a texel index of any value into `0..size`.
    pub(crate) fn texel(self, index: i64, size: u32) -> u32 {
        let size = i64::from(size.max(1));
        let wrapped = match self {
            Self::Repeat => index.rem_euclid(size),
            Self::Clamp => index.clamp(0, size - 1),
            Self::Mirror => {
                let folded = index.rem_euclid(2 * size);
                folded.min(2 * size - 1 - folded)
            }
        };
        wrapped as u32
    }
}

/// An image: 8 bits a channel, RGBA, first row on top, not premultiplied.
///
/// Whether the values are sRGB or linear is a matter of use: base colour and emission are sRGB,
/// everything else is linear.
#[derive(Clone, PartialEq, Eq)]
pub struct TextureData {
    /// Name in the file, for messages.
    pub name: String,
    /// Texels across.
    pub width: u32,
    /// Texels down.
    pub height: u32,
    /// `width * height * 4` bytes.
    pub rgba8: Vec<u8>,
}

impl std::fmt::Debug for TextureData {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "TextureData({}, {}×{})", self.name, self.width, self.height)
    }
}

impl TextureData {
    /// The four bytes of the texel at column `x` of row `y`.
    pub(crate) fn texel(&self, x: u32, y: u32) -> [u8; 4] {
        let at = (y as usize * self.width as usize + x as usize) * 4;
        self.rgba8.get(at..at + 4).and_then(|bytes| bytes.try_into().ok()).unwrap_or([0; 4])
    }

    /// Mean of one channel over the image, in `[0, 1]`, not linearised.
    pub(crate) fn channel_mean(&self, channel: usize) -> f32 {
        let texels = self.rgba8.chunks_exact(4);
        let count = texels.len().max(1) as f64;
        let sum: u64 = texels.map(|texel| u64::from(texel[channel])).sum();
        (sum as f64 / count / 255.0) as f32
    }

    /// Least alpha of the image, in `[0, 1]`.
    pub(crate) fn least_alpha(&self) -> f32 {
        let least = self.rgba8.chunks_exact(4).map(|texel| texel[3]).min();
        f32::from(least.unwrap_or(255)) / 255.0
    }
}

/// A texture as one slot of a material uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureUse {
    /// Index into [`Scene::textures`](super::Scene::textures).
    pub texture: u32,
    /// Wrap mode along u and v.
    pub wrap: [Wrap; 2],
    /// Rows of the affine map from the mesh's texture coordinates to the image's
    /// (`KHR_texture_transform`): `u' = row[0] · (u, v, 1)`, `v' = row[1] · (u, v, 1)`.
    /// Image coordinates run from (0, 0), the image's upper left corner, to (1, 1).
    pub image_from_mesh_uv: [Vec3; 2],
}

impl TextureUse {
    /// Uses texture `index` as it is, repeated.
    pub fn new(index: u32) -> Self {
        Self { texture: index, wrap: [Wrap::Repeat; 2], image_from_mesh_uv: [Vec3::X, Vec3::Y] }
    }

    /// Sets the map of `KHR_texture_transform`: scale, then rotation (radians, counter-clockwise as
    /// seen on the image, whose v runs downwards), then offset.
    pub fn with_transform(mut self, scale: Vec2, rotation: f32, offset: Vec2) -> Self {
        let (sin, cos) = rotation.sin_cos();
        self.image_from_mesh_uv =
            [Vec3::new(cos * scale.x, sin * scale.y, offset.x), Vec3::new(-sin * scale.x, cos * scale.y, offset.y)];
        self
    }

    /// Sets the wrap modes.
    pub fn with_wrap(mut self, wrap: [Wrap; 2]) -> Self {
        self.wrap = wrap;
        self
    }

    /// The image's coordinates at the mesh's coordinates `uv`.
    pub fn image_uv(&self, uv: Vec2) -> Vec2 {
        let homogeneous = uv.extend(1.0);
        Vec2::new(self.image_from_mesh_uv[0].dot(homogeneous), self.image_from_mesh_uv[1].dot(homogeneous))
    }

    /// Linear RGB of the nearest texel at the mesh's coordinates `uv`, read as sRGB.
    pub(crate) fn nearest_srgb(&self, data: &TextureData, uv: Vec2) -> Vec3 {
        let at = self.image_uv(uv);
        if !at.is_finite() {
            return Vec3::ZERO;
        }
        let column = (at.x * data.width as f32).floor() as i64;
        let row = (at.y * data.height as f32).floor() as i64;
        let texel = data.texel(self.wrap[0].texel(column, data.width), self.wrap[1].texel(row, data.height));
        Vec3::new(linear_of_srgb(texel[0]), linear_of_srgb(texel[1]), linear_of_srgb(texel[2]))
    }
}

/// Linear value of an sRGB byte (IEC 61966-2-1).
pub(crate) fn linear_of_srgb(byte: u8) -> f32 {
    let encoded = f32::from(byte) / 255.0;
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrap_folds_indices_into_the_image() {
        let fold = |wrap: Wrap| (-5..8).map(|i| wrap.texel(i, 3)).collect::<Vec<_>>();
        assert_eq!(fold(Wrap::Repeat), [1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1]);
        assert_eq!(fold(Wrap::Clamp), [0, 0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2, 2]);
        assert_eq!(fold(Wrap::Mirror), [1, 2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0, 1]);
    }

    #[test]
    fn transform_scales_then_turns_then_moves() {
        let quarter = std::f32::consts::FRAC_PI_2;
        let slot = TextureUse::new(0).with_transform(Vec2::new(2.0, 3.0), quarter, Vec2::new(0.25, 0.5));
        // (1, 0) scaled to (2, 0), turned counter-clockwise on an image whose v runs down to (0, -2).
        let at = slot.image_uv(Vec2::new(1.0, 0.0));
        assert!(at.abs_diff_eq(Vec2::new(0.25, -1.5), 1e-6), "{at}");
        let at = slot.image_uv(Vec2::new(0.0, 1.0));
        assert!(at.abs_diff_eq(Vec2::new(3.25, 0.5), 1e-6), "{at}");
    }

    #[test]
    fn nearest_reads_the_texel_that_covers_the_point() {
        let data = TextureData { name: "two".into(), width: 2, height: 1, rgba8: vec![255, 0, 0, 255, 0, 188, 0, 128] };
        let slot = TextureUse::new(0);
        assert_eq!(slot.nearest_srgb(&data, Vec2::new(0.25, 0.5)), Vec3::X);
        let green = slot.nearest_srgb(&data, Vec2::new(-0.25, 7.5)).y;
        assert!((green - 0.5029).abs() < 1e-3, "sRGB 188 is about one half: {green}");
        assert!((data.least_alpha() - 128.0 / 255.0).abs() < 1e-6, "least alpha");
        assert!((data.channel_mean(0) - 0.5).abs() < 1e-6, "mean of red");
    }
}
