//! The declaration of one frame by code.

use crate::{
    BufferDesc, ComputeShader, Handle, History, RasterShader, Resource, TextureDesc,
    closure::Record,
    declaration::{Access, Declaration, Origin, PassDecl, PassKind, ResourceDecl, ResourceKind, Write, rust_place},
    error::{GraphError, PassPlace},
    handle::{Buffer, Texture},
    pass::{Calls, ClosurePass, ComputePass, RasterPass},
    plan::{Plan, PlanOptions},
    raster::Targets,
    verify::Bound,
};
use std::{
    collections::HashMap,
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
    pub(crate) readbacks: u32,
    errors: Vec<GraphError>,
    resource_names: HashMap<String, u32>,
    pub(crate) pass_names: HashMap<String, u32>,
}

/// The caller's wgpu object behind a resource.
#[derive(Clone, Debug)]
pub(crate) enum Object {
    None,
    Texture(wgpu::Texture),
    Buffer(wgpu::Buffer),
}

/// A pass with all it takes to run it.
pub(crate) struct Recorded<'f> {
    pub(crate) decl: PassDecl,
    pub(crate) work: Work<'f>,
}

/// What a pass does.
#[derive(Debug)]
pub(crate) enum Work<'f> {
    Compute { shader: ComputeShader, bound: Vec<Bound>, params: Option<Vec<u8>>, groups: [u32; 3] },
    Raster { shader: RasterShader, bound: Vec<Bound>, params: Option<Vec<u8>>, targets: Targets, vertices: u32, instances: u32 },
    ClearBuffer { buffer: usize },
    CopyBuffer { from: usize, to: usize },
    CopyTexture { from: usize, to: usize },
    Readback { resource: usize, index: u32 },
    Closure(Record<'f>),
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
            declaration: Declaration { name: name.to_owned(), ..Declaration::default() },
            work: Vec::new(),
            objects: Vec::new(),
            readbacks: 0,
            errors: Vec::new(),
            resource_names: HashMap::new(),
            pass_names: HashMap::new(),
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

    /// A texture kept between frames.
    #[track_caller]
    pub fn history_texture(&mut self, name: &str, desc: TextureDesc) -> History<Texture> {
        let name = unique(&mut self.resource_names, name);
        History {
            previous: self.add_texture(&format!("{name}.previous"), desc.clone(), Origin::Previous, Object::None),
            current: self.add_texture(&format!("{name}.current"), desc, Origin::Current, Object::None),
        }
    }

    /// A buffer kept between frames.
    #[track_caller]
    pub fn history_buffer(&mut self, name: &str, desc: BufferDesc) -> History<Buffer> {
        let name = unique(&mut self.resource_names, name);
        History {
            previous: self.add_buffer(&format!("{name}.previous"), desc.clone(), Origin::Previous, Object::None),
            current: self.add_buffer(&format!("{name}.current"), desc, Origin::Current, Object::None),
        }
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
        let name = unique(&mut self.resource_names, name);
        if empty {
            self.errors.push(GraphError::EmptyResource { resource: name.clone(), rust: rust_place(Some(location)) });
        }
        let handle = Handle { index: self.declaration.resources.len(), graph: self.id, name: Arc::from(name.as_str()), desc };
        self.declaration.resources.push(ResourceDecl { name, kind, origin, bytes, keep: false, location: Some(location) });
        self.objects.push(object);
        handle
    }

    /// Begins a compute pass.
    #[track_caller]
    pub fn compute(&mut self, shader: &ComputeShader) -> ComputePass<'_, 'f> {
        ComputePass { graph: self, shader: shader.clone(), calls: Calls::new(Location::caller()) }
    }

    /// Begins a raster pass.
    #[track_caller]
    pub fn raster(&mut self, shader: &RasterShader) -> RasterPass<'_, 'f> {
        RasterPass { graph: self, shader: shader.clone(), calls: Calls::new(Location::caller()), colors: Vec::new(), depth: None }
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

    /// Fills the whole buffer with zero bytes.
    #[track_caller]
    pub fn clear_buffer(&mut self, buffer: &mut Handle<Buffer>) {
        let name = format!("clear {}", buffer.name);
        let usage = wgpu::BufferUsages::COPY_DST.bits();
        let access = Access::new(buffer.index, "clear", false, Write::Overwrite, usage);
        self.copy_pass(&name, vec![access], false, &[(buffer.graph, &buffer.name)], Work::ClearBuffer { buffer: buffer.index });
    }

    /// Copies a whole buffer to one of the same size.
    #[track_caller]
    pub fn copy_buffer(&mut self, from: &Handle<Buffer>, to: &mut Handle<Buffer>) {
        let name = format!("copy {} to {}", from.name, to.name);
        if from.desc.size != to.desc.size {
            self.mismatch(&name, (&from.name, from.desc.to_string()), (&to.name, to.desc.to_string()));
            return;
        }
        let usages = (wgpu::BufferUsages::COPY_SRC.bits(), wgpu::BufferUsages::COPY_DST.bits());
        let accesses = copy_accesses(from.index, to.index, usages);
        let work = Work::CopyBuffer { from: from.index, to: to.index };
        self.copy_pass(&name, accesses, false, &[(from.graph, &from.name), (to.graph, &to.name)], work);
    }

    /// Copies a whole texture, all mips and layers, to one of the same size and format (sRGB or not).
    #[track_caller]
    pub fn copy_texture(&mut self, from: &Handle<Texture>, to: &mut Handle<Texture>) {
        let name = format!("copy {} to {}", from.name, to.name);
        let key = |desc: &TextureDesc| {
            (desc.size, desc.format.remove_srgb_suffix(), desc.mip_level_count, desc.sample_count, desc.dimension)
        };
        if key(&from.desc) != key(&to.desc) {
            self.mismatch(&name, (&from.name, from.desc.to_string()), (&to.name, to.desc.to_string()));
            return;
        }
        let usages = (wgpu::TextureUsages::COPY_SRC.bits(), wgpu::TextureUsages::COPY_DST.bits());
        let accesses = copy_accesses(from.index, to.index, usages);
        let work = Work::CopyTexture { from: from.index, to: to.index };
        self.copy_pass(&name, accesses, false, &[(from.graph, &from.name), (to.graph, &to.name)], work);
    }

    /// Brings the buffer's bytes back to the CPU with the frame's output.
    #[track_caller]
    pub fn readback_buffer(&mut self, buffer: &Handle<Buffer>) -> Readback {
        self.readback(&buffer.name, buffer.graph, buffer.index, wgpu::BufferUsages::COPY_SRC.bits())
    }

    /// Brings the texture's first mip level, all layers, back to the CPU: rows tightly packed, row 0 on top.
    #[track_caller]
    pub fn readback_texture(&mut self, texture: &Handle<Texture>) -> Readback {
        let desc = &texture.desc;
        let refusal = unreadable(desc);
        if let Some(message) = refusal {
            let at = Self::place(&format!("readback {}", texture.name), Location::caller());
            let (resource, desc) = (texture.name.to_string(), desc.to_string());
            self.errors.push(GraphError::Readback { at, resource, desc, message: message.to_owned() });
        }
        self.readback(&texture.name, texture.graph, texture.index, wgpu::TextureUsages::COPY_SRC.bits())
    }

    #[track_caller]
    fn readback(&mut self, name: &str, graph: u64, resource: usize, usage: u32) -> Readback {
        let readback = Readback { graph: self.id, index: self.readbacks };
        self.readbacks += 1;
        let access = Access::new(resource, "readback", true, Write::No, usage);
        let work = Work::Readback { resource, index: readback.index };
        self.copy_pass(&format!("readback {name}"), vec![access], true, &[(graph, name)], work);
        readback
    }

    /// Never culls the passes that write this resource, and keeps its memory to the end of the frame.
    #[track_caller]
    pub fn keep(&mut self, handle: &Handle<impl Resource>) {
        if handle.graph == self.id {
            self.declaration.resources[handle.index].keep = true;
        } else {
            let at = Self::place("keep", Location::caller());
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

    #[track_caller]
    fn mismatch(&mut self, name: &str, from: (&str, String), to: (&str, String)) {
        let at = Self::place(name, Location::caller());
        let (from_desc, to_desc) = (from.1, to.1);
        self.errors.push(GraphError::CopyMismatch { at, from: from.0.to_owned(), from_desc, to: to.0.to_owned(), to_desc });
    }

    #[track_caller]
    fn copy_pass(&mut self, name: &str, accesses: Vec<Access>, side_effect: bool, handles: &[(u64, &str)], work: Work<'f>) {
        let location = Location::caller();
        let at = Self::place(name, location);
        let mut errors: Vec<GraphError> = handles
            .iter()
            .filter(|(graph, _)| *graph != self.id)
            .map(|(_, resource)| GraphError::ForeignHandle { at: at.clone(), resource: (*resource).to_owned() })
            .collect();
        if errors.is_empty() {
            crate::verify::conflicts(self, &accesses, &at, &mut errors);
        }
        if !errors.is_empty() {
            self.refuse(errors);
            return;
        }
        let decl = PassDecl {
            name: name.to_owned(),
            kind: PassKind::Copy,
            heavy: false,
            side_effect,
            pinned: false,
            accesses,
            location: Some(location),
        };
        self.record(Recorded { decl, work });
    }

    pub(crate) fn place(name: &str, location: &'static Location<'static>) -> PassPlace {
        PassPlace::new(name, rust_place(Some(location)))
    }

    pub(crate) fn refuse(&mut self, errors: Vec<GraphError>) {
        self.errors.extend(errors);
    }

    pub(crate) fn record(&mut self, mut recorded: Recorded<'f>) {
        recorded.decl.name = unique(&mut self.pass_names, &recorded.decl.name);
        self.declaration.passes.push(recorded.decl);
        self.work.push(recorded.work);
    }

    pub(crate) fn copy_usage(&self, resource: usize, read: bool) -> u32 {
        match (self.declaration.resources.get(resource).map(|resource| &resource.kind), read) {
            (Some(ResourceKind::Texture(_)), true) => wgpu::TextureUsages::COPY_SRC.bits(),
            (Some(ResourceKind::Texture(_)), false) => wgpu::TextureUsages::COPY_DST.bits(),
            (_, true) => wgpu::BufferUsages::COPY_SRC.bits(),
            (_, false) => wgpu::BufferUsages::COPY_DST.bits(),
        }
    }
}

fn copy_accesses(from: usize, to: usize, usages: (u32, u32)) -> Vec<Access> {
    vec![
        Access::new(from, "copy source", true, Write::No, usages.0),
        Access::new(to, "copy target", false, Write::Overwrite, usages.1),
    ]
}

/// Why a texture cannot be read back, with the mend.
pub(crate) fn unreadable(desc: &TextureDesc) -> Option<&'static str> {
    let format = desc.format;
    let copyable =
        matches!(format, wgpu::TextureFormat::Depth32Float | wgpu::TextureFormat::Depth16Unorm | wgpu::TextureFormat::Stencil8);
    if desc.sample_count != 1 {
        Some("it has several samples per texel; resolve it first by a pass that reads them")
    } else if format.is_depth_stencil_format() && !copyable || format.is_multi_planar_format() {
        Some("its format has no single copyable layout; use depth32float or a colour format")
    } else {
        None
    }
}

/// `name`, or `name#2`, `name#3`… where it is taken.
pub(crate) fn unique(taken: &mut HashMap<String, u32>, name: &str) -> String {
    let mut candidate = name.to_owned();
    loop {
        if !taken.contains_key(&candidate) {
            taken.insert(candidate.clone(), 1);
            return candidate;
        }
        let count = taken.entry(name.to_owned()).or_insert(1);
        *count += 1;
        candidate = format!("{name}#{count}");
    }
}

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
