//! Calls whose size the GPU decides: arguments that earlier passes write.

use crate::{
    Buffer, Graph, Handle,
    declaration::{Access, Write},
    error::{GraphError, PassRef},
    verify,
};
use std::sync::Arc;

/// How many workgroups run.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Groups {
    Given([u32; 3]),
    Indirect(IndirectSource),
}

/// What a draw draws.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Draw {
    Given { vertices: u32, instances: u32 },
    Indirect(IndirectSource),
}

/// Where the arguments of an indirect call lie.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IndirectSource {
    pub(crate) resource: usize,
    /// Bytes.
    pub(crate) offset: u64,
}

/// The arguments of an indirect call, not yet checked.
pub(crate) struct Indirect {
    pub(crate) source: IndirectSource,
    graph: u64,
    name: Arc<str>,
    /// Bytes of the arguments, and of the buffer.
    needed: u64,
    given: u64,
}

impl Indirect {
    pub(crate) fn new(buffer: &Handle<Buffer>, offset: u64, needed: u64) -> Self {
        let source = IndirectSource { resource: buffer.index, offset };
        Self { source, graph: buffer.graph, name: Arc::clone(&buffer.name), needed, given: buffer.desc.padded() }
    }

    pub(crate) fn check(self, graph: &Graph<'_>, at: PassRef<'_>, accesses: &mut Vec<Access>, errors: &mut Vec<GraphError>) {
        if self.graph != graph.id {
            errors.push(GraphError::ForeignHandle { at: at.place(), resource: self.name.to_string() });
            return;
        }
        let offset = self.source.offset;
        if !offset.is_multiple_of(4) || offset.saturating_add(self.needed) > self.given {
            let (resource, needed, given) = (self.name.to_string(), self.needed, self.given);
            errors.push(GraphError::Indirect { at: at.place(), resource, offset, needed, given });
            return;
        }
        let usage = wgpu::BufferUsages::INDIRECT.bits();
        accesses.push(Access::new(self.source.resource, "indirect arguments", true, Write::No, usage));
        verify::conflicts(graph, accesses, at, errors);
    }
}
