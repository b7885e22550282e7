//! The declaration of one frame by code.

use crate::{
    BufferDesc, ComputeShader, Handle, History, RasterShader, Resource, TextureDesc,
    closure::Record,
    declaration::{Declaration, Origin, PassDecl, Place, ResourceDecl, ResourceKind, rust_place},
    error::{GraphError, PassRef},
    handle::{Buffer, Texture, Tlas},
    hash::FoldedMap,
    indirect::{Draw, Groups},
    pass::{Calls, ClosurePass, ComputePass, RasterPass},
    plan::{Plan, PlanOptions},
    raster::{Target, Targets},
    verify::{Bound, ParamsRange},
};
use std::{
    hash::BuildHasherDefault,
    panic::Location,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

/// Distinguishes the graphs of a process, so that a handle of one cannot be used in another.
static NEXT_GRAPH: AtomicU64 = AtomicU64::new(1);

/// One frame, declared pass by pass; runs nothing.
///
/// Passes behave as if run in the order they are declared. Mistakes are collected and returned by
/// [`Graph::plan`] and by execution.
#[derive(Debug)]
pub struct Graph<'f> {
    pub(crate) id: u64,
    pub(crate) declaration: Declaration,
    pub(crate) work: Vec<Work<'f>>,
    pub(crate) objects: Vec<Object>,
    /// First contents of resources kept between frames, by index.
    pub(crate) initials: Vec<(usize, Arc<[u8]>)>,
    pub(crate) readbacks: u32,
    pub(crate) errors: Vec<GraphError>,
    /// The params of all passes, each at a multiple of [`UNIFORM_ALIGN`].
    pub(crate) params: Vec<u8>,
    resource_names: Names,
    pub(crate) pass_names: Names,
}

/// The caller's wgpu object behind a resource.
#[derive(Clone, Debug)]
pub(crate) enum Object {
    None,
    Texture(wgpu::Texture),
    Buffer(wgpu::Buffer),
    Tlas(wgpu::Tlas),
}

/// A pass with all it takes to run it.
pub(crate) struct Recorded<'f> {
    pub(crate) decl: PassDecl,
    pub(crate) work: Work<'f>,
}

/// What a pass does.
#[derive(Debug)]
pub(crate) enum Work<'f> {
    Compute { shader: ComputeShader, bound: Vec<Bound>, params: Option<ParamsRange>, groups: Groups },
    Raster { shader: RasterShader, bound: Vec<Bound>, params: Option<ParamsRange>, targets: Targets, draw: Draw },
    ClearTexture { target: Cleared },
    ClearBuffer { buffer: usize },
    CopyBuffer { from: usize, to: usize },
    CopyTexture { from: usize, to: usize },
    Readback { resource: usize, index: u32 },
    Closure(Record<'f>),
}

/// A part of a texture, and what it is filled with.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Cleared {
    Color(Target<wgpu::Color>),
    Depth(Target<f32>),
}

/// What a resource that is kept between frames holds when it is made anew: in the first frame, and after its description
/// changed or history was reset.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub enum Initial {
    /// Zero bytes.
    #[default]
    Zero,
    /// These bytes: a buffer's, or the rows of a texture's first mip level, layer after layer, tightly packed; its other
    /// mips are zero.
    Bytes(Arc<[u8]>),
}

/// Names the bytes a frame brings back; see [`FrameOutput::bytes`](crate::FrameOutput::bytes).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Readback {
    pub(crate) graph: u64,
    pub(crate) index: u32,
}

impl<'f> Graph<'f> {
    /// An empty frame. History is shared between frames of one name.
    pub fn new(name: &str) -> Self {
        Self {
            id: NEXT_GRAPH.fetch_add(1, Ordering::Relaxed),
            declaration: Declaration {
                name: name.to_owned(),
                resources: Vec::with_capacity(USUAL),
                passes: Vec::with_capacity(USUAL),
            },
            work: Vec::with_capacity(USUAL),
            objects: Vec::with_capacity(USUAL),
            initials: Vec::new(),
            readbacks: 0,
            errors: Vec::new(),
            params: Vec::new(),
            resource_names: Names::with_capacity_and_hasher(USUAL, BuildHasherDefault::default()),
            pass_names: Names::with_capacity_and_hasher(USUAL, BuildHasherDefault::default()),
        }
    }

    /// A texture for this frame only. A name met again gets the suffix `#2` and so on.
    #[track_caller]
    pub fn texture(&mut self, name: &str, desc: TextureDesc) -> Handle<Texture> {
        self.add_texture(name, desc, Origin::Transient, Object::None)
    }

    /// A buffer for this frame only. A name met again gets the suffix `#2` and so on.
    #[track_caller]
    pub fn buffer(&mut self, name: &str, desc: BufferDesc) -> Handle<Buffer> {
        self.add_buffer(name, desc, Origin::Transient, Object::None)
    }

    /// The caller's texture. `None` plans but does not execute.
    #[track_caller]
    pub fn import_texture(
        &mut self,
        name: &str,
        desc: TextureDesc,
        texture: impl Into<Option<wgpu::Texture>>,
    ) -> Handle<Texture> {
        let object = texture.into().map_or(Object::None, Object::Texture);
        self.add_texture(name, desc, Origin::Imported, object)
    }

    /// The caller's buffer. `None` plans but does not execute.
    #[track_caller]
    pub fn import_buffer(&mut self, name: &str, desc: BufferDesc, buffer: impl Into<Option<wgpu::Buffer>>) -> Handle<Buffer> {
        let object = buffer.into().map_or(Object::None, Object::Buffer);
        self.add_buffer(name, desc, Origin::Imported, object)
    }

    /// The caller's acceleration structure, built in an earlier submission. `None` plans but does not execute.
    #[track_caller]
    pub fn import_tlas(&mut self, name: &str, tlas: impl Into<Option<wgpu::Tlas>>) -> Handle<Tlas> {
        let object = tlas.into().map_or(Object::None, Object::Tlas);
        self.add(name, ResourceKind::Tlas, Origin::Imported, object, 0, false, ())
    }

    /// A pair of textures kept between frames, zero at first.
    #[track_caller]
    pub fn history_texture(&mut self, name: &str, desc: TextureDesc) -> History<Texture> {
        self.history_texture_from(name, desc, Initial::Zero)
    }

    /// A pair of textures kept between frames; `initial` is what `previous` holds in the first frame.
    #[track_caller]
    pub fn history_texture_from(&mut self, name: &str, desc: TextureDesc, initial: Initial) -> History<Texture> {
        let name = unique(&mut self.resource_names, Arc::from(name));
        let previous = self.add_texture(&format!("{name}.previous"), desc.clone(), Origin::Previous, Object::None);
        self.set_initial(previous.index, crate::executor::texture_bytes(&desc), initial);
        History { previous, current: self.add_texture(&format!("{name}.current"), desc, Origin::Current, Object::None) }
    }

    /// A pair of buffers kept between frames, zero at first.
    #[track_caller]
    pub fn history_buffer(&mut self, name: &str, desc: BufferDesc) -> History<Buffer> {
        self.history_buffer_from(name, desc, Initial::Zero)
    }

    /// A pair of buffers kept between frames; `initial` is what `previous` holds in the first frame.
    #[track_caller]
    pub fn history_buffer_from(&mut self, name: &str, desc: BufferDesc, initial: Initial) -> History<Buffer> {
        let name = unique(&mut self.resource_names, Arc::from(name));
        let previous = self.add_buffer(&format!("{name}.previous"), desc.clone(), Origin::Previous, Object::None);
        self.set_initial(previous.index, Some(desc.size), initial);
        History { previous, current: self.add_buffer(&format!("{name}.current"), desc, Origin::Current, Object::None) }
    }

    /// One texture kept between frames of graphs of this name: what a frame writes, the next one finds.
    #[track_caller]
    pub fn persistent_texture(&mut self, name: &str, desc: TextureDesc, initial: Initial) -> Handle<Texture> {
        let bytes = crate::executor::texture_bytes(&desc);
        let handle = self.add_texture(name, desc, Origin::Persistent, Object::None);
        self.set_initial(handle.index, bytes, initial);
        handle
    }

    /// One buffer kept between frames of graphs of this name: what a frame writes, the next one finds.
    #[track_caller]
    pub fn persistent_buffer(&mut self, name: &str, desc: BufferDesc, initial: Initial) -> Handle<Buffer> {
        let bytes = desc.size;
        let handle = self.add_buffer(name, desc, Origin::Persistent, Object::None);
        self.set_initial(handle.index, Some(bytes), initial);
        handle
    }

    /// Notes first contents of `needed` bytes; `None`: the format has no copyable layout.
    #[track_caller]
    fn set_initial(&mut self, resource: usize, needed: Option<u64>, initial: Initial) {
        let Initial::Bytes(bytes) = initial else { return };
        if needed == Some(bytes.len() as u64) {
            self.initials.push((resource, bytes));
            return;
        }
        let decl = &self.declaration.resources[resource];
        let message = match needed {
            None => "its format cannot be filled from bytes; use `Initial::Zero`".to_owned(),
            Some(needed) => format!("its first contents take {needed} bytes and {} were given; give them all", bytes.len()),
        };
        let (resource, rust) = (decl.name.to_string(), rust_place(Some(Location::caller())));
        self.errors.push(GraphError::Initial { resource, rust, message });
    }

    #[track_caller]
    fn add_texture(&mut self, name: &str, desc: TextureDesc, origin: Origin, object: Object) -> Handle<Texture> {
        let (kind, bytes, empty) = (ResourceKind::Texture(desc.clone()), desc.bytes(), desc.is_empty());
        self.add(name, kind, origin, object, bytes, empty, desc)
    }

    #[track_caller]
    fn add_buffer(&mut self, name: &str, desc: BufferDesc, origin: Origin, object: Object) -> Handle<Buffer> {
        let (kind, bytes, empty) = (ResourceKind::Buffer(desc.clone()), desc.padded(), desc.size == 0);
        self.add(name, kind, origin, object, bytes, empty, desc)
    }

    #[track_caller]
    #[expect(clippy::too_many_arguments, reason = "one private place that fills a declaration's row")]
    fn add<T: Resource>(
        &mut self,
        name: &str,
        kind: ResourceKind,
        origin: Origin,
        object: Object,
        bytes: u64,
        empty: bool,
        desc: T::Desc,
    ) -> Handle<T> {
        let location = Location::caller();
        let name = unique(&mut self.resource_names, Arc::from(name));
        if empty {
            self.errors.push(GraphError::EmptyResource { resource: name.to_string(), rust: rust_place(Some(location)) });
        }
        let handle = Handle { index: self.declaration.resources.len(), graph: self.id, name: Arc::clone(&name), desc };
        let place = Place(Some(location));
        self.declaration.resources.push(ResourceDecl { name, kind, origin, bytes, keep: false, place });
        self.objects.push(object);
        handle
    }

    /// Begins a compute pass.
    #[track_caller]
    pub fn compute(&mut self, shader: &ComputeShader) -> ComputePass<'_, 'f> {
        ComputePass { graph: self, shader: shader.latest(), calls: Calls::new(Location::caller()) }
    }

    /// Begins a raster pass.
    #[track_caller]
    pub fn raster(&mut self, shader: &RasterShader) -> RasterPass<'_, 'f> {
        RasterPass {
            graph: self,
            shader: shader.latest(),
            calls: Calls::new(Location::caller()),
            colors: Vec::new(),
            depth: None,
        }
    }

    /// Begins a pass the caller records.
    #[track_caller]
    pub fn closure(&mut self, name: &str) -> ClosurePass<'_, 'f> {
        ClosurePass {
            graph: self,
            name: name.to_owned(),
            accesses: Vec::new(),
            foreign: Vec::new(),
            side_effect: false,
            heavy: false,
            pinned: false,
            location: Location::caller(),
        }
    }

    /// Never culls the passes that write this resource, and keeps its memory to the end of the frame.
    #[track_caller]
    pub fn keep(&mut self, handle: &Handle<impl Resource>) {
        if handle.graph == self.id {
            self.declaration.resources[handle.index].keep = true;
        } else {
            let at = PassRef::new("keep", Location::caller()).place();
            self.errors.push(GraphError::ForeignHandle { at, resource: handle.name.to_string() });
        }
    }

    /// The frame as plain data.
    ///
    /// # Errors
    /// The mistakes met while declaring.
    pub fn declaration(&self) -> Result<Declaration, GraphError> {
        self.check()?;
        Ok(self.declaration.clone())
    }

    /// Plans the frame; needs no device.
    ///
    /// # Errors
    /// The mistakes met while declaring, and those that show only over the whole frame, such as stale reads.
    pub fn plan(&self, options: &PlanOptions) -> Result<Plan, GraphError> {
        self.check()?;
        crate::plan(&self.declaration, options)
    }

    pub(crate) fn check(&self) -> Result<(), GraphError> {
        GraphError::collect(self.errors.clone()).map_or(Ok(()), Err)
    }

    /// Keeps the bytes of a pass's params until the frame runs; returns where they lie.
    pub(crate) fn add_params(&mut self, bytes: &[u8]) -> ParamsRange {
        let start = self.params.len();
        self.params.extend_from_slice(bytes);
        self.params.resize(self.params.len().next_multiple_of(UNIFORM_ALIGN), 0);
        start as u64..(start + bytes.len()) as u64
    }

    pub(crate) fn refuse(&mut self, errors: Vec<GraphError>) {
        self.errors.extend(errors);
    }

    pub(crate) fn record(&mut self, mut recorded: Recorded<'f>) {
        recorded.decl.name = unique(&mut self.pass_names, recorded.decl.name);
        self.declaration.passes.push(recorded.decl);
        self.work.push(recorded.work);
    }

    pub(crate) fn copy_usage(&self, resource: usize, read: bool) -> u32 {
        match (self.declaration.resources.get(resource).map(|resource| &resource.kind), read) {
            (Some(ResourceKind::Texture(_)), true) => wgpu::TextureUsages::COPY_SRC.bits(),
            (Some(ResourceKind::Texture(_)), false) => wgpu::TextureUsages::COPY_DST.bits(),
            (Some(ResourceKind::Tlas), _) => 0,
            (_, true) => wgpu::BufferUsages::COPY_SRC.bits(),
            (_, false) => wgpu::BufferUsages::COPY_DST.bits(),
        }
    }
}

/// Names that are taken, with the number that was given out last.
type Names = FoldedMap<Arc<str>, u32>;

/// `name`, or `name#2`, `name#3`… where it is taken.
pub(crate) fn unique(taken: &mut Names, name: Arc<str>) -> Arc<str> {
    let Some(&last) = taken.get(&name) else {
        taken.insert(Arc::clone(&name), 1);
        return name;
    };
    let mut number = last + 1;
    let candidate = loop {
        let candidate: Arc<str> = format!("{name}#{number}").into();
        if !taken.contains_key(&candidate) {
            break candidate;
        }
        number += 1;
    };
    taken.insert(name, number);
    taken.insert(Arc::clone(&candidate), 1);
    candidate
}

/// Passes and resources there is room for at once: graphs are made anew every frame, and most have about as many.
const USUAL: usize = 128;

/// Uniform offsets are multiples of this (bytes), the largest any device asks for.
const UNIFORM_ALIGN: usize = 256;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_made_unique() {
        let mut graph = Graph::new("t");
        let names: Vec<String> =
            ["a", "a#2", "a", "a"].iter().map(|name| graph.buffer(name, BufferDesc::words(1)).name().to_owned()).collect();
        assert_eq!(names, ["a", "a#2", "a#3", "a#4"]);
    }
}
