//! From a declaration to a plan: a pure function, one file per phase.
//!
//! ```text
//!   validate → dependencies → cull → order → lifetimes → place
//! ```

mod cull;
mod dependencies;
mod lifetimes;
mod order;
mod place;
mod validate;

use crate::{declaration::Declaration, error::GraphError};
pub use lifetimes::Lifetime;
pub use place::Slot;

/// How a frame is planned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct PlanOptions {
    /// Whether transient resources share memory.
    pub sharing: Sharing,
}

/// How transient resources share memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Sharing {
    /// Each has its own.
    Off,
    /// Resources of equal description whose lifetimes do not overlap share one object.
    #[default]
    Pool,
}

/// A frame ready to run.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct Plan {
    /// Indices of the passes that run, in the order they run.
    pub order: Vec<usize>,
    /// The passes that do not run, and why.
    pub culled: Vec<Culled>,
    /// Per resource: from which position in `order` to which it is in use; `None`: never.
    pub lifetimes: Vec<Option<Lifetime>>,
    /// The objects that hold transient resources.
    pub slots: Vec<Slot>,
    /// Per resource: its slot.
    pub slot_of: Vec<Option<usize>>,
    /// Per resource: its place in one shared heap, by the estimate behind `memory.placed_bytes` (bytes).
    pub offsets: Vec<Option<u64>>,
    /// Per position in `order`: bytes of the transient resources in use there.
    pub live_bytes: Vec<u64>,
    /// Bytes of transient resources.
    pub memory: Memory,
    /// Per resource: union of the wgpu usage bits of the passes that run.
    pub usages: Vec<u32>,
}

/// A pass that does not run.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Culled {
    /// Index of the pass.
    pub index: usize,
    /// Its name.
    pub pass: String,
    /// Why.
    pub reason: String,
}

/// Bytes of transient resources, by way of placing them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct Memory {
    /// When nothing is shared.
    pub unshared_bytes: u64,
    /// The most in use at once: no way of placing needs less.
    pub peak_live_bytes: u64,
    /// In a pool of objects with exact descriptions.
    pub pooled_bytes: u64,
    /// In one heap at 256-byte offsets, by first fit; an estimate, as drivers may align more.
    pub placed_bytes: u64,
    /// What this plan takes, by its [`Sharing`].
    pub allocated_bytes: u64,
}

/// Plans a frame; needs no device.
///
/// # Errors
/// If the declaration is inconsistent: stale reads, cycles, writes to a previous frame, names or indices that do not fit.
pub fn plan(declaration: &Declaration, options: &PlanOptions) -> Result<Plan, GraphError> {
    if let Some(error) = GraphError::collect(validate::validate(declaration)) {
        return Err(error);
    }
    let dependencies = dependencies::dependencies(declaration);
    let (live, culled) = cull::cull(declaration, &dependencies);
    let order = order::order(&live, &dependencies)
        .map_err(|pass| GraphError::Cycle { path: format!("`{}`", declaration.passes[pass].name) })?;
    let lifetimes = lifetimes::lifetimes(declaration, &order);
    let live_bytes = lifetimes::live_bytes(declaration, &lifetimes, order.len());
    let usages = usages(declaration, &order);
    let pool = place::pool(declaration, &lifetimes, &usages, Sharing::Pool);
    let pooled_bytes = place::total(&pool.0);
    let (slots, slot_of) = match options.sharing {
        Sharing::Pool => pool,
        Sharing::Off => place::pool(declaration, &lifetimes, &usages, Sharing::Off),
    };
    let (offsets, placed_bytes) = place::heap(declaration, &lifetimes, &live_bytes);
    let memory = Memory {
        unshared_bytes: lifetimes::unshared_bytes(declaration, &lifetimes),
        peak_live_bytes: live_bytes.iter().copied().max().unwrap_or(0),
        pooled_bytes,
        placed_bytes,
        allocated_bytes: place::total(&slots),
    };
    Ok(Plan { order, culled, lifetimes, slots, slot_of, offsets, live_bytes, memory, usages })
}

fn usages(declaration: &Declaration, order: &[usize]) -> Vec<u32> {
    let mut usages = vec![0; declaration.resources.len()];
    for access in order.iter().flat_map(|&pass| &declaration.passes[pass].accesses) {
        usages[access.resource] |= access.usage;
    }
    usages
}
