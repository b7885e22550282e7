//! What ordering works on: units, the transient resources they touch, and what must come before what, as flat arrays.

use super::super::{dependencies::Edge, merge::Units};
use crate::declaration::{Declaration, Origin};

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
    pub(super) fn new(rows: usize, pairs: impl ExactSizeIterator<Item = (u32, u32)> + Clone) -> Self {
        // Counts, then a running sum: where each row begins. The second pass moves each start to its row's end, hence to the
        // next one's start, so all begin one place further on.
        let mut starts = vec![0_u32; rows + 2];
        for (row, _) in pairs.clone() {
            starts[row as usize + 2] += 1;
        }
        for row in 2..starts.len() {
            starts[row] += starts[row - 1];
        }
        let mut values = vec![0; pairs.len()];
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

    /// All values.
    pub(super) fn len(&self) -> usize {
        self.values.len()
    }
}

/// Units and what they touch. Items are the transient resources that some unit touches.
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
    /// Item to its bytes.
    pub(super) bytes: Vec<Bytes>,
    /// Item to whether it lives to the end.
    pub(super) kept: Vec<bool>,
    /// Item to its number of units, and one more if it lives to the end.
    pub(super) uses: Vec<u32>,
}

impl Model {
    /// The model of the passes that run; `None` if all bytes together are more than can be counted.
    pub(super) fn new(declaration: &Declaration, units: &Units, edges: &[(u32, u32)]) -> Option<Self> {
        const NONE: u32 = u32::MAX;
        let count = units.len();
        // Per resource: its item, and the last unit that was seen to touch it.
        let mut item_of = vec![(NONE, NONE); declaration.resources.len()];
        let (mut bytes, mut kept, mut uses) = (Vec::new(), Vec::new(), Vec::new());
        // (unit, item)
        let mut touches: Vec<(u32, u32)> = Vec::with_capacity(4 * units.len());
        let mut total: Bytes = 0;
        for unit in 0..count {
            for access in units.unit(unit).iter().flat_map(|&pass| &declaration.passes[pass].accesses) {
                let (item, seen) = &mut item_of[access.resource];
                if *seen == unit as u32 {
                    continue;
                }
                *seen = unit as u32;
                if *item == NONE {
                    let resource = &declaration.resources[access.resource];
                    if resource.origin != Origin::Transient || resource.bytes == 0 {
                        continue;
                    }
                    *item = bytes.len() as u32;
                    let size = Bytes::try_from(resource.bytes).ok()?;
                    // Costs are differences of sums: half the range is left to them.
                    total = total.checked_add(size).filter(|total| *total <= Bytes::MAX / 4)?;
                    bytes.push(size);
                    kept.push(resource.keep);
                    uses.push(u32::from(resource.keep));
                }
                uses[*item as usize] += 1;
                touches.push((unit as u32, *item));
            }
        }
        Some(Self {
            units: count as u32,
            next: Rows::new(count, edges.iter().copied()),
            previous: Rows::new(count, edges.iter().map(|&(from, to)| (to, from))),
            items: Rows::new(count, touches.iter().copied()),
            touching: Rows::new(bytes.len(), touches.iter().map(|&(unit, item)| (item, unit))),
            bytes,
            kept,
            uses,
        })
    }

    /// Bytes that no order can do without: the most that one unit touches.
    pub(super) fn bound(&self) -> Bytes {
        (0..self.units).map(|unit| self.items.of(unit).iter().map(|&item| self.bytes[item as usize]).sum()).max().unwrap_or(0)
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
        let pair = (unit_of[edge.from], unit_of[edge.to]);
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
