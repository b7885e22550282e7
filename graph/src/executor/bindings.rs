//! Bind groups and views of one pass.

use super::{Physical, pipelines::Pipelines, zeros::Zeros};
use crate::{
    TextureDesc,
    declaration::{Declaration, ResourceKind},
    reflect::{Binding, BindingKind},
    shader::ShaderCore,
    subresource::Subresources,
    verify::{Bound, ParamsRange},
};
use std::ops::Range;

/// A bind group with its index.
pub(super) type Groups = Vec<(u32, wgpu::BindGroup)>;

/// What bind groups are made from.
pub(super) struct Source<'a> {
    pub(super) device: &'a wgpu::Device,
    pub(super) declaration: &'a Declaration,
    pub(super) physical: &'a [Physical],
    pub(super) params: Option<&'a wgpu::Buffer>,
}

enum Owned {
    View(wgpu::TextureView),
    Sampler(wgpu::Sampler),
    Buffer(wgpu::Buffer, Range<u64>),
    Tlas(wgpu::Tlas),
}

impl Source<'_> {
    /// One bind group per layout there is.
    pub(super) fn groups(
        &self,
        core: &ShaderCore,
        layouts: &[Option<wgpu::BindGroupLayout>],
        bound: &[Bound],
        params: Option<&ParamsRange>,
        (pipelines, zeros): (&mut Pipelines, &mut Zeros),
    ) -> Groups {
        let owned: Vec<Option<Owned>> = core
            .bindings
            .iter()
            .zip(bound)
            .map(|(binding, bound)| self.own(binding, bound, params, (&mut *pipelines, &mut *zeros)))
            .collect();
        let mut groups = Vec::new();
        for (group, layout) in layouts.iter().enumerate() {
            let Some(layout) = layout else { continue };
            let entries: Vec<wgpu::BindGroupEntry<'_>> = core
                .bindings
                .iter()
                .zip(&owned)
                .filter(|(binding, _)| binding.group as usize == group)
                .filter_map(|(binding, owned)| {
                    let resource = match owned.as_ref()? {
                        Owned::View(view) => wgpu::BindingResource::TextureView(view),
                        Owned::Sampler(sampler) => wgpu::BindingResource::Sampler(sampler),
                        Owned::Tlas(tlas) => wgpu::BindingResource::AccelerationStructure(tlas),
                        Owned::Buffer(buffer, range) => wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                            buffer,
                            offset: range.start,
                            size: wgpu::BufferSize::new(range.end - range.start),
                        }),
                    };
                    Some(wgpu::BindGroupEntry { binding: binding.number, resource })
                })
                .collect();
            let descriptor = wgpu::BindGroupDescriptor { label: Some(&core.label), layout, entries: &entries };
            groups.push((group as u32, self.device.create_bind_group(&descriptor)));
        }
        groups
    }

    fn own(
        &self,
        binding: &Binding,
        bound: &Bound,
        params: Option<&ParamsRange>,
        (pipelines, zeros): (&mut Pipelines, &mut Zeros),
    ) -> Option<Owned> {
        match bound {
            Bound::Params => Some(Owned::Buffer(self.params?.clone(), params.cloned()?)),
            Bound::Sampler(sampler) => Some(Owned::Sampler(pipelines.sampler(self.device, *sampler))),
            Bound::Buffer { resource } => self.physical[*resource].range().map(|(buffer, range)| Owned::Buffer(buffer, range)),
            Bound::Texture { resource, format, part } => {
                let Physical::Texture(texture) = &self.physical[*resource] else { return None };
                let ResourceKind::Texture(desc) = &self.declaration.resources[*resource].kind else { return None };
                Some(Owned::View(texture_view(texture, desc, binding, *format, *part)?))
            }
            Bound::Tlas { resource } => {
                let Physical::Tlas(tlas) = &self.physical[*resource] else { return None };
                Some(Owned::Tlas(tlas.clone()))
            }
            Bound::Zeros => match zeros.get(self.device, &binding.kind)? {
                (Physical::Texture(texture), Some(format)) => {
                    let desc = TextureDesc::new_2d([1, 1], format).layers(texture.depth_or_array_layers());
                    Some(Owned::View(texture_view(&texture, &desc, binding, format, Subresources::ALL)?))
                }
                (other, _) => other.range().map(|(buffer, range)| Owned::Buffer(buffer, range)),
            },
        }
    }
}

/// The part of a texture that the shader's variable sees. Ranges are those of the description: the object may have
/// more mips and layers, for others that share it.
fn texture_view(
    texture: &wgpu::Texture,
    desc: &TextureDesc,
    binding: &Binding,
    format: wgpu::TextureFormat,
    part: Subresources,
) -> Option<wgpu::TextureView> {
    let (dimension, usage) = match &binding.kind {
        BindingKind::Texture { view, .. } => (*view, wgpu::TextureUsages::TEXTURE_BINDING),
        BindingKind::StorageTexture { view, access: wgpu::StorageTextureAccess::Atomic, .. } => {
            (*view, wgpu::TextureUsages::STORAGE_ATOMIC)
        }
        BindingKind::StorageTexture { view, .. } => (*view, wgpu::TextureUsages::STORAGE_BINDING),
        _ => return None,
    };
    let mips = part.mips_of(desc.mip_level_count);
    let layers = if desc.dimension == wgpu::TextureDimension::D3 { 0..1 } else { part.layers_of(desc.size[2]) };
    Some(texture.create_view(&wgpu::TextureViewDescriptor {
        label: Some(&binding.name),
        format: Some(format),
        dimension: Some(dimension),
        // A view in another format may not allow all that the texture does.
        usage: Some(usage),
        aspect: if format.is_combined_depth_stencil_format() { wgpu::TextureAspect::DepthOnly } else { wgpu::TextureAspect::All },
        base_mip_level: mips.start,
        mip_level_count: Some(mips.len() as u32),
        base_array_layer: layers.start,
        array_layer_count: Some(layers.len() as u32),
    }))
}

/// The one mip and layer of a texture that is drawn into.
pub(super) fn attachment_view(texture: &wgpu::Texture, desc: &TextureDesc, part: Subresources) -> wgpu::TextureView {
    let transient = texture.usage() & wgpu::TextureUsages::TRANSIENT_ATTACHMENT;
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2),
        usage: Some(wgpu::TextureUsages::RENDER_ATTACHMENT | transient),
        base_mip_level: part.mips_of(desc.mip_level_count).start,
        mip_level_count: Some(1),
        base_array_layer: part.layers_of(desc.size[2]).start,
        array_layer_count: Some(1),
        ..Default::default()
    })
}
