//! Compares a frame with the device, before anything is created.

use super::{Frame, pipelines::Pipelines, readback::Rows};
use crate::{
    ComputeShader,
    declaration::{ResourceDecl, ResourceKind},
    error::{GraphError, PassPlace},
    format,
    graph::{Object, Work},
    indirect::Groups,
    reflect::{Binding, BindingKind},
};

/// What the device cannot give: sizes, formats and bindings, which follow from the plan alone.
pub(super) fn resources(limits: &wgpu::Limits, features: wgpu::Features, frame: &Frame<'_>) -> Result<(), GraphError> {
    for (index, resource) in frame.declaration.resources.iter().enumerate() {
        if frame.plan.lifetimes[index].is_none() {
            continue;
        }
        let usage = frame.plan.usages[index];
        self::resource(resource, usage, limits, features)?;
    }
    Ok(())
}

/// The first thing about one resource, used in this way, that the device cannot do.
pub(super) fn resource(
    resource: &ResourceDecl,
    usage: u32,
    limits: &wgpu::Limits,
    features: wgpu::Features,
) -> Result<(), GraphError> {
    match &resource.kind {
        ResourceKind::Buffer(_) => buffer(resource, usage, limits),
        ResourceKind::Texture(_) => texture(resource, usage, limits, features),
        ResourceKind::Tlas => acceleration_structure(resource, features),
    }
}

/// What may differ in every frame of one plan: imported objects, sizes of dispatches, shaders. What shaders that have a
/// pipeline need is known to be there.
pub(super) fn work(
    limits: &wgpu::Limits,
    features: wgpu::Features,
    pipelines: &Pipelines,
    frame: &Frame<'_>,
    work: &[Option<Work<'_>>],
) -> Result<(), GraphError> {
    for (index, resource) in frame.declaration.resources.iter().enumerate() {
        if resource.origin == crate::Origin::Imported && frame.plan.lifetimes[index].is_some() {
            import(frame, index, frame.plan.usages[index])?;
        }
    }
    for &pass in &frame.plan.order {
        let Some(work) = &work[pass] else { continue };
        work_limits(work, &frame.declaration.passes[pass].name, limits, pipelines)?;
        blending(work, &frame.declaration.resources, features)?;
        if let Work::Readback { resource, .. } = work
            && let ResourceKind::Texture(desc) = &frame.declaration.resources[*resource].kind
        {
            let most = limits.max_buffer_size;
            let what = || format!("reading back `{}`", frame.declaration.resources[*resource].name);
            limit(what, Rows::of(desc).bytes(), "max_buffer_size", most, "read back a smaller texture")?;
        }
    }
    Ok(())
}

fn limit(what: impl Fn() -> String, asked: u64, name: &'static str, allowed: u64, mend: &str) -> Result<(), GraphError> {
    if asked <= allowed {
        return Ok(());
    }
    Err(GraphError::Limit { what: what(), asked, limit: name, allowed, mend: mend.to_owned() })
}

fn buffer(resource: &ResourceDecl, usage: u32, limits: &wgpu::Limits) -> Result<(), GraphError> {
    let what = || format!("buffer `{}`", resource.name);
    let usage = wgpu::BufferUsages::from_bits_truncate(usage);
    let mend = "make it smaller, or ask the adapter for higher limits";
    limit(what, resource.bytes, "max_buffer_size", limits.max_buffer_size, mend)?;
    if usage.contains(wgpu::BufferUsages::STORAGE) {
        limit(what, resource.bytes, "max_storage_buffer_binding_size", limits.max_storage_buffer_binding_size, mend)?;
    }
    if usage.contains(wgpu::BufferUsages::UNIFORM) {
        limit(what, resource.bytes, "max_uniform_buffer_binding_size", limits.max_uniform_buffer_binding_size, mend)?;
    }
    Ok(())
}

fn texture(resource: &ResourceDecl, usage: u32, limits: &wgpu::Limits, features: wgpu::Features) -> Result<(), GraphError> {
    let ResourceKind::Texture(desc) = &resource.kind else { return Ok(()) };
    let what = || format!("texture `{}`", resource.name);
    let mend = "make it smaller";
    let [width, height, depth] = desc.size.map(u64::from);
    if desc.dimension == wgpu::TextureDimension::D3 {
        let most = limits.max_texture_dimension_3d.into();
        limit(what, width.max(height).max(depth), "max_texture_dimension_3d", most, mend)?;
    } else {
        limit(what, width.max(height), "max_texture_dimension_2d", limits.max_texture_dimension_2d.into(), mend)?;
        limit(what, depth, "max_texture_array_layers", limits.max_texture_array_layers.into(), "use fewer layers")?;
    }
    let refuse =
        |usage: String| GraphError::FormatUsage { resource: resource.name.to_string(), format: format::name(desc.format), usage };
    if !features.contains(desc.format.required_features()) {
        return Err(refuse(format!("a texture without {:?}", desc.format.required_features())));
    }
    if !features.contains(wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES) {
        let usage = wgpu::TextureUsages::from_bits_truncate(usage);
        let able = desc.format.guaranteed_format_features(features);
        let lacking = usage - able.allowed_usages;
        if !lacking.is_empty() {
            return Err(refuse(format!("{lacking:?}")));
        }
        if !able.flags.sample_count_supported(desc.sample_count) {
            return Err(refuse(format!("a texture of {} samples", desc.sample_count)));
        }
    }
    Ok(())
}

fn acceleration_structure(resource: &ResourceDecl, features: wgpu::Features) -> Result<(), GraphError> {
    if features.contains(wgpu::Features::EXPERIMENTAL_RAY_QUERY) {
        return Ok(());
    }
    Err(GraphError::RayQuery { resource: resource.name.to_string() })
}

/// The caller's object against its description.
fn import(frame: &Frame<'_>, index: usize, usage: u32) -> Result<(), GraphError> {
    let resource = &frame.declaration.resources[index];
    let at = || {
        let mut passes = frame.plan.order.iter().map(|&pass| &frame.declaration.passes[pass]);
        let user = passes.find(|pass| pass.accesses.iter().any(|access| access.resource == index));
        user.map_or_else(PassPlace::default, crate::declaration::PassDecl::place)
    };
    let mismatch = |message: String| Err(GraphError::ImportMismatch { at: at(), resource: resource.name.to_string(), message });
    match (&resource.kind, &frame.objects[index]) {
        (ResourceKind::Texture(desc), Object::Texture(texture)) => {
            let lacking = wgpu::TextureUsages::from_bits_truncate(usage) - texture.usage();
            let same = texture.size() == desc.extent()
                && texture.format() == desc.format
                && texture.mip_level_count() == desc.mip_level_count
                && texture.sample_count() == desc.sample_count
                && texture.dimension() == desc.dimension;
            if !same {
                let size = texture.size();
                return mismatch(format!(
                    "declared as {desc}, but the wgpu texture is {} {}×{}×{}, {} mips, {} samples; declare it as it is",
                    format::name(texture.format()),
                    size.width,
                    size.height,
                    size.depth_or_array_layers,
                    texture.mip_level_count(),
                    texture.sample_count()
                ));
            }
            if lacking.is_empty() {
                Ok(())
            } else {
                mismatch(format!("the wgpu texture lacks usage {lacking:?}; create it with that"))
            }
        }
        (ResourceKind::Buffer(desc), Object::Buffer(buffer)) => {
            let lacking = wgpu::BufferUsages::from_bits_truncate(usage) - buffer.usage();
            if buffer.size() < desc.padded() {
                return mismatch(format!(
                    "declared with {} bytes, but the wgpu buffer has {}; declare it as it is",
                    desc.padded(),
                    buffer.size()
                ));
            }
            if lacking.is_empty() {
                Ok(())
            } else {
                mismatch(format!("the wgpu buffer lacks usage {lacking:?}; create it with that"))
            }
        }
        (ResourceKind::Tlas, Object::Tlas(_)) => Ok(()),
        _ => Err(GraphError::ImportMissing { at: at(), resource: resource.name.to_string() }),
    }
}

fn work_limits(work: &Work<'_>, pass: &str, limits: &wgpu::Limits, pipelines: &Pipelines) -> Result<(), GraphError> {
    let what = || format!("pass `{pass}`");
    match work {
        Work::Compute { shader, groups, .. } => {
            if !pipelines.has_compute(shader) {
                compute_limits(shader, what, limits)?;
            }
            let most = limits.max_compute_workgroups_per_dimension;
            let asked = match groups {
                Groups::Given(groups) => groups.iter().copied().max().unwrap_or(0),
                Groups::Indirect(_) => 0,
            };
            let mend = "fold the dispatch into more dimensions (`dispatch_1d`), or split it";
            limit(what, asked.into(), "max_compute_workgroups_per_dimension", most.into(), mend)
        }
        Work::Raster { shader, targets, .. } => {
            bindings(what, &shader.core.bindings, limits)?;
            let mend = "write fewer outputs, or split the pass";
            limit(what, targets.colors.len() as u64, "max_color_attachments", limits.max_color_attachments.into(), mend)
        }
        _ => Ok(()),
    }
}

/// WebGPU blends 16-bit floats everywhere, 32-bit floats by a feature.
fn blending(work: &Work<'_>, resources: &[ResourceDecl], features: wgpu::Features) -> Result<(), GraphError> {
    let Work::Raster { shader, targets, .. } = work else { return Ok(()) };
    if shader.blend.is_none() || features.contains(wgpu::Features::FLOAT32_BLENDABLE) {
        return Ok(());
    }
    for target in targets.colors.iter().flatten() {
        let resource = &resources[target.resource];
        let ResourceKind::Texture(desc) = &resource.kind else { continue };
        if desc.format.sample_type(None, None) == Some(wgpu::TextureSampleType::Float { filterable: false }) {
            let usage = "a blended target without FLOAT32_BLENDABLE".to_owned();
            return Err(GraphError::FormatUsage {
                resource: resource.name.to_string(),
                format: format::name(desc.format),
                usage,
            });
        }
    }
    Ok(())
}

fn compute_limits(shader: &ComputeShader, what: impl Fn() -> String + Copy, limits: &wgpu::Limits) -> Result<(), GraphError> {
    bindings(what, &shader.core.bindings, limits)?;
    let size = shader.workgroup_size();
    let mend = "use a smaller @workgroup_size";
    limit(what, size[0].into(), "max_compute_workgroup_size_x", limits.max_compute_workgroup_size_x.into(), mend)?;
    limit(what, size[1].into(), "max_compute_workgroup_size_y", limits.max_compute_workgroup_size_y.into(), mend)?;
    limit(what, size[2].into(), "max_compute_workgroup_size_z", limits.max_compute_workgroup_size_z.into(), mend)?;
    let invocations = size.iter().fold(1_u64, |total, n| total.saturating_mul(u64::from(*n)));
    let most = limits.max_compute_invocations_per_workgroup.into();
    limit(what, invocations, "max_compute_invocations_per_workgroup", most, mend)?;
    let most = limits.max_compute_workgroup_storage_size.into();
    limit(what, shader.workgroup_bytes, "max_compute_workgroup_storage_size", most, "use less var<workgroup>")
}

fn bindings(what: impl Fn() -> String + Copy, bindings: &[Binding], limits: &wgpu::Limits) -> Result<(), GraphError> {
    let groups = bindings.iter().map(|binding| u64::from(binding.group) + 1).max().unwrap_or(0);
    limit(what, groups, "max_bind_groups", limits.max_bind_groups.into(), "use lower @group numbers")?;
    for stage in [wgpu::ShaderStages::COMPUTE, wgpu::ShaderStages::VERTEX, wgpu::ShaderStages::FRAGMENT] {
        let count =
            |kind: fn(&BindingKind) -> bool| bindings.iter().filter(|b| b.stages.contains(stage) && kind(&b.kind)).count() as u64;
        let mend = "bind fewer, or join some into one";
        let storage = count(|kind| matches!(kind, BindingKind::Storage { .. }));
        limit(what, storage, "max_storage_buffers_per_shader_stage", limits.max_storage_buffers_per_shader_stage.into(), mend)?;
        let uniform = count(|kind| matches!(kind, BindingKind::Uniform { .. }));
        limit(what, uniform, "max_uniform_buffers_per_shader_stage", limits.max_uniform_buffers_per_shader_stage.into(), mend)?;
        let sampled = count(|kind| matches!(kind, BindingKind::Texture { .. }));
        limit(what, sampled, "max_sampled_textures_per_shader_stage", limits.max_sampled_textures_per_shader_stage.into(), mend)?;
        let stored = count(|kind| matches!(kind, BindingKind::StorageTexture { .. }));
        limit(what, stored, "max_storage_textures_per_shader_stage", limits.max_storage_textures_per_shader_stage.into(), mend)?;
        let samplers = count(|kind| matches!(kind, BindingKind::Sampler));
        limit(what, samplers, "max_samplers_per_shader_stage", limits.max_samplers_per_shader_stage.into(), mend)?;
    }
    Ok(())
}
