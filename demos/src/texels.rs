//! Any texture's bytes as linear RGB, to be looked at.
//!
//! One channel becomes grey, two become red and green, alpha is dropped; sRGB is made linear; integers keep their values.

use lightloom_graph::TextureDesc;
use lightloom_graph::wgpu::{TextureDimension, TextureFormat};

use crate::Picture;

/// The first layer of a texture.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Texels {
    /// Values as they are.
    pub(crate) picture: Picture,
    /// What the numbers can be.
    pub(crate) numbers: Numbers,
    /// Layers or slices that are not shown.
    pub(crate) more_layers: u32,
}

/// What a format's numbers can be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Numbers {
    /// 0 to 1.
    Unorm,
    /// 0 to 1, of colour: stored by the sRGB curve.
    Srgb,
    /// −1 to 1.
    Snorm,
    /// Any, of three or four channels: radiance, if none is negative.
    Float,
    /// Any, of one or two channels.
    Data,
    /// Whole numbers, the largest of which stands for "nothing" in many a buffer of indices.
    Whole {
        /// The largest value of the format.
        largest: u32,
    },
}

/// How the bits of a texel become numbers.
#[derive(Clone, Copy)]
enum Layout {
    /// Channels of one type, in order.
    Channels(usize, Channel),
    /// B, G, R, A.
    Bgra8,
    Rgb10a2 {
        unorm: bool,
    },
    Rg11b10,
    Rgb9e5,
}

#[derive(Clone, Copy)]
enum Channel {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F16,
    F32,
}

impl Channel {
    fn size(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 | Self::F16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
        }
    }

    /// The number of little-endian bytes; `scale`: whether integers become 0 to 1 or −1 to 1.
    fn number(self, b: &[u8], scale: bool) -> f32 {
        let (value, most) = match self {
            Self::U8 => (f32::from(b[0]), 255.0),
            Self::I8 => (f32::from(b[0] as i8), 127.0),
            Self::U16 => (f32::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
            Self::I16 => (f32::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
            Self::F16 => return half(u16::from_le_bytes([b[0], b[1]])),
            Self::U32 => return u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32,
            Self::I32 => return i32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32,
            Self::F32 => return f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        };
        if scale { (value / most).max(-1.0) } else { value }
    }
}

/// The first layer of a texture from its tightly packed bytes, or why it cannot be shown.
pub(crate) fn decode(desc: &TextureDesc, bytes: &[u8]) -> Result<Texels, String> {
    let (layout, numbers) = layout(desc.format).ok_or("its format is compressed, or not known here")?;
    let stride = match layout {
        Layout::Channels(count, channel) => count * channel.size(),
        _ => 4,
    };
    let scale = matches!(numbers, Numbers::Unorm | Numbers::Srgb | Numbers::Snorm);
    let texel = |b: &[u8]| {
        let rgb = match layout {
            Layout::Channels(count, channel) => {
                let number = |i: usize| channel.number(&b[i * channel.size()..], scale);
                match count {
                    1 => [number(0); 3],
                    2 => [number(0), number(1), 0.0],
                    _ => [number(0), number(1), number(2)],
                }
            }
            Layout::Bgra8 => [2, 1, 0].map(|i| f32::from(b[i]) / 255.0),
            Layout::Rgb10a2 { unorm } => {
                [0, 10, 20].map(|shift| (word(b) >> shift & 0x3ff) as f32 / if unorm { 1023.0 } else { 1.0 })
            }
            Layout::Rg11b10 => {
                let word = word(b);
                [small_float(word & 0x7ff, 6), small_float(word >> 11 & 0x7ff, 6), small_float(word >> 22, 5)]
            }
            Layout::Rgb9e5 => {
                let word = word(b);
                let scale = 2_f32.powi((word >> 27) as i32 - 24);
                [0, 9, 18].map(|shift| (word >> shift & 0x1ff) as f32 * scale)
            }
        };
        if numbers == Numbers::Srgb { rgb.map(linear) } else { rgb }
    };
    let [width, height, layers] = desc.size;
    let count = width as usize * height as usize;
    let pixels = bytes.chunks_exact(stride).take(count).map(texel).collect();
    let more_layers = if desc.dimension == TextureDimension::D1 { 0 } else { layers.saturating_sub(1) };
    Ok(Texels { picture: Picture::new([width, height], pixels), numbers, more_layers })
}

fn word(b: &[u8]) -> u32 {
    u32::from_le_bytes([b[0], b[1], b[2], b[3]])
}

fn layout(format: TextureFormat) -> Option<(Layout, Numbers)> {
    use Channel as C;
    use TextureFormat as F;
    let whole = |largest| Numbers::Whole { largest };
    let (count, channel, numbers) = match format {
        F::R8Unorm => (1, C::U8, Numbers::Unorm),
        F::Rg8Unorm => (2, C::U8, Numbers::Unorm),
        F::Rgba8Unorm => (4, C::U8, Numbers::Unorm),
        F::Rgba8UnormSrgb => (4, C::U8, Numbers::Srgb),
        F::R8Snorm => (1, C::I8, Numbers::Snorm),
        F::Rg8Snorm => (2, C::I8, Numbers::Snorm),
        F::Rgba8Snorm => (4, C::I8, Numbers::Snorm),
        F::R8Uint | F::Stencil8 => (1, C::U8, whole(0xff)),
        F::Rg8Uint => (2, C::U8, whole(0xff)),
        F::Rgba8Uint => (4, C::U8, whole(0xff)),
        F::R8Sint => (1, C::I8, whole(0x7f)),
        F::Rg8Sint => (2, C::I8, whole(0x7f)),
        F::Rgba8Sint => (4, C::I8, whole(0x7f)),
        F::R16Unorm | F::Depth16Unorm => (1, C::U16, Numbers::Unorm),
        F::Rg16Unorm => (2, C::U16, Numbers::Unorm),
        F::Rgba16Unorm => (4, C::U16, Numbers::Unorm),
        F::R16Snorm => (1, C::I16, Numbers::Snorm),
        F::Rg16Snorm => (2, C::I16, Numbers::Snorm),
        F::Rgba16Snorm => (4, C::I16, Numbers::Snorm),
        F::R16Uint => (1, C::U16, whole(0xffff)),
        F::Rg16Uint => (2, C::U16, whole(0xffff)),
        F::Rgba16Uint => (4, C::U16, whole(0xffff)),
        F::R16Sint => (1, C::I16, whole(0x7fff)),
        F::Rg16Sint => (2, C::I16, whole(0x7fff)),
        F::Rgba16Sint => (4, C::I16, whole(0x7fff)),
        F::R16Float => (1, C::F16, Numbers::Data),
        F::Rg16Float => (2, C::F16, Numbers::Data),
        F::Rgba16Float => (4, C::F16, Numbers::Float),
        F::R32Uint => (1, C::U32, whole(u32::MAX)),
        F::Rg32Uint => (2, C::U32, whole(u32::MAX)),
        F::Rgba32Uint => (4, C::U32, whole(u32::MAX)),
        F::R32Sint => (1, C::I32, whole(i32::MAX as u32)),
        F::Rg32Sint => (2, C::I32, whole(i32::MAX as u32)),
        F::Rgba32Sint => (4, C::I32, whole(i32::MAX as u32)),
        F::R32Float | F::Depth32Float => (1, C::F32, Numbers::Data),
        F::Rg32Float => (2, C::F32, Numbers::Data),
        F::Rgba32Float => (4, C::F32, Numbers::Float),
        F::Bgra8Unorm => return Some((Layout::Bgra8, Numbers::Unorm)),
        F::Bgra8UnormSrgb => return Some((Layout::Bgra8, Numbers::Srgb)),
        F::Rgb10a2Unorm => return Some((Layout::Rgb10a2 { unorm: true }, Numbers::Unorm)),
        F::Rgb10a2Uint => return Some((Layout::Rgb10a2 { unorm: false }, whole(0x3ff))),
        F::Rg11b10Ufloat => return Some((Layout::Rg11b10, Numbers::Float)),
        F::Rgb9e5Ufloat => return Some((Layout::Rgb9e5, Numbers::Float)),
        _ => return None,
    };
    Some((Layout::Channels(count, channel), numbers))
}

/// A 16-bit float (IEEE 754 binary16).
fn half(bits: u16) -> f32 {
    let value = small_float(u32::from(bits & 0x7fff), 10);
    if bits & 0x8000 == 0 { value } else { -value }
}

/// An unsigned float with five bits of exponent and `mantissa` bits of mantissa.
fn small_float(bits: u32, mantissa: u32) -> f32 {
    let fraction = (bits & ((1 << mantissa) - 1)) as f32 / (1 << mantissa) as f32;
    match bits >> mantissa & 0x1f {
        0 => fraction * 2_f32.powi(-14),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        exponent => (1.0 + fraction) * 2_f32.powi(exponent as i32 - 15),
    }
}

/// From the sRGB curve to linear (IEC 61966-2-1).
fn linear(x: f32) -> f32 {
    if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn first(format: TextureFormat, bytes: &[u8]) -> [f32; 3] {
        decode(&TextureDesc::new_2d([1, 1], format), bytes).unwrap().picture.pixels()[0]
    }

    #[test]
    #[expect(clippy::float_cmp, reason = "each value is exact in its format")]
    fn formats_become_the_numbers_they_stand_for() {
        use TextureFormat as F;
        assert_eq!(first(F::Rgba8Unorm, &[255, 0, 51, 9]), [1.0, 0.0, 0.2]);
        assert_eq!(first(F::Bgra8Unorm, &[255, 0, 51, 9]), [0.2, 0.0, 1.0]);
        assert_eq!(first(F::Rgba8Snorm, &[0x80, 127, 0, 0]), [-1.0, 1.0, 0.0]);
        assert_eq!(first(F::R32Uint, &7_u32.to_le_bytes()), [7.0; 3]);
        assert_eq!(first(F::Rg16Sint, &[0xff, 0xff, 2, 0]), [-1.0, 2.0, 0.0]);
        assert_eq!(first(F::Depth32Float, &0.25_f32.to_le_bytes()), [0.25; 3]);
        // 1, −2 and the smallest denormal of binary16.
        assert_eq!(first(F::Rgba16Float, &[0, 0x3c, 0, 0xc0, 1, 0, 0, 0]), [1.0, -2.0, 2_f32.powi(-24)]);
        assert!(first(F::R16Float, &[1, 0x7c])[0].is_nan() && first(F::R16Float, &[0, 0x7c])[0].is_infinite(), "specials");
        // 1, ½ and 2: exponents 15, 14 and 16 over no mantissa.
        let word = 15_u32 << 6 | (14 << 6) << 11 | (16 << 5) << 22;
        assert_eq!(first(F::Rg11b10Ufloat, &word.to_le_bytes()), [1.0, 0.5, 2.0]);
        // 256 · 2⁻⁹ · 2^(e − 15): e = 16 gives 1.
        let word = 256_u32 | 128 << 9 | 16 << 27;
        assert_eq!(first(F::Rgb9e5Ufloat, &word.to_le_bytes()), [1.0, 0.5, 0.0]);
        assert_eq!(first(F::Rgb10a2Unorm, &(1023_u32 << 20).to_le_bytes()), [0.0, 0.0, 1.0]);
        assert!((first(F::Rgba8UnormSrgb, &[188, 0, 255, 0])[0] - 0.5029).abs() < 1e-3, "sRGB 188 is half the light");
    }

    #[test]
    fn the_first_layer_is_shown_and_the_rest_counted() {
        let desc = TextureDesc::new_2d([2, 1], TextureFormat::R8Uint).layers(3);
        let texels = decode(&desc, &[1, 2, 3, 4, 5, 6]).unwrap();
        assert_eq!(texels.picture.pixels(), [[1.0; 3], [2.0; 3]]);
        assert_eq!(texels.more_layers, 2);
        assert!(decode(&TextureDesc::new_2d([4, 4], TextureFormat::Bc1RgbaUnorm), &[0; 8]).is_err(), "compressed");
    }
}
