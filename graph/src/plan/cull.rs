//! Leaves out passes whose results nothing uses, and says why, with the chain of passes that do not need them.
//!
//! One sweep from the back knows of each cell what becomes of its contents, so when it meets a pass it knows whether anything
//! that runs sees what the pass writes:
//!
//! ```text
//!   recorded     A writes t    B overwrites t    C reads t, writes the output
//!   of t  ◄──    dead          needed            dead                 so A does not run: `B` overwrites it
//! ```

use super::{
    Culled,
    uses::{Use, Uses},
};
use crate::declaration::Declaration;
use std::fmt::Write as _;

/// Per pass whether it runs, and the reasons of those that do not.
pub(super) fn cull(declaration: &Declaration, uses: &Uses) -> (Vec<bool>, Vec<Culled>) {
    let mut live = vec![true; declaration.passes.len()];
    let mut fates = vec![Fate::default(); uses.cells.len()];
    // What becomes of what culled passes write; passes from the back, of each its writes from the front.
    let mut writes: Vec<(u32, Fate)> = Vec::new();
    // Culled passes, with where their writes begin.
    let mut dead: Vec<(usize, usize)> = Vec::new();
    for (index, pass) in declaration.passes.iter().enumerate().rev() {
        let all = uses.of(index);
        let needed = |used: &Use| used.wanted || (used.writes && fates[used.cells()].iter().any(|fate| fate.needed));
        live[index] = pass.side_effect || all.iter().any(needed);
        if !live[index] {
            dead.push((index, writes.len()));
            for access in all.chunk_by(Use::is_of_same).filter(|access| access[0].writes) {
                let fates = access.iter().flat_map(|used| &fates[used.cells()]);
                // What is read somewhere is told first, then what is overwritten.
                let told = |fate: &&Fate| if fate.next == NONE { 2 } else { u8::from(fate.readers == 0) };
                writes.push((access[0].resource, fates.min_by_key(told).copied().unwrap_or_default()));
            }
        }
        // What a pass overwrites it may see before.
        for used in all.iter().filter(|used| !used.sees) {
            fates[used.cells()].fill(Fate { next: index as u32, readers: 0, needed: false });
        }
        for used in all.iter().filter(|used| used.sees) {
            fates[used.cells()].iter_mut().for_each(|fate| fate.seen(index as u32, live[index]));
        }
    }
    let chains = Chains { declaration, writes, dead };
    let culled = chains.dead.iter().enumerate().rev();
    let culled = culled
        .map(|(at, &(index, _))| Culled { index, pass: declaration.passes[index].name.clone(), reason: chains.reason(at) })
        .collect();
    (live, culled)
}

/// No pass.
const NONE: u32 = u32::MAX;

/// What becomes of the contents of a cell.
#[derive(Clone, Copy, Debug)]
struct Fate {
    /// The pass that uses the cell next, if any.
    next: u32,
    /// How many see the contents before any overwrites them, `next` among them.
    readers: u32,
    /// Whether one of these runs.
    needed: bool,
}

impl Default for Fate {
    fn default() -> Self {
        Self { next: NONE, readers: 0, needed: false }
    }
}

impl Fate {
    /// As it is before `pass` sees the contents.
    fn seen(&mut self, pass: u32, runs: bool) {
        if self.next != pass || self.readers == 0 {
            self.readers += 1;
        }
        self.next = pass;
        self.needed |= runs;
    }
}

/// Steps of a chain that are spelt out.
const LINKS: usize = 4;

/// What becomes of what culled passes write.
struct Chains<'a> {
    declaration: &'a Declaration,
    /// Resources they write, pass after pass.
    writes: Vec<(u32, Fate)>,
    /// Culled passes from the last, with where their writes begin.
    dead: Vec<(usize, usize)>,
}

impl Chains<'_> {
    fn writes(&self, at: usize) -> &[(u32, Fate)] {
        let end = self.dead.get(at + 1).map_or(self.writes.len(), |&(_, start)| start);
        &self.writes[self.dead[at].1..end]
    }

    fn name(&self, pass: u32) -> &str {
        &self.declaration.passes[pass as usize].name
    }

    fn resource(&self, resource: u32) -> &str {
        &self.declaration.resources[resource as usize].name
    }

    /// Why a pass does not run. Each thing it writes has a chain that ends where nothing follows.
    fn reason(&self, at: usize) -> String {
        let mut text = String::with_capacity(160);
        for &(resource, fate) in self.writes(at) {
            if !text.is_empty() {
                text.push_str("; ");
            }
            Self::tell(&mut text, "writes ", self.resource(resource), ", ");
            self.follow(fate, &mut text);
        }
        if text.is_empty() { "writes nothing and has no side effect".to_owned() } else { text }
    }

    /// Tells a fate, and what became of what its readers wrote from it.
    fn follow(&self, mut fate: Fate, text: &mut String) {
        for link in 0.. {
            if fate.next == NONE {
                text.push_str("which nothing reads");
                return;
            }
            if fate.readers == 0 {
                Self::tell(text, "which ", self.name(fate.next), " overwrites before anything reads it");
                return;
            }
            Self::tell(text, "read only by ", self.name(fate.next), "");
            if fate.readers > 1 {
                let _ = write!(text, " and {} more that are culled", fate.readers - 1);
            }
            // All that see it are culled too, or the writer would run.
            let next = self.dead.binary_search_by(|&(pass, _)| (fate.next as usize).cmp(&pass));
            let Some(&(resource, then)) = next.ok().and_then(|at| self.writes(at).first()) else {
                text.push_str(", which writes nothing and has no side effect");
                return;
            };
            if link == LINKS {
                text.push_str(", which is culled in turn");
                return;
            }
            Self::tell(text, ", which writes ", self.resource(resource), ", ");
            fate = then;
        }
    }

    fn tell(text: &mut String, before: &str, name: &str, after: &str) {
        for part in [before, "`", name, "`", after] {
            text.push_str(part);
        }
    }
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
        let reasons: Vec<(&str, &str)> = plan.culled.iter().map(|c| (&*c.pass, c.reason.as_str())).collect();
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
