//! From where to where each resource is in use.

use super::uses::Uses;
use crate::declaration::{Declaration, Origin};
use std::ops::Range;

/// First and last position in the plan's order at which a resource is in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Lifetime {
    /// First position.
    pub first: usize,
    /// Last position, inclusive.
    pub last: usize,
}

/// Per resource its lifetime; `None` if no pass that runs uses it.
///
/// A step runs as one, so what it uses is in use from its first position to its last.
pub(super) fn lifetimes(
    declaration: &Declaration,
    uses: &Uses,
    order: &[usize],
    steps: &[Range<usize>],
) -> Vec<Option<Lifetime>> {
    let mut lifetimes: Vec<Option<Lifetime>> = vec![None; declaration.resources.len()];
    for step in steps {
        for used in uses.of_all(&order[step.clone()]) {
            let last = step.end - 1;
            lifetimes[used.resource as usize].get_or_insert(Lifetime { first: step.start, last }).last = last;
        }
    }
    for (resource, lifetime) in declaration.resources.iter().zip(&mut lifetimes) {
        if let Some(lifetime) = lifetime
            && resource.keep
        {
            lifetime.last = order.len().saturating_sub(1);
        }
    }
    lifetimes
}

/// Transient resources in use, with their lifetimes.
pub(super) fn transient<'a>(
    declaration: &'a Declaration,
    lifetimes: &'a [Option<Lifetime>],
) -> impl Iterator<Item = (usize, Lifetime)> + 'a {
    lifetimes
        .iter()
        .enumerate()
        .filter(|(resource, _)| declaration.resources[*resource].origin == Origin::Transient)
        .filter_map(|(resource, lifetime)| lifetime.map(|lifetime| (resource, lifetime)))
}

/// Per position the bytes of the transient resources in use.
pub(super) fn live_bytes(declaration: &Declaration, lifetimes: &[Option<Lifetime>], positions: usize) -> Vec<u64> {
    let mut change = vec![0_i128; positions + 1];
    for (resource, lifetime) in transient(declaration, lifetimes) {
        let bytes = i128::from(declaration.resources[resource].bytes);
        change[lifetime.first] += bytes;
        change[lifetime.last + 1] -= bytes;
    }
    let mut live = 0_i128;
    change[..positions]
        .iter()
        .map(|step| {
            live += step;
            u64::try_from(live).unwrap_or(u64::MAX)
        })
        .collect()
}

/// Bytes of all transient resources in use.
pub(super) fn unshared_bytes(declaration: &Declaration, lifetimes: &[Option<Lifetime>]) -> u64 {
    transient(declaration, lifetimes).fold(0, |total, (resource, _)| total.saturating_add(declaration.resources[resource].bytes))
}
