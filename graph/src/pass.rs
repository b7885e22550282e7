//! Builders of passes. A pass takes effect at its last call: `dispatch…`, `draw` or `record`.

use crate::{
    Buffer, ComputeShader, Graph, Handle, RasterShader, Resource, ShaderStruct, Subresources, Texture,
    closure::{ClosureContext, Record},
    declaration::{Access, PassDecl, PassKind, Place, Write},
    error::{GraphError, PassRef},
    graph::{Recorded, Work},
    indirect::{Draw, Groups, Indirect},
    layout::StructLayout,
    raster,
    shader::ShaderCore,
    verify::{self, Bound, Call, Params, View},
};
use std::{panic::Location, sync::Arc};

/// How a sampler filters and wraps; bound to a WGSL `sampler`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sampler {
    /// Linear or nearest, for magnification, minification and mips alike.
    pub filter: wgpu::FilterMode,
    /// What lies outside 0…1.
    pub wrap: wgpu::AddressMode,
}

impl Sampler {
    /// Linear filter, clamped to the edge.
    pub const LINEAR_CLAMP: Self = Self { filter: wgpu::FilterMode::Linear, wrap: wgpu::AddressMode::ClampToEdge };
    /// Linear filter, repeating.
    pub const LINEAR_REPEAT: Self = Self { filter: wgpu::FilterMode::Linear, wrap: wgpu::AddressMode::Repeat };
    /// Nearest texel, clamped to the edge.
    pub const NEAREST_CLAMP: Self = Self { filter: wgpu::FilterMode::Nearest, wrap: wgpu::AddressMode::ClampToEdge };
    /// Nearest texel, repeating.
    pub const NEAREST_REPEAT: Self = Self { filter: wgpu::FilterMode::Nearest, wrap: wgpu::AddressMode::Repeat };
}

/// What an attachment holds when the pass begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Load {
    /// This colour (r, g, b, a) everywhere.
    Clear([f64; 4]),
    /// This depth (0 near … 1 far) everywhere.
    ClearDepth(f32),
    /// What earlier passes wrote.
    Keep,
}

/// What compute and raster passes collect.
#[derive(Debug)]
pub(crate) struct Calls {
    pub(crate) name: Option<Arc<str>>,
    pub(crate) params: Option<Params>,
    pub(crate) bound: Vec<Call>,
    pub(crate) heavy: bool,
    pub(crate) pinned: bool,
    pub(crate) location: &'static Location<'static>,
}

impl Calls {
    pub(crate) fn new(location: &'static Location<'static>) -> Self {
        Self { name: None, params: None, bound: Vec::new(), heavy: false, pinned: false, location }
    }

    /// The pass's own name, or the shader's.
    fn name(&self, core: &ShaderCore) -> Arc<str> {
        self.name.clone().unwrap_or_else(|| Arc::clone(&core.label))
    }

    /// Compares the calls with the shader.
    fn check(&self, graph: &Graph<'_>, core: &ShaderCore, at: PassRef<'_>, indirect: Option<Indirect>) -> Checked {
        let mut checked = match verify::bindings(graph, core, self, at) {
            Ok((bound, accesses)) => Checked { bound, accesses, errors: Vec::new() },
            Err(errors) => Checked { bound: Vec::new(), accesses: Vec::new(), errors },
        };
        if let Some(indirect) = indirect {
            indirect.check(graph, at, &mut checked.accesses, &mut checked.errors);
        }
        checked
    }

    fn decl(&self, name: Arc<str>, kind: PassKind, accesses: Vec<Access>) -> PassDecl {
        let (heavy, pinned, place) = (self.heavy, self.pinned, Place(Some(self.location)));
        PassDecl { name, kind, heavy, side_effect: false, pinned, accesses, place }
    }
}

/// What is bound and accessed, and the mistakes.
struct Checked {
    bound: Vec<Bound>,
    accesses: Vec<Access>,
    errors: Vec<GraphError>,
}

macro_rules! shared_calls {
    () => {
        /// Another name than the shader's label, for times, errors and debuggers.
        pub fn name(mut self, name: &str) -> Self {
            self.calls.name = Some(Arc::from(name));
            self
        }

        /// The contents of the WGSL's `var<uniform> params`.
        pub fn params<T: ShaderStruct>(mut self, params: &T) -> Self {
            let range = self.graph.add_params(bytemuck::bytes_of(params));
            self.calls.params = Some(Params { layout: StructLayout::of::<T>(), range });
            self
        }

        /// Binds `handle` to the WGSL variable `binding`, to be read.
        #[track_caller]
        pub fn read<T: Resource>(mut self, binding: &str, handle: &Handle<T>) -> Self {
            self.calls.bound.push(Call::new(&self.shader.core, binding, handle, false, View::default()));
            self
        }

        /// Binds a view of the texture in another of its formats, to be read.
        #[track_caller]
        pub fn read_as(mut self, binding: &str, handle: &Handle<Texture>, format: wgpu::TextureFormat) -> Self {
            self.calls.bound.push(Call::new(&self.shader.core, binding, handle, false, format.into()));
            self
        }

        /// Like [`Self::read`] where the shader uses `binding`, nothing where it does not: for groups of resources that
        /// many shaders share, such as a scene.
        #[track_caller]
        pub fn read_if_used<T: Resource>(self, binding: &str, handle: &Handle<T>) -> Self {
            if self.shader.core.uses(binding) { self.read(binding, handle) } else { self }
        }

        /// [`Self::read_as`] where the shader uses `binding`, nothing where it does not.
        #[track_caller]
        pub fn read_as_if_used(self, binding: &str, handle: &Handle<Texture>, format: wgpu::TextureFormat) -> Self {
            if self.shader.core.uses(binding) { self.read_as(binding, handle, format) } else { self }
        }

        /// Binds `handle` to the WGSL variable `binding`, to be written. Whether the shader also reads it, naga says.
        #[track_caller]
        pub fn write<T: Resource>(mut self, binding: &str, handle: &mut Handle<T>) -> Self {
            self.calls.bound.push(Call::new(&self.shader.core, binding, handle, true, View::default()));
            self
        }

        /// Binds some mips and layers of the texture to the WGSL variable `binding`, to be read.
        #[track_caller]
        pub fn read_at(mut self, binding: &str, handle: &Handle<Texture>, part: Subresources) -> Self {
            self.calls.bound.push(Call::new(&self.shader.core, binding, handle, false, part.into()));
            self
        }

        /// Binds some mips and layers of the texture to the WGSL variable `binding`, to be written. Other parts may be read
        /// by the same pass.
        #[track_caller]
        pub fn write_at(mut self, binding: &str, handle: &mut Handle<Texture>, part: Subresources) -> Self {
            self.calls.bound.push(Call::new(&self.shader.core, binding, handle, true, part.into()));
            self
        }

        /// Like [`Self::read`] where there is a resource; where there is none, the shader sees zeros: a buffer that is as
        /// long as its WGSL type at least must be, or a texture of one texel.
        #[track_caller]
        pub fn read_optional<T: Resource>(mut self, binding: &str, handle: Option<&Handle<T>>) -> Self {
            self.calls.bound.push(match handle {
                Some(handle) => Call::new(&self.shader.core, binding, handle, false, View::default()),
                None => Call::nothing(&self.shader.core, binding),
            });
            self
        }

        /// Binds a sampler to the WGSL variable `binding`.
        #[track_caller]
        pub fn sampler(mut self, binding: &str, sampler: Sampler) -> Self {
            self.calls.bound.push(Call::sampler(&self.shader.core, binding, sampler));
            self
        }

        /// Marks a long pass: it gets a submission of its own, and the executor waits for it and reports progress.
        pub fn heavy(mut self) -> Self {
            self.calls.heavy = true;
            self
        }

        /// Keeps the pass in recorded order among the pinned passes, where the planner could move it to save memory.
        pub fn pinned(mut self) -> Self {
            self.calls.pinned = true;
            self
        }
    };
}

/// Builds a compute pass; ends with one of the `dispatch` calls.
#[derive(Debug)]
#[must_use = "a pass takes effect at its `dispatch` call"]
pub struct ComputePass<'g, 'f> {
    pub(crate) graph: &'g mut Graph<'f>,
    pub(crate) shader: ComputeShader,
    pub(crate) calls: Calls,
}

impl ComputePass<'_, '_> {
    shared_calls!();

    /// Runs `groups` workgroups in x, y and z.
    pub fn dispatch(self, groups: [u32; 3]) {
        self.finish(Groups::Given(groups), None);
    }

    /// Runs as many workgroups as three u32 (x, y, z) at `offset` (bytes, a multiple of 4) of `arguments` say when the
    /// pass runs.
    #[track_caller]
    pub fn dispatch_indirect(self, arguments: &Handle<Buffer>, offset: u64) {
        let indirect = Indirect::new(arguments, offset, 12);
        self.finish(Groups::Indirect(indirect.source), Some(indirect));
    }

    fn finish(self, groups: Groups, indirect: Option<Indirect>) {
        let Self { graph, shader, calls } = self;
        let name = calls.name(&shader.core);
        let at = PassRef::new(&name, calls.location);
        let Checked { bound, accesses, errors } = calls.check(graph, &shader.core, at, indirect);
        if !errors.is_empty() {
            graph.refuse(errors);
            return;
        }
        graph.record(Recorded {
            decl: calls.decl(name, PassKind::Compute, accesses),
            work: Work::Compute { shader, bound, params: calls.params.map(|params| params.range), groups },
        });
    }

    /// Runs at least `threads` invocations in x, y and z: whole workgroups, so kernels test their bounds.
    pub fn dispatch_threads(self, threads: [u32; 3]) {
        let size = self.shader.workgroup_size();
        self.dispatch(std::array::from_fn(|i| threads[i].div_ceil(size[i].max(1))));
    }

    /// Runs at least `threads` invocations in one row, folded into y past 65 535 workgroups.
    ///
    /// The kernel's index is `id.x + id.y * num_workgroups.x * workgroup_size.x`; it tests its bound.
    pub fn dispatch_1d(self, threads: u32) {
        let groups = threads.div_ceil(self.shader.workgroup_size()[0].max(1));
        self.dispatch(fold_1d(groups));
    }
}

/// Largest number of workgroups in one dimension that `WebGPU` promises.
const MAX_GROUPS: u32 = 65_535;

fn fold_1d(groups: u32) -> [u32; 3] {
    if groups <= MAX_GROUPS {
        return [groups, 1, 1];
    }
    // Rows of equal length, so that few groups are idle.
    let rows = groups.div_ceil(MAX_GROUPS);
    [groups.div_ceil(rows), rows, 1]
}

/// Builds a raster pass; ends with [`RasterPass::draw`].
#[derive(Debug)]
#[must_use = "a pass takes effect at its `draw` call"]
pub struct RasterPass<'g, 'f> {
    pub(crate) graph: &'g mut Graph<'f>,
    pub(crate) shader: RasterShader,
    pub(crate) calls: Calls,
    pub(crate) colors: Vec<raster::Attach>,
    pub(crate) depth: Option<raster::Attach>,
}

impl RasterPass<'_, '_> {
    shared_calls!();

    /// Attaches a colour texture to the fragment output `member`.
    #[track_caller]
    pub fn color(self, member: &str, texture: &mut Handle<Texture>, load: Load) -> Self {
        self.color_at(member, texture, Subresources::ALL, load)
    }

    /// Attaches one mip and layer of a colour texture to the fragment output `member`.
    #[track_caller]
    pub fn color_at(mut self, member: &str, texture: &mut Handle<Texture>, part: Subresources, load: Load) -> Self {
        self.colors.push(raster::Attach::new(member, texture, part, load));
        self
    }

    /// Attaches a depth texture; fragments that pass the shader's depth test (`Less` unless it says otherwise) write their depth.
    #[track_caller]
    pub fn depth(self, texture: &mut Handle<Texture>, load: Load) -> Self {
        self.depth_at(texture, Subresources::ALL, load)
    }

    /// Attaches one mip and layer of a depth texture, as [`RasterPass::depth`].
    #[track_caller]
    pub fn depth_at(mut self, texture: &mut Handle<Texture>, part: Subresources, load: Load) -> Self {
        self.depth = Some(raster::Attach::new("depth", texture, part, load));
        self
    }

    /// Draws a triangle list of `vertices` vertices, `instances` times.
    pub fn draw(self, vertices: u32, instances: u32) {
        self.finish(Draw::Given { vertices, instances }, None);
    }

    /// Draws what four u32 (vertices, instances, first vertex, first instance) at `offset` (bytes, a multiple of 4) of
    /// `arguments` say when the pass runs. The first instance is 0 where the device lacks `INDIRECT_FIRST_INSTANCE`.
    #[track_caller]
    pub fn draw_indirect(self, arguments: &Handle<Buffer>, offset: u64) {
        let indirect = Indirect::new(arguments, offset, 16);
        self.finish(Draw::Indirect(indirect.source), Some(indirect));
    }

    fn finish(self, draw: Draw, indirect: Option<Indirect>) {
        let Self { graph, shader, calls, colors, depth } = self;
        let name = calls.name(&shader.core);
        let at = PassRef::new(&name, calls.location);
        let Checked { bound, mut accesses, mut errors } = calls.check(graph, &shader.core, at, indirect);
        let targets = raster::targets(graph, &shader, &colors, depth.as_ref(), at, &mut accesses, &mut errors);
        if errors.is_empty() {
            verify::conflicts(graph, &accesses, at, &mut errors);
        }
        if !errors.is_empty() {
            graph.refuse(errors);
            return;
        }
        graph.record(Recorded {
            decl: calls.decl(name, PassKind::Raster, accesses),
            work: Work::Raster { shader, bound, params: calls.params.map(|params| params.range), targets, draw },
        });
    }
}

/// Builds a pass the caller records; ends with [`ClosurePass::record`].
#[derive(Debug)]
#[must_use = "a pass takes effect at its `record` call"]
pub struct ClosurePass<'g, 'f> {
    pub(crate) graph: &'g mut Graph<'f>,
    pub(crate) name: String,
    pub(crate) accesses: Vec<Access>,
    pub(crate) foreign: Vec<String>,
    pub(crate) side_effect: bool,
    pub(crate) heavy: bool,
    pub(crate) pinned: bool,
    pub(crate) location: &'static Location<'static>,
}

impl<'f> ClosurePass<'_, 'f> {
    /// Reads `handle` by copying from it (usage `COPY_SRC`).
    pub fn read<T: Resource>(self, handle: &Handle<T>) -> Self {
        // COPY_SRC has the value 1 for textures and 4 for buffers; `copy_usage` knows.
        let usage = self.graph.copy_usage(handle.index, true);
        self.access(handle, true, Write::No, usage)
    }

    /// Writes `handle` by copying to it (usage `COPY_DST`); earlier contents stay where it does not write.
    pub fn write<T: Resource>(self, handle: &mut Handle<T>) -> Self {
        let usage = self.graph.copy_usage(handle.index, false);
        self.access(handle, false, Write::Keep, usage)
    }

    /// Reads `handle` with the given wgpu usages.
    pub fn read_as<T: Resource>(self, handle: &Handle<T>, usages: T::Usages) -> Self {
        self.access(handle, true, Write::No, T::usages(usages))
    }

    /// Writes `handle` with the given wgpu usages; earlier contents stay where it does not write.
    pub fn write_as<T: Resource>(self, handle: &mut Handle<T>, usages: T::Usages) -> Self {
        self.access(handle, false, Write::Keep, T::usages(usages))
    }

    /// The pass does something beyond its writes, so it is never culled, and is [pinned](Self::pinned).
    pub fn side_effect(mut self) -> Self {
        self.side_effect = true;
        self
    }

    /// Marks a long pass, as [`ComputePass::heavy`].
    pub fn heavy(mut self) -> Self {
        self.heavy = true;
        self
    }

    /// Keeps the pass in recorded order among the pinned passes, as [`ComputePass::pinned`].
    pub fn pinned(mut self) -> Self {
        self.pinned = true;
        self
    }

    fn access<T: Resource>(mut self, handle: &Handle<T>, read: bool, write: Write, usage: u32) -> Self {
        if handle.graph == self.graph.id {
            let binding = if read { "read" } else { "write" };
            self.accesses.push(Access::new(handle.index, binding, read, write, usage));
        } else {
            self.foreign.push(handle.name().to_owned());
        }
        self
    }

    /// Records the pass by `record`, called once when the frame executes, unless the pass was culled.
    pub fn record(self, record: impl FnOnce(&mut ClosureContext<'_>) -> Result<(), String> + 'f) {
        let Self { graph, name, accesses, foreign, side_effect, heavy, pinned, location } = self;
        let at = PassRef::new(&name, location);
        let mut errors: Vec<GraphError> =
            foreign.into_iter().map(|resource| GraphError::ForeignHandle { at: at.place(), resource }).collect();
        verify::conflicts(graph, &accesses, at, &mut errors);
        if !errors.is_empty() {
            graph.refuse(errors);
            return;
        }
        graph.record(Recorded {
            decl: PassDecl {
                name: Arc::from(name),
                kind: PassKind::Closure,
                heavy,
                side_effect,
                pinned: pinned || side_effect,
                accesses,
                place: Place(Some(location)),
            },
            work: Work::Closure(Record(Box::new(record))),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::fold_1d;

    #[test]
    fn long_rows_fold_into_y() {
        assert_eq!(fold_1d(65_535), [65_535, 1, 1]);
        for groups in [65_536, 100_000, 1 << 20, u32::MAX / 64] {
            let [x, y, z] = fold_1d(groups);
            assert!(x <= 65_535 && z == 1, "{groups}: {x} {y}");
            let total = u64::from(x) * u64::from(y);
            assert!(total >= groups.into() && total - u64::from(groups) < u64::from(y), "{groups}: {x}×{y}");
        }
    }
}
