//! Plans by the structure of their declaration.

use crate::{
    declaration::Declaration,
    error::GraphError,
    plan::{Plan, PlanOptions, plan},
};
use std::{
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
}

/// A plan and where it comes from.
pub(super) struct Planned {
    pub(super) plan: Arc<Plan>,
    pub(super) cached: bool,
    pub(super) reason: String,
}

impl Plans {
    /// The plan of `declaration`, from the cache where its structure was met before.
    pub(super) fn get(&mut self, declaration: &Declaration, options: PlanOptions) -> Result<Planned, GraphError> {
        let mut hasher = DefaultHasher::new();
        (declaration, options).hash(&mut hasher);
        let hash = hasher.finish();
        let found = self
            .entries
            .iter()
            .position(|entry| entry.hash == hash && entry.options == options && entry.declaration == *declaration);
        if let Some(index) = found {
            self.entries[..=index].rotate_right(1);
            return Ok(Planned { plan: Arc::clone(&self.entries[0].plan), cached: true, reason: String::new() });
        }
        let reason = self.reason(declaration, options);
        let plan = Arc::new(plan(declaration, &options)?);
        self.entries.truncate(KEPT - 1);
        self.entries.insert(0, Entry { hash, options, declaration: declaration.clone(), plan: Arc::clone(&plan) });
        Ok(Planned { plan, cached: false, reason })
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
