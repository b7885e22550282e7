//! The accesses of a frame, made small: what every phase goes over, some of them several times.

use super::{cells::Cells, validate};
use crate::{
    declaration::{Access, Declaration, Origin, ResourceDecl, Write},
    error::GraphError,
};
use std::ops::Range;

/// What planning needs to know of an access, or of one row of its cells where it has several.
#[derive(Clone, Copy, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "answers, each asked for alone")]
pub(super) struct Use {
    pub(super) resource: u32,
    /// Which access of the pass.
    access: u32,
    /// wgpu usage bits.
    pub(super) usage: u32,
    first_cell: u32,
    end_cell: u32,
    pub(super) reads: bool,
    pub(super) writes: bool,
    /// Whether what was there before shows.
    pub(super) sees: bool,
    /// As in [`Access`].
    pub(super) exclusive: bool,
    /// Whether the resource is the graph's for this frame.
    pub(super) transient: bool,
    /// Whether what is written is wanted beyond the frame.
    pub(super) wanted: bool,
}

impl Use {
    /// The access at a position among those of its pass, where a resource is one cell.
    fn new(access: &Access, at: u32, resource: &ResourceDecl) -> Self {
        let (reads, writes) = (access.read, access.writes());
        Self {
            resource: access.resource as u32,
            access: at,
            usage: access.usage,
            first_cell: access.resource as u32,
            end_cell: access.resource as u32 + 1,
            reads,
            writes,
            sees: reads || access.write != Write::Overwrite,
            exclusive: access.exclusive,
            transient: resource.origin == Origin::Transient,
            wanted: writes && (resource.keep || resource.origin.outlives_frame()),
        }
    }

    pub(super) fn cells(&self) -> Range<usize> {
        self.first_cell as usize..self.end_cell as usize
    }

    /// The access it is of.
    pub(super) fn of<'a>(&self, declaration: &'a Declaration, pass: usize) -> &'a Access {
        &declaration.passes[pass].accesses[self.access as usize]
    }

    /// Whether both, of one pass, are of one access.
    pub(super) fn is_of_same(&self, other: &Self) -> bool {
        self.access == other.access
    }
}

/// All of a frame, pass after pass.
#[derive(Debug)]
pub(super) struct Uses {
    pub(super) cells: Cells,
    /// Where those of each pass begin, and the end of the last.
    starts: Vec<u32>,
    all: Vec<Use>,
}

impl Uses {
    /// Of a declaration.
    ///
    /// # Errors
    /// If an access does not fit ([`validate::access`]).
    pub(super) fn new(declaration: &Declaration) -> Result<Self, GraphError> {
        let mut errors = Vec::new();
        let mut in_parts = false;
        let mut starts = Vec::with_capacity(declaration.passes.len() + 1);
        let mut all = Vec::with_capacity(3 * declaration.passes.len());
        for pass in &declaration.passes {
            starts.push(all.len() as u32);
            for (at, access) in (0..).zip(&pass.accesses) {
                if let Err(error) = validate::access(declaration, pass, access) {
                    errors.push(error);
                    continue;
                }
                in_parts |= !access.part.is_all();
                all.push(Use::new(access, at, &declaration.resources[access.resource]));
            }
        }
        starts.push(all.len() as u32);
        let whole = Self { cells: Cells::uncut(declaration.resources.len()), starts, all };
        match GraphError::collect(errors) {
            Some(error) => Err(error),
            None if in_parts => Ok(whole.cut(declaration)),
            None => Ok(whole),
        }
    }

    /// The same, by the cells of resources that are used in parts.
    fn cut(self, declaration: &Declaration) -> Self {
        let cells = Cells::new(declaration);
        let mut starts = Vec::with_capacity(self.starts.len());
        let mut all = Vec::with_capacity(2 * self.all.len());
        for pass in 0..declaration.passes.len() {
            starts.push(all.len() as u32);
            for used in self.of(pass) {
                let row = |row: Range<usize>| Use { first_cell: row.start as u32, end_cell: row.end as u32, ..*used };
                all.extend(cells.of(used.of(declaration, pass)).map(row));
            }
        }
        starts.push(all.len() as u32);
        Self { cells, starts, all }
    }

    /// Those of one pass.
    pub(super) fn of(&self, pass: usize) -> &[Use] {
        &self.all[self.starts[pass] as usize..self.starts[pass + 1] as usize]
    }

    /// Those of several passes.
    pub(super) fn of_all<'a>(&'a self, passes: &'a [usize]) -> impl Iterator<Item = &'a Use> {
        passes.iter().flat_map(|&pass| self.of(pass))
    }
}
