//! Which pass must come after which earlier one. A culled pass between two that run orders nothing; what the one reads and the
//! other overwrites, does.

use super::cells::Cells;
use crate::declaration::Declaration;

/// An edge from an earlier pass to a later one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Edge {
    pub(super) from: usize,
    pub(super) to: usize,
}

/// No pass, or the end of a list.
const NONE: u32 = u32::MAX;

/// All edges among the passes for which `runs` holds, in recorded order of `to`; all lead forwards.
pub(super) fn dependencies(declaration: &Declaration, cells: &Cells, runs: impl Fn(usize) -> bool) -> Vec<Edge> {
    let mut writer = vec![NONE; cells.len()];
    // Readers of each cell since its last write, as lists in one vector: (pass, next).
    let mut readers = vec![NONE; cells.len()];
    let mut links: Vec<(u32, u32)> = Vec::with_capacity(declaration.passes.len() * 4);
    let mut edges = Vec::with_capacity(declaration.passes.len() * 4);
    let mut join = |from: u32, to: usize| {
        if from != NONE && from as usize != to {
            edges.push(Edge { from: from as usize, to });
        }
    };
    for (to, pass) in declaration.passes.iter().enumerate().filter(|(to, _)| runs(*to)) {
        for access in &pass.accesses {
            for cell in cells.of(access) {
                join(writer[cell], to);
                if access.writes() {
                    let mut link = readers[cell];
                    while link != NONE {
                        let (reader, next) = links[link as usize];
                        join(reader, to);
                        link = next;
                    }
                }
            }
        }
        for access in &pass.accesses {
            for cell in cells.of(access) {
                if access.writes() {
                    writer[cell] = to as u32;
                    readers[cell] = NONE;
                } else {
                    links.push((to as u32, readers[cell]));
                    readers[cell] = links.len() as u32 - 1;
                }
            }
        }
    }
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
        let declaration = Declaration::from_frame_json(frame).unwrap();
        let mut edges = dependencies(&declaration, &Cells::new(&declaration), |_| true);
        edges.sort_by_key(|edge| (edge.from, edge.to));
        edges.dedup();
        let edge = |from, to| Edge { from, to };
        assert_eq!(edges, [edge(0, 1), edge(0, 2), edge(1, 2), edge(2, 3)]);
    }

    #[test]
    fn mips_are_written_apart() {
        let frame = r#"{"frame": "f",
            "resources": [{"name": "t", "kind": "texture", "origin": "transient", "format": "r32float", "size": [8, 8, 1], "mips": 3}],
            "passes": [{"name": "0", "kind": "compute", "writes": [{"resource": "t", "mips": [0, 1]}]},
                       {"name": "1", "kind": "compute", "reads": [{"resource": "t", "mips": [0, 1]}], "writes": [{"resource": "t", "mips": [1, 2]}]},
                       {"name": "again", "kind": "compute", "writes": [{"resource": "t", "mips": [2, 3]}]},
                       {"name": "all", "kind": "compute", "reads": ["t"]}]}"#;
        let declaration = Declaration::from_frame_json(frame).unwrap();
        let mut edges: Vec<(usize, usize)> =
            dependencies(&declaration, &Cells::new(&declaration), |_| true).iter().map(|edge| (edge.from, edge.to)).collect();
        edges.sort_unstable();
        assert_eq!(edges, [(0, 1), (0, 3), (1, 3), (2, 3)], "mip 2 waits for nobody");
    }
}
