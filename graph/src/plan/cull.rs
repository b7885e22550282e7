//! Leaves out passes whose results nothing uses, and says why, with the chain of passes that do not need them.

use super::{Culled, cells::Cells, dependencies::Edge};
use crate::declaration::{Access, Declaration, PassDecl, Write};
use std::fmt::Write as _;

/// Per pass whether it runs, and the reasons of those that do not.
pub(super) fn cull(declaration: &Declaration, cells: &Cells, edges: &[Edge]) -> (Vec<bool>, Vec<Culled>) {
    let passes = declaration.passes.len();
    let mut live: Vec<bool> = declaration.passes.iter().map(|pass| is_root(declaration, pass)).collect();
    if !live.iter().all(|&live| live) {
        // Edges lead forwards and come by their target, so one sweep from the back reaches all that a root needs.
        for edge in edges.iter().rev().filter(|edge| edge.data) {
            live[edge.from] |= live[edge.to];
        }
    }
    if live.iter().all(|&live| live) {
        return (live, Vec::new());
    }
    let chains = Chains::new(declaration, cells);
    let culled = (0..passes)
        .filter(|&pass| !live[pass])
        .map(|index| Culled { index, pass: declaration.passes[index].name.to_string(), reason: chains.reason(index) })
        .collect();
    (live, culled)
}

fn is_root(declaration: &Declaration, pass: &PassDecl) -> bool {
    pass.side_effect
        || pass.accesses.iter().filter(|access| access.writes()).any(|access| {
            let resource = &declaration.resources[access.resource];
            resource.keep || resource.origin.outlives_frame()
        })
}

/// Steps of a chain that are spelt out.
const LINKS: usize = 4;

/// What becomes of what passes write.
struct Chains<'a> {
    declaration: &'a Declaration,
    cells: &'a Cells,
    /// Cell by cell: the passes that use it, in recorded order, with whether they see earlier contents.
    uses: Vec<(u32, bool)>,
    /// Where each cell's uses begin, and the end of the last.
    starts: Vec<u32>,
}

impl<'a> Chains<'a> {
    fn new(declaration: &'a Declaration, cells: &'a Cells) -> Self {
        let accesses =
            || declaration.passes.iter().enumerate().flat_map(|(pass, decl)| decl.accesses.iter().map(move |a| (pass, a)));
        // Counts, then a running sum; the second round moves each start to its cell's end, the next one's start.
        let mut starts = vec![0_u32; cells.len() + 2];
        for (_, access) in accesses() {
            cells.of(access).for_each(|cell| starts[cell + 2] += 1);
        }
        for cell in 2..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut uses = vec![(0, false); starts.last().map_or(0, |&end| end as usize)];
        for (pass, access) in accesses() {
            for cell in cells.of(access) {
                uses[starts[cell + 1] as usize] = (pass as u32, access.read || access.write != Write::Overwrite);
                starts[cell + 1] += 1;
            }
        }
        Self { declaration, cells, uses, starts }
    }

    fn uses(&self, cell: usize) -> &[(u32, bool)] {
        &self.uses[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    fn name(&self, pass: usize) -> &str {
        &self.declaration.passes[pass].name
    }

    /// Why `pass` does not run. Each thing it writes has a chain that ends where nothing follows.
    fn reason(&self, pass: usize) -> String {
        let mut text = String::with_capacity(160);
        for access in self.writes(pass) {
            if !text.is_empty() {
                text.push_str("; ");
            }
            Self::tell(&mut text, "writes ", &self.declaration.resources[access.resource].name, ", ");
            self.follow(self.fate(pass, access), &mut text);
        }
        if text.is_empty() { "writes nothing and has no side effect".to_owned() } else { text }
    }

    fn writes(&self, pass: usize) -> impl Iterator<Item = &'a Access> + use<'a> {
        self.declaration.passes[pass].accesses.iter().filter(|access| access.writes())
    }

    /// Tells a fate, and what became of what its readers wrote from it.
    fn follow(&self, mut fate: Fate, text: &mut String) {
        for link in 0.. {
            match fate {
                Fate::Unread => {
                    text.push_str("which nothing reads");
                    return;
                }
                Fate::Overwritten(by) => {
                    Self::tell(text, "which ", self.name(by), " overwrites before anything reads it");
                    return;
                }
                Fate::Read(by, others) => {
                    Self::tell(text, "read only by ", self.name(by), "");
                    if others > 0 {
                        let _ = write!(text, " and {others} more that are culled");
                    }
                    let Some(access) = self.writes(by).next() else {
                        text.push_str(", which writes nothing and has no side effect");
                        return;
                    };
                    if link == LINKS {
                        text.push_str(", which is culled in turn");
                        return;
                    }
                    Self::tell(text, ", which writes ", &self.declaration.resources[access.resource].name, ", ");
                    fate = self.fate(by, access);
                }
            }
        }
    }

    fn tell(text: &mut String, before: &str, name: &str, after: &str) {
        for part in [before, "`", name, "`", after] {
            text.push_str(part);
        }
    }

    /// What becomes of what `pass` writes by one access.
    fn fate(&self, pass: usize, access: &Access) -> Fate {
        let mut fate = Fate::Unread;
        for cell in self.cells.of(access) {
            let uses = self.uses(cell);
            let after = &uses[uses.partition_point(|&(other, _)| other as usize <= pass)..];
            let found = match after.first() {
                None => Fate::Unread,
                Some(&(by, false)) => Fate::Overwritten(by as usize),
                Some(&(by, true)) => {
                    let readers = after.iter().take_while(|(_, sees)| *sees);
                    Fate::Read(by as usize, readers.filter(|(other, _)| *other != by).count())
                }
            };
            if matches!(fate, Fate::Unread) || matches!((&fate, &found), (Fate::Overwritten(_), Fate::Read(..))) {
                fate = found;
            }
        }
        fate
    }
}

/// What becomes of what a culled pass wrote.
enum Fate {
    Unread,
    Overwritten(usize),
    /// By this culled pass first, and by so many others.
    Read(usize, usize),
}

#[cfg(test)]
mod tests {
    use super::super::{PlanOptions, plan};
    use crate::Declaration;

    #[test]
    fn every_culled_pass_has_its_chain() {
        let frame = r#"{"frame": "f",
            "resources": [{"name": "out", "kind": "buffer", "origin": "imported", "bytes": 4},
                          {"name": "a", "kind": "buffer", "origin": "transient", "bytes": 4},
                          {"name": "b", "kind": "buffer", "origin": "transient", "bytes": 4}],
            "passes": [{"name": "overwritten", "kind": "compute", "reads": [], "writes": [{"resource": "a"}]},
                       {"name": "source", "kind": "compute", "reads": [], "writes": [{"resource": "a"}]},
                       {"name": "dead", "kind": "compute", "reads": ["a"], "writes": [{"resource": "b"}]},
                       {"name": "dead too", "kind": "compute", "reads": ["b"], "writes": [{"resource": "b", "preserve": true}]},
                       {"name": "idle", "kind": "compute", "reads": ["a"], "writes": []},
                       {"name": "sink", "kind": "compute", "reads": ["a"], "writes": [{"resource": "out"}]}]}"#;
        let plan = plan(&Declaration::from_frame_json(frame).unwrap(), &PlanOptions::default()).unwrap();
        assert_eq!(plan.order, [1, 5]);
        let reasons: Vec<(&str, &str)> = plan.culled.iter().map(|c| (c.pass.as_str(), c.reason.as_str())).collect();
        assert_eq!(
            reasons,
            [
                ("overwritten", "writes `a`, which `source` overwrites before anything reads it"),
                ("dead", "writes `b`, read only by `dead too`, which writes `b`, which nothing reads"),
                ("dead too", "writes `b`, which nothing reads"),
                ("idle", "writes nothing and has no side effect"),
            ]
        );
    }

    #[test]
    fn a_long_chain_is_cut_short() {
        let pass = |i: usize| {
            let reads = if i == 0 { String::new() } else { format!("\"r{}\"", i - 1) };
            format!(r#"{{"name": "p{i}", "kind": "compute", "reads": [{reads}], "writes": [{{"resource": "r{i}"}}]}}"#)
        };
        let resource = |i: usize| format!(r#"{{"name": "r{i}", "kind": "buffer", "origin": "transient", "bytes": 4}}"#);
        let join = |f: &dyn Fn(usize) -> String| (0..50).map(f).collect::<Vec<_>>().join(",");
        let frame = format!(r#"{{"frame": "f", "resources": [{}], "passes": [{}]}}"#, join(&resource), join(&pass));
        let plan = plan(&Declaration::from_frame_json(&frame).unwrap(), &PlanOptions::default()).unwrap();
        assert_eq!(plan.culled.len(), 50);
        assert!(plan.culled[0].reason.starts_with("writes `r0`, read only by `p1`, which writes `r1`, read only by `p2`"));
        assert!(plan.culled[0].reason.ends_with("read only by `p5`, which is culled in turn"), "{}", plan.culled[0].reason);
        assert!(plan.culled[48].reason.ends_with("which writes `r49`, which nothing reads"));
    }
}
