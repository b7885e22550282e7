//! Plans by the structure of their declaration.

use super::{
    heap::{HeapError, Heaps},
    limits::resource_limits,
};
use crate::{
    declaration::Declaration,
    error::GraphError,
    plan::{ALIGN, Need, Plan, PlanOptions, Sharing, plan, plan_with_needs},
};
use std::{
    cell::RefCell,
    hash::{DefaultHasher, Hash, Hasher},
    sync::Arc,
};

/// Plans kept: enough for a few graphs and their variants to alternate.
const KEPT: usize = 32;

/// The most recently used plans, latest first.
#[derive(Debug, Default)]
pub(super) struct Plans {
    entries: Vec<Entry>,
}

#[derive(Debug)]
struct Entry {
    hash: u64,
    options: PlanOptions,
    declaration: Declaration,
    plan: Arc<Plan>,
    sharing: Sharing,
    note: String,
}

/// A plan and where it comes from.
pub(super) struct Planned {
    pub(super) plan: Arc<Plan>,
    pub(super) cached: bool,
    pub(super) reason: String,
    /// The plan's way of sharing.
    pub(super) sharing: Sharing,
    /// Why it is not the one asked for; empty if it is.
    pub(super) note: String,
}

impl Entry {
    fn planned(&self, cached: bool, reason: String) -> Planned {
        Planned { plan: Arc::clone(&self.plan), cached, reason, sharing: self.sharing, note: self.note.clone() }
    }
}

impl Plans {
    /// The plan of `declaration`, from the cache where its structure was met before.
    ///
    /// `heaps`: what tells the needs of resources in shared memory, for [`Sharing::Placed`].
    pub(super) fn get(
        &mut self,
        declaration: &Declaration,
        options: PlanOptions,
        heaps: Option<(&mut Heaps, &wgpu::Device)>,
    ) -> Result<Planned, GraphError> {
        let mut hasher = DefaultHasher::new();
        (declaration, options).hash(&mut hasher);
        let hash = hasher.finish();
        let found = self
            .entries
            .iter()
            .position(|entry| entry.hash == hash && entry.options == options && entry.declaration == *declaration);
        if let Some(index) = found {
            self.entries[..=index].rotate_right(1);
            return Ok(self.entries[0].planned(true, String::new()));
        }
        let reason = self.reason(declaration, options);
        let (plan, note) = match heaps {
            Some((heaps, device)) => placed(declaration, options, heaps, device)?,
            None => (plan(declaration, &options)?, String::new()),
        };
        let sharing = if note.is_empty() { options.sharing } else { Sharing::Merged };
        self.entries.truncate(KEPT - 1);
        self.entries.insert(0, Entry { hash, options, declaration: declaration.clone(), plan: Arc::new(plan), sharing, note });
        Ok(self.entries[0].planned(false, reason))
    }

    /// In place of the plan given last, for which there is no shared memory: one for the pool.
    pub(super) fn fall_back(&mut self, declaration: &Declaration, note: String) -> Result<Planned, GraphError> {
        let options = PlanOptions::default().sharing(Sharing::Merged);
        let plan = Arc::new(plan(declaration, &options)?);
        if let Some(entry) = self.entries.first_mut() {
            (entry.plan, entry.sharing, entry.note) = (Arc::clone(&plan), Sharing::Merged, note.clone());
        }
        Ok(Planned { plan, cached: false, reason: String::new(), sharing: Sharing::Merged, note })
    }

    /// What differs from the latest frame of the same name.
    fn reason(&self, declaration: &Declaration, options: PlanOptions) -> String {
        let Some(last) = self.entries.iter().find(|entry| entry.declaration.name == declaration.name) else {
            return "first frame of this name".to_owned();
        };
        if last.options != options {
            return format!("sharing changed from {:?} to {:?}", last.options.sharing, options.sharing);
        }
        let old = &last.declaration;
        for (a, b) in old.resources.iter().zip(&declaration.resources) {
            if a != b {
                return if a.name == b.name {
                    format!("resource `{}` changed", a.name)
                } else {
                    format!("resource `{}` in place of `{}`", b.name, a.name)
                };
            }
        }
        for (a, b) in old.passes.iter().zip(&declaration.passes) {
            if a != b {
                return if a.name == b.name {
                    format!("pass `{}` changed", a.name)
                } else {
                    format!("pass `{}` in place of `{}`", b.name, a.name)
                };
            }
        }
        format!(
            "{} resources and {} passes, before {} and {}",
            declaration.resources.len(),
            declaration.passes.len(),
            old.resources.len(),
            old.passes.len()
        )
    }
}

/// A plan for shared memory, or one for the pool with the reason.
fn placed(
    declaration: &Declaration,
    options: PlanOptions,
    heaps: &mut Heaps,
    device: &wgpu::Device,
) -> Result<(Plan, String), GraphError> {
    let (limits, features) = (device.limits(), device.features());
    let state = RefCell::new((heaps, None));
    let plan_for_heaps = plan_with_needs(declaration, &options, &|index, usage| {
        let resource = &declaration.resources[index];
        let fallback = Need { bytes: resource.bytes, align: ALIGN, class: 0 };
        // What is beyond the limits is not for the driver to see; the executor refuses the frame before it is placed.
        if resource_limits(resource, usage, &limits, features).is_err() {
            return fallback;
        }
        let (heaps, refusal) = &mut *state.borrow_mut();
        heaps.need(&resource.kind, usage).unwrap_or_else(|error| {
            let why = match error {
                HeapError::Unsupported(why) => why,
                HeapError::OutOfMemory => "the device is out of memory".to_owned(),
            };
            refusal.get_or_insert_with(|| format!("`{}`: {why}", resource.name));
            fallback
        })
    })?;
    match state.into_inner().1 {
        None => Ok((plan_for_heaps, String::new())),
        Some(note) => Ok((plan(declaration, &options.sharing(Sharing::Merged))?, note)),
    }
}
