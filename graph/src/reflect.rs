//! What an entry point binds and really does with it, by naga.

use crate::{
    error::{ShaderError, ShaderPlace, names},
    wgsl::FlatWgsl,
};
use naga::{
    AddressSpace, GlobalVariable, ImageClass, ImageDimension, Module, ShaderStage, StorageAccess, TypeInner,
    proc::Layouter,
    valid::{GlobalUse, ModuleInfo},
};
use std::{collections::HashMap, sync::Arc};
use wgpu::TextureViewDimension as View;

/// A field of a WGSL struct (bytes).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FieldShape {
    pub(crate) name: String,
    pub(crate) offset: usize,
    pub(crate) size: usize,
}

/// A WGSL struct (bytes); `size` is the stride when it stands in an array.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StructShape {
    pub(crate) name: String,
    pub(crate) size: usize,
    pub(crate) fields: Vec<FieldShape>,
}

/// What one element of a buffer is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Element {
    Struct(StructShape),
    /// No struct: the type in words.
    Plain(String),
    /// A struct that ends in a runtime-sized array: no Rust struct describes it.
    Tail(String),
}

/// What kind of thing a binding is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum BindingKind {
    Uniform { size: u64, element: Element },
    Storage { read_only: bool, size: u64, element: Element },
    Texture { sample: wgpu::TextureSampleType, view: View, multisampled: bool },
    StorageTexture { format: wgpu::TextureFormat, access: wgpu::StorageTextureAccess, view: View },
    Sampler,
    AccelerationStructure,
}

/// One global variable as an entry point uses it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Binding {
    pub(crate) name: Arc<str>,
    pub(crate) group: u32,
    pub(crate) number: u32,
    pub(crate) kind: BindingKind,
    pub(crate) reads: bool,
    pub(crate) writes: bool,
    pub(crate) stages: wgpu::ShaderStages,
    pub(crate) place: ShaderPlace,
}

impl Binding {
    /// Whether WGSL declares the buffer `read_write`, whatever the entry point does with it.
    pub(crate) fn is_read_write(&self) -> bool {
        matches!(self.kind, BindingKind::Storage { read_only: false, .. })
    }

    /// The WGSL declaration in words.
    pub(crate) fn describe(&self) -> String {
        match &self.kind {
            BindingKind::Uniform { .. } => "a uniform buffer".to_owned(),
            BindingKind::Storage { read_only: true, .. } => "a storage buffer (read)".to_owned(),
            BindingKind::Storage { .. } => "a storage buffer (read_write)".to_owned(),
            BindingKind::Texture { sample, view, multisampled } => texture_type(*sample, *view, *multisampled),
            BindingKind::StorageTexture { format, view, .. } => {
                format!("texture_storage_{}<{}>", view_name(*view), crate::format::name(*format))
            }
            BindingKind::Sampler => "a sampler".to_owned(),
            BindingKind::AccelerationStructure => "an acceleration structure".to_owned(),
        }
    }

    /// The builder call that would bind it.
    pub(crate) fn mend(&self) -> String {
        let name = &self.name;
        match &self.kind {
            BindingKind::Uniform { .. } => "`.params(&…)`".to_owned(),
            BindingKind::Sampler => format!("`.sampler(\"{name}\", …)`"),
            _ if self.writes => format!("`.write(\"{name}\", &mut …)`"),
            _ => format!("`.read(\"{name}\", &…)`"),
        }
    }
}

/// WGSL's spelling of a sampled texture type.
pub(crate) fn texture_type(sample: wgpu::TextureSampleType, view: View, multisampled: bool) -> String {
    let multi = if multisampled { "multisampled_" } else { "" };
    let view = view_name(view);
    match sample {
        wgpu::TextureSampleType::Depth => format!("texture_depth_{multi}{view}"),
        wgpu::TextureSampleType::Uint => format!("texture_{multi}{view}<u32>"),
        wgpu::TextureSampleType::Sint => format!("texture_{multi}{view}<i32>"),
        wgpu::TextureSampleType::Float { .. } => format!("texture_{multi}{view}<f32>"),
    }
}

/// `2d`, `2d_array` and so on.
pub(crate) fn view_name(view: View) -> &'static str {
    match view {
        View::D1 => "1d",
        View::D2 => "2d",
        View::D2Array => "2d_array",
        View::Cube => "cube",
        View::CubeArray => "cube_array",
        View::D3 => "3d",
    }
}

/// A member of the fragment stage's output struct.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Output {
    pub(crate) name: String,
    pub(crate) location: u32,
    /// What it writes: float, uint or sint.
    pub(crate) sample: wgpu::TextureSampleType,
    pub(crate) components: u8,
}

/// One entry point.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) bindings: Vec<Binding>,
    /// Bindings the module declares and this entry point does not use.
    pub(crate) unused: Vec<String>,
    pub(crate) outputs: Vec<Output>,
    pub(crate) writes_depth: bool,
    /// Bytes of `var<workgroup>` the module declares.
    pub(crate) workgroup_bytes: u64,
}

/// A parsed and validated module.
#[derive(Debug)]
pub(crate) struct Reflected {
    pub(crate) module: Module,
    pub(crate) info: ModuleInfo,
}

/// Parses and validates `flat` within `WebGPU`'s portable subset, ray queries, which WGSL asks for by `enable`, and atomic floats, which it
/// asks for by their type.
pub(crate) fn parse(flat: &FlatWgsl) -> Result<Reflected, ShaderError> {
    let source = flat.source();
    let module = naga::front::wgsl::parse_str(source).map_err(|error| {
        let span = error.labels().map(|(span, _)| span).find(naga::Span::is_defined).unwrap_or_default();
        let detail: Vec<&str> = error.labels().map(|(_, text)| text).filter(|text| !error.message().contains(text)).collect();
        let notes: Vec<&str> = error.notes().collect();
        let message = [error.message(), &detail.join(", "), &notes.join(", ")]
            .iter()
            .filter(|part| !part.is_empty())
            .map(ToString::to_string)
            .collect::<Vec<_>>();
        ShaderError::Parse { place: flat.place(span), message: message.join(": ") }
    })?;
    let mut validator = wgpu_naga_bridge::create_validator(
        wgpu::Features::EXPERIMENTAL_RAY_QUERY | wgpu::Features::SHADER_FLOAT32_ATOMIC,
        wgpu::DownlevelFlags::all(),
        naga::valid::ValidationFlags::all(),
    );
    let info = validator.validate(&module).map_err(|error| {
        let span = error.spans().map(|(span, _)| *span).find(naga::Span::is_defined).unwrap_or_default();
        ShaderError::Validation { place: flat.place(span), message: chain(error.as_inner()) }
    })?;
    Ok(Reflected { module, info })
}

/// An error and its causes in one line: what a message says of an error that is another library's.
pub fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text = text + ": " + &cause.to_string();
        source = cause.source();
    }
    text
}

/// What the entry point `name` of `stage` binds.
pub(crate) fn entry(reflected: &Reflected, flat: &FlatWgsl, stage: ShaderStage, name: &str) -> Result<Entry, ShaderError> {
    let Reflected { module, info } = reflected;
    let Some(index) = module.entry_points.iter().position(|entry| entry.stage == stage && entry.name == name) else {
        let known = names(module.entry_points.iter().map(|entry| entry.name.as_str()));
        return Err(ShaderError::EntryPoint {
            place: flat.root(),
            stage: format!("{stage:?}").to_lowercase(),
            entry: name.to_owned(),
            known,
        });
    };
    let function = info.get_entry_point(index);
    let mut layouter = Layouter::default();
    layouter.update(module.to_ctx()).map_err(|error| ShaderError::Validation { place: flat.root(), message: chain(&error) })?;
    let mut bindings: Vec<Binding> = Vec::new();
    let mut unused = Vec::new();
    let mut workgroup_bytes = 0;
    let mut slots: HashMap<(u32, u32), String> = HashMap::new();
    for (handle, variable) in module.global_variables.iter() {
        let uses = function[handle];
        let Some(slot) = variable.binding else {
            if variable.space == AddressSpace::WorkGroup && !uses.is_empty() {
                workgroup_bytes += u64::from(layouter[variable.ty].size);
            }
            continue;
        };
        let name = variable.name.clone().unwrap_or_default();
        if uses.is_empty() {
            unused.push(name);
            continue;
        }
        let place = flat.place(module.global_variables.get_span(handle));
        if let Some(other) = slots.insert((slot.group, slot.binding), name.clone()) {
            return Err(ShaderError::SameSlot { place, binding: name, other, group: slot.group, number: slot.binding });
        }
        let filtered = function.sampling_set.iter().any(|key| key.image == handle);
        let kind = kind(module, &layouter, variable, filtered).map_err(|what| ShaderError::Unsupported {
            place: place.clone(),
            binding: name.clone(),
            what,
        })?;
        bindings.push(Binding {
            name: name.into(),
            group: slot.group,
            number: slot.binding,
            kind,
            reads: uses.intersects(GlobalUse::READ | GlobalUse::ATOMIC) || !uses.contains(GlobalUse::WRITE),
            writes: uses.intersects(GlobalUse::WRITE | GlobalUse::ATOMIC),
            stages: wgpu_naga_bridge::map_naga_stage(stage),
            place,
        });
    }
    let (outputs, writes_depth) =
        if stage == ShaderStage::Fragment { outputs(module, index, flat)? } else { (Vec::new(), false) };
    Ok(Entry { bindings, unused, outputs, writes_depth, workgroup_bytes })
}

fn view(dimension: ImageDimension, arrayed: bool) -> View {
    match (dimension, arrayed) {
        (ImageDimension::D1, _) => View::D1,
        (ImageDimension::D2, false) => View::D2,
        (ImageDimension::D2, true) => View::D2Array,
        (ImageDimension::D3, _) => View::D3,
        (ImageDimension::Cube, false) => View::Cube,
        (ImageDimension::Cube, true) => View::CubeArray,
    }
}

fn kind(module: &Module, layouter: &Layouter, variable: &GlobalVariable, filtered: bool) -> Result<BindingKind, String> {
    let inner = &module.types[variable.ty].inner;
    let size = u64::from(layouter[variable.ty].size);
    match (variable.space, inner) {
        (_, TypeInner::BindingArray { .. }) => Err("an array of bindings".to_owned()),
        (AddressSpace::Uniform, _) => Ok(BindingKind::Uniform { size, element: element(module, layouter, variable.ty) }),
        (AddressSpace::Storage { access }, _) => Ok(BindingKind::Storage {
            read_only: !access.contains(StorageAccess::STORE),
            size,
            element: element(module, layouter, variable.ty),
        }),
        (_, TypeInner::Sampler { comparison: false }) => Ok(BindingKind::Sampler),
        (_, TypeInner::Sampler { comparison: true }) => Err("a comparison sampler".to_owned()),
        (_, &TypeInner::Image { dim, arrayed, class }) => {
            let view = view(dim, arrayed);
            match class {
                ImageClass::Sampled { kind, multi } => {
                    let sample = match kind {
                        naga::ScalarKind::Sint => wgpu::TextureSampleType::Sint,
                        naga::ScalarKind::Uint => wgpu::TextureSampleType::Uint,
                        _ => wgpu::TextureSampleType::Float { filterable: filtered && !multi },
                    };
                    Ok(BindingKind::Texture { sample, view, multisampled: multi })
                }
                ImageClass::Depth { multi } => {
                    Ok(BindingKind::Texture { sample: wgpu::TextureSampleType::Depth, view, multisampled: multi })
                }
                ImageClass::Storage { format, access } => Ok(BindingKind::StorageTexture {
                    format: wgpu_naga_bridge::map_storage_format_from_naga(format),
                    access: match (access.contains(StorageAccess::LOAD), access.contains(StorageAccess::STORE)) {
                        _ if access.contains(StorageAccess::ATOMIC) => wgpu::StorageTextureAccess::Atomic,
                        (true, false) => wgpu::StorageTextureAccess::ReadOnly,
                        (true, true) => wgpu::StorageTextureAccess::ReadWrite,
                        _ => wgpu::StorageTextureAccess::WriteOnly,
                    },
                    view,
                }),
                ImageClass::External => Err("an external texture".to_owned()),
            }
        }
        (_, TypeInner::AccelerationStructure { vertex_return: false }) => Ok(BindingKind::AccelerationStructure),
        (_, TypeInner::AccelerationStructure { vertex_return: true }) => {
            Err("an acceleration structure that returns vertices".to_owned())
        }
        (space, _) => Err(format!("address space {space:?}")),
    }
}

/// The element of a buffer type: arrays are looked through, once.
fn element(module: &Module, layouter: &Layouter, ty: naga::Handle<naga::Type>) -> Element {
    let (ty, stride) = match module.types[ty].inner {
        TypeInner::Array { base, stride, .. } => (base, stride as usize),
        _ => (ty, layouter[ty].size as usize),
    };
    let described = &module.types[ty];
    let TypeInner::Struct { members, .. } = &described.inner else {
        return Element::Plain(type_name(module, ty));
    };
    let name = described.name.clone().unwrap_or_default();
    if let Some(last) = members.last()
        && matches!(module.types[last.ty].inner, TypeInner::Array { size: naga::ArraySize::Dynamic, .. })
    {
        return Element::Tail(name);
    }
    let fields = members
        .iter()
        .map(|member| FieldShape {
            name: member.name.clone().unwrap_or_default(),
            offset: member.offset as usize,
            size: layouter[member.ty].size as usize,
        })
        .collect();
    Element::Struct(StructShape { name, size: stride, fields })
}

fn type_name(module: &Module, ty: naga::Handle<naga::Type>) -> String {
    let scalar = |scalar: naga::Scalar| match scalar.kind {
        naga::ScalarKind::Sint => format!("i{}", scalar.width * 8),
        naga::ScalarKind::Uint => format!("u{}", scalar.width * 8),
        naga::ScalarKind::Bool => "bool".to_owned(),
        _ => format!("f{}", scalar.width * 8),
    };
    match &module.types[ty].inner {
        TypeInner::Scalar(value) => scalar(*value),
        TypeInner::Atomic(value) => format!("atomic<{}>", scalar(*value)),
        TypeInner::Vector { size, scalar: value } => format!("vec{}<{}>", *size as u8, scalar(*value)),
        TypeInner::Matrix { columns, rows, scalar: value } => {
            format!("mat{}x{}<{}>", *columns as u8, *rows as u8, scalar(*value))
        }
        TypeInner::Array { base, .. } => format!("array<{}>", type_name(module, *base)),
        _ => module.types[ty].name.clone().unwrap_or_else(|| "value".to_owned()),
    }
}

/// The fragment stage's colour outputs by member name, and whether it writes depth.
fn outputs(module: &Module, index: usize, flat: &FlatWgsl) -> Result<(Vec<Output>, bool), ShaderError> {
    let entry = &module.entry_points[index];
    let Some(result) = &entry.function.result else { return Ok((Vec::new(), false)) };
    let refuse = || ShaderError::FragmentOutput { place: flat.root(), entry: entry.name.clone() };
    let TypeInner::Struct { members, .. } = &module.types[result.ty].inner else {
        let depth = matches!(result.binding, Some(naga::Binding::BuiltIn(naga::BuiltIn::FragDepth)));
        return if depth { Ok((Vec::new(), true)) } else { Err(refuse()) };
    };
    let mut depth = false;
    let mut found = Vec::new();
    for member in members {
        match member.binding {
            Some(naga::Binding::BuiltIn(naga::BuiltIn::FragDepth)) => depth = true,
            Some(naga::Binding::Location { location, .. }) => {
                let (scalar, components) = match module.types[member.ty].inner {
                    TypeInner::Scalar(scalar) => (scalar, 1),
                    TypeInner::Vector { size, scalar } => (scalar, size as u8),
                    _ => return Err(refuse()),
                };
                let sample = match scalar.kind {
                    naga::ScalarKind::Uint => wgpu::TextureSampleType::Uint,
                    naga::ScalarKind::Sint => wgpu::TextureSampleType::Sint,
                    _ => wgpu::TextureSampleType::Float { filterable: false },
                };
                found.push(Output { name: member.name.clone().unwrap_or_default(), location, sample, components });
            }
            _ => {}
        }
    }
    found.sort_by_key(|output| output.location);
    Ok((found, depth))
}
