//! What ordering works on: units, the transient resources they touch, and what must come before what, as flat arrays.

use super::super::{dependencies::Edge, merge::Units, uses::Uses};
use crate::declaration::Declaration;

/// Bytes that come and go. [`Model::new`] sees to it that no sum overflows.
pub(super) type Bytes = i64;

/// Rows of numbers, one row after the other.
#[derive(Debug)]
pub(super) struct Rows {
    starts: Vec<u32>,
    values: Vec<u32>,
}

impl Rows {
    /// Values by row; within a row, in the order of `pairs`.
    pub(super) fn new(rows: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        // Counts, then a running sum: where each row begins. The second pass moves each start to its row's end, hence to the
        // next one's start, so all begin one place further on.
        let mut starts = vec![0_u32; rows + 2];
        for (row, _) in pairs.clone() {
            starts[row as usize + 2] += 1;
        }
        for row in 2..starts.len() {
            starts[row] += starts[row - 1];
        }
        let mut values = vec![0; starts[rows + 1] as usize];
        for (row, value) in pairs {
            let at = &mut starts[row as usize + 1];
            values[*at as usize] = value;
            *at += 1;
        }
        starts.pop();
        Self { starts, values }
    }

    /// One row.
    pub(super) fn of(&self, row: u32) -> &[u32] {
        &self.values[self.starts[row as usize] as usize..self.starts[row as usize + 1] as usize]
    }

    /// All, by row.
    fn pairs(&self) -> impl Iterator<Item = (u32, u32)> + Clone {
        let rows = (0..).zip(self.starts.windows(2));
        rows.flat_map(|(row, range)| self.values[range[0] as usize..range[1] as usize].iter().map(move |&value| (row, value)))
    }

    /// All values.
    pub(super) fn len(&self) -> usize {
        self.values.len()
    }
}

/// What units touch. Items are the transient resources that some unit touches.
#[derive(Debug)]
pub(super) struct Touches {
    /// Unit to items, each once.
    items: Rows,
    /// Item to its bytes.
    bytes: Vec<Bytes>,
    /// Item to whether it lives to the end.
    kept: Vec<bool>,
    /// Item to its number of units, and one more if it lives to the end.
    uses: Vec<u32>,
    /// Bytes that no order can do without: the most that one unit touches.
    pub(super) bound: Bytes,
}

impl Touches {
    /// What the passes that run touch; `None` if all bytes together are more than can be counted.
    pub(super) fn new(declaration: &Declaration, uses: &Uses, units: &Units) -> Option<Self> {
        const NONE: u32 = u32::MAX;
        // Per resource: its item, and the last unit that was seen to touch it.
        let mut item_of = vec![(NONE, NONE); declaration.resources.len()];
        let most = declaration.resources.len();
        let mut touches = Self {
            items: Rows { starts: Vec::with_capacity(units.len() + 1), values: Vec::with_capacity(3 * units.len()) },
            bytes: Vec::with_capacity(most),
            kept: Vec::with_capacity(most),
            uses: Vec::with_capacity(most),
            bound: 0,
        };
        let mut total: Bytes = 0;
        for unit in 0..units.len() {
            let mut touched = 0;
            touches.items.starts.push(touches.items.len() as u32);
            for used in uses.of_all(units.unit(unit)) {
                if !used.transient {
                    continue;
                }
                let (item, seen) = &mut item_of[used.resource as usize];
                if *seen == unit as u32 {
                    continue;
                }
                *seen = unit as u32;
                if *item == NONE {
                    let resource = &declaration.resources[used.resource as usize];
                    if resource.bytes == 0 {
                        continue;
                    }
                    *item = touches.bytes.len() as u32;
                    let size = Bytes::try_from(resource.bytes).ok()?;
                    // Costs are differences of sums: half the range is left to them.
                    total = total.checked_add(size).filter(|total| *total <= Bytes::MAX / 4)?;
                    touches.bytes.push(size);
                    touches.kept.push(resource.keep);
                    touches.uses.push(u32::from(resource.keep));
                }
                touched += touches.bytes[*item as usize];
                touches.uses[*item as usize] += 1;
                touches.items.values.push(*item);
            }
            touches.bound = touches.bound.max(touched);
        }
        touches.items.starts.push(touches.items.len() as u32);
        Some(touches)
    }
}

/// Units, what they touch, and what must come before what.
#[derive(Debug)]
pub(super) struct Model {
    /// Number of units.
    pub(super) units: u32,
    /// Unit to those that come after it.
    pub(super) next: Rows,
    /// Unit to those that come before it.
    pub(super) previous: Rows,
    /// Unit to items, each once.
    pub(super) items: Rows,
    /// Item to units, each once, ascending.
    pub(super) touching: Rows,
    /// As in [`Touches`].
    pub(super) bytes: Vec<Bytes>,
    pub(super) kept: Vec<bool>,
    pub(super) uses: Vec<u32>,
    pub(super) bound: Bytes,
}

impl Model {
    pub(super) fn new(touches: Touches, units: usize, edges: &[(u32, u32)]) -> Self {
        let Touches { items, bytes, kept, uses, bound } = touches;
        Self {
            units: units as u32,
            next: Rows::new(units, edges.iter().copied()),
            previous: Rows::new(units, edges.iter().map(|&(from, to)| (to, from))),
            touching: Rows::new(bytes.len(), items.pairs().map(|(unit, item)| (item, unit))),
            items,
            bytes,
            kept,
            uses,
            bound,
        }
    }
}

/// What must come before what, as pairs of units: the dependencies, and pinned units in recorded order.
pub(super) fn unit_edges(declaration: &Declaration, units: &Units, dependencies: &[Edge]) -> Vec<(u32, u32)> {
    const NONE: u32 = u32::MAX;
    let mut unit_of = vec![NONE; declaration.passes.len()];
    for unit in 0..units.len() {
        for &pass in units.unit(unit) {
            unit_of[pass] = unit as u32;
        }
    }
    let mut edges: Vec<(u32, u32)> = Vec::with_capacity(dependencies.len());
    for edge in dependencies {
        let pair = (unit_of[edge.from as usize], unit_of[edge.to as usize]);
        // Dependencies between the same two passes stand together, so this drops nearly all repetitions.
        if pair.0 != NONE && pair.1 != NONE && pair.0 != pair.1 && edges.last() != Some(&pair) {
            edges.push(pair);
        }
    }
    let mut last = None;
    for unit in 0..units.len() {
        if units.unit(unit).iter().any(|&pass| declaration.passes[pass].pinned) {
            edges.extend(last.map(|last| (last, unit as u32)));
            last = Some(unit as u32);
        }
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_keep_the_order_of_their_values() {
        let rows = Rows::new(4, [(2, 5), (0, 1), (2, 3), (3, 9)].into_iter());
        assert_eq!([rows.of(0), rows.of(1), rows.of(2), rows.of(3)], [&[1][..], &[], &[5, 3], &[9]]);
        assert_eq!(rows.len(), 4);
    }
}
