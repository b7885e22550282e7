//! Compares what a pass declares with what its shader does.

mod layout;

use crate::{
    BufferDesc, Graph, Handle, Resource, Subresources, TextureDesc,
    declaration::{Access, ResourceKind, Write},
    error::{GraphError, PassPlace, did_you_mean, names},
    layout::StructLayout,
    pass::{Calls, Sampler},
    plan::validate,
    reflect::{self, Binding, BindingKind},
    shader::ShaderCore,
};
use layout::compare;
use std::{panic::Location, sync::Arc};
use wgpu::TextureViewDimension as Dimension;

/// One `.read`, `.write` or `.sampler` call.
#[derive(Debug)]
pub(crate) struct Call {
    binding: String,
    target: Target,
    location: &'static Location<'static>,
}

#[derive(Debug)]
enum Target {
    Resource {
        index: usize,
        graph: u64,
        name: Arc<str>,
        write: bool,
        view: View,
    },
    /// An optional input that is not there.
    Nothing,
    Sampler(Sampler),
}

/// How a resource is looked at: in which format, and which part of it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct View {
    pub(crate) format: Option<wgpu::TextureFormat>,
    pub(crate) part: Subresources,
}

impl From<wgpu::TextureFormat> for View {
    fn from(format: wgpu::TextureFormat) -> Self {
        Self { format: Some(format), ..Self::default() }
    }
}

impl From<Subresources> for View {
    fn from(part: Subresources) -> Self {
        Self { part, ..Self::default() }
    }
}

impl Call {
    #[track_caller]
    pub(crate) fn new<T: Resource>(binding: &str, handle: &Handle<T>, write: bool, view: View) -> Self {
        let target = Target::Resource { index: handle.index, graph: handle.graph, name: Arc::clone(&handle.name), write, view };
        Self { binding: binding.to_owned(), target, location: Location::caller() }
    }

    #[track_caller]
    pub(crate) fn nothing(binding: &str) -> Self {
        Self { binding: binding.to_owned(), target: Target::Nothing, location: Location::caller() }
    }

    #[track_caller]
    pub(crate) fn sampler(binding: &str, sampler: Sampler) -> Self {
        Self { binding: binding.to_owned(), target: Target::Sampler(sampler), location: Location::caller() }
    }

    fn resource_name(&self) -> &str {
        match &self.target {
            Target::Resource { name, .. } => name,
            Target::Nothing => "nothing",
            Target::Sampler(_) => "sampler",
        }
    }
}

/// The contents of the uniform `params`.
#[derive(Debug)]
pub(crate) struct Params {
    pub(crate) layout: StructLayout,
    pub(crate) bytes: Vec<u8>,
}

/// What is bound to the shader's binding of the same position in its list.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Bound {
    Params,
    Buffer {
        resource: usize,
    },
    Texture {
        resource: usize,
        format: wgpu::TextureFormat,
        part: Subresources,
    },
    /// Zeros, in place of an optional input.
    Zeros,
    Sampler(Sampler),
}

const PARAMS: &str = "params";

/// Checks all bindings of a pass. Returns one [`Bound`] per binding of the shader, and the pass's accesses.
pub(crate) fn bindings(
    graph: &Graph<'_>,
    core: &ShaderCore,
    calls: &Calls,
    at: &PassPlace,
) -> Result<(Vec<Bound>, Vec<Access>), Vec<GraphError>> {
    let mut errors = Vec::new();
    let mut bound: Vec<Option<Bound>> = vec![None; core.bindings.len()];
    let mut first: Vec<Option<&str>> = vec![None; core.bindings.len()];
    let mut accesses = Vec::new();
    let find = |name: &str| core.bindings.iter().position(|binding| binding.name == name);
    if let Some(params) = &calls.params {
        match find(PARAMS) {
            Some(index) => {
                check_params(params, &core.bindings[index], at, &mut errors);
                bound[index] = Some(Bound::Params);
                first[index] = Some("the argument of `.params`");
            }
            None if core.unused.iter().any(|name| name == PARAMS) => {}
            None => errors.push(unknown(core, PARAMS, at)),
        }
    }
    for call in &calls.bound {
        let at = PassPlace::new(at.pass(), crate::declaration::rust_place(Some(call.location)));
        let Some(index) = find(&call.binding) else {
            match (&call.target, core.unused.contains(&call.binding)) {
                // The module declares it, this entry point leaves it alone: nothing to bind, and no dependency.
                (Target::Resource { write: false, .. } | Target::Nothing | Target::Sampler(_), true) => {}
                (_, true) => errors.push(GraphError::WriteIsNotWritten {
                    at,
                    binding: call.binding.clone(),
                    resource: call.resource_name().to_owned(),
                    shader: core.source.flat.root(),
                }),
                _ => errors.push(unknown(core, &call.binding, &at)),
            }
            continue;
        };
        if let Some(first) = first[index] {
            let (first, second) = (first.to_owned(), call.resource_name().to_owned());
            errors.push(GraphError::BoundTwice { at, binding: call.binding.clone(), first, second });
            continue;
        }
        first[index] = Some(call.resource_name());
        let check = Check { graph, binding: &core.bindings[index], at: &at };
        match check.call(call) {
            Ok((one, access)) => {
                bound[index] = Some(one);
                accesses.extend(access);
            }
            Err(error) => errors.push(error),
        }
    }
    for (index, binding) in core.bindings.iter().enumerate() {
        if first[index].is_none() {
            errors.push(GraphError::Unbound {
                at: at.clone(),
                binding: binding.name.clone(),
                shader: binding.place.clone(),
                kind: binding.describe(),
                mend: binding.mend(),
            });
        }
    }
    conflicts(graph, &accesses, at, &mut errors);
    if errors.is_empty() { Ok((bound.into_iter().flatten().collect(), accesses)) } else { Err(errors) }
}

fn unknown(core: &ShaderCore, binding: &str, at: &PassPlace) -> GraphError {
    let known = || core.bindings.iter().map(|binding| binding.name.as_str());
    let hint = did_you_mean(binding, known());
    GraphError::UnknownBinding {
        at: at.clone(),
        binding: binding.to_owned(),
        shader: core.source.flat.root(),
        known: names(known()),
        hint,
    }
}

/// What one access of a pass writes may have no other access in it.
pub(crate) fn conflicts(graph: &Graph<'_>, accesses: &[Access], at: &PassPlace, errors: &mut Vec<GraphError>) {
    let pairs = accesses.iter().enumerate().flat_map(|(i, first)| accesses[i + 1..].iter().map(move |second| (first, second)));
    let clashes = |a: &Access, b: &Access| a.resource == b.resource && (a.writes() || b.writes()) && a.part.overlaps(b.part);
    let mut told = Vec::new();
    for (first, second) in pairs.filter(|(first, second)| clashes(first, second)) {
        if !told.contains(&first.resource) {
            told.push(first.resource);
            errors.push(GraphError::WriteConflict {
                at: at.clone(),
                resource: graph.declaration.resources[first.resource].name.clone(),
                first: first.binding.clone(),
                second: second.binding.clone(),
            });
        }
    }
}

struct Check<'a> {
    graph: &'a Graph<'a>,
    binding: &'a Binding,
    at: &'a PassPlace,
}

impl Check<'_> {
    fn call(&self, call: &Call) -> Result<(Bound, Option<Access>), GraphError> {
        match &call.target {
            Target::Sampler(sampler) => match self.binding.kind {
                BindingKind::Sampler => Ok((Bound::Sampler(*sampler), None)),
                _ => Err(self.wrong_kind("a sampler", "a sampler")),
            },
            Target::Nothing => match self.binding.kind {
                BindingKind::Uniform { .. } | BindingKind::Storage { read_only: true, .. } | BindingKind::Texture { .. } => {
                    Ok((Bound::Zeros, None))
                }
                _ => Err(self.wrong_kind("an optional input", "nothing, which only what is read can be")),
            },
            Target::Resource { index, graph, name, write, view } => {
                if *graph != self.graph.id {
                    return Err(GraphError::ForeignHandle { at: self.at.clone(), resource: name.to_string() });
                }
                if *write && !self.binding.writes {
                    return Err(GraphError::WriteIsNotWritten {
                        at: self.at.clone(),
                        binding: self.binding.name.clone(),
                        resource: name.to_string(),
                        shader: self.binding.place.clone(),
                    });
                }
                if !*write && self.binding.writes {
                    return Err(GraphError::ReadIsWritten {
                        at: self.at.clone(),
                        binding: self.binding.name.clone(),
                        resource: name.to_string(),
                        shader: self.binding.place.clone(),
                    });
                }
                if let Some(error) = validate::part_error(&self.graph.declaration, *index, view.part, self.at)
                    && !view.part.is_all()
                {
                    return Err(error);
                }
                let (bound, usage, part) = match &self.graph.declaration.resources[*index].kind {
                    ResourceKind::Buffer(desc) => (Bound::Buffer { resource: *index }, self.buffer(name, desc)?, view.part),
                    ResourceKind::Texture(desc) => {
                        let format = view.format.unwrap_or(desc.format);
                        let part = self.part(name, desc, view.part)?;
                        (Bound::Texture { resource: *index, format, part }, self.texture(name, desc, format, part)?, part)
                    }
                };
                let write = if self.binding.writes { Write::Keep } else { Write::No };
                Ok((bound, Some(Access { part, ..Access::new(*index, &self.binding.name, self.binding.reads, write, usage) })))
            }
        }
    }

    fn wrong_kind(&self, resource: &str, given: &str) -> GraphError {
        let mend = match self.binding.kind {
            BindingKind::Uniform { .. } if self.binding.name == PARAMS => "its contents by `.params(&…)`",
            BindingKind::Uniform { .. } | BindingKind::Storage { .. } => "a buffer, or change the WGSL",
            BindingKind::Texture { .. } | BindingKind::StorageTexture { .. } => "a texture, or change the WGSL",
            BindingKind::Sampler => "a sampler by `.sampler(…)`",
        };
        GraphError::Kind {
            at: self.at.clone(),
            binding: self.binding.name.clone(),
            shader: self.binding.place.clone(),
            expected: self.binding.describe().into(),
            resource: resource.to_owned(),
            given: given.into(),
            mend: mend.into(),
        }
    }

    fn buffer(&self, name: &str, desc: &BufferDesc) -> Result<u32, GraphError> {
        let (size, element, usage) = match &self.binding.kind {
            BindingKind::Uniform { size, element } => (*size, element, wgpu::BufferUsages::UNIFORM),
            BindingKind::Storage { size, element, .. } => (*size, element, wgpu::BufferUsages::STORAGE),
            _ => return Err(self.wrong_kind(name, "a buffer")),
        };
        if let Some(layout) = &desc.element {
            compare(layout, element, self.binding, self.at)?;
        }
        if desc.padded() < size {
            return Err(GraphError::BufferTooSmall {
                at: self.at.clone(),
                binding: self.binding.name.clone(),
                shader: self.binding.place.clone(),
                needed: size,
                resource: name.to_owned(),
                given: desc.padded(),
            });
        }
        Ok(usage.bits())
    }

    /// The part that is really bound: a storage texture is one mip level, the first if none is named.
    fn part(&self, name: &str, desc: &TextureDesc, part: Subresources) -> Result<Subresources, GraphError> {
        if !matches!(self.binding.kind, BindingKind::StorageTexture { .. }) || desc.mip_level_count == 1 {
            return Ok(part);
        }
        let mips = part.mips_of(desc.mip_level_count);
        if part.mips == Subresources::ALL.mips {
            return Ok(Subresources { mips: Subresources::mip(0).mips, ..part });
        }
        if mips.len() == 1 {
            return Ok(part);
        }
        Err(GraphError::TextureShape {
            at: self.at.clone(),
            binding: self.binding.name.clone(),
            shader: self.binding.place.clone(),
            expected: "a storage texture, which is one mip level".into(),
            resource: name.to_owned(),
            given: part.to_string().into(),
            mend: "bind one of them".into(),
        })
    }

    fn texture(
        &self,
        name: &str,
        desc: &TextureDesc,
        format: wgpu::TextureFormat,
        part: Subresources,
    ) -> Result<u32, GraphError> {
        let format_name = crate::format::name;
        if format != desc.format && !desc.view_formats.contains(&format) {
            let (format, asked) = (format_name(desc.format), format_name(format));
            return Err(GraphError::ViewFormat { at: self.at.clone(), resource: name.to_owned(), format, asked });
        }
        match self.binding.kind {
            BindingKind::Texture { sample, view, multisampled } => {
                self.shape(name, desc, part, view, multisampled)?;
                self.sample(name, format, sample, view, multisampled)?;
                Ok(wgpu::TextureUsages::TEXTURE_BINDING.bits())
            }
            BindingKind::StorageTexture { format: expected, view, access } => {
                if expected != format {
                    return Err(GraphError::StorageFormat {
                        at: self.at.clone(),
                        binding: self.binding.name.clone(),
                        shader: self.binding.place.clone(),
                        expected: format_name(expected),
                        resource: name.to_owned(),
                        given: format_name(format),
                    });
                }
                self.shape(name, desc, part, view, false)?;
                let atomic = access == wgpu::StorageTextureAccess::Atomic;
                Ok(if atomic { wgpu::TextureUsages::STORAGE_ATOMIC } else { wgpu::TextureUsages::STORAGE_BINDING }.bits())
            }
            _ => Err(self.wrong_kind(name, "a texture")),
        }
    }

    fn shape(
        &self,
        name: &str,
        desc: &TextureDesc,
        part: Subresources,
        view: Dimension,
        multisampled: bool,
    ) -> Result<(), GraphError> {
        let three_d = desc.dimension == wgpu::TextureDimension::D3;
        let layers = part.layers_of(desc.size[2]).len();
        let fits = match view {
            Dimension::D1 => false,
            Dimension::D2 => !three_d && layers == 1,
            Dimension::D2Array => !three_d,
            Dimension::Cube => !three_d && layers == 6,
            Dimension::CubeArray => !three_d && layers.is_multiple_of(6),
            Dimension::D3 => three_d,
        };
        let mend = if !fits {
            if view == Dimension::D2 && !three_d {
                "declare a texture_2d_array in WGSL, or bind one layer (`read_at`, `write_at`)"
            } else {
                "change the size in Rust or the type in WGSL"
            }
        } else if multisampled != (desc.sample_count > 1) {
            "give both the same number of samples, or use the multisampled type in WGSL"
        } else {
            return Ok(());
        };
        let multi = if multisampled { "multisampled " } else { "" };
        Err(GraphError::TextureShape {
            at: self.at.clone(),
            binding: self.binding.name.clone(),
            shader: self.binding.place.clone(),
            expected: format!("{multi}{}", reflect::view_name(view)).into(),
            resource: name.to_owned(),
            given: desc.to_string().into(),
            mend: mend.into(),
        })
    }

    fn sample(
        &self,
        name: &str,
        format: wgpu::TextureFormat,
        expected: wgpu::TextureSampleType,
        view: Dimension,
        multisampled: bool,
    ) -> Result<(), GraphError> {
        use wgpu::TextureSampleType as S;
        let aspect = if format.has_depth_aspect() { Some(wgpu::TextureAspect::DepthOnly) } else { None };
        let given = format.sample_type(aspect, None);
        let fits = match (expected, given) {
            (S::Float { filterable: true }, Some(S::Float { filterable: false })) => {
                return Err(GraphError::NotFilterable {
                    at: self.at.clone(),
                    binding: self.binding.name.clone(),
                    shader: self.binding.place.clone(),
                    resource: name.to_owned(),
                    format: crate::format::name(format),
                });
            }
            (S::Float { .. }, Some(S::Float { .. }))
            | (S::Uint, Some(S::Uint))
            | (S::Sint, Some(S::Sint))
            | (S::Depth, Some(S::Depth)) => true,
            _ => false,
        };
        if fits {
            return Ok(());
        }
        let kind = match given {
            Some(S::Uint) => "u32",
            Some(S::Sint) => "i32",
            Some(S::Depth) => "depth",
            _ => "f32",
        };
        Err(GraphError::SampleKind {
            at: self.at.clone(),
            binding: self.binding.name.clone(),
            shader: self.binding.place.clone(),
            expected: self.binding.describe().into(),
            resource: name.into(),
            format: crate::format::name(format).into(),
            given: kind.into(),
            mend: reflect::texture_type(given.unwrap_or(S::Float { filterable: false }), view, multisampled).into(),
        })
    }
}

fn check_params(params: &Params, binding: &Binding, at: &PassPlace, errors: &mut Vec<GraphError>) {
    let BindingKind::Uniform { element, .. } = &binding.kind else {
        errors.push(GraphError::Kind {
            at: at.clone(),
            binding: PARAMS.to_owned(),
            shader: binding.place.clone(),
            expected: binding.describe().into(),
            resource: params.layout.name.to_owned(),
            given: "the argument of `.params`".into(),
            mend: "`var<uniform> params` in the WGSL".into(),
        });
        return;
    };
    errors.extend(compare(&params.layout, element, binding, at).err());
}
