//! Frame files, version 1: a declaration as JSON, without shaders.

use crate::{
    BufferDesc, Subresources, TextureDesc,
    declaration::{Access, Declaration, Origin, PassDecl, PassKind, Place, ResourceDecl, ResourceKind, Write},
    error::{GraphError, did_you_mean},
    format,
    plan::cells::Cells,
};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _};
use std::collections::{BTreeMap, HashMap};

#[derive(Serialize, Deserialize)]
#[expect(clippy::struct_field_names, reason = "`frame` is the key that the form has")]
struct Frame {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    version: Option<u32>,
    frame: String,
    resources: Vec<FrameResource>,
    passes: Vec<FramePass>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameResource {
    name: String,
    kind: Kind,
    origin: FrameOrigin,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    format: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    size: Option<[u32; 3]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mips: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    samples: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    dimension: Option<Dimension>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    bytes: Option<u64>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    keep: bool,
}

#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Texture,
    Buffer,
    #[serde(rename = "acceleration_structure")]
    Tlas,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
enum Dimension {
    #[serde(rename = "2d")]
    D2,
    #[serde(rename = "3d")]
    D3,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum FrameOrigin {
    Transient,
    Imported,
    History,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FramePass {
    name: String,
    kind: PassKind,
    #[serde(default)]
    reads: Vec<FrameRead>,
    #[serde(default)]
    writes: Vec<FrameWrite>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    side_effect: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pinned: bool,
}

/// A resource read: its name, or name and part.
#[derive(PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "a read is a resource's name, or {\"resource\": name, \"mips\": [first, end], \"layers\": [first, end]}"
)]
enum FrameRead {
    Whole(String),
    Part(FramePart),
}

#[derive(PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FramePart {
    resource: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mips: Option<[u32; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    layers: Option<[u32; 2]>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameWrite {
    resource: String,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    preserve: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mips: Option<[u32; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    layers: Option<[u32; 2]>,
}

/// The range of a part, as a frame file has it: nothing for all.
fn range(of: [u32; 2]) -> Option<[u32; 2]> {
    (of != Subresources::ALL.mips).then_some(of)
}

fn part(mips: Option<[u32; 2]>, layers: Option<[u32; 2]>) -> Subresources {
    let all = Subresources::ALL;
    Subresources { mips: mips.unwrap_or(all.mips), layers: layers.unwrap_or(all.layers) }
}

impl Declaration {
    /// Reads a frame file.
    ///
    /// # Errors
    /// [`GraphError::FrameSyntax`] with line and column, or an error that names the pass or resource.
    pub fn from_frame_json(json: &str) -> Result<Self, GraphError> {
        let frame: Frame = serde_json::from_str(json).map_err(|error| {
            let (line, column) = (error.line(), error.column());
            let message = error.to_string();
            let tail = format!(" at line {line} column {column}");
            GraphError::FrameSyntax { line, column, message: message.strip_suffix(&tail).unwrap_or(&message).to_owned() }
        })?;
        Self::try_from(frame)
    }

    /// The frame as a frame file. Shaders, closures and wgpu objects are not in it.
    pub fn to_frame_json(&self) -> String {
        serde_json::to_string_pretty(&Frame::from(self)).unwrap_or_default()
    }
}

impl Serialize for Declaration {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Frame::from(self).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Declaration {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::try_from(Frame::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}

impl TryFrom<Frame> for Declaration {
    type Error = GraphError;

    fn try_from(frame: Frame) -> Result<Self, GraphError> {
        let mut errors = Vec::new();
        if let Some(version) = frame.version.filter(|version| *version != 1) {
            let message = format!("version {version} of the frame form is not known; this reads version 1");
            errors.push(GraphError::FrameSyntax { line: 1, column: 1, message });
        }
        let mut index = HashMap::new();
        let mut resources = Vec::with_capacity(frame.resources.len());
        for (second, resource) in frame.resources.into_iter().enumerate() {
            if let Some(first) = index.insert(resource.name.clone(), second) {
                let (frame, name) = (frame.frame.clone(), resource.name.clone());
                errors.push(GraphError::DuplicateName { frame, what: "resource", name, first, second });
            }
            let name = resource.name.clone();
            match resource_decl(resource) {
                Ok(decl) => resources.push(decl),
                Err(message) => errors.push(GraphError::BadResource { frame: frame.frame.clone(), resource: name, message }),
            }
        }
        let mut pass_index = HashMap::new();
        let mut passes = Vec::with_capacity(frame.passes.len());
        for (second, pass) in frame.passes.into_iter().enumerate() {
            if let Some(first) = pass_index.insert(pass.name.clone(), second) {
                let (frame, name) = (frame.frame.clone(), pass.name.clone());
                errors.push(GraphError::DuplicateName { frame, what: "pass", name, first, second });
            }
            passes.push(pass_decl(pass, &frame.frame, &index, &mut errors));
        }
        match GraphError::collect(errors) {
            Some(error) => Err(error),
            None => Ok(Self { name: frame.frame, resources, passes }),
        }
    }
}

fn resource_decl(resource: FrameResource) -> Result<ResourceDecl, String> {
    let origin = match resource.origin {
        FrameOrigin::Transient => Origin::Transient,
        FrameOrigin::Imported => Origin::Imported,
        FrameOrigin::History => Origin::Persistent,
    };
    let (kind, bytes) = match resource.kind {
        Kind::Buffer => {
            if resource.format.is_some() || resource.size.is_some() {
                return Err("a buffer has `bytes`, and no `format` or `size`".to_owned());
            }
            let bytes = resource.bytes.ok_or("a buffer needs `bytes` (0: unknown)")?;
            (ResourceKind::Buffer(BufferDesc::bytes(bytes)), bytes)
        }
        Kind::Tlas => {
            if origin != Origin::Imported {
                return Err("an acceleration structure is always `imported`".to_owned());
            }
            if resource.format.is_some() || resource.size.is_some() {
                return Err("an acceleration structure has no `format` or `size`".to_owned());
            }
            (ResourceKind::Tlas, resource.bytes.unwrap_or(0))
        }
        Kind::Texture => {
            let name = resource.format.ok_or("a texture needs `format`")?;
            let size = resource.size.ok_or("a texture needs `size`: [width, height, layers]")?;
            let format = format::parse(&name)
                .ok_or_else(|| format!("`{name}` is no texture format of WebGPU{}", did_you_mean(&name, format::names())))?;
            let mut desc = TextureDesc::new_2d([size[0], size[1]], format).layers(size[2]);
            desc.mip_level_count = resource.mips.unwrap_or(1);
            desc.sample_count = resource.samples.unwrap_or(1);
            if matches!(resource.dimension, Some(Dimension::D3)) {
                desc.dimension = wgpu::TextureDimension::D3;
            }
            if desc.is_empty() {
                return Err(format!(
                    "size {size:?}, mips {} and samples {} must all be at least 1",
                    desc.mip_level_count, desc.sample_count
                ));
            }
            let bytes = resource.bytes.unwrap_or_else(|| desc.bytes());
            (ResourceKind::Texture(desc), bytes)
        }
    };
    Ok(ResourceDecl { name: resource.name.into(), kind, origin, bytes, keep: resource.keep, place: Place::default() })
}

/// A resource with the mips and layers that are meant.
type Meant = (usize, [u32; 2], [u32; 2]);

fn pass_decl(pass: FramePass, frame: &str, index: &HashMap<String, usize>, errors: &mut Vec<GraphError>) -> PassDecl {
    // One access per resource and part: `true` if it reads, and how it writes.
    let mut merged: BTreeMap<Meant, (bool, Write)> = BTreeMap::new();
    let reads = pass.reads.iter().map(|read| match read {
        FrameRead::Whole(name) => (name, Subresources::ALL, true, Write::No, "reads"),
        FrameRead::Part(read) => (&read.resource, part(read.mips, read.layers), true, Write::No, "reads"),
    });
    let writes = pass.writes.iter().map(|write| {
        let kind = if write.preserve { Write::Keep } else { Write::Overwrite };
        (&write.resource, part(write.mips, write.layers), write.preserve, kind, "writes")
    });
    for (name, part, read, write, verb) in reads.chain(writes) {
        let Some(&resource) = index.get(name) else {
            errors.push(GraphError::UnknownResource {
                frame: frame.to_owned(),
                pass: pass.name.clone(),
                verb,
                resource: name.clone(),
                hint: did_you_mean(name, index.keys().map(String::as_str)),
            });
            continue;
        };
        let entry = merged.entry((resource, part.mips, part.layers)).or_insert((false, Write::No));
        entry.0 |= read;
        if entry.1 != Write::Keep {
            entry.1 = if write == Write::No { entry.1 } else { write };
        }
    }
    let accesses = merged
        .into_iter()
        .map(|((resource, mips, layers), (read, write))| Access {
            part: Subresources { mips, layers },
            ..Access::new(resource, if write == Write::No { "reads" } else { "writes" }, read, write, 0)
        })
        .collect();
    PassDecl {
        name: pass.name.into(),
        kind: pass.kind,
        heavy: false,
        side_effect: pass.side_effect,
        pinned: pass.pinned,
        accesses,
        place: Place::default(),
    }
}

impl From<&Declaration> for Frame {
    fn from(declaration: &Declaration) -> Self {
        let resources = declaration.resources.iter().map(frame_resource).collect();
        let name = |resource: usize| declaration.resources.get(resource).map_or_else(String::new, |r| r.name.to_string());
        let mut passes = Vec::new();
        // A write that keeps earlier contents needs them only if there are any.
        let mut contents = Contents::new(declaration);
        for pass in &declaration.passes {
            let (mut reads, mut writes) = (Vec::new(), Vec::new());
            for access in &pass.accesses {
                if access.writes() {
                    let preserve = access.read || (access.write == Write::Keep && contents.has(access));
                    let (mips, layers) = (range(access.part.mips), range(access.part.layers));
                    writes.push(FrameWrite { resource: name(access.resource), preserve, mips, layers });
                } else if access.part.is_all() {
                    reads.push(FrameRead::Whole(name(access.resource)));
                } else {
                    let (mips, layers) = (range(access.part.mips), range(access.part.layers));
                    reads.push(FrameRead::Part(FramePart { resource: name(access.resource), mips, layers }));
                }
            }
            contents.write(pass);
            reads.dedup();
            let (side_effect, pinned) = (pass.side_effect, pass.pinned);
            passes.push(FramePass { name: pass.name.to_string(), kind: pass.kind, reads, writes, side_effect, pinned });
        }
        Self { version: None, frame: declaration.name.clone(), resources, passes }
    }
}

/// Which parts of resources have contents, while the passes go by.
struct Contents(Option<(Cells, Vec<bool>)>);

impl Contents {
    fn new(declaration: &Declaration) -> Self {
        let resources = &declaration.resources;
        let sound = declaration.passes.iter().flat_map(|pass| &pass.accesses).all(|access| access.resource < resources.len());
        Self(sound.then(|| {
            let cells = Cells::new(declaration);
            let mut written = vec![false; cells.len()];
            for (index, _) in resources.iter().enumerate().filter(|(_, resource)| resource.origin.has_contents()) {
                written[cells.of_resource(index)].fill(true);
            }
            (cells, written)
        }))
    }

    fn has(&self, access: &Access) -> bool {
        self.0.as_ref().is_some_and(|(cells, written)| cells.of(access).flatten().all(|cell| written[cell]))
    }

    fn write(&mut self, pass: &PassDecl) {
        if let Some((cells, written)) = &mut self.0 {
            let writes = pass.accesses.iter().filter(|access| access.writes());
            writes.flat_map(|access| cells.of(access)).for_each(|row| written[row].fill(true));
        }
    }
}

fn frame_resource(resource: &ResourceDecl) -> FrameResource {
    let origin = match resource.origin {
        Origin::Transient => FrameOrigin::Transient,
        Origin::Imported => FrameOrigin::Imported,
        Origin::Persistent | Origin::Previous | Origin::Current => FrameOrigin::History,
    };
    let mut frame = FrameResource {
        name: resource.name.to_string(),
        kind: Kind::Buffer,
        origin,
        format: None,
        size: None,
        mips: None,
        samples: None,
        dimension: None,
        bytes: Some(resource.bytes),
        keep: resource.keep,
    };
    if resource.kind == ResourceKind::Tlas {
        frame.kind = Kind::Tlas;
    }
    if let ResourceKind::Texture(desc) = &resource.kind {
        frame.kind = Kind::Texture;
        frame.format = Some(format::name(desc.format));
        frame.size = Some(desc.size);
        frame.mips = Some(desc.mip_level_count);
        frame.samples = Some(desc.sample_count);
        frame.dimension = (desc.dimension == wgpu::TextureDimension::D3).then_some(Dimension::D3);
    }
    frame
}
