//! Lowers the peak of an order by moving what need not be there.
//!
//! At the peak, each resource that is in use but not touched is there for others. Either all that touched it so far sinks
//! past the peak, with what depends on them, or all that touches it later is hoisted before it, with what they depend on:
//!
//! ```text
//!   before   a A b c ▲ d B e      A writes a large resource for B; the peak ▲ neither needs A nor feeds B
//!   sunk     a b c ▲ d A B e      A, and whatever depends on A, comes just before its first consumer …
//!   hoisted  a A b c B ▲ d e      … or B, and whatever it depends on, comes just after its last producer
//! ```
//!
//! Both are tried for the largest such resources, and the best move that lowers the peak is made, until none does. A move
//! changes what is in use only between its two ends, so trying it costs what lies there. The sum of these costs is bounded.

use super::model::{Bytes, Model};

/// Resources tried at each peak, largest first.
const TRIED: usize = 10;
/// Units moved at once, at most.
const GROUP: usize = 64;
/// Units between both ends of a move, at most.
const REACH: usize = 512;

/// Bit of a count in [`Search::count`]: the item is in use.
const ALIVE: u32 = 1 << 31;

/// An order under improvement, with what follows from it.
#[derive(Debug)]
pub(super) struct Search<'a> {
    model: &'a Model,
    pub(super) sequence: Vec<u32>,
    /// The most in use at once, and the first position at which it is.
    pub(super) peak: Bytes,
    peak_at: usize,
    /// Unit to its position.
    position: Vec<usize>,
    /// Item to its first and last position; the last of what is kept is `usize::MAX`.
    first: Vec<usize>,
    last: Vec<usize>,
    /// Position to the bytes in use.
    live: Vec<Bytes>,
    /// Item to its touches in the window under trial; else 0.
    count: Vec<u32>,
    /// Unit to whether it is in the group under trial; else false.
    grouped: Vec<bool>,
    /// The window under trial, and the bytes in use at each of its positions.
    units: Vec<u32>,
    lives: Vec<Bytes>,
    /// What could leave the peak, and the group under trial.
    idle: Vec<u32>,
    group: Vec<u32>,
}

/// A window of positions in another order.
#[derive(Debug)]
struct Move {
    start: usize,
    units: Vec<u32>,
    /// The most in use in the window, and how many more positions than before are at the old peak.
    peak: (Bytes, isize),
}

impl<'a> Search<'a> {
    pub(super) fn new(model: &'a Model, sequence: Vec<u32>) -> Self {
        let (units, items) = (sequence.len(), model.bytes.len());
        let mut state = Self {
            model,
            sequence,
            peak: 0,
            peak_at: 0,
            position: vec![0; units],
            first: vec![usize::MAX; items],
            last: vec![0; items],
            live: vec![0; units],
            count: vec![0; items],
            grouped: vec![false; units],
            units: Vec::new(),
            lives: Vec::new(),
            idle: Vec::new(),
            group: Vec::new(),
        };
        for (at, &unit) in state.sequence.iter().enumerate() {
            state.position[unit as usize] = at;
            for &item in model.items.of(unit) {
                state.first[item as usize] = state.first[item as usize].min(at);
                state.last[item as usize] = if model.kept[item as usize] { usize::MAX } else { at };
            }
        }
        let mut change = vec![0; units + 1];
        for item in 0..items {
            change[state.first[item]] += model.bytes[item];
            change[state.last[item].min(units - 1) + 1] -= model.bytes[item];
        }
        let mut live = 0;
        for (now, change) in state.live.iter_mut().zip(change) {
            live += change;
            *now = live;
        }
        state.find_peak();
        state
    }

    /// Moves units until the peak is at `bound` or no move lowers it; then true. Looks at about `effort` units at most.
    pub(super) fn improve(&mut self, bound: Bytes, effort: usize) -> bool {
        let mut left = effort;
        while self.peak > bound {
            // Finding the peak costs a look at all units, if a short one.
            left = left.saturating_sub(self.sequence.len() / 8);
            let best = self.best_move(self.peak_at, &mut left);
            if left == 0 {
                return false;
            }
            let Some(best) = best else { break };
            self.apply(&best);
            self.find_peak();
        }
        true
    }

    fn find_peak(&mut self) {
        (self.peak_at, self.peak) = (0, 0);
        for (at, &live) in self.live.iter().enumerate() {
            if live > self.peak {
                (self.peak_at, self.peak) = (at, live);
            }
        }
    }

    fn best_move(&mut self, at: usize, left: &mut usize) -> Option<Move> {
        let model = self.model;
        let mut idle = std::mem::take(&mut self.idle);
        let mut group = std::mem::take(&mut self.group);
        idle.clear();
        let touched = model.items.of(self.sequence[at]);
        idle.extend((0..model.bytes.len() as u32).filter(|item| {
            let index = *item as usize;
            self.first[index] < at && at < self.last[index] && !touched.contains(item)
        }));
        idle.sort_by_key(|&item| std::cmp::Reverse(model.bytes[item as usize]));
        idle.truncate(TRIED);
        let mut best: Option<Move> = None;
        for &item in &idle {
            if self.descendants(self.sequence[self.first[item as usize]], at, &mut group) {
                let start = group.iter().map(|&unit| self.position[unit as usize]).min().unwrap_or(at);
                let follows = |&unit: &u32| model.next.of(unit).iter().map(|&next| self.position[next as usize]);
                let limit = group.iter().flat_map(follows).filter(|&next| next > at).min().unwrap_or(self.sequence.len()) - 1;
                for end in [limit, at] {
                    self.try_move(&group, start, end, false, &mut best, left);
                    if limit == at {
                        break;
                    }
                }
            }
            if !model.kept[item as usize] && self.ancestors(item, at, &mut group) {
                let end = group.iter().map(|&unit| self.position[unit as usize]).max().unwrap_or(at);
                let leads = |&unit: &u32| model.previous.of(unit).iter().map(|&before| self.position[before as usize]);
                let limit = group.iter().flat_map(leads).filter(|&before| before < at).max().map_or(0, |before| before + 1);
                for start in [limit, at] {
                    self.try_move(&group, start, end, true, &mut best, left);
                    if limit == at {
                        break;
                    }
                }
            }
            if *left == 0 {
                break;
            }
        }
        (self.idle, self.group) = (idle, group);
        best
    }

    /// Sets `group` to `unit` and all that depends on it up to position `at`; false if that is at `at`, or if they are many.
    fn descendants(&mut self, unit: u32, at: usize, group: &mut Vec<u32>) -> bool {
        let model = self.model;
        group.clear();
        group.push(unit);
        self.close(group, at, |unit| model.next.of(unit), |position| position <= at)
    }

    /// Sets `group` to all from `at` on that touch `item`, and what they depend on; false as above.
    fn ancestors(&mut self, item: u32, at: usize, group: &mut Vec<u32>) -> bool {
        let model = self.model;
        group.clear();
        group.extend(model.touching.of(item).iter().filter(|&&unit| self.position[unit as usize] >= at));
        self.close(group, at, |unit| model.previous.of(unit), |position| position >= at)
    }

    fn close(
        &mut self,
        group: &mut Vec<u32>,
        at: usize,
        step: impl Fn(u32) -> &'a [u32],
        inside: impl Fn(usize) -> bool,
    ) -> bool {
        for &unit in &*group {
            self.grouped[unit as usize] = true;
        }
        let mut done = 0;
        let mut fits = true;
        while fits && done < group.len() {
            for &unit in step(group[done]) {
                let position = self.position[unit as usize];
                if inside(position) && !self.grouped[unit as usize] {
                    fits &= position != at && group.len() < GROUP;
                    self.grouped[unit as usize] = true;
                    group.push(unit);
                }
            }
            done += 1;
        }
        for &unit in &*group {
            self.grouped[unit as usize] = false;
        }
        fits
    }

    /// Puts the group to the front or the back of a window, and keeps the move if it is the best so far.
    fn try_move(&mut self, group: &[u32], start: usize, end: usize, front: bool, best: &mut Option<Move>, left: &mut usize) {
        if end - start > REACH || *left == 0 {
            return;
        }
        *left = left.saturating_sub((end - start + 1) * 4);
        for &unit in group {
            self.grouped[unit as usize] = true;
        }
        let window = &self.sequence[start..=end];
        let mut units = std::mem::take(&mut self.units);
        units.clear();
        units.extend(window.iter().filter(|&&unit| self.grouped[unit as usize] == front));
        units.extend(window.iter().filter(|&&unit| self.grouped[unit as usize] != front));
        for &unit in group {
            self.grouped[unit as usize] = false;
        }
        let before = &self.live[start..=end];
        let old = before.iter().copied().max().unwrap_or(0);
        let times = |lives: &[Bytes]| lives.iter().filter(|&&live| live == old).count() as isize;
        let old_times = times(before);
        let limit = best.as_ref().map_or((old, 0), |best| best.peak);
        if self.replay(start, &units, limit.0) {
            let peak = (self.lives.iter().copied().max().unwrap_or(0), times(&self.lives) - old_times);
            if peak < limit {
                *best = Some(Move { start, units: units.clone(), peak });
            }
        }
        self.units = units;
    }

    /// Sets [`lives`](Search::lives) to the bytes in use at each position of a window, were its units in this order. False as soon
    /// as they are more than `limit`.
    fn replay(&mut self, start: usize, units: &[u32], limit: Bytes) -> bool {
        let model = self.model;
        let end = start + units.len() - 1;
        let born = |&&item: &&u32| self.first[item as usize] == start;
        let bytes = |&item: &u32| model.bytes[item as usize];
        let mut live = self.live[start] - model.items.of(self.sequence[start]).iter().filter(born).map(bytes).sum::<Bytes>();
        for &item in units.iter().flat_map(|&unit| model.items.of(unit)) {
            self.count[item as usize] += 1;
        }
        self.lives.clear();
        for &unit in units {
            for &item in model.items.of(unit) {
                let count = &mut self.count[item as usize];
                if *count & ALIVE == 0 {
                    *count |= ALIVE;
                    if self.first[item as usize] >= start {
                        live += model.bytes[item as usize];
                    }
                }
            }
            if live > limit {
                for &item in units.iter().flat_map(|&unit| model.items.of(unit)) {
                    self.count[item as usize] = 0;
                }
                return false;
            }
            self.lives.push(live);
            for &item in model.items.of(unit) {
                let count = &mut self.count[item as usize];
                *count -= 1;
                if *count == ALIVE {
                    *count = 0;
                    if self.last[item as usize] <= end {
                        live -= model.bytes[item as usize];
                    }
                }
            }
        }
        true
    }

    fn apply(&mut self, best: &Move) {
        let model = self.model;
        let (start, end) = (best.start, best.start + best.units.len() - 1);
        self.replay(start, &best.units, Bytes::MAX);
        self.live[start..=end].copy_from_slice(&self.lives);
        self.sequence[start..=end].copy_from_slice(&best.units);
        for (at, &unit) in (start..).zip(&best.units) {
            self.position[unit as usize] = at;
        }
        // First and last positions inside the window: from the back the first, from the front the last.
        for (at, &unit) in (start..start + best.units.len()).zip(&best.units).rev() {
            for &item in model.items.of(unit) {
                if self.first[item as usize] >= start {
                    self.first[item as usize] = at;
                }
            }
        }
        for (at, &unit) in (start..).zip(&best.units) {
            for &item in model.items.of(unit) {
                if self.last[item as usize] <= end {
                    self.last[item as usize] = at;
                }
            }
        }
    }
}
