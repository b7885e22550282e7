//! An order of a frame, with what follows from it.

use super::{
    Lifetime,
    lifetimes::{lifetimes, live_bytes},
    merge::Units,
    uses::Uses,
};
use crate::declaration::Declaration;
use std::ops::Range;

/// Which pass runs when, and what is in use when.
#[derive(Debug, Default)]
pub(super) struct Timeline {
    /// As in [`Plan`](super::Plan).
    pub(super) order: Vec<usize>,
    pub(super) steps: Vec<Range<usize>>,
    pub(super) lifetimes: Vec<Option<Lifetime>>,
    pub(super) live_bytes: Vec<u64>,
}

impl Timeline {
    /// Of the units in the given order.
    pub(super) fn new(declaration: &Declaration, uses: &Uses, units: &Units, sequence: &[u32]) -> Self {
        let (order, steps) = units.flatten(sequence);
        let lifetimes = lifetimes(declaration, uses, &order, &steps);
        let live_bytes = live_bytes(declaration, &lifetimes, order.len());
        Self { order, steps, lifetimes, live_bytes }
    }

    /// The most in use at once (bytes).
    pub(super) fn peak(&self) -> u64 {
        self.live_bytes.iter().copied().max().unwrap_or(0)
    }
}
