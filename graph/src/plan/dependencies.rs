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
            edges.extend(readers[access.resource].drain(..).filter(|&from| from != to).map(|from| Edge {
                from,
                to,
                data: false,
            }));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readers_wait_for_writers_and_writers_for_readers() {
        let frame = r#"{"frame": "f",
            "resources": [{"name": "a", "kind": "buffer", "origin": "transient", "bytes": 4}],
            "passes": [{"name": "write", "kind": "compute", "writes": [{"resource": "a"}]},
                       {"name": "read", "kind": "compute", "reads": ["a"]},
                       {"name": "add", "kind": "compute", "writes": [{"resource": "a", "preserve": true}]},
                       {"name": "clear", "kind": "compute", "writes": [{"resource": "a"}]}]}"#;
        let mut edges = dependencies(&Declaration::from_frame_json(frame).unwrap());
        edges.sort_by_key(|edge| (edge.from, edge.to, edge.data));
        edges.dedup();
        let edge = |from, to, data| Edge { from, to, data };
        assert_eq!(edges, [edge(0, 1, true), edge(0, 2, true), edge(1, 2, false), edge(2, 3, false)]);
    }
}
