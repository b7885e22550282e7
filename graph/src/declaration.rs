//! One frame as plain data: what planning needs, and no shaders, closures or wgpu objects.

use crate::{
    BufferDesc, Subresources, TextureDesc,
    error::{PassPlace, PassRef},
};
use std::{
    fmt,
    hash::{Hash, Hasher},
    panic::Location,
    sync::Arc,
};

/// A frame as data. Build it through [`Graph::declaration`](crate::Graph::declaration) or
/// [`Declaration::from_frame_json`]; serde writes and reads the frame form of version 1.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct Declaration {
    /// Name of the frame.
    pub name: String,
    /// Resources; accesses name them by index.
    pub resources: Vec<ResourceDecl>,
    /// Passes in recorded order.
    pub passes: Vec<PassDecl>,
}

/// One resource.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct ResourceDecl {
    /// Name, unique in the frame.
    pub name: Arc<str>,
    /// What it is, with its description.
    pub kind: ResourceKind,
    /// Who owns it.
    pub origin: Origin,
    /// Bytes it takes; 0: unknown and not counted.
    pub bytes: u64,
    /// Whether its writers are never culled.
    pub keep: bool,
    pub(crate) place: Place,
}

/// What a resource is.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum ResourceKind {
    /// A texture.
    Texture(TextureDesc),
    /// A buffer.
    Buffer(BufferDesc),
    /// A top-level acceleration structure; always imported.
    Tlas,
}

/// Who owns a resource, hence whose contents it has when the frame begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Origin {
    /// The graph's, for this frame only; its first contents are garbage.
    Transient,
    /// The caller's.
    Imported,
    /// Kept between frames: readable at once, and what is written stays for the next frame. Frame files call it history.
    Persistent,
    /// The last frame's half of a history pair: read only.
    Previous,
    /// This frame's half of a history pair: write before reading.
    Current,
}

impl fmt::Display for ResourceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Texture(desc) => desc.fmt(f),
            Self::Buffer(desc) => desc.fmt(f),
            Self::Tlas => f.write_str("acceleration structure"),
        }
    }
}

impl Origin {
    /// Whether reading it before anything wrote it is fine.
    pub(crate) fn has_contents(self) -> bool {
        matches!(self, Self::Imported | Self::Persistent | Self::Previous)
    }

    /// Whether what is written to it outlives the frame.
    pub(crate) fn outlives_frame(self) -> bool {
        matches!(self, Self::Imported | Self::Persistent | Self::Current)
    }
}

/// One pass.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct PassDecl {
    /// Name, unique in the frame.
    pub name: Arc<str>,
    /// What it does.
    pub kind: PassKind,
    /// Whether it takes long and is given a submission of its own.
    pub heavy: bool,
    /// Whether it must run whatever becomes of what it writes.
    pub side_effect: bool,
    /// Whether it keeps its place in recorded order among the passes that are pinned.
    pub pinned: bool,
    /// What it reads and writes.
    pub accesses: Vec<Access>,
    pub(crate) place: Place,
}

impl PassDecl {
    /// The pass, for an error.
    pub(crate) fn at(&self) -> PassRef<'_> {
        PassRef { name: &self.name, location: self.place.0 }
    }

    pub(crate) fn place(&self) -> PassPlace {
        self.at().place()
    }
}

/// The line of Rust that declared something, if any. It is no part of a frame's structure: all places are equal.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Place(pub(crate) Option<&'static Location<'static>>);

impl PartialEq for Place {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Eq for Place {}

impl Hash for Place {
    fn hash<H: Hasher>(&self, _: &mut H) {}
}

/// `file:line`, or nothing.
pub(crate) fn rust_place(location: Option<&Location<'_>>) -> String {
    location.map_or_else(String::new, |location| format!("{}:{}", location.file(), location.line()))
}

/// Kind of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PassKind {
    /// Compute dispatch.
    Compute,
    /// Draw with attachments.
    Raster,
    /// Copy, clear or readback.
    Copy,
    /// Any other transfer (frame files).
    Transfer,
    /// Ray-tracing pipeline (frame files).
    Raytrace,
    /// Recorded by the caller.
    Closure,
}

impl PassKind {
    /// Its name in frame files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Compute => "compute",
            Self::Raster => "raster",
            Self::Copy => "copy",
            Self::Transfer => "transfer",
            Self::Raytrace => "raytrace",
            Self::Closure => "closure",
        }
    }
}

/// One use of a resource by a pass.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct Access {
    /// Index of the resource.
    pub resource: usize,
    /// Name it is bound to, or a word for the use.
    pub binding: Arc<str>,
    /// Whether it needs the contents from before the pass.
    pub read: bool,
    /// Whether and how it writes.
    pub write: Write,
    /// Which mips and layers.
    pub part: Subresources,
    /// Where it is attached, if it is drawn into.
    pub attachment: Option<Attachment>,
    /// wgpu usage bits, of `TextureUsages` or `BufferUsages`.
    pub(crate) usage: u32,
    /// Whether wgpu takes it for a write although it only reads: a `read_write` variable that the shader never stores to.
    pub(crate) exclusive: bool,
}

/// Where a raster pass attaches a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Attachment {
    /// The fragment output of this location.
    Color(u32),
    /// The depth buffer.
    Depth,
    /// Nowhere: the pass only clears it.
    Clear,
}

/// How an access writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Write {
    /// It does not.
    No,
    /// Some of it may keep what an earlier pass wrote, so that pass stays alive.
    Keep,
    /// All of it: what was there is gone.
    Overwrite,
}

impl Access {
    /// An access to the whole of `resource`.
    pub(crate) fn new(resource: usize, binding: impl Into<Arc<str>>, read: bool, write: Write, usage: u32) -> Self {
        Self {
            resource,
            binding: binding.into(),
            read,
            write,
            part: Subresources::ALL,
            attachment: None,
            usage,
            exclusive: false,
        }
    }

    /// Whether it writes at all.
    pub fn writes(&self) -> bool {
        self.write != Write::No
    }
}
