//! Descriptions in Vulkan's terms, equal to what wgpu's Vulkan backend would make of them.

use crate::TextureDesc;
use ash::vk;
use wgpu::{BufferUsages, TextureFormat as T, TextureUsages, TextureUses};

/// Depth and stencil formats the device renders to; where one is missing wgpu takes a larger one.
#[derive(Clone, Copy, Debug)]
pub(super) struct DepthFormats {
    pub(super) d24: bool,
    pub(super) d24_s8: bool,
    pub(super) s8: bool,
}

/// The Vulkan format; `None` for those placement does not know (ASTC, ETC2, several planes).
pub(super) fn format(format: T, depth: DepthFormats) -> Option<vk::Format> {
    use vk::Format as F;
    Some(match format {
        T::R8Unorm => F::R8_UNORM,
        T::R8Snorm => F::R8_SNORM,
        T::R8Uint => F::R8_UINT,
        T::R8Sint => F::R8_SINT,
        T::R16Uint => F::R16_UINT,
        T::R16Sint => F::R16_SINT,
        T::R16Unorm => F::R16_UNORM,
        T::R16Snorm => F::R16_SNORM,
        T::R16Float => F::R16_SFLOAT,
        T::Rg8Unorm => F::R8G8_UNORM,
        T::Rg8Snorm => F::R8G8_SNORM,
        T::Rg8Uint => F::R8G8_UINT,
        T::Rg8Sint => F::R8G8_SINT,
        T::R32Uint => F::R32_UINT,
        T::R32Sint => F::R32_SINT,
        T::R32Float => F::R32_SFLOAT,
        T::R64Uint => F::R64_UINT,
        T::Rg16Uint => F::R16G16_UINT,
        T::Rg16Sint => F::R16G16_SINT,
        T::Rg16Unorm => F::R16G16_UNORM,
        T::Rg16Snorm => F::R16G16_SNORM,
        T::Rg16Float => F::R16G16_SFLOAT,
        T::Rgba8Unorm => F::R8G8B8A8_UNORM,
        T::Rgba8UnormSrgb => F::R8G8B8A8_SRGB,
        T::Rgba8Snorm => F::R8G8B8A8_SNORM,
        T::Rgba8Uint => F::R8G8B8A8_UINT,
        T::Rgba8Sint => F::R8G8B8A8_SINT,
        T::Bgra8Unorm => F::B8G8R8A8_UNORM,
        T::Bgra8UnormSrgb => F::B8G8R8A8_SRGB,
        T::Rgb9e5Ufloat => F::E5B9G9R9_UFLOAT_PACK32,
        T::Rgb10a2Uint => F::A2B10G10R10_UINT_PACK32,
        T::Rgb10a2Unorm => F::A2B10G10R10_UNORM_PACK32,
        T::Rg11b10Ufloat => F::B10G11R11_UFLOAT_PACK32,
        T::Rg32Uint => F::R32G32_UINT,
        T::Rg32Sint => F::R32G32_SINT,
        T::Rg32Float => F::R32G32_SFLOAT,
        T::Rgba16Uint => F::R16G16B16A16_UINT,
        T::Rgba16Sint => F::R16G16B16A16_SINT,
        T::Rgba16Unorm => F::R16G16B16A16_UNORM,
        T::Rgba16Snorm => F::R16G16B16A16_SNORM,
        T::Rgba16Float => F::R16G16B16A16_SFLOAT,
        T::Rgba32Uint => F::R32G32B32A32_UINT,
        T::Rgba32Sint => F::R32G32B32A32_SINT,
        T::Rgba32Float => F::R32G32B32A32_SFLOAT,
        T::Depth16Unorm => F::D16_UNORM,
        T::Depth24Plus if depth.d24 => F::X8_D24_UNORM_PACK32,
        T::Depth24Plus | T::Depth32Float => F::D32_SFLOAT,
        T::Stencil8 if depth.s8 => F::S8_UINT,
        T::Stencil8 | T::Depth24PlusStencil8 if depth.d24_s8 => F::D24_UNORM_S8_UINT,
        T::Stencil8 | T::Depth24PlusStencil8 | T::Depth32FloatStencil8 => F::D32_SFLOAT_S8_UINT,
        T::Bc1RgbaUnorm => F::BC1_RGBA_UNORM_BLOCK,
        T::Bc1RgbaUnormSrgb => F::BC1_RGBA_SRGB_BLOCK,
        T::Bc2RgbaUnorm => F::BC2_UNORM_BLOCK,
        T::Bc2RgbaUnormSrgb => F::BC2_SRGB_BLOCK,
        T::Bc3RgbaUnorm => F::BC3_UNORM_BLOCK,
        T::Bc3RgbaUnormSrgb => F::BC3_SRGB_BLOCK,
        T::Bc4RUnorm => F::BC4_UNORM_BLOCK,
        T::Bc4RSnorm => F::BC4_SNORM_BLOCK,
        T::Bc5RgUnorm => F::BC5_UNORM_BLOCK,
        T::Bc5RgSnorm => F::BC5_SNORM_BLOCK,
        T::Bc6hRgbUfloat => F::BC6H_UFLOAT_BLOCK,
        T::Bc6hRgbFloat => F::BC6H_SFLOAT_BLOCK,
        T::Bc7RgbaUnorm => F::BC7_UNORM_BLOCK,
        T::Bc7RgbaUnormSrgb => F::BC7_SRGB_BLOCK,
        _ => return None,
    })
}

/// The parts of the image's texels.
pub(super) fn aspects(format: vk::Format) -> vk::ImageAspectFlags {
    use vk::{Format as F, ImageAspectFlags as A};
    match format {
        F::D16_UNORM | F::X8_D24_UNORM_PACK32 | F::D32_SFLOAT => A::DEPTH,
        F::D24_UNORM_S8_UINT | F::D32_SFLOAT_S8_UINT => A::DEPTH | A::STENCIL,
        F::S8_UINT => A::STENCIL,
        _ => A::COLOR,
    }
}

/// Usages of an image; `None` if placement does not serve one of them.
pub(super) fn image_usage(usage: TextureUsages, is_depth: bool) -> Option<vk::ImageUsageFlags> {
    use vk::ImageUsageFlags as V;
    let attachment = if is_depth { V::DEPTH_STENCIL_ATTACHMENT } else { V::COLOR_ATTACHMENT };
    let pairs = [
        (TextureUsages::COPY_SRC, V::TRANSFER_SRC),
        (TextureUsages::COPY_DST, V::TRANSFER_DST),
        (TextureUsages::TEXTURE_BINDING, V::SAMPLED),
        (TextureUsages::STORAGE_BINDING, V::STORAGE),
        (TextureUsages::STORAGE_ATOMIC, V::STORAGE),
        (TextureUsages::RENDER_ATTACHMENT, attachment),
    ];
    let known = pairs.iter().fold(TextureUsages::empty(), |known, (usage, _)| known | *usage);
    let flags = pairs.iter().filter(|(bit, _)| usage.contains(*bit)).fold(V::empty(), |flags, (_, flag)| flags | *flag);
    (known.contains(usage) && !usage.is_empty()).then_some(flags)
}

/// Usages of a buffer; `None` if placement does not serve one of them: mapped memory, acceleration structures.
pub(super) fn buffer_usage(usage: BufferUsages) -> Option<vk::BufferUsageFlags> {
    use vk::BufferUsageFlags as V;
    let pairs = [
        (BufferUsages::COPY_SRC, V::TRANSFER_SRC),
        (BufferUsages::COPY_DST, V::TRANSFER_DST),
        (BufferUsages::INDEX, V::INDEX_BUFFER),
        (BufferUsages::VERTEX, V::VERTEX_BUFFER),
        (BufferUsages::UNIFORM, V::UNIFORM_BUFFER),
        (BufferUsages::STORAGE, V::STORAGE_BUFFER),
        // wgpu checks indirect arguments by a shader of its own, and turns timestamps into nanoseconds by another.
        (BufferUsages::INDIRECT, V::from_raw(V::INDIRECT_BUFFER.as_raw() | V::STORAGE_BUFFER.as_raw())),
        (BufferUsages::QUERY_RESOLVE, V::from_raw(V::TRANSFER_DST.as_raw() | V::STORAGE_BUFFER.as_raw())),
    ];
    let known = pairs.iter().fold(BufferUsages::empty(), |known, (usage, _)| known | *usage);
    let flags = pairs.iter().filter(|(bit, _)| usage.contains(*bit)).fold(V::empty(), |flags, (_, flag)| flags | *flag);
    (known.contains(usage) && !usage.is_empty()).then_some(flags)
}

/// The state of a texture between its lives, and its layout. One the usages allow, most likely that of the first use.
pub(super) fn home(usage: TextureUsages, is_depth: bool) -> (TextureUses, vk::ImageLayout) {
    use vk::ImageLayout as L;
    if usage.contains(TextureUsages::RENDER_ATTACHMENT) {
        if is_depth {
            (TextureUses::DEPTH_STENCIL_WRITE, L::DEPTH_STENCIL_ATTACHMENT_OPTIMAL)
        } else {
            (TextureUses::COLOR_TARGET, L::COLOR_ATTACHMENT_OPTIMAL)
        }
    } else if usage.contains(TextureUsages::STORAGE_BINDING) {
        (TextureUses::STORAGE_READ_WRITE, L::GENERAL)
    } else if usage.contains(TextureUsages::STORAGE_ATOMIC) {
        (TextureUses::STORAGE_ATOMIC, L::GENERAL)
    } else if usage.contains(TextureUsages::COPY_DST) {
        (TextureUses::COPY_DST, L::TRANSFER_DST_OPTIMAL)
    } else if usage.contains(TextureUsages::TEXTURE_BINDING) {
        (TextureUses::RESOURCE, if is_depth { L::DEPTH_STENCIL_READ_ONLY_OPTIMAL } else { L::SHADER_READ_ONLY_OPTIMAL })
    } else {
        (TextureUses::COPY_SRC, L::TRANSFER_SRC_OPTIMAL)
    }
}

/// Flags wgpu would set, so that its views are allowed, and `ALIAS`, by which validation layers know of the sharing.
pub(super) fn image_flags(desc: &TextureDesc, usage: TextureUsages) -> vk::ImageCreateFlags {
    use vk::ImageCreateFlags as V;
    let mut flags = V::ALIAS;
    if desc.dimension == wgpu::TextureDimension::D3 {
        if usage.contains(TextureUsages::RENDER_ATTACHMENT) {
            flags |= V::TYPE_2D_ARRAY_COMPATIBLE;
        }
    } else if desc.size[0] == desc.size[1] && desc.size[2].is_multiple_of(6) && desc.sample_count == 1 {
        flags |= V::CUBE_COMPATIBLE;
    }
    if !desc.view_formats.is_empty() {
        flags |= V::MUTABLE_FORMAT;
    }
    flags
}
