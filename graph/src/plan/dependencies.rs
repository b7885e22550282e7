//! Which pass needs which earlier pass, and why.

use crate::declaration::{Declaration, Write};

/// An edge from an earlier pass to a later one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Edge {
    pub(super) from: usize,
    pub(super) to: usize,
    /// Whether `to` sees what `from` wrote; otherwise only the order matters.
    pub(super) data: bool,
}

/// All edges, in recorded order of `to`; all lead forwards.
pub(super) fn dependencies(declaration: &Declaration) -> Vec<Edge> {
    let mut writer: Vec<Option<usize>> = vec![None; declaration.resources.len()];
    let mut readers: Vec<Vec<usize>> = vec![Vec::new(); declaration.resources.len()];
    let mut edges = Vec::new();
    for (to, pass) in declaration.passes.iter().enumerate() {
        for access in pass.accesses.iter().filter(|access| access.read || !access.writes()) {
            if let Some(from) = writer[access.resource] {
                edges.push(Edge { from, to, data: true });
            }
        }
        for access in pass.accesses.iter().filter(|access| access.writes()) {
            if let Some(from) = writer[access.resource] {
                edges.push(Edge { from, to, data: access.write == Write::Keep });
            }
            edges.extend(readers[access.resource].drain(..).filter(|&from| from != to).map(|from| Edge { from, to, data: false }));
        }
        for access in &pass.accesses {
            if access.writes() {
                writer[access.resource] = Some(to);
            } else {
                readers[access.resource].push(to);
            }
        }
    }
    edges.retain(|edge| edge.from != edge.to);
    edges
}
