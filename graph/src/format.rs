//! `WebGPU` names of texture formats, and the usages a frame can infer.

use wgpu::{AstcBlock as B, AstcChannel as C, TextureFormat as F};

/// Formats whose name is not plainly the variant in lower case come from this table; ASTC is spelt out below.
const FORMATS: &[(&str, F)] = &[
    ("r8unorm", F::R8Unorm),
    ("r8snorm", F::R8Snorm),
    ("r8uint", F::R8Uint),
    ("r8sint", F::R8Sint),
    ("r16uint", F::R16Uint),
    ("r16sint", F::R16Sint),
    ("r16unorm", F::R16Unorm),
    ("r16snorm", F::R16Snorm),
    ("r16float", F::R16Float),
    ("rg8unorm", F::Rg8Unorm),
    ("rg8snorm", F::Rg8Snorm),
    ("rg8uint", F::Rg8Uint),
    ("rg8sint", F::Rg8Sint),
    ("r32uint", F::R32Uint),
    ("r32sint", F::R32Sint),
    ("r32float", F::R32Float),
    ("rg16uint", F::Rg16Uint),
    ("rg16sint", F::Rg16Sint),
    ("rg16unorm", F::Rg16Unorm),
    ("rg16snorm", F::Rg16Snorm),
    ("rg16float", F::Rg16Float),
    ("rgba8unorm", F::Rgba8Unorm),
    ("rgba8unorm-srgb", F::Rgba8UnormSrgb),
    ("rgba8snorm", F::Rgba8Snorm),
    ("rgba8uint", F::Rgba8Uint),
    ("rgba8sint", F::Rgba8Sint),
    ("bgra8unorm", F::Bgra8Unorm),
    ("bgra8unorm-srgb", F::Bgra8UnormSrgb),
    ("rgb9e5ufloat", F::Rgb9e5Ufloat),
    ("rgb10a2uint", F::Rgb10a2Uint),
    ("rgb10a2unorm", F::Rgb10a2Unorm),
    ("rg11b10ufloat", F::Rg11b10Ufloat),
    ("r64uint", F::R64Uint),
    ("rg32uint", F::Rg32Uint),
    ("rg32sint", F::Rg32Sint),
    ("rg32float", F::Rg32Float),
    ("rgba16uint", F::Rgba16Uint),
    ("rgba16sint", F::Rgba16Sint),
    ("rgba16unorm", F::Rgba16Unorm),
    ("rgba16snorm", F::Rgba16Snorm),
    ("rgba16float", F::Rgba16Float),
    ("rgba32uint", F::Rgba32Uint),
    ("rgba32sint", F::Rgba32Sint),
    ("rgba32float", F::Rgba32Float),
    ("stencil8", F::Stencil8),
    ("depth16unorm", F::Depth16Unorm),
    ("depth24plus", F::Depth24Plus),
    ("depth24plus-stencil8", F::Depth24PlusStencil8),
    ("depth32float", F::Depth32Float),
    ("depth32float-stencil8", F::Depth32FloatStencil8),
    ("nv12", F::NV12),
    ("p010", F::P010),
    ("bc1-rgba-unorm", F::Bc1RgbaUnorm),
    ("bc1-rgba-unorm-srgb", F::Bc1RgbaUnormSrgb),
    ("bc2-rgba-unorm", F::Bc2RgbaUnorm),
    ("bc2-rgba-unorm-srgb", F::Bc2RgbaUnormSrgb),
    ("bc3-rgba-unorm", F::Bc3RgbaUnorm),
    ("bc3-rgba-unorm-srgb", F::Bc3RgbaUnormSrgb),
    ("bc4-r-unorm", F::Bc4RUnorm),
    ("bc4-r-snorm", F::Bc4RSnorm),
    ("bc5-rg-unorm", F::Bc5RgUnorm),
    ("bc5-rg-snorm", F::Bc5RgSnorm),
    ("bc6h-rgb-ufloat", F::Bc6hRgbUfloat),
    ("bc6h-rgb-float", F::Bc6hRgbFloat),
    ("bc7-rgba-unorm", F::Bc7RgbaUnorm),
    ("bc7-rgba-unorm-srgb", F::Bc7RgbaUnormSrgb),
    ("etc2-rgb8unorm", F::Etc2Rgb8Unorm),
    ("etc2-rgb8unorm-srgb", F::Etc2Rgb8UnormSrgb),
    ("etc2-rgb8a1unorm", F::Etc2Rgb8A1Unorm),
    ("etc2-rgb8a1unorm-srgb", F::Etc2Rgb8A1UnormSrgb),
    ("etc2-rgba8unorm", F::Etc2Rgba8Unorm),
    ("etc2-rgba8unorm-srgb", F::Etc2Rgba8UnormSrgb),
    ("eac-r11unorm", F::EacR11Unorm),
    ("eac-r11snorm", F::EacR11Snorm),
    ("eac-rg11unorm", F::EacRg11Unorm),
    ("eac-rg11snorm", F::EacRg11Snorm),
];

const ASTC_BLOCKS: &[(&str, B)] = &[
    ("4x4", B::B4x4),
    ("5x4", B::B5x4),
    ("5x5", B::B5x5),
    ("6x5", B::B6x5),
    ("6x6", B::B6x6),
    ("8x5", B::B8x5),
    ("8x6", B::B8x6),
    ("8x8", B::B8x8),
    ("10x5", B::B10x5),
    ("10x6", B::B10x6),
    ("10x8", B::B10x8),
    ("10x10", B::B10x10),
    ("12x10", B::B12x10),
    ("12x12", B::B12x12),
];

/// The `WebGPU` name of a format.
pub(crate) fn name(format: F) -> String {
    if let F::Astc { block, channel } = format {
        let block = ASTC_BLOCKS.iter().find(|(_, b)| *b == block).map_or("", |(name, _)| name);
        let channel = match channel {
            C::Unorm => "unorm",
            C::UnormSrgb => "unorm-srgb",
            C::Hdr => "hdr",
        };
        return format!("astc-{block}-{channel}");
    }
    FORMATS
        .iter()
        .find(|(_, f)| *f == format)
        .map_or_else(|| format!("{format:?}").to_lowercase(), |(name, _)| (*name).to_owned())
}

/// The format of a `WebGPU` name.
pub(crate) fn parse(name: &str) -> Option<F> {
    if let Some((block, channel)) = name.strip_prefix("astc-").and_then(|rest| rest.split_once('-')) {
        let block = ASTC_BLOCKS.iter().find(|(name, _)| *name == block)?.1;
        let channel = match channel {
            "unorm" => C::Unorm,
            "unorm-srgb" => C::UnormSrgb,
            "hdr" => C::Hdr,
            _ => return None,
        };
        return Some(F::Astc { block, channel });
    }
    FORMATS.iter().find(|(n, _)| *n == name).map(|(_, f)| *f)
}

/// All names but the ASTC family's.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    FORMATS.iter().map(|(name, _)| *name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip() {
        for (text, format) in FORMATS {
            assert_eq!(parse(text), Some(*format));
            assert_eq!(name(*format), *text);
        }
        let astc = F::Astc { block: B::B10x8, channel: C::UnormSrgb };
        assert_eq!(parse(&name(astc)), Some(astc));
        assert_eq!(parse("rgba17float"), None);
        assert_eq!(parse("astc-3x3-unorm"), None);
    }
}
