//! Topological order; of the passes that could come next, the one recorded first does.

use super::dependencies::Edge;
use petgraph::{Direction, graph::DiGraph};
use std::{cmp::Reverse, collections::BinaryHeap};

/// The live passes in order, or a pass on a cycle.
pub(super) fn order(live: &[bool], edges: &[Edge]) -> Result<Vec<usize>, usize> {
    let mut graph: DiGraph<usize, ()> = DiGraph::with_capacity(live.len(), edges.len());
    let node: Vec<_> = (0..live.len()).map(|pass| live[pass].then(|| graph.add_node(pass))).collect();
    for edge in edges {
        if let (Some(from), Some(to)) = (node[edge.from], node[edge.to]) {
            graph.add_edge(from, to, ());
        }
    }
    let mut waiting: Vec<usize> =
        graph.node_indices().map(|n| graph.neighbors_directed(n, Direction::Incoming).count()).collect();
    let mut ready: BinaryHeap<Reverse<usize>> =
        graph.node_indices().filter(|n| waiting[n.index()] == 0).map(|n| Reverse(graph[n])).collect();
    let mut order = Vec::with_capacity(graph.node_count());
    while let Some(Reverse(pass)) = ready.pop() {
        order.push(pass);
        let Some(node) = node[pass] else { continue };
        for next in graph.neighbors_directed(node, Direction::Outgoing) {
            waiting[next.index()] -= 1;
            if waiting[next.index()] == 0 {
                ready.push(Reverse(graph[next]));
            }
        }
    }
    if order.len() == graph.node_count() {
        return Ok(order);
    }
    let stuck = graph.node_indices().find(|n| waiting[n.index()] > 0).map_or(0, |n| graph[n]);
    Err(stuck)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(from: usize, to: usize) -> Edge {
        Edge { from, to, data: true }
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
