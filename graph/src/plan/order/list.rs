//! List scheduling: of the units that could come next, the one after which least is in use.
//!
//! Forwards, a unit costs the bytes it brings to life, less those it is the last to touch. Backwards, from the end of the
//! frame, it is the other way round, which looks ahead where the first looks back: it asks for what a consumer needs just
//! before it.
//!
//! A unit's cost changes only when an item it touches comes to life, or when all others that touch the item are done: two
//! events per item, so the queue sees each touch at most twice. Entries whose cost has changed since are dropped when met.

use super::model::{Bytes, Model};
use std::{cmp::Reverse, collections::BinaryHeap};

/// From which end of the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    Forward,
    Backward,
}

/// An order of all units. The model has no cycle.
pub(super) fn schedule(model: &Model, direction: Direction) -> Vec<u32> {
    let forward = direction == Direction::Forward;
    let (after, before) = if forward { (&model.next, &model.previous) } else { (&model.previous, &model.next) };
    let mut blocked: Vec<u32> = (0..model.units).map(|unit| before.of(unit).len() as u32).collect();
    // What lives to the end is never freed forwards, and in use from the start backwards.
    let mut alive: Vec<bool> = model.kept.iter().map(|&kept| kept && !forward).collect();
    let mut waiting: Vec<u32> = if forward {
        model.uses.clone()
    } else {
        model.uses.iter().zip(&model.kept).map(|(uses, kept)| uses - u32::from(*kept)).collect()
    };
    let mut done = vec![false; model.units as usize];
    let mut cost: Vec<Bytes> = (0..model.units)
        .map(|unit| {
            let one = |&item: &u32| {
                let bytes = model.bytes[item as usize];
                let born = if alive[item as usize] { 0 } else { bytes };
                if waiting[item as usize] == 1 { born - bytes } else { born }
            };
            model.items.of(unit).iter().map(one).sum()
        })
        .collect();
    // Ties: recorded order.
    let rank = |unit: u32| if forward { unit } else { model.units - 1 - unit };
    let mut ready: BinaryHeap<Reverse<(Bytes, u32)>> = (0..model.units)
        .filter(|&unit| blocked[unit as usize] == 0)
        .map(|unit| Reverse((cost[unit as usize], rank(unit))))
        .collect();
    let mut sequence = Vec::with_capacity(model.units as usize);
    while let Some(Reverse((price, ranked))) = ready.pop() {
        let unit = rank(ranked);
        if done[unit as usize] || cost[unit as usize] != price {
            continue;
        }
        done[unit as usize] = true;
        sequence.push(unit);
        for &item in model.items.of(unit) {
            let index = item as usize;
            waiting[index] -= 1;
            let born = !std::mem::replace(&mut alive[index], true);
            let last = waiting[index] == 1;
            if !born && !last {
                continue;
            }
            for &other in model.touching.of(item) {
                if done[other as usize] {
                    continue;
                }
                cost[other as usize] -= model.bytes[index] * (Bytes::from(born) + Bytes::from(last));
                if blocked[other as usize] == 0 {
                    ready.push(Reverse((cost[other as usize], rank(other))));
                }
            }
        }
        for &other in after.of(unit) {
            blocked[other as usize] -= 1;
            if blocked[other as usize] == 0 {
                ready.push(Reverse((cost[other as usize], rank(other))));
            }
        }
    }
    if !forward {
        sequence.reverse();
    }
    sequence
}

#[cfg(test)]
mod tests {
    use super::super::super::{cull, dependencies, merge, uses};
    use super::{
        super::model::{Touches, unit_edges},
        *,
    };
    use crate::Declaration;

    #[test]
    fn both_directions_end_one_chain_before_the_next_begins() {
        let imported = |name| format!(r#"{{"name": "{name}", "kind": "buffer", "origin": "imported", "bytes": 4}}"#);
        let mut resources = vec![imported("out"), imported("side"), imported("aside")];
        let (mut first, mut second) = (Vec::new(), Vec::new());
        for chain in 0..4 {
            resources.push(format!(r#"{{"name": "r{chain}", "kind": "buffer", "origin": "transient", "bytes": 100}}"#));
            let side = if chain == 0 { r#", {"resource": "side"}"# } else { "" };
            first.push(format!(r#"{{"name": "w{chain}", "kind": "compute", "writes": [{{"resource": "r{chain}"}}{side}]}}"#));
            second.push(format!(
                r#"{{"name": "u{chain}", "kind": "compute", "reads": ["r{chain}"], "writes": [{{"resource": "out", "preserve": true}}]}}"#
            ));
        }
        // One that could come right after the first, and brings or frees nothing.
        first.push(r#"{"name": "idle", "kind": "compute", "reads": ["side"], "writes": [{"resource": "aside"}]}"#.to_owned());
        first.append(&mut second);
        let (resources, passes) = (resources.join(","), first.join(","));
        let frame = format!(r#"{{"frame": "f", "resources": [{resources}], "passes": [{passes}]}}"#);
        let declaration = Declaration::from_frame_json(&frame).unwrap();
        let uses = uses::Uses::new(&declaration).unwrap();
        let (runs, _) = cull::cull(&declaration, &uses);
        let edges = dependencies::dependencies(&uses, &runs);
        let units = merge::merge(&declaration, &runs);
        let touches = Touches::new(&declaration, &uses, &units).unwrap();
        let model = Model::new(touches, units.len(), &unit_edges(&declaration, &units, &edges));
        // The consumers add to one result, so they keep their order. What frees comes before what does nothing.
        assert_eq!(schedule(&model, Direction::Forward), [0, 5, 4, 1, 6, 2, 7, 3, 8]);
        assert_eq!(schedule(&model, Direction::Backward), [0, 5, 1, 6, 2, 7, 3, 8, 4]);
    }
}
