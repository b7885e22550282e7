//! Bind groups of one pass.

use super::{Physical, pipelines::Pipelines};
use crate::{
    declaration::{Declaration, ResourceKind},
    reflect::{Binding, BindingKind},
    shader::ShaderCore,
    verify::Bound,
};
use std::ops::Range;

/// Where a pass's params lie in the frame's uniform buffer (bytes).
pub(super) type ParamsRange = Option<Range<u64>>;

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
}

impl Source<'_> {
    /// One bind group per layout there is, with its index. They are made anew each frame: that costs microseconds, and
    /// a cache would hold on to resources.
    pub(super) fn groups(
        &self,
        core: &ShaderCore,
        layouts: &[Option<wgpu::BindGroupLayout>],
        bound: &[Bound],
        params: &ParamsRange,
        pipelines: &mut Pipelines,
    ) -> Vec<(u32, wgpu::BindGroup)> {
        let owned: Vec<Option<Owned>> =
            core.bindings.iter().zip(bound).map(|(binding, bound)| self.own(binding, bound, params, pipelines)).collect();
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

    fn own(&self, binding: &Binding, bound: &Bound, params: &ParamsRange, pipelines: &mut Pipelines) -> Option<Owned> {
        match bound {
            Bound::Params => Some(Owned::Buffer(self.params?.clone(), params.clone()?)),
            Bound::Sampler(sampler) => Some(Owned::Sampler(pipelines.sampler(self.device, *sampler))),
            Bound::Buffer { resource } => match (&self.physical[*resource], &self.declaration.resources[*resource].kind) {
                (Physical::Buffer(buffer), ResourceKind::Buffer(desc)) => Some(Owned::Buffer(buffer.clone(), 0..desc.padded())),
                _ => None,
            },
            Bound::Texture { resource, format } => {
                let Physical::Texture(texture) = &self.physical[*resource] else { return None };
                let (dimension, usage) = match &binding.kind {
                    BindingKind::Texture { view, .. } => (*view, wgpu::TextureUsages::TEXTURE_BINDING),
                    BindingKind::StorageTexture { view, access: wgpu::StorageTextureAccess::Atomic, .. } => {
                        (*view, wgpu::TextureUsages::STORAGE_ATOMIC)
                    }
                    BindingKind::StorageTexture { view, .. } => (*view, wgpu::TextureUsages::STORAGE_BINDING),
                    _ => return None,
                };
                let storage = matches!(binding.kind, BindingKind::StorageTexture { .. });
                Some(Owned::View(texture.create_view(&wgpu::TextureViewDescriptor {
                    label: Some(&binding.name),
                    format: Some(*format),
                    dimension: Some(dimension),
                    // A view in another format may not allow all that the texture does.
                    usage: Some(usage),
                    aspect: if format.is_combined_depth_stencil_format() {
                        wgpu::TextureAspect::DepthOnly
                    } else {
                        wgpu::TextureAspect::All
                    },
                    mip_level_count: storage.then_some(1),
                    ..Default::default()
                })))
            }
        }
    }
}
