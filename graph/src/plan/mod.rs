//! From a declaration to a plan: a pure function, one file per phase.
//!
//! ```text
//!   validate → uses → cull → dependencies → merge → order → lifetimes → place
//! ```
//!
//! Where the order that needs less memory is not the recorded one, both go on as [`Timeline`]s until it is known which
//! allocates less by the sharing that was asked for.

pub(crate) mod cells;
mod cull;
mod dependencies;
mod lifetimes;
mod merge;
mod order;
mod place;
mod timeline;
mod uses;
pub(crate) mod validate;

use crate::{declaration::Declaration, error::GraphError};
pub use lifetimes::Lifetime;
pub use place::{Slot, SlotKind};
use std::{ops::Range, sync::Arc};
use timeline::Timeline;
use uses::Uses;

/// How a frame is planned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct PlanOptions {
    /// Whether and how transient resources share memory.
    pub sharing: Sharing,
    /// How passes are put in order.
    pub order: PassOrder,
    /// Whether attachments that never leave their render pass take transient memory (the adapter has such).
    pub transient_attachments: bool,
    /// Whether to leave out the bytes of the ways of sharing that the plan does not take: they are 0 in [`Memory`] then.
    pub only_own_bytes: bool,
}

impl PlanOptions {
    /// The same with another way of sharing.
    pub fn sharing(self, sharing: Sharing) -> Self {
        Self { sharing, ..self }
    }

    /// The same with another way of ordering.
    pub fn order(self, order: PassOrder) -> Self {
        Self { order, ..self }
    }
}

/// How transient resources share memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Sharing {
    /// Each has its own.
    Off,
    /// Resources of equal description and equal usages whose lifetimes do not overlap share one object.
    Exact,
    /// As `Exact`, for all descriptions that one object can serve: usages, view formats, mips and layers are merged, and
    /// buffers lie in arenas.
    #[default]
    Merged,
    /// Resources lie at offsets of shared memory, whatever their descriptions. Where the device cannot, the executor
    /// takes `Merged` and says so.
    Placed,
}

/// How passes are put in order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PassOrder {
    /// As recorded.
    Recorded,
    /// So that less memory is in use at once; as recorded where that changes nothing, or where objects that resources share
    /// one after the other would not take less. Pinned passes keep their order.
    #[default]
    Memory,
}

/// What a resource needs of shared memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Need {
    /// Bytes.
    pub bytes: u64,
    /// Its offset is a multiple of this (bytes), a power of two.
    pub align: u64,
    /// Resources of different classes lie in different heaps.
    pub class: u32,
}

/// A frame ready to run.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct Plan {
    /// Indices of the passes that run, in the order they run.
    pub order: Vec<usize>,
    /// Positions in `order` that run together: one render pass, or a single pass of another kind. They cover `order`.
    pub steps: Vec<Range<usize>>,
    /// The passes that do not run, and why.
    pub culled: Vec<Culled>,
    /// Per resource: from which position in `order` to which it is in use; `None`: never.
    pub lifetimes: Vec<Option<Lifetime>>,
    /// The objects that hold transient resources.
    pub slots: Vec<Slot>,
    /// Per resource: its slot.
    pub slot_of: Vec<Option<usize>>,
    /// Per resource: where it lies in its slot (bytes).
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
    pub pass: Arc<str>,
    /// Why.
    pub reason: String,
}

/// Bytes of transient resources, by way of placing them; each in the order that a plan of that [`Sharing`] takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct Memory {
    /// When nothing is shared.
    pub unshared_bytes: u64,
    /// The most in use at once in recorded order: there, no way of placing needs less.
    pub peak_live_bytes: u64,
    /// The most in use at once in the plan's order; another way of placing may take another order, and less.
    pub ordered_peak_live_bytes: u64,
    /// In a pool of objects with merged descriptions, and arenas for buffers.
    pub pooled_bytes: u64,
    /// At offsets of shared memory.
    pub placed_bytes: u64,
    /// What this plan takes, by its [`Sharing`].
    pub allocated_bytes: u64,
}

/// Plans a frame; needs no device.
///
/// # Errors
/// If the declaration is inconsistent: stale reads, cycles, writes to a previous frame, names or indices that do not fit.
pub fn plan(declaration: &Declaration, options: &PlanOptions) -> Result<Plan, GraphError> {
    plan_with_needs(declaration, options, &|resource, _| Need {
        bytes: declaration.resources[resource].bytes,
        align: ALIGN,
        class: 0,
    })
}

/// Offsets are multiples of this (bytes): the largest alignment `WebGPU` asks of a buffer binding.
pub(crate) const ALIGN: u64 = 256;

/// As [`plan`], with what each resource needs of shared memory, given its index and its wgpu usage bits.
///
/// # Errors
/// As [`plan`].
pub fn plan_with_needs(
    declaration: &Declaration,
    options: &PlanOptions,
    needs: &dyn Fn(usize, u32) -> Need,
) -> Result<Plan, GraphError> {
    validate::names(declaration)?;
    let uses = Uses::new(declaration)?;
    validate::contents(declaration, &uses)?;
    let (live, culled) = cull::cull(declaration, &uses);
    let edges = dependencies::dependencies(&uses, &live);
    let units = merge::merge(declaration, &live);
    let orders = order::Orders::new(declaration, &units, &edges);
    let recorded =
        orders.recorded().map_err(|pass| GraphError::Cycle { path: format!("`{}`", declaration.passes[pass].name) })?;
    // The recorded order, then the one for memory if it is another.
    let mut timelines = vec![Timeline::new(declaration, &uses, &units, &recorded)];
    let recorded_peak = timelines[0].peak();
    if options.order == PassOrder::Memory {
        let smaller = orders.smaller(&uses, &recorded, recorded_peak);
        timelines.extend(smaller.map(|sequence| Timeline::new(declaration, &uses, &units, &sequence)));
    }
    let mut usages = usages(declaration, &uses, &timelines[0].order);
    if options.transient_attachments {
        let Timeline { lifetimes, steps, .. } = &timelines[0];
        merge::transient_attachments(declaration, lifetimes, steps, &mut usages);
    }
    let items: Vec<Vec<place::Item>> = timelines.iter().map(|timeline| place::items(declaration, timeline, &usages)).collect();
    let last = timelines.len() - 1;
    let wants = |sharing| options.sharing == sharing || !options.only_own_bytes;
    let merged = wants(Sharing::Merged).then(|| {
        let by_unit = place::BufferUses::new(declaration, &uses, &units);
        place::least(items.iter().map(|items| place::Draft::new(declaration, &by_unit, items)))
    });
    let heaps = wants(Sharing::Placed).then(|| (last, place::heaps(declaration, &items[last], needs, recorded_peak)));
    let mut memory = Memory {
        unshared_bytes: lifetimes::unshared_bytes(declaration, &timelines[0].lifetimes),
        peak_live_bytes: recorded_peak,
        ordered_peak_live_bytes: 0,
        pooled_bytes: merged.as_ref().map_or(0, |(_, lots)| lots.bytes()),
        placed_bytes: heaps.as_ref().map_or(0, |(_, lots)| lots.bytes()),
        allocated_bytes: 0,
    };
    let (which, lots) = match options.sharing {
        Sharing::Off => None,
        Sharing::Exact => {
            (0..).zip(&items).map(|(at, items)| (at, place::exact(declaration, items))).min_by_key(|(_, lots)| lots.bytes())
        }
        Sharing::Merged => merged,
        Sharing::Placed => heaps,
    }
    .unwrap_or_else(|| (last, place::alone(&items[last])));
    let timeline = timelines.swap_remove(which);
    memory.allocated_bytes = lots.bytes();
    memory.ordered_peak_live_bytes = timeline.peak();
    let place::Placed { slots, slot_of, offsets } = place::Placed::new(declaration.resources.len(), &items[which], &lots);
    let Timeline { order, steps, lifetimes, live_bytes } = timeline;
    Ok(Plan { order, steps, culled, lifetimes, slots, slot_of, offsets, live_bytes, memory, usages })
}

fn usages(declaration: &Declaration, uses: &Uses, order: &[usize]) -> Vec<u32> {
    let mut usages = vec![0; declaration.resources.len()];
    for used in uses.of_all(order) {
        usages[used.resource as usize] |= used.usage;
    }
    usages
}
