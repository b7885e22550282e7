//! Passes that run as one: draws into the same attachments become one render pass.

use crate::declaration::Declaration;
use std::ops::Range;

/// The live passes in recorded order, cut into units that run as one.
#[derive(Debug)]
pub(super) struct Units {
    /// Passes, unit after unit.
    pub(super) passes: Vec<usize>,
    /// Where each unit begins in `passes`, and the end of the last.
    pub(super) starts: Vec<usize>,
}

impl Units {
    pub(super) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// The passes of one unit.
    pub(super) fn unit(&self, unit: usize) -> &[usize] {
        &self.passes[self.starts[unit]..self.starts[unit + 1]]
    }

    /// Passes and steps, for the units in the given order.
    pub(super) fn flatten(&self, sequence: impl IntoIterator<Item = usize>) -> (Vec<usize>, Vec<Range<usize>>) {
        let mut order = Vec::with_capacity(self.passes.len());
        let mut steps = Vec::with_capacity(self.len());
        for unit in sequence {
            let first = order.len();
            order.extend_from_slice(self.unit(unit));
            steps.push(first..order.len());
        }
        (order, steps)
    }
}

/// Units of the passes that run.
pub(super) fn merge(_declaration: &Declaration, live: &[bool]) -> Units {
    let passes: Vec<usize> = (0..live.len()).filter(|&pass| live[pass]).collect();
    Units { starts: (0..=passes.len()).collect(), passes }
}
