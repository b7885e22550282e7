//! Topological order; of the passes that could come next, the one recorded first does.

use super::{PassOrder, dependencies::Edge, merge::Units};
use crate::declaration::Declaration;
use petgraph::{Direction, graph::DiGraph};
use std::{cmp::Reverse, collections::BinaryHeap};

/// The units in order, or a pass on a cycle.
pub(super) fn order(declaration: &Declaration, units: &Units, edges: &[Edge], _order: PassOrder) -> Result<Vec<usize>, usize> {
    let mut graph: DiGraph<usize, ()> = DiGraph::with_capacity(units.len(), edges.len());
    let mut unit_of = vec![None; declaration.passes.len()];
    for unit in 0..units.len() {
        let node = graph.add_node(unit);
        for &pass in units.unit(unit) {
            unit_of[pass] = Some(node);
        }
    }
    for edge in edges {
        if let (Some(from), Some(to)) = (unit_of[edge.from], unit_of[edge.to])
            && from != to
        {
            graph.add_edge(from, to, ());
        }
    }
    let mut waiting: Vec<usize> =
        graph.node_indices().map(|n| graph.neighbors_directed(n, Direction::Incoming).count()).collect();
    let mut ready: BinaryHeap<Reverse<usize>> =
        graph.node_indices().filter(|n| waiting[n.index()] == 0).map(|n| Reverse(n.index())).collect();
    let mut order = Vec::with_capacity(units.len());
    while let Some(Reverse(unit)) = ready.pop() {
        order.push(unit);
        for next in graph.neighbors_directed(petgraph::graph::NodeIndex::new(unit), Direction::Outgoing) {
            waiting[next.index()] -= 1;
            if waiting[next.index()] == 0 {
                ready.push(Reverse(next.index()));
            }
        }
    }
    if order.len() == units.len() {
        return Ok(order);
    }
    let stuck = waiting.iter().position(|&n| n > 0).map_or(0, |unit| units.unit(unit)[0]);
    Err(stuck)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(from: usize, to: usize) -> Edge {
        Edge { from, to, data: true }
    }

    /// Orders passes of which nothing is known but the edges.
    fn order(live: &[bool], edges: &[Edge]) -> Result<Vec<usize>, usize> {
        let passes = (0..live.len()).map(|i| format!(r#"{{"name": "{i}", "kind": "compute"}}"#)).collect::<Vec<_>>().join(",");
        let frame = format!(r#"{{"frame": "f", "resources": [], "passes": [{passes}]}}"#);
        let declaration = Declaration::from_frame_json(&frame).unwrap();
        let units = super::super::merge::merge(&declaration, live);
        let sequence = super::order(&declaration, &units, edges, PassOrder::Recorded)?;
        Ok(units.flatten(sequence).0)
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
    }

    #[test]
    fn double_edges_count_twice_on_both_sides() {
        assert_eq!(order(&[true; 2], &[edge(1, 0), edge(1, 0)]), Ok(vec![1, 0]));
    }
}
