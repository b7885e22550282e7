//! Where memory is handed over: the fewest points of a plan's order that serve every resource.
//!
//! ```text
//!   position      0   1   2   3   4   5
//!   a             ■───■
//!   b (a's bytes)         ├───■───■        may be handed over at 2 or 3
//!   c                 ■───■
//!   d (c's bytes)             ├───■        at 3 or 4
//!   hand-overs    ▲           ▲            b and d together at 3
//! ```

use crate::plan::{Plan, SlotKind};
use std::collections::BTreeMap;

/// What begins and ends where.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Schedule {
    /// By position before which memory is handed over: the resources that take it.
    pub(super) hand_overs: BTreeMap<usize, Vec<usize>>,
    /// By position: the resources whose life ends with it.
    pub(super) ends: BTreeMap<usize, Vec<usize>>,
}

/// A resource that may take its memory before any position of `from..=first`.
#[derive(Clone, Copy, Debug)]
struct Window {
    from: usize,
    first: usize,
    resource: usize,
}

/// The schedule of a plan's heaps; `bytes`: what a resource covers from its offset on.
pub(super) fn schedule(plan: &Plan, bytes: &dyn Fn(usize) -> u64) -> Schedule {
    let mut schedule = Schedule::default();
    let mut windows: Vec<Window> = Vec::new();
    for slot in plan.slots.iter().filter(|slot| slot.kind == SlotKind::Heap) {
        let mut lives: Vec<(usize, usize, usize)> = slot
            .resources
            .iter()
            .filter_map(|&resource| plan.lifetimes[resource].map(|lifetime| (lifetime.first, lifetime.last, resource)))
            .collect();
        lives.sort_unstable();
        let mut users = LastUsers::default();
        for (first, last, resource) in lives {
            let start = plan.offsets[resource].unwrap_or(0);
            let from = users.take(start, start.saturating_add(bytes(resource)), last).map_or(0, |last| last + 1);
            // A plan in which two lives overlap would have `from` after `first`; first use is the last moment.
            windows.push(Window { from: from.min(first), first, resource });
            schedule.ends.entry(last).or_default().push(resource);
        }
    }
    // The classical greedy: the window that closes first sets the point, and all that are open there join it.
    windows.sort_unstable_by_key(|window| (window.first, window.resource));
    let mut point = None;
    for window in windows {
        let at = match point {
            Some(at) if window.from <= at => at,
            _ => window.first,
        };
        point = Some(at);
        schedule.hand_overs.entry(at).or_default().push(window.resource);
    }
    schedule
}

/// Which position last used which bytes: ranges side by side, by start.
#[derive(Default)]
struct LastUsers {
    ranges: BTreeMap<u64, (u64, usize)>,
}

impl LastUsers {
    /// The last position that used any of `start..end`; from now on `last` is.
    fn take(&mut self, start: u64, end: u64, last: usize) -> Option<usize> {
        let mut latest = None;
        let touched: Vec<(u64, u64, usize)> = self
            .ranges
            .range(..end)
            .rev()
            .take_while(|(_, (other_end, _))| *other_end > start)
            .map(|(&other, &(other_end, user))| (other, other_end, user))
            .collect();
        for (other, other_end, user) in touched {
            latest = latest.max(Some(user));
            self.ranges.remove(&other);
            if other < start {
                self.ranges.insert(other, (start, user));
            }
            if other_end > end {
                self.ranges.insert(end, (other_end, user));
            }
        }
        self.ranges.insert(start, (end, last));
        latest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Lifetime, Slot};

    /// (first, last, offset, bytes) of each resource.
    fn scheduled(rows: &[(usize, usize, u64, u64)]) -> Schedule {
        let plan = Plan {
            lifetimes: rows.iter().map(|&(first, last, ..)| Some(Lifetime { first, last })).collect(),
            slots: vec![Slot { kind: SlotKind::Heap, bytes: 0, usage: 0, resources: (0..rows.len()).collect() }],
            offsets: rows.iter().map(|row| Some(row.2)).collect(),
            ..Plan::default()
        };
        schedule(&plan, &|resource| rows[resource].3)
    }

    #[test]
    fn hand_overs_are_as_few_as_can_be() {
        // The figure: `b` takes `a`'s bytes, `d` takes `c`'s.
        let found = scheduled(&[(0, 1, 0, 8), (3, 4, 0, 8), (1, 2, 8, 8), (4, 5, 8, 8)]);
        let points: Vec<(usize, Vec<usize>)> = found.hand_overs.into_iter().collect();
        assert_eq!(points, [(0, vec![0, 2]), (3, vec![1, 3])], "what is free at the start joins the first");
        assert_eq!(found.ends.into_iter().collect::<Vec<_>>(), [(1, vec![0]), (2, vec![2]), (4, vec![1]), (5, vec![3])]);
    }

    #[test]
    fn each_takes_its_memory_after_all_who_had_any_of_it() {
        // The last covers the first two in part, and both halves of the first stay its own.
        let found = scheduled(&[(0, 0, 0, 16), (1, 3, 4, 4), (4, 4, 6, 20), (5, 5, 0, 4)]);
        let points: Vec<(usize, Vec<usize>)> = found.hand_overs.into_iter().collect();
        assert_eq!(points, [(0, vec![0]), (1, vec![1]), (4, vec![2, 3])]);
        let mut users = LastUsers::default();
        assert_eq!(users.take(0, 16, 0), None);
        assert_eq!(users.take(4, 8, 3), Some(0));
        assert_eq!(users.take(8, 16, 4), Some(0), "the right remainder");
        assert_eq!(users.take(0, 16, 5), Some(4), "the latest of three");
        assert_eq!(users.take(16, 32, 6), None, "side by side is not over each other");
    }
}
