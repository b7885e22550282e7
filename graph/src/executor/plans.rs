//! Plans by the structure of their declaration.

use super::{cache::Cache, pool::Acquired};
use crate::{
    declaration::{Declaration, ResourceKind},
    error::GraphError,
    hash::Folded,
    plan::{Need, Plan, PlanOptions, plan, plan_with_needs},
};
use std::{
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
    state: State,
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
        self.find(declaration, options, |declaration| plan(declaration, &options))
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
        self.find(declaration, options, |declaration| plan_with_needs(declaration, &options, needs))
    }

    fn find(
        &mut self,
        declaration: &Declaration,
        options: PlanOptions,
        make: impl FnOnce(&Declaration) -> Result<Plan, GraphError>,
    ) -> Result<Planned, GraphError> {
        let hash = structure_hash(declaration, options);
        let found = self
            .entries
            .iter()
            .position(|entry| entry.hash == hash && entry.options == options && same_structure(&entry.declaration, declaration));
        if let Some(index) = found {
            self.entries[..=index].rotate_right(1);
            return Ok(Planned { plan: Arc::clone(&self.entries[0].plan), cached: true, reason: String::new() });
        }
        let reason = self.reason(declaration, options);
        let plan = Arc::new(make(declaration)?);
        self.entries.truncate(KEPT - 1);
        let entry = Entry { hash, options, declaration: declaration.clone(), plan: Arc::clone(&plan), state: State::default() };
        self.entries.insert(0, entry);
        Ok(Planned { plan, cached: false, reason })
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

/// Names told of a change; the rest is counted.
const TOLD: usize = 3;

/// What came, what went and what changed, by name.
fn difference<T: PartialEq>(what: &str, old: &[T], new: &[T], name: impl Fn(&T) -> &str) -> Vec<String> {
    let by_name: std::collections::HashMap<&str, &T> = old.iter().map(|item| (name(item), item)).collect();
    let names: std::collections::HashSet<&str> = new.iter().map(|item| name(item)).collect();
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
        assert_eq!(reason(&first, options.sharing(crate::Sharing::Off)), "sharing changed from Merged to Off");
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
