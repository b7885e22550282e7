//! Descriptions of textures and buffers.

use crate::{ShaderStruct, layout::StructLayout};
use std::fmt;

/// What a texture is; two textures share memory only if their descriptions are equal.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct TextureDesc {
    /// Width, height, and layers (2D) or depth (3D), in texels.
    pub size: [u32; 3],
    /// Format of a texel.
    pub format: wgpu::TextureFormat,
    /// Mip levels, at least 1.
    pub mip_level_count: u32,
    /// Samples per texel, 1 or 4.
    pub sample_count: u32,
    /// 2D (the default, with layers) or 3D.
    pub dimension: wgpu::TextureDimension,
    /// Other formats a view may take, such as the sRGB twin.
    pub view_formats: Vec<wgpu::TextureFormat>,
}

impl TextureDesc {
    /// A 2D texture with one layer, one mip level and one sample. `size` in texels.
    pub fn new_2d(size: [u32; 2], format: wgpu::TextureFormat) -> Self {
        Self {
            size: [size[0], size[1], 1],
            format,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            view_formats: Vec::new(),
        }
    }

    /// A 3D texture. `size` in texels.
    pub fn new_3d(size: [u32; 3], format: wgpu::TextureFormat) -> Self {
        Self { size, dimension: wgpu::TextureDimension::D3, ..Self::new_2d([1, 1], format) }
    }

    /// The same with `n` layers.
    pub fn layers(mut self, n: u32) -> Self {
        self.size[2] = n;
        self
    }

    /// The same with `n` mip levels.
    pub fn mip_levels(mut self, n: u32) -> Self {
        self.mip_level_count = n;
        self
    }

    /// The same with `n` samples per texel.
    pub fn samples(mut self, n: u32) -> Self {
        self.sample_count = n;
        self
    }

    /// The same, with one more format that views may take.
    pub fn view_format(mut self, format: wgpu::TextureFormat) -> Self {
        if !self.view_formats.contains(&format) {
            self.view_formats.push(format);
        }
        self
    }

    /// Bytes the texels take, all mips, layers and samples; what a driver adds is not counted.
    pub fn bytes(&self) -> u64 {
        let (block_w, block_h) = self.format.block_dimensions();
        // Formats without one copyable layout (depth24plus, depth32float-stencil8) are counted as drivers store them.
        let block_bytes =
            u64::from(self.format.block_copy_size(None).or(self.format.target_pixel_byte_cost()).unwrap_or(match self.format {
                wgpu::TextureFormat::Depth32FloatStencil8 => 8,
                _ => 4,
            }));
        let mut total = 0_u64;
        for mip in 0..self.mip_level_count.min(32) {
            let extent = |texels: u32| u64::from((texels >> mip).max(1));
            let depth = if self.dimension == wgpu::TextureDimension::D3 { extent(self.size[2]) } else { u64::from(self.size[2]) };
            let blocks = extent(self.size[0]).div_ceil(block_w.into()) * extent(self.size[1]).div_ceil(block_h.into());
            total = total.saturating_add(blocks.saturating_mul(depth).saturating_mul(block_bytes));
        }
        total.saturating_mul(self.sample_count.into())
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.size.contains(&0) || self.mip_level_count == 0 || self.sample_count == 0
    }

    pub(crate) fn extent(&self) -> wgpu::Extent3d {
        wgpu::Extent3d { width: self.size[0], height: self.size[1], depth_or_array_layers: self.size[2] }
    }
}

impl fmt::Display for TextureDesc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [w, h, d] = self.size;
        write!(f, "{} {w}×{h}", crate::format::name(self.format))?;
        if d != 1 {
            write!(f, "×{d}")?;
        }
        if self.mip_level_count != 1 {
            write!(f, ", {} mips", self.mip_level_count)?;
        }
        if self.sample_count != 1 {
            write!(f, ", {} samples", self.sample_count)?;
        }
        Ok(())
    }
}

/// What a buffer is.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct BufferDesc {
    /// Size (bytes). The wgpu buffer is this, rounded up to a multiple of 4.
    pub size: u64,
    /// Layout of one element, compared with the WGSL; `None`: not compared.
    pub element: Option<StructLayout>,
}

impl BufferDesc {
    /// A buffer of `size` bytes with no known elements.
    pub fn bytes(size: u64) -> Self {
        Self { size, element: None }
    }

    /// A buffer of `count` 32-bit words.
    pub fn words(count: u64) -> Self {
        Self::bytes(count.saturating_mul(4))
    }

    /// A buffer of `count` structs `T`, whose layout is compared with the WGSL's.
    pub fn array_of<T: ShaderStruct>(count: u64) -> Self {
        let element = StructLayout::of::<T>();
        Self { size: count.saturating_mul(element.size as u64), element: Some(element) }
    }

    /// Bytes of the wgpu buffer: the size rounded up to whole words.
    pub(crate) fn padded(&self) -> u64 {
        self.size.saturating_add(3) & !3
    }
}

impl fmt::Display for BufferDesc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.element {
            Some(element) => write!(f, "{} bytes of {}", self.size, element.name),
            None => write!(f, "{} bytes", self.size),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgpu::TextureFormat as F;

    #[test]
    fn bytes_count_mips_layers_samples_and_blocks() {
        assert_eq!(TextureDesc::new_2d([1920, 1080], F::Rgba16Float).bytes(), 16_588_800, "rgba16float is 8 bytes a texel");
        assert_eq!(TextureDesc::new_2d([4, 4], F::R32Float).mip_levels(3).bytes(), 4 * (16 + 4 + 1), "mips shrink by 4");
        assert_eq!(TextureDesc::new_2d([4, 4], F::R32Float).layers(6).bytes(), 6 * 64, "layers multiply");
        assert_eq!(TextureDesc::new_2d([4, 4], F::Rgba8Unorm).samples(4).bytes(), 256, "samples multiply");
        assert_eq!(TextureDesc::new_3d([4, 4, 4], F::R32Float).mip_levels(2).bytes(), 256 + 32, "depth shrinks too");
        assert_eq!(TextureDesc::new_2d([5, 5], F::Bc1RgbaUnorm).bytes(), 4 * 8, "blocks round up");
        assert_eq!(TextureDesc::new_2d([2, 2], F::Depth32Float).bytes(), 16, "depth has a size");
        assert_eq!(TextureDesc::new_2d([u32::MAX, u32::MAX], F::Rgba32Float).layers(u32::MAX).bytes(), u64::MAX, "saturates");
    }

    #[test]
    fn buffers_round_up_to_words() {
        assert_eq!(BufferDesc::bytes(5).padded(), 8, "a wgpu buffer is whole words");
        assert_eq!(BufferDesc::words(3).size, 12, "words are 4 bytes");
        assert_eq!(BufferDesc::words(u64::MAX).size, u64::MAX, "saturates");
    }
}
