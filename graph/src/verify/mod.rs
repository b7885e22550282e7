//! Compares what a pass declares with what its shader does.

mod layout;

use crate::{
    BufferDesc, Graph, Handle, Resource, Subresources, TextureDesc,
    declaration::{Access, ResourceKind, Write},
    error::{GraphError, PassRef, did_you_mean, names},
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
    variable: Variable,
    target: Target,
    location: &'static Location<'static>,
}

/// The variable a call names.
#[derive(Debug)]
enum Variable {
    /// Index among the shader's bindings.
    Bound(usize),
    /// Index among the bindings that the module has and the entry point leaves alone.
    Unused(usize),
    Unknown(String),
}

impl Variable {
    fn find(core: &ShaderCore, name: &str) -> Self {
        match core.bindings.iter().position(|binding| *binding.name == *name) {
            Some(index) => Self::Bound(index),
            None => match core.unused.iter().position(|unused| *unused == *name) {
                Some(index) => Self::Unused(index),
                None => Self::Unknown(name.to_owned()),
            },
        }
    }
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
    pub(crate) fn new<T: Resource>(core: &ShaderCore, binding: &str, handle: &Handle<T>, write: bool, view: View) -> Self {
        let target = Target::Resource { index: handle.index, graph: handle.graph, name: Arc::clone(&handle.name), write, view };
        Self { variable: Variable::find(core, binding), target, location: Location::caller() }
    }

    #[track_caller]
    pub(crate) fn nothing(core: &ShaderCore, binding: &str) -> Self {
        Self { variable: Variable::find(core, binding), target: Target::Nothing, location: Location::caller() }
    }

    #[track_caller]
    pub(crate) fn sampler(core: &ShaderCore, binding: &str, sampler: Sampler) -> Self {
        Self { variable: Variable::find(core, binding), target: Target::Sampler(sampler), location: Location::caller() }
    }

    fn resource_name(&self) -> &str {
        match &self.target {
            Target::Resource { name, .. } => name,
            Target::Nothing => "nothing",
            Target::Sampler(_) => "sampler",
        }
    }
}

/// Bytes of a graph's params.
pub(crate) type ParamsRange = std::ops::Range<u64>;

/// The contents of the uniform `params`.
#[derive(Debug)]
pub(crate) struct Params {
    pub(crate) layout: StructLayout,
    /// Where they lie among the graph's params (bytes).
    pub(crate) range: ParamsRange,
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
    Tlas {
        resource: usize,
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
    at: PassRef<'_>,
) -> Result<(Vec<Bound>, Vec<Access>), Vec<GraphError>> {
    let mut errors = Vec::new();
    let mut bound: Vec<Option<Bound>> = vec![None; core.bindings.len()];
    let mut accesses = Vec::with_capacity(calls.bound.len() + 2);
    if let Some(params) = &calls.params {
        match Variable::find(core, PARAMS) {
            Variable::Bound(index) => {
                check_params(params, &core.bindings[index], at, &mut errors);
                bound[index] = Some(Bound::Params);
            }
            Variable::Unused(_) => {}
            Variable::Unknown(name) => errors.push(unknown(core, &name, at)),
        }
    }
    for call in &calls.bound {
        let at = at.at(call.location);
        let index = match (&call.variable, &call.target) {
            (Variable::Bound(index), _) => *index,
            (Variable::Unknown(name), _) => {
                errors.push(unknown(core, name, at));
                continue;
            }
            (Variable::Unused(unused), Target::Resource { write: true, name, .. }) => {
                errors.push(GraphError::WriteIsNotWritten {
                    at: at.place(),
                    binding: core.unused[*unused].clone(),
                    resource: name.to_string(),
                    shader: core.source.flat.root(),
                });
                continue;
            }
            // The module declares it, this entry point leaves it alone: nothing to bind, and no dependency.
            (Variable::Unused(_), _) => continue,
        };
        let binding = &core.bindings[index];
        if bound[index].is_some() {
            let earlier = calls.bound.iter().find(|other| matches!(other.variable, Variable::Bound(i) if i == index));
            let first =
                earlier.filter(|earlier| !std::ptr::eq(*earlier, call)).map_or("the argument of `.params`", Call::resource_name);
            let (binding, first, second) = (binding.name.to_string(), first.to_owned(), call.resource_name().to_owned());
            errors.push(GraphError::BoundTwice { at: at.place(), binding, first, second });
            continue;
        }
        let check = Check { graph, binding, at };
        match check.call(call) {
            Ok((one, access)) => {
                bound[index] = Some(one);
                accesses.extend(access);
            }
            Err(error) => errors.push(error),
        }
    }
    if bound.iter().any(Option::is_none) {
        let called = |index| calls.bound.iter().any(|call| matches!(call.variable, Variable::Bound(other) if other == index));
        for (_, binding) in core.bindings.iter().enumerate().filter(|(index, _)| bound[*index].is_none() && !called(*index)) {
            errors.push(GraphError::Unbound {
                at: at.place(),
                binding: binding.name.to_string(),
                shader: binding.place.clone(),
                kind: binding.describe(),
                mend: binding.mend(),
            });
        }
    }
    conflicts(graph, &accesses, at, &mut errors);
    if !errors.is_empty() {
        return Err(errors);
    }
    // All are there; unlike `flatten`, this collects in place.
    Ok((bound.into_iter().map_while(|bound| bound).collect(), accesses))
}

fn unknown(core: &ShaderCore, binding: &str, at: PassRef<'_>) -> GraphError {
    let known = || core.bindings.iter().map(|binding| &*binding.name);
    let hint = did_you_mean(binding, known());
    GraphError::UnknownBinding {
        at: at.place(),
        binding: binding.to_owned(),
        shader: core.source.flat.root(),
        known: names(known()),
        hint,
    }
}

/// What one access of a pass writes, or WGSL says it may, can have no other access in it.
pub(crate) fn conflicts(graph: &Graph<'_>, accesses: &[Access], at: PassRef<'_>, errors: &mut Vec<GraphError>) {
    let pairs = accesses.iter().enumerate().flat_map(|(i, first)| accesses[i + 1..].iter().map(move |second| (first, second)));
    let clashes = |a: &Access, b: &Access| {
        a.resource == b.resource && (a.writes() || b.writes() || a.exclusive != b.exclusive) && a.part.overlaps(b.part)
    };
    let mut told = Vec::new();
    for (first, second) in pairs.filter(|(first, second)| clashes(first, second)) {
        if !told.contains(&first.resource) {
            told.push(first.resource);
            errors.push(GraphError::WriteConflict {
                at: at.place(),
                resource: graph.declaration.resources[first.resource].name.to_string(),
                first: first.binding.to_string(),
                second: second.binding.to_string(),
            });
        }
    }
}

struct Check<'a> {
    graph: &'a Graph<'a>,
    binding: &'a Binding,
    at: PassRef<'a>,
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
                    return Err(GraphError::ForeignHandle { at: self.at.place(), resource: name.to_string() });
                }
                if *write && !self.binding.writes {
                    return Err(GraphError::WriteIsNotWritten {
                        at: self.at.place(),
                        binding: self.binding.name.to_string(),
                        resource: name.to_string(),
                        shader: self.binding.place.clone(),
                    });
                }
                if !*write && self.binding.writes {
                    return Err(GraphError::ReadIsWritten {
                        at: self.at.place(),
                        binding: self.binding.name.to_string(),
                        resource: name.to_string(),
                        shader: self.binding.place.clone(),
                    });
                }
                if let Some(error) = validate::part_error(&self.graph.declaration, *index, view.part, self.at) {
                    return Err(error);
                }
                let (bound, usage, part) = match &self.graph.declaration.resources[*index].kind {
                    ResourceKind::Buffer(desc) => (Bound::Buffer { resource: *index }, self.buffer(name, desc)?, view.part),
                    ResourceKind::Texture(desc) => {
                        let format = view.format.unwrap_or(desc.format);
                        let part = self.part(name, desc, view.part)?;
                        (Bound::Texture { resource: *index, format, part }, self.texture(name, desc, format, part)?, part)
                    }
                    ResourceKind::Tlas if self.binding.kind == BindingKind::AccelerationStructure => {
                        (Bound::Tlas { resource: *index }, 0, view.part)
                    }
                    ResourceKind::Tlas => return Err(self.wrong_kind(name, "an acceleration structure")),
                };
                let write = if self.binding.writes { Write::Keep } else { Write::No };
                Ok((
                    bound,
                    Some(Access {
                        part,
                        exclusive: !self.binding.writes && self.binding.is_read_write(),
                        ..Access::new(*index, Arc::clone(&self.binding.name), self.binding.reads, write, usage)
                    }),
                ))
            }
        }
    }

    fn wrong_kind(&self, resource: &str, given: &str) -> GraphError {
        let mend = match self.binding.kind {
            BindingKind::Uniform { .. } if *self.binding.name == *PARAMS => "its contents by `.params(&…)`",
            BindingKind::Uniform { .. } | BindingKind::Storage { .. } => "a buffer, or change the WGSL",
            BindingKind::Texture { .. } | BindingKind::StorageTexture { .. } => "a texture, or change the WGSL",
            BindingKind::Sampler => "a sampler by `.sampler(…)`",
            BindingKind::AccelerationStructure => "what `import_tlas` returns",
        };
        GraphError::Kind {
            at: self.at.place(),
            binding: self.binding.name.to_string(),
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
                at: self.at.place(),
                binding: self.binding.name.to_string(),
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
            at: self.at.place(),
            binding: self.binding.name.to_string(),
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
            return Err(GraphError::ViewFormat { at: self.at.place(), resource: name.to_owned(), format, asked });
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
                        at: self.at.place(),
                        binding: self.binding.name.to_string(),
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
            at: self.at.place(),
            binding: self.binding.name.to_string(),
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
                    at: self.at.place(),
                    binding: self.binding.name.to_string(),
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
            at: self.at.place(),
            binding: self.binding.name.to_string(),
            shader: self.binding.place.clone(),
            expected: self.binding.describe().into(),
            resource: name.into(),
            format: crate::format::name(format).into(),
            given: kind.into(),
            mend: reflect::texture_type(given.unwrap_or(S::Float { filterable: false }), view, multisampled).into(),
        })
    }
}

fn check_params(params: &Params, binding: &Binding, at: PassRef<'_>, errors: &mut Vec<GraphError>) {
    let BindingKind::Uniform { element, .. } = &binding.kind else {
        errors.push(GraphError::Kind {
            at: at.place(),
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
