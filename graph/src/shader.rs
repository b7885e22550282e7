//! Shaders, parsed, validated and reflected without a device.

use crate::{
    error::{ShaderError, names},
    reflect::{self, Binding, Entry, Reflected},
    reload::Follower,
    sources::{Parsed, WgslSources},
    wgsl::FlatWgsl,
};
use naga::ShaderStage;
use std::{
    collections::HashMap,
    hash::{DefaultHasher, Hash, Hasher},
    sync::Arc,
};

/// One WGSL text, shared by the shaders made from it.
#[derive(Debug)]
pub(crate) struct Source {
    pub(crate) flat: FlatWgsl,
    pub(crate) reflected: Reflected,
    /// Of the text.
    hash: u64,
}

impl Source {
    /// Parses and validates `flat`.
    pub(crate) fn parse(flat: FlatWgsl) -> Result<Self, ShaderError> {
        let reflected = reflect::parse(&flat)?;
        let mut hasher = DefaultHasher::new();
        flat.source().hash(&mut hasher);
        Ok(Self { flat, reflected, hash: hasher.finish() })
    }
}

/// What compute and raster shaders share. Two shaders with equal identities compile to the same pipeline.
#[derive(Clone, Debug)]
pub(crate) struct ShaderCore {
    pub(crate) label: Arc<str>,
    pub(crate) source: Arc<Source>,
    pub(crate) constants: Arc<[(String, f64)]>,
    pub(crate) bindings: Arc<[Binding]>,
    pub(crate) unused: Arc<[String]>,
    hash: u64,
}

impl PartialEq for ShaderCore {
    fn eq(&self, other: &Self) -> bool {
        self.hash == other.hash
            && self.label == other.label
            && (Arc::ptr_eq(&self.source, &other.source) || self.source.flat.source() == other.source.flat.source())
            && self.constants.len() == other.constants.len()
            && self.constants.iter().zip(other.constants.iter()).all(|(a, b)| (&a.0, a.1.to_bits()) == (&b.0, b.1.to_bits()))
    }
}

impl Eq for ShaderCore {}

impl Hash for ShaderCore {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.hash.hash(state);
    }
}

impl ShaderCore {
    fn new(label: &str, source: Arc<Source>, bindings: Vec<Binding>, unused: Vec<String>) -> Self {
        let mut core = Self {
            label: Arc::from(label),
            source,
            constants: Arc::new([]),
            bindings: bindings.into(),
            unused: unused.into(),
            hash: 0,
        };
        core.rehash();
        core
    }

    fn rehash(&mut self) {
        let mut hasher = DefaultHasher::new();
        self.label.hash(&mut hasher);
        self.source.hash.hash(&mut hasher);
        for (name, value) in self.constants.iter() {
            (name, value.to_bits()).hash(&mut hasher);
        }
        self.hash = hasher.finish();
    }

    fn set_constant(&mut self, name: &str, value: f64) -> Result<(), ShaderError> {
        let overrides = &self.source.reflected.module.overrides;
        let refuse = |message: &str| ShaderError::Constant {
            place: self.source.flat.root(),
            name: name.to_owned(),
            value,
            message: message.to_owned(),
            known: names(overrides.iter().filter_map(|(_, o)| o.name.as_deref())),
        };
        let Some((_, found)) = overrides.iter().find(|(_, o)| o.name.as_deref() == Some(name)) else {
            return Err(refuse("no such override"));
        };
        if !value.is_finite() {
            return Err(refuse("must be finite"));
        }
        // wgpu keys an override with `@id` by that number.
        let key = found.id.map_or_else(|| name.to_owned(), |id| id.to_string());
        let mut constants = self.constants.to_vec();
        constants.retain(|(other, _)| *other != key);
        constants.push((key, value));
        constants.sort_by(|a, b| a.0.cmp(&b.0));
        self.constants = constants.into();
        self.rehash();
        Ok(())
    }

    /// Whether the entry points use the variable `binding`.
    pub(crate) fn uses(&self, binding: &str) -> bool {
        self.bindings.iter().any(|found| *found.name == *binding)
    }

    pub(crate) fn constants(&self) -> Vec<(&str, f64)> {
        self.constants.iter().map(|(name, value)| (name.as_str(), *value)).collect()
    }

    /// The module with this shader's constants put in; refuses values that do not fit.
    fn specialised(&self, stage: ShaderStage, entry: &str) -> Result<[u32; 3], ShaderError> {
        let constants: naga::back::PipelineConstants = self.constants.iter().cloned().collect();
        let Reflected { module, info } = &self.source.reflected;
        let (module, _) = naga::back::pipeline_constants::process_overrides(module, info, Some((stage, entry)), &constants)
            .map_err(|error| {
                let (name, value) = self.constants.last().cloned().unwrap_or_default();
                ShaderError::Constant {
                    place: self.source.flat.root(),
                    name,
                    value,
                    message: reflect::chain(&error),
                    known: names(self.source.reflected.module.overrides.iter().filter_map(|(_, o)| o.name.as_deref())),
                }
            })?;
        let found = module.entry_points.iter().find(|e| e.stage == stage && e.name == entry);
        Ok(found.map_or([1; 3], |e| e.workgroup_size))
    }
}

/// The file's name without folder and ending.
pub(crate) fn stem(path: &str) -> &str {
    let file = path.rsplit('/').next().unwrap_or(path);
    file.strip_suffix(".wgsl").unwrap_or(file)
}

/// A kind of shader, as a set of sources makes it.
pub(crate) trait Shader: Clone + Send + Sync + 'static {
    /// The shader of `source` whose entry points are named after `label`.
    fn build(label: &str, source: Arc<Source>) -> Result<Self, ShaderError>;
    /// The same with a constant.
    fn set_constant(self, name: &str, value: f64) -> Result<Self, ShaderError>;
    /// Where shaders of this kind are kept.
    fn shelf(parsed: &mut Parsed) -> &mut HashMap<String, Self>;
    fn core(&self) -> &ShaderCore;
}

/// A compute entry point, parsed, validated and reflected; cheap to clone, needs no device.
#[derive(Clone, Debug)]
pub struct ComputeShader {
    pub(crate) core: Arc<ShaderCore>,
    workgroup_size: [u32; 3],
    pub(crate) workgroup_bytes: u64,
    live: Option<Arc<Follower<Self>>>,
}

impl ComputeShader {
    /// The shader in the file `path` of `sources`; its entry point and label are the file's stem.
    ///
    /// # Errors
    /// If a file is missing, the WGSL is invalid, or there is no such entry point.
    pub fn new(sources: &WgslSources, path: &str) -> Result<Self, ShaderError> {
        let Some(live) = sources.live() else { return sources.shader(path) };
        let (shader, follower) = live.shader::<Self>(path)?;
        Ok(Self { live: Some(follower), ..shader })
    }

    /// The shader in the text `wgsl`; its entry point is `label`.
    ///
    /// # Errors
    /// If the WGSL is invalid or there is no such entry point.
    pub fn from_wgsl(label: &str, wgsl: &str) -> Result<Self, ShaderError> {
        Self::build(label, Arc::new(Source::parse(FlatWgsl::single(label, wgsl))?))
    }

    /// The shader with the WGSL `override` `name` set.
    ///
    /// # Errors
    /// If there is no such override or the value does not fit its type.
    pub fn with_constant(self, name: &str, value: f64) -> Result<Self, ShaderError> {
        let Some(live) = &self.live else { return self.set_constant(name, value) };
        let (shader, follower) = live.with_constant(name, value)?;
        Ok(Self { live: Some(follower), ..shader })
    }

    /// The shader as its files are now: of a live set, the version that the last good
    /// [`WgslSources::poll`](crate::WgslSources::poll) took up, and otherwise itself. Passes take it by themselves.
    pub fn latest(&self) -> Self {
        self.live.as_ref().map_or_else(|| self.clone(), |live| live.latest())
    }

    /// The label: the entry point's name.
    pub fn label(&self) -> &str {
        &self.core.label
    }

    /// Invocations of one workgroup in x, y and z.
    pub fn workgroup_size(&self) -> [u32; 3] {
        self.live.as_ref().map_or(self.workgroup_size, |live| live.latest().workgroup_size)
    }

    /// The flattened WGSL that this value was made from.
    pub fn wgsl(&self) -> &str {
        self.core.source.flat.source()
    }
}

impl Shader for ComputeShader {
    fn build(label: &str, source: Arc<Source>) -> Result<Self, ShaderError> {
        let Entry { bindings, unused, workgroup_bytes, .. } =
            reflect::entry(&source.reflected, &source.flat, ShaderStage::Compute, label)?;
        let index = source.reflected.module.entry_points.iter().position(|e| e.name == label);
        let declared = index.map_or([1; 3], |i| source.reflected.module.entry_points[i].workgroup_size);
        let core = ShaderCore::new(label, source, bindings, unused);
        // Overrides without a default have no value yet: then the size stays as declared until they get one.
        let workgroup_size = core.specialised(ShaderStage::Compute, label).unwrap_or(declared);
        Ok(Self { core: Arc::new(core), workgroup_size, workgroup_bytes, live: None })
    }

    fn set_constant(mut self, name: &str, value: f64) -> Result<Self, ShaderError> {
        Arc::make_mut(&mut self.core).set_constant(name, value)?;
        match self.core.specialised(ShaderStage::Compute, &self.core.label) {
            Ok(size) => self.workgroup_size = size,
            // Another override may still be without its value; the last call that leaves none decides.
            Err(error) if !error.to_string().contains("Missing value") => return Err(error),
            Err(_) => {}
        }
        Ok(self)
    }

    fn shelf(parsed: &mut Parsed) -> &mut HashMap<String, Self> {
        &mut parsed.compute
    }

    fn core(&self) -> &ShaderCore {
        &self.core
    }
}

/// A vertex and a fragment entry point (`<stem>_vertex`, `<stem>_fragment`); cheap to clone, needs no device.
///
/// There are no vertex buffers: the vertex stage pulls from storage buffers by `vertex_index`. The fragment stage
/// returns a struct whose member names are the attachments' names. Triangles are lists, front faces counter-clockwise.
#[derive(Clone, Debug)]
pub struct RasterShader {
    pub(crate) core: Arc<ShaderCore>,
    pub(crate) outputs: Arc<[reflect::Output]>,
    pub(crate) vertex: Arc<str>,
    pub(crate) fragment: Arc<str>,
    pub(crate) cull: Option<wgpu::Face>,
    pub(crate) blend: Option<wgpu::BlendState>,
    pub(crate) depth_compare: wgpu::CompareFunction,
    pub(crate) writes_depth: bool,
    live: Option<Arc<Follower<Self>>>,
}

impl RasterShader {
    /// The shader in the file `path` of `sources`; its label is the file's stem.
    ///
    /// # Errors
    /// If a file is missing, the WGSL is invalid, or an entry point is missing.
    pub fn new(sources: &WgslSources, path: &str) -> Result<Self, ShaderError> {
        let Some(live) = sources.live() else { return sources.shader(path) };
        let (shader, follower) = live.shader::<Self>(path)?;
        Ok(Self { live: Some(follower), ..shader })
    }

    /// The shader in the text `wgsl`, with entry points `<label>_vertex` and `<label>_fragment`.
    ///
    /// # Errors
    /// If the WGSL is invalid or an entry point is missing.
    pub fn from_wgsl(label: &str, wgsl: &str) -> Result<Self, ShaderError> {
        Self::build(label, Arc::new(Source::parse(FlatWgsl::single(label, wgsl))?))
    }

    /// The shader with the WGSL `override` `name` set, in both stages.
    ///
    /// # Errors
    /// If there is no such override or the value does not fit its type.
    pub fn with_constant(self, name: &str, value: f64) -> Result<Self, ShaderError> {
        let Some(live) = &self.live else { return self.set_constant(name, value) };
        let (shader, follower) = live.with_constant(name, value)?;
        Ok(Self { live: Some(follower), ..self.with_program(shader) })
    }

    /// The shader as its files are now: of a live set, the version that the last good
    /// [`WgslSources::poll`](crate::WgslSources::poll) took up, and otherwise itself. Passes take it by themselves.
    pub fn latest(&self) -> Self {
        self.live.as_ref().map_or_else(|| self.clone(), |live| self.with_program(live.latest()))
    }

    /// Another program in the same state of culling, blending and depth test.
    fn with_program(&self, program: Self) -> Self {
        Self { cull: self.cull, blend: self.blend, depth_compare: self.depth_compare, ..program }
    }

    /// The shader, culling `face`; by default nothing is culled.
    pub fn with_cull(mut self, face: Option<wgpu::Face>) -> Self {
        self.cull = face;
        self
    }

    /// The shader, blending every colour attachment with `blend`; by default fragments replace. Attachments of 32-bit floats need a device
    /// with `FLOAT32_BLENDABLE`.
    pub fn with_blend(mut self, blend: wgpu::BlendState) -> Self {
        self.blend = Some(blend);
        self
    }

    /// The shader, with another depth test than `Less`; `Greater` for reversed depth.
    pub fn with_depth_compare(mut self, compare: wgpu::CompareFunction) -> Self {
        self.depth_compare = compare;
        self
    }

    /// The label: the stem of the entry points' names.
    pub fn label(&self) -> &str {
        &self.core.label
    }

    /// The flattened WGSL that this value was made from.
    pub fn wgsl(&self) -> &str {
        self.core.source.flat.source()
    }
}

impl Shader for RasterShader {
    fn build(label: &str, source: Arc<Source>) -> Result<Self, ShaderError> {
        let (vertex, fragment) = (format!("{label}_vertex"), format!("{label}_fragment"));
        let first = reflect::entry(&source.reflected, &source.flat, ShaderStage::Vertex, &vertex)?;
        let second = reflect::entry(&source.reflected, &source.flat, ShaderStage::Fragment, &fragment)?;
        let mut bindings = first.bindings;
        for binding in second.bindings {
            match bindings.iter_mut().find(|other| (other.group, other.number) == (binding.group, binding.number)) {
                None => bindings.push(binding),
                Some(other) if other.name != binding.name => {
                    return Err(ShaderError::SameSlot {
                        place: binding.place,
                        binding: binding.name.to_string(),
                        other: other.name.to_string(),
                        group: binding.group,
                        number: binding.number,
                    });
                }
                Some(other) => {
                    other.stages |= binding.stages;
                    let written = other.writes || binding.writes;
                    other.reads |= binding.reads;
                    other.writes = written;
                    if let reflect::BindingKind::Texture { sample: wgpu::TextureSampleType::Float { filterable: true }, .. } =
                        binding.kind
                    {
                        other.kind = binding.kind;
                    }
                }
            }
        }
        let unused = first.unused.into_iter().filter(|name| second.unused.contains(name)).collect();
        let core = ShaderCore::new(label, source, bindings, unused);
        Ok(Self {
            core: Arc::new(core),
            outputs: second.outputs.into(),
            vertex: vertex.into(),
            fragment: fragment.into(),
            cull: None,
            blend: None,
            depth_compare: wgpu::CompareFunction::Less,
            writes_depth: second.writes_depth,
            live: None,
        })
    }

    fn set_constant(mut self, name: &str, value: f64) -> Result<Self, ShaderError> {
        Arc::make_mut(&mut self.core).set_constant(name, value)?;
        Ok(self)
    }

    fn shelf(parsed: &mut Parsed) -> &mut HashMap<String, Self> {
        &mut parsed.raster
    }

    fn core(&self) -> &ShaderCore {
        &self.core
    }
}
