//! Topological order, improved so that less memory is in use at once.
//!
//! ```text
//!   recorded      A B C d b c ■     A, B and C each write what d, b and c read: four are in use at the peak
//!   for memory    A B b C c d       each is read as soon as it can be; the peak is what d needs anyway
//! ```
//!
//! Finding the order of least peak is NP-hard (it is register allocation by another name). Frames are mostly recorded well, so
//! local moves start from the recorded order ([`improve`]), and end where none lowers the peak. Where they have not ended
//! soon, the recorded order was far from good, and two of list scheduling ([`list`]) are asked, from the back and from the front.
//! One that cannot be better is taken; else the moves go on, and where their effort is spent at last, those two are improved in
//! turn. No order is taken over the recorded one unless its peak is lower, and the result depends on nothing but the
//! declaration.
//!
//! The nodes are units: passes that run as one render pass stay together. Pinned passes keep their recorded order among
//! themselves by edges from each to the next.

mod improve;
mod list;
mod model;

use super::{dependencies::Edge, merge::Units, uses::Uses};
use crate::declaration::Declaration;
use improve::Search;
use list::Direction;
use model::{Model, Rows, Touches};
use petgraph::graphmap::DiGraphMap;
use std::{cmp::Reverse, collections::BinaryHeap};

/// What local moves may cost, as touches of resources: this many times those of the frame.
const EFFORT: usize = 16;
/// Before list scheduling is asked, local moves may cost one part in so many of that.
const FIRST: usize = 4;

/// Units that must run, and what must come before what.
#[derive(Debug)]
pub(super) struct Orders<'a> {
    declaration: &'a Declaration,
    units: &'a Units,
    edges: Vec<(u32, u32)>,
}

impl<'a> Orders<'a> {
    pub(super) fn new(declaration: &'a Declaration, units: &'a Units, dependencies: &[Edge]) -> Self {
        Self { declaration, units, edges: model::unit_edges(declaration, units, dependencies) }
    }

    /// The units as recorded, or a pass on a cycle.
    pub(super) fn recorded(&self) -> Result<Vec<u32>, usize> {
        recorded(self.units.len(), &self.edges).map_err(|stuck| self.units.unit(stuck as usize)[0])
    }

    /// An order in which less is in use at once than in the recorded one, where it is `peak` bytes.
    pub(super) fn smaller(&self, uses: &Uses, recorded: &[u32], peak: u64) -> Option<Vec<u32>> {
        let touches = Touches::new(self.declaration, uses, self.units)?;
        if u64::try_from(touches.bound) == Ok(peak) {
            return None;
        }
        smaller(&Model::new(touches, self.units.len(), &self.edges), recorded)
    }
}

/// Of the units that could come next, the one recorded first; or a unit on a cycle.
fn recorded(units: usize, edges: &[(u32, u32)]) -> Result<Vec<u32>, u32> {
    if edges.iter().all(|(from, to)| from < to) {
        return Ok((0..units as u32).collect());
    }
    let next = Rows::new(units, edges.iter().copied());
    let mut waiting = vec![0_u32; units];
    for &(_, to) in edges {
        waiting[to as usize] += 1;
    }
    let mut ready: BinaryHeap<Reverse<u32>> =
        (0..units as u32).filter(|&unit| waiting[unit as usize] == 0).map(Reverse).collect();
    let mut sequence = Vec::with_capacity(units);
    while let Some(Reverse(unit)) = ready.pop() {
        sequence.push(unit);
        for &to in next.of(unit) {
            waiting[to as usize] -= 1;
            if waiting[to as usize] == 0 {
                ready.push(Reverse(to));
            }
        }
    }
    if sequence.len() == units { Ok(sequence) } else { Err(on_a_cycle(edges)) }
}

/// The first unit on a cycle, not merely behind one.
fn on_a_cycle(edges: &[(u32, u32)]) -> u32 {
    let graph = DiGraphMap::<u32, ()>::from_edges(edges);
    let cycles = petgraph::algo::tarjan_scc(&graph).into_iter().filter(|units| units.len() > 1);
    cycles.flatten().min().unwrap_or(0)
}

/// The order of the smallest peak that was found, if that is smaller than the recorded one's.
fn smaller(model: &Model, recorded: &[u32]) -> Option<Vec<u32>> {
    let bound = model.bound;
    let effort = EFFORT * (model.items.len() + model.units as usize);
    let mut local = Search::new(model, recorded.to_vec());
    let before = local.peak;
    let lower = |search: Search<'_>| (search.peak < before).then_some(search.sequence);
    if local.improve(bound, effort / FIRST) {
        return lower(local);
    }
    let mut listed = Vec::with_capacity(2);
    for direction in [Direction::Backward, Direction::Forward] {
        let search = Search::new(model, list::schedule(model, direction));
        if search.peak <= bound {
            return lower(search);
        }
        listed.push(search);
    }
    if !local.improve(bound, effort - effort / FIRST) {
        for mut search in listed {
            search.improve(bound, effort);
            if search.peak < local.peak {
                local = search;
            }
            if local.peak <= bound {
                break;
            }
        }
    }
    lower(local)
}

#[cfg(test)]
mod tests {
    use super::{
        super::{PlanOptions, Sharing},
        *,
    };

    fn edge(from: u32, to: u32) -> Edge {
        Edge { from, to }
    }

    /// Orders passes of which nothing is known but the edges.
    fn order(live: &[bool], edges: &[Edge]) -> Result<Vec<usize>, usize> {
        let passes = (0..live.len()).map(|i| format!(r#"{{"name": "{i}", "kind": "compute"}}"#)).collect::<Vec<_>>().join(",");
        let frame = format!(r#"{{"frame": "f", "resources": [], "passes": [{passes}]}}"#);
        let declaration = Declaration::from_frame_json(&frame).unwrap();
        let units = super::super::merge::merge(&declaration, live);
        let sequence = Orders::new(&declaration, &units, edges).recorded()?;
        Ok(units.flatten(&sequence).0)
    }

    #[test]
    fn recorded_order_breaks_ties() {
        assert_eq!(order(&[true; 4], &[]), Ok(vec![0, 1, 2, 3]));
        assert_eq!(order(&[true; 4], &[edge(2, 0), edge(3, 1)]), Ok(vec![2, 0, 3, 1]));
        assert_eq!(order(&[true, false, true], &[edge(0, 1), edge(1, 2)]), Ok(vec![0, 2]), "culled passes drop out");
    }

    #[test]
    fn a_cycle_is_found() {
        assert_eq!(order(&[true; 3], &[edge(0, 1), edge(1, 2), edge(2, 1)]), Err(1));
        assert_eq!(order(&[true; 3], &[edge(1, 0), edge(1, 2), edge(2, 1)]), Err(1), "0 only waits for it");
    }

    #[test]
    fn double_edges_count_twice_on_both_sides() {
        assert_eq!(order(&[true; 2], &[edge(1, 0), edge(1, 0)]), Ok(vec![1, 0]));
    }

    /// The order of a frame of buffers of these bytes, the last of them imported; a pass is what it reads and writes.
    fn for_memory(bytes: &[u64], passes: &[(&[usize], &[usize])], pinned: &[usize]) -> Vec<usize> {
        let name = |resource: &usize| format!("r{resource}");
        let resources: Vec<serde_json::Value> = (0..bytes.len())
            .map(|at| {
                let origin = if at + 1 == bytes.len() { "imported" } else { "transient" };
                serde_json::json!({"name": name(&at), "kind": "buffer", "origin": origin, "bytes": bytes[at]})
            })
            .collect();
        let passes: Vec<serde_json::Value> = (0..)
            .zip(passes)
            .map(|(at, (reads, writes))| {
                let reads: Vec<String> = reads.iter().map(name).collect();
                let imported = |&write: &usize| write + 1 == bytes.len();
                let writes: Vec<serde_json::Value> = writes
                    .iter()
                    .map(|write| serde_json::json!({"resource": name(write), "preserve": imported(write)}))
                    .collect();
                serde_json::json!({"name": format!("p{at}"), "kind": "compute", "reads": reads, "writes": writes})
            })
            .collect();
        let frame = serde_json::json!({"frame": "f", "resources": resources, "passes": passes});
        let mut declaration = Declaration::from_frame_json(&frame.to_string()).unwrap();
        for &pass in pinned {
            declaration.passes[pass].pinned = true;
        }
        super::super::plan(&declaration, &PlanOptions::default().sharing(Sharing::Placed)).unwrap().order
    }

    /// Two producers, then their two consumers.
    const PAIRS: [(&[usize], &[usize]); 4] = [(&[], &[0]), (&[], &[1]), (&[0], &[2]), (&[1], &[2])];

    #[test]
    fn producers_move_to_their_consumers() {
        assert_eq!(for_memory(&[10, 10, 1], &PAIRS, &[]), [0, 2, 1, 3]);
    }

    #[test]
    fn pinned_passes_keep_their_order() {
        assert_eq!(for_memory(&[10, 10, 1], &PAIRS, &[1, 2]), [0, 1, 2, 3], "1 before 2, which is where 2 was to go");
        assert_eq!(for_memory(&[10, 10, 1], &PAIRS, &[1]), [0, 2, 1, 3], "one alone may move");
    }

    #[test]
    fn an_order_that_saves_nothing_is_not_taken() {
        // The two must meet in the last pass, whichever comes first.
        let passes: [(&[usize], &[usize]); 3] = [(&[], &[0]), (&[], &[1]), (&[1, 0], &[2])];
        assert_eq!(for_memory(&[10, 1, 1], &passes, &[]), [0, 1, 2]);
    }

    #[test]
    fn a_culled_pass_keeps_apart_what_it_stood_between() {
        // 0 and 1 would sink past 4, to let the large ones of 0 and 3 live one after the other. But 3 overwrites what 1 reads.
        // The only way from 1 to 3 is by 2, which 3 overwrites in turn.
        let (small, large, other, word, out) = (0, 1, 2, 3, 4);
        let passes: [(&[usize], &[usize]); 6] = [
            (&[], &[small, large]),
            (&[small], &[word]),
            (&[], &[small]),
            (&[], &[small, other]),
            (&[small, other], &[out]),
            (&[large, word], &[out]),
        ];
        assert_eq!(for_memory(&[1, 50, 50, 1, 1], &passes, &[]), [0, 1, 3, 4, 5]);
    }

    #[test]
    fn sizes_that_cannot_be_counted_leave_the_order_as_it_is() {
        assert_eq!(for_memory(&[u64::MAX, u64::MAX, 1], &PAIRS, &[]), [0, 1, 2, 3]);
    }
}
