//! What the shader sees of an optional input that is not there: zeros.

use super::Physical;
use crate::{TextureDesc, reflect::BindingKind};
use std::collections::HashMap;

/// Zero-filled objects by what they stand in for, made when first needed.
#[derive(Debug, Default)]
pub(super) struct Zeros {
    textures: HashMap<(wgpu::TextureFormat, wgpu::TextureViewDimension, bool), wgpu::Texture>,
    buffers: HashMap<(u64, wgpu::BufferUsages), wgpu::Buffer>,
}

impl Zeros {
    /// An object for `kind`, with the format of its texture.
    pub(super) fn get(&mut self, device: &wgpu::Device, kind: &BindingKind) -> Option<(Physical, Option<wgpu::TextureFormat>)> {
        match kind {
            BindingKind::Uniform { size, .. } => Some((self.buffer(device, *size, wgpu::BufferUsages::UNIFORM), None)),
            BindingKind::Storage { size, .. } => Some((self.buffer(device, *size, wgpu::BufferUsages::STORAGE), None)),
            BindingKind::Texture { sample, view, multisampled } => {
                let format = match sample {
                    wgpu::TextureSampleType::Uint => wgpu::TextureFormat::R8Uint,
                    wgpu::TextureSampleType::Sint => wgpu::TextureFormat::R8Sint,
                    wgpu::TextureSampleType::Depth => wgpu::TextureFormat::Depth32Float,
                    wgpu::TextureSampleType::Float { .. } => wgpu::TextureFormat::R8Unorm,
                };
                let texture = self
                    .textures
                    .entry((format, *view, *multisampled))
                    .or_insert_with(|| create(device, format, *view, *multisampled));
                Some((Physical::Texture(texture.clone()), Some(format)))
            }
            BindingKind::StorageTexture { .. } | BindingKind::Sampler | BindingKind::AccelerationStructure => None,
        }
    }

    /// wgpu fills new objects with zeros before their first use.
    fn buffer(&mut self, device: &wgpu::Device, size: u64, usage: wgpu::BufferUsages) -> Physical {
        let size = size.max(4).next_multiple_of(4);
        let create =
            || device.create_buffer(&wgpu::BufferDescriptor { label: Some("zeros"), size, usage, mapped_at_creation: false });
        Physical::Buffer { buffer: self.buffers.entry((size, usage)).or_insert_with(create).clone(), offset: 0, size }
    }
}

fn create(
    device: &wgpu::Device,
    format: wgpu::TextureFormat,
    view: wgpu::TextureViewDimension,
    multisampled: bool,
) -> wgpu::Texture {
    use wgpu::TextureViewDimension as V;
    let layers = if matches!(view, V::Cube | V::CubeArray) { 6 } else { 1 };
    let desc = match view {
        V::D3 => TextureDesc::new_3d([1, 1, 1], format),
        _ => TextureDesc::new_2d([1, 1], format).layers(layers),
    };
    let mut usage = wgpu::TextureUsages::TEXTURE_BINDING;
    if multisampled {
        usage |= wgpu::TextureUsages::RENDER_ATTACHMENT;
    }
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("zeros"),
        size: desc.extent(),
        mip_level_count: 1,
        sample_count: if multisampled { 4 } else { 1 },
        dimension: desc.dimension,
        format,
        usage,
        view_formats: &[],
    })
}
