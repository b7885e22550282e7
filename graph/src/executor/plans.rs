//! Plans by the structure of their declaration.

use super::{
    cache::Cache,
    heap::{HeapError, Heaps},
    limits,
    pool::Acquired,
};
use crate::{
    declaration::{Declaration, ResourceKind},
    error::GraphError,
    hash::Folded,
    plan::{ALIGN, Need, Plan, PlanOptions, Sharing, plan, plan_with_needs},
};
use std::{
    cell::RefCell,
    hash::{Hash, Hasher},
    sync::Arc,
};

/// Plans kept: enough for a few graphs and their variants to alternate.
const KEPT: usize = 32;

/// The most recently used plans. Frames of equal structure share a plan, whatever the graph's name: one for each view of
/// a scene, say.
#[derive(Debug, Default)]
pub struct PlanCache {
    /// Latest first.
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
    state: State,
}

impl Entry {
    fn planned(&self, cached: bool, reason: String) -> Planned {
        Planned { plan: Arc::clone(&self.plan), cached, reason, sharing: self.sharing, note: self.note.clone() }
    }
}

/// What the executor keeps with a plan.
#[derive(Debug, Default)]
pub(super) struct State {
    pub(super) cache: Cache,
    pub(super) acquired: Acquired,
    /// Whether the device was found able to run it.
    pub(super) checked: bool,
}

/// A plan and where it comes from.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Planned {
    /// The plan.
    pub plan: Arc<Plan>,
    /// Whether it was in the cache.
    pub cached: bool,
    /// Why it was made anew; empty if it was in the cache.
    pub reason: String,
    /// The plan's way of sharing.
    pub sharing: Sharing,
    /// Why that is not the one asked for; empty if it is.
    pub note: String,
}

impl PlanCache {
    /// An empty cache.
    pub fn new() -> Self {
        Self::default()
    }

    /// The plan of `declaration`, from the cache where its structure was met before.
    ///
    /// # Errors
    /// As [`plan`].
    pub fn get(&mut self, declaration: &Declaration, options: PlanOptions) -> Result<Planned, GraphError> {
        self.find(declaration, options, |declaration| Ok((plan(declaration, &options)?, String::new())))
    }

    /// As [`PlanCache::get`], with what each resource needs of shared memory. The needs must not change between calls.
    ///
    /// # Errors
    /// As [`plan_with_needs`].
    pub fn get_with_needs(
        &mut self,
        declaration: &Declaration,
        options: PlanOptions,
        needs: &dyn Fn(usize, u32) -> Need,
    ) -> Result<Planned, GraphError> {
        self.find(declaration, options, |declaration| Ok((plan_with_needs(declaration, &options, needs)?, String::new())))
    }

    /// As [`PlanCache::get`] for shared memory, with what `heaps` say of the needs; a plan for the pool where they refuse.
    pub(super) fn get_placed(
        &mut self,
        declaration: &Declaration,
        options: PlanOptions,
        heaps: &mut Heaps,
        device: &wgpu::Device,
    ) -> Result<Planned, GraphError> {
        self.find(declaration, options, |declaration| placed(declaration, options, heaps, device))
    }

    /// In place of the plan given last, for which there is no shared memory: one for the pool.
    pub(super) fn fall_back(&mut self, declaration: &Declaration, note: String) -> Result<Planned, GraphError> {
        let Some(entry) = self.entries.first_mut() else { return self.get(declaration, PlanOptions::default()) };
        entry.plan = Arc::new(plan(declaration, &entry.options.sharing(Sharing::Merged))?);
        (entry.sharing, entry.note, entry.state) = (Sharing::Merged, note, State::default());
        Ok(entry.planned(false, String::new()))
    }

    fn find(
        &mut self,
        declaration: &Declaration,
        options: PlanOptions,
        make: impl FnOnce(&Declaration) -> Result<(Plan, String), GraphError>,
    ) -> Result<Planned, GraphError> {
        let hash = structure_hash(declaration, options);
        let found = self
            .entries
            .iter()
            .position(|entry| entry.hash == hash && entry.options == options && same_structure(&entry.declaration, declaration));
        if let Some(index) = found {
            self.entries[..=index].rotate_right(1);
            return Ok(self.entries[0].planned(true, String::new()));
        }
        let reason = self.reason(declaration, options);
        let (plan, note) = make(declaration)?;
        let (plan, sharing) = (Arc::new(plan), if note.is_empty() { options.sharing } else { Sharing::Merged });
        self.entries.truncate(KEPT - 1);
        let declaration = declaration.clone();
        let entry = Entry { hash, options, declaration, plan, sharing, note, state: State::default() };
        self.entries.insert(0, entry);
        Ok(self.entries[0].planned(false, reason))
    }

    /// The state kept with the plan that was found last; put it back when the frame is done.
    pub(super) fn take_state(&mut self) -> State {
        self.entries.first_mut().map(|entry| std::mem::take(&mut entry.state)).unwrap_or_default()
    }

    pub(super) fn put_state(&mut self, state: State) {
        if let Some(entry) = self.entries.first_mut() {
            entry.state = state;
        }
    }

    #[cfg(test)]
    pub(super) fn cached_bindings(&self) -> usize {
        self.entries.iter().map(|entry| entry.state.cache.len()).sum()
    }

    /// Drops bind groups of plans that no recent frame used.
    pub(super) fn evict(&mut self, frame: u64) {
        for entry in &mut self.entries {
            entry.state.cache.evict(frame);
        }
    }

    /// What differs from the latest frame of the same name.
    fn reason(&self, declaration: &Declaration, options: PlanOptions) -> String {
        let Some(last) = self.entries.iter().find(|entry| entry.declaration.name == declaration.name) else {
            return "first frame of this name".to_owned();
        };
        let mut changes: Vec<String> = Vec::new();
        if last.options.sharing != options.sharing {
            changes.push(format!("sharing changed from {:?} to {:?}", last.options.sharing, options.sharing));
        } else if last.options != options {
            changes.push("the options of planning changed".to_owned());
        }
        let old = &last.declaration;
        changes.extend(difference("resource", &old.resources, &declaration.resources, |resource| &resource.name));
        changes.extend(difference("pass", &old.passes, &declaration.passes, |pass| &pass.name));
        if changes.is_empty() {
            changes.push("the plan of this structure had left the cache".to_owned());
        }
        changes.join("; ")
    }
}

/// A plan for shared memory; or one for the pool, with the reason.
fn placed(
    declaration: &Declaration,
    options: PlanOptions,
    heaps: &mut Heaps,
    device: &wgpu::Device,
) -> Result<(Plan, String), GraphError> {
    let (device_limits, features) = (device.limits(), device.features());
    let state = RefCell::new((heaps, None));
    let plan_for_heaps = plan_with_needs(declaration, &options, &|index, usage| {
        let resource = &declaration.resources[index];
        let fallback = Need { bytes: resource.bytes, align: ALIGN, class: 0 };
        // What is beyond the limits is not for the driver to see; the executor refuses the frame before it is placed.
        if limits::resource(resource, usage, &device_limits, features).is_err() {
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

/// Names told of a change; the rest is counted.
const TOLD: usize = 3;

/// What came, what went and what changed, by name.
fn difference<T: PartialEq>(what: &str, old: &[T], new: &[T], name: impl Fn(&T) -> &str) -> Vec<String> {
    let by_name: std::collections::HashMap<&str, &T> = old.iter().map(|item| (name(item), item)).collect();
    let names: std::collections::HashSet<&str> = new.iter().map(&name).collect();
    let changed = new.iter().filter(|item| by_name.get(name(item)).is_some_and(|old| old != item));
    let came = new.iter().filter(|item| !by_name.contains_key(name(item)));
    let went = old.iter().filter(|item| !names.contains(name(item)));
    let tell = |items: Vec<&T>, verb: &str| {
        let told: Vec<String> = items.iter().take(TOLD).map(|item| format!("`{}`", name(item))).collect();
        let more = items.len().saturating_sub(TOLD);
        let more = if more == 0 { String::new() } else { format!(" and {more} more") };
        (!told.is_empty()).then(|| format!("{what} {}{more} {verb}", told.join(", ")))
    };
    [tell(changed.collect(), "changed"), tell(came.collect(), "came"), tell(went.collect(), "went")]
        .into_iter()
        .flatten()
        .collect()
}

fn same_structure(a: &Declaration, b: &Declaration) -> bool {
    a.resources == b.resources && a.passes == b.passes
}

/// Hash of what the plan follows from, without the names: frames that differ only in these are rare, and told apart by
/// comparing them. It is computed every frame.
fn structure_hash(declaration: &Declaration, options: PlanOptions) -> u64 {
    let mut hasher = Folded::default();
    options.hash(&mut hasher);
    for resource in &declaration.resources {
        let flags = resource.origin as u64 | u64::from(resource.keep) << 8;
        hasher.write_u64(resource.bytes ^ flags << 48);
        if let ResourceKind::Texture(desc) = &resource.kind {
            hasher.write_u64(u64::from(desc.size[0]) | u64::from(desc.size[1]) << 32);
            hasher.write_u64(u64::from(desc.size[2]) | u64::from(desc.mip_level_count) << 32);
        }
    }
    for pass in &declaration.passes {
        let flags = pass.kind as u64 | u64::from(pass.heavy) << 8 | u64::from(pass.side_effect) << 9;
        hasher.write_u64(flags | u64::from(pass.pinned) << 10 | (pass.accesses.len() as u64) << 16);
        for access in &pass.accesses {
            let how = u64::from(access.read) | (access.write as u64) << 1 | u64::from(access.exclusive) << 3;
            hasher.write_u64(access.resource as u64 | u64::from(access.usage) << 32 ^ how << 60);
            if !access.part.is_all() {
                access.part.hash(&mut hasher);
            }
        }
    }
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(name: &str, resources: &[(&str, u64)], passes: &[&str]) -> Declaration {
        let resources: Vec<String> = resources
            .iter()
            .map(|(name, bytes)| format!(r#"{{"name": "{name}", "kind": "buffer", "origin": "imported", "bytes": {bytes}}}"#))
            .collect();
        let passes: Vec<String> = passes
            .iter()
            .map(|name| format!(r#"{{"name": "{name}", "kind": "compute", "writes": [{{"resource": "a"}}]}}"#))
            .collect();
        let text = format!(r#"{{"frame": "{name}", "resources": [{}], "passes": [{}]}}"#, resources.join(","), passes.join(","));
        Declaration::from_frame_json(&text).unwrap()
    }

    #[test]
    fn the_reason_names_what_changed() {
        let mut cache = PlanCache::new();
        let options = PlanOptions::default();
        let mut reason = |declaration: &Declaration, options| cache.get(declaration, options).unwrap().reason;
        let first = frame("f", &[("a", 4), ("b", 4)], &["p", "q"]);
        assert_eq!(reason(&first, options), "first frame of this name");
        assert_eq!(reason(&first, options), "", "cached");
        assert_eq!(reason(&frame("f", &[("a", 8), ("b", 4)], &["p", "q"]), options), "resource `a` changed");
        assert_eq!(
            reason(&frame("f", &[("a", 8), ("c", 4)], &["p", "r", "s", "t", "u"]), options),
            "resource `c` came; resource `b` went; pass `r`, `s`, `t` and 1 more came; pass `q` went"
        );
        assert_eq!(reason(&first, options), "", "the first is still there");
        assert_eq!(reason(&first, options.sharing(Sharing::Off)), "sharing changed from Merged to Off");
    }

    #[test]
    fn views_of_one_structure_share_a_plan() {
        let mut cache = PlanCache::new();
        let one = cache.get(&frame("left eye", &[("a", 4)], &["p"]), PlanOptions::default()).unwrap();
        let two = cache.get(&frame("right eye", &[("a", 4)], &["p"]), PlanOptions::default()).unwrap();
        assert!(two.cached && Arc::ptr_eq(&one.plan, &two.plan));
    }

    #[test]
    fn old_plans_leave() {
        let mut cache = PlanCache::new();
        for bytes in 0..100 {
            cache.get(&frame("f", &[("a", 4 + bytes)], &["p"]), PlanOptions::default()).unwrap();
        }
        assert_eq!(cache.entries.len(), KEPT);
    }
}
