//! Which pass must come after which earlier one. A culled pass between two that run orders nothing; what the one reads and the
//! other overwrites, does.

use super::uses::Uses;

/// An edge from an earlier pass to a later one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Edge {
    pub(super) from: u32,
    pub(super) to: u32,
}

/// No pass, or the end of a list.
const NONE: u32 = u32::MAX;

/// All edges among the passes that run, in recorded order of `to`; all lead forwards.
pub(super) fn dependencies(uses: &Uses, runs: &[bool]) -> Vec<Edge> {
    let mut writer = vec![NONE; uses.cells.len()];
    // Readers of each cell since its last write, as lists in one vector: (pass, next).
    let mut readers = vec![NONE; uses.cells.len()];
    let mut links: Vec<(u32, u32)> = Vec::with_capacity(runs.len() * 4);
    let mut edges = Vec::with_capacity(runs.len() * 4);
    let mut join = |from: u32, to: u32| {
        if from != NONE && from != to {
            edges.push(Edge { from, to });
        }
    };
    for pass in (0..runs.len()).filter(|&pass| runs[pass]) {
        let to = pass as u32;
        for used in uses.of(pass) {
            for cell in used.cells() {
                join(writer[cell], to);
                if !used.writes {
                    links.push((to, readers[cell]));
                    readers[cell] = links.len() as u32 - 1;
                    continue;
                }
                let mut link = readers[cell];
                while link != NONE {
                    let (reader, next) = links[link as usize];
                    join(reader, to);
                    link = next;
                }
                (writer[cell], readers[cell]) = (to, NONE);
            }
        }
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Declaration;

    fn edges(frame: &str) -> Vec<(u32, u32)> {
        let declaration = Declaration::from_frame_json(frame).unwrap();
        let runs = vec![true; declaration.passes.len()];
        let mut edges: Vec<(u32, u32)> =
            dependencies(&Uses::new(&declaration).unwrap(), &runs).iter().map(|edge| (edge.from, edge.to)).collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    #[test]
    fn readers_wait_for_writers_and_writers_for_readers() {
        let frame = r#"{"frame": "f",
            "resources": [{"name": "a", "kind": "buffer", "origin": "transient", "bytes": 4}],
            "passes": [{"name": "write", "kind": "compute", "writes": [{"resource": "a"}]},
                       {"name": "read", "kind": "compute", "reads": ["a"]},
                       {"name": "add", "kind": "compute", "writes": [{"resource": "a", "preserve": true}]},
                       {"name": "clear", "kind": "compute", "writes": [{"resource": "a"}]}]}"#;
        assert_eq!(edges(frame), [(0, 1), (0, 2), (1, 2), (2, 3)]);
    }

    #[test]
    fn mips_are_written_apart() {
        let frame = r#"{"frame": "f",
            "resources": [{"name": "t", "kind": "texture", "origin": "transient", "format": "r32float", "size": [8, 8, 1], "mips": 3}],
            "passes": [{"name": "0", "kind": "compute", "writes": [{"resource": "t", "mips": [0, 1]}]},
                       {"name": "1", "kind": "compute", "reads": [{"resource": "t", "mips": [0, 1]}], "writes": [{"resource": "t", "mips": [1, 2]}]},
                       {"name": "again", "kind": "compute", "writes": [{"resource": "t", "mips": [2, 3]}]},
                       {"name": "all", "kind": "compute", "reads": ["t"]}]}"#;
        assert_eq!(edges(frame), [(0, 1), (0, 3), (1, 3), (2, 3)], "mip 2 waits for nobody");
    }
}
