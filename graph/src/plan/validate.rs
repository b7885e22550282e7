//! Refuses frames that cannot mean anything: what shows only over the whole frame.

use super::{
    cells,
    uses::{Use, Uses},
};
use crate::{
    Subresources,
    declaration::{Access, Declaration, Origin, PassDecl},
    error::{GraphError, PassRef},
    hash::Folded,
};
use std::hash::Hasher;

/// Names that occur twice.
pub(super) fn names(declaration: &Declaration) -> Result<(), GraphError> {
    let mut errors = Vec::new();
    let (resources, passes) = (&declaration.resources, &declaration.passes);
    unique("resource", declaration, resources.len(), |at| &resources[at].name, &mut errors);
    unique("pass", declaration, passes.len(), |at| &passes[at].name, &mut errors);
    GraphError::collect(errors).map_or(Ok(()), Err)
}

/// An access whose index or part does not fit, or that writes to a previous frame.
#[inline]
pub(super) fn access(declaration: &Declaration, pass: &PassDecl, access: &Access) -> Result<(), GraphError> {
    let Some(resource) = declaration.resources.get(access.resource) else {
        return Err(GraphError::UnknownResource {
            frame: declaration.name.clone(),
            pass: pass.name.to_string(),
            verb: if access.writes() { "writes" } else { "reads" },
            resource: format!("#{}", access.resource),
            hint: String::new(),
        });
    };
    if access.writes() && resource.origin == Origin::Previous {
        return Err(GraphError::WritesPrevious { at: pass.place(), resource: resource.name.to_string() });
    }
    if access.part.is_all() {
        return Ok(());
    }
    part_error(declaration, access.resource, access.part, pass.at()).map_or(Ok(()), Err)
}

/// If the resource has no such mips or layers.
pub(crate) fn part_error(declaration: &Declaration, resource: usize, part: Subresources, at: PassRef<'_>) -> Option<GraphError> {
    let [mips, layers] = cells::counts(declaration, resource);
    let inside = |[start, end]: [u32; 2], count: u32| start < end && start < count && (end <= count || end == u32::MAX);
    if inside(part.mips, mips) && inside(part.layers, layers) {
        return None;
    }
    Some(GraphError::NoSuchPart {
        at: at.place(),
        resource: declaration.resources[resource].name.to_string(),
        part: part.to_string(),
        mips,
        layers,
    })
}

/// Reads of what nothing wrote.
pub(super) fn contents(declaration: &Declaration, uses: &Uses) -> Result<(), GraphError> {
    let mut errors = Vec::new();
    let mut written = vec![false; uses.cells.len()];
    for (index, _) in declaration.resources.iter().enumerate().filter(|(_, resource)| resource.origin.has_contents()) {
        written[uses.cells.of_resource(index)].fill(true);
    }
    let mut writers: Option<Vec<Vec<usize>>> = None;
    for pass in 0..declaration.passes.len() {
        let all = uses.of(pass);
        let stale_rows = all.iter().filter(|used| used.reads && written[used.cells()].iter().any(|written| !written));
        let mut told: Option<&Use> = None;
        for used in stale_rows {
            if told.is_none_or(|told| !told.is_of_same(used)) {
                let writers = writers.get_or_insert_with(|| all_writers(declaration));
                errors.push(stale(declaration, uses, writers, &written, pass, used));
                told = Some(used);
            }
        }
        for used in all.iter().filter(|used| used.writes) {
            written[used.cells()].fill(true);
        }
    }
    GraphError::collect(errors).map_or(Ok(()), Err)
}

/// Names that occur twice. The table holds indices at the places of their names' hashes, or at the next ones that are free.
fn unique<'a>(
    what: &'static str,
    declaration: &Declaration,
    count: usize,
    name: impl Fn(usize) -> &'a str,
    errors: &mut Vec<GraphError>,
) {
    const FREE: u32 = u32::MAX;
    let mut table = vec![FREE; (2 * count).next_power_of_two()];
    for second in 0..count {
        let mut hash = Folded::default();
        hash.write(name(second).as_bytes());
        let mut at = hash.finish() as usize;
        loop {
            at &= table.len() - 1;
            let first = table[at];
            if first == FREE {
                table[at] = second as u32;
                break;
            }
            if name(first as usize) == name(second) {
                let (frame, name, first) = (declaration.name.clone(), name(second).to_owned(), first as usize);
                errors.push(GraphError::DuplicateName { frame, what, name, first, second });
                break;
            }
            at += 1;
        }
    }
}

/// What is wrong with an access, given by one of its rows, that reads what was not `written`.
#[cold]
fn stale(declaration: &Declaration, uses: &Uses, writers: &[Vec<usize>], written: &[bool], pass: usize, row: &Use) -> GraphError {
    let index = row.resource as usize;
    let access = row.of(declaration, pass);
    let resource = &declaration.resources[index];
    let missing = |writer: usize| {
        let wrote = |cell| uses.of(writer).iter().any(|used| used.writes && used.cells().contains(&cell));
        uses.cells.of(access).flatten().any(|cell| !written[cell] && wrote(cell))
    };
    let later = writers[index].iter().copied().find(|&writer| writer > pass && missing(writer));
    if let Some(path) = later.and_then(|later| cycle(declaration, writers, pass, index, later)) {
        return GraphError::Cycle { path };
    }
    let mend = match later {
        Some(later) => format!("`{}` writes it later: record that first", declaration.passes[later].name),
        None if resource.origin == Origin::Current => "write it first, or read the `previous` handle of the pair".to_owned(),
        None => "write or clear it first (`clear_buffer`, `Load::Clear`), or keep it between frames as history".to_owned(),
    };
    let part = if access.part.is_all() { String::new() } else { format!(", {}", access.part) };
    GraphError::StaleRead {
        at: declaration.passes[pass].place(),
        resource: resource.name.to_string(),
        how: format!("{}{part}", access.binding),
        mend,
    }
}

fn all_writers(declaration: &Declaration) -> Vec<Vec<usize>> {
    let mut writers = vec![Vec::new(); declaration.resources.len()];
    for (index, pass) in declaration.passes.iter().enumerate() {
        for access in pass.accesses.iter().filter(|access| access.writes()) {
            writers[access.resource].push(index);
        }
    }
    writers
}

/// If the later writer itself needs what `reader` writes, the way round, in words.
fn cycle(declaration: &Declaration, writers: &[Vec<usize>], reader: usize, resource: usize, later: usize) -> Option<String> {
    let name = |pass: usize| &declaration.passes[pass].name;
    let mut seen = vec![false; declaration.passes.len()];
    // (pass, resource it is needed for, position of the pass that needs it)
    let mut queue = vec![(later, resource, usize::MAX)];
    seen[later] = true;
    let mut next = 0;
    while next < queue.len() {
        let (pass, ..) = queue[next];
        if pass == reader {
            let mut steps = Vec::new();
            let mut at = next;
            while at != usize::MAX {
                let (pass, resource, parent) = queue[at];
                steps.push(format!("`{}` writes `{}` for", name(pass), declaration.resources[resource].name));
                at = parent;
            }
            return Some(format!("{} `{}`", steps.join(" "), name(reader)));
        }
        for access in declaration.passes[pass].accesses.iter().filter(|access| access.read) {
            for &writer in &writers[access.resource] {
                if writer != pass && !seen[writer] {
                    seen[writer] = true;
                    queue.push((writer, access.resource, next));
                }
            }
        }
        next += 1;
    }
    None
}
