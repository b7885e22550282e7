//! Bind groups and views that an equal frame needs again.
//!
//! They belong to a plan and are found by position, then compared by what they are made of: an equal plan is nearly
//! always given equal objects. Two variants of each are kept, since history makes odd and even frames differ.

use super::{Physical, bindings::Groups};
use crate::{shader::ShaderCore, verify::Bound};
use std::sync::Arc;

/// Variants not used for so many frames are dropped, so that their objects can go.
const IDLE_FRAMES: u64 = 32;

/// Per position in the plan's order: what was made for it.
#[derive(Debug, Default)]
pub(super) struct Cache {
    bindings: Vec<[Option<Bindings>; 2]>,
    views: Vec<[Option<Views>; 2]>,
    last_frame: u64,
}

#[derive(Debug)]
struct Bindings {
    core: ShaderCore,
    bound: Vec<Bound>,
    objects: Vec<Physical>,
    groups: Arc<Groups>,
    last_frame: u64,
}

#[derive(Debug)]
struct Views {
    objects: Vec<Physical>,
    made: Arc<Vec<wgpu::TextureView>>,
    last_frame: u64,
}

/// What bind groups are found by, beside the objects behind `bound`.
pub(super) struct Key<'a> {
    pub(super) position: usize,
    pub(super) core: &'a ShaderCore,
    pub(super) bound: &'a [Bound],
}

impl Cache {
    /// Prepares for a frame of `positions` passes.
    pub(super) fn begin(&mut self, positions: usize, frame: u64) {
        self.bindings.resize_with(positions, Default::default);
        self.views.resize_with(positions, Default::default);
        self.last_frame = frame;
    }

    /// The bind groups of a pass, made anew if they are not those of an earlier frame.
    pub(super) fn groups<'o>(
        &mut self,
        key: &Key<'_>,
        objects: impl Iterator<Item = &'o Physical> + Clone,
        make: impl FnOnce() -> Groups,
    ) -> Arc<Groups> {
        let (frame, variants) = (self.last_frame, &mut self.bindings[key.position]);
        for found in variants.iter_mut().flatten() {
            if found.objects.iter().eq(objects.clone()) && *found.bound == *key.bound && found.core == *key.core {
                found.last_frame = frame;
                return Arc::clone(&found.groups);
            }
        }
        let groups = Arc::new(make());
        let made = Bindings {
            core: key.core.clone(),
            bound: key.bound.to_vec(),
            objects: objects.cloned().collect(),
            groups: Arc::clone(&groups),
            last_frame: frame,
        };
        replace(variants, made, |found| found.last_frame);
        groups
    }

    /// The attachments' views of a render pass that begins at `position`.
    pub(super) fn views(
        &mut self,
        position: usize,
        objects: &[Physical],
        make: impl FnOnce() -> Vec<wgpu::TextureView>,
    ) -> Arc<Vec<wgpu::TextureView>> {
        let (frame, variants) = (self.last_frame, &mut self.views[position]);
        for found in variants.iter_mut().flatten() {
            if *found.objects == *objects {
                found.last_frame = frame;
                return Arc::clone(&found.made);
            }
        }
        let views = Arc::new(make());
        let made = Views { objects: objects.to_vec(), made: Arc::clone(&views), last_frame: frame };
        replace(variants, made, |found| found.last_frame);
        views
    }

    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        let bindings = self.bindings.iter().flatten().flatten().count();
        bindings + self.views.iter().flatten().flatten().count()
    }

    /// Drops what no recent frame used.
    pub(super) fn evict(&mut self, frame: u64) {
        let old = |last: u64| last + IDLE_FRAMES <= frame;
        if old(self.last_frame) {
            *self = Self::default();
        } else if frame.is_multiple_of(IDLE_FRAMES) {
            for variant in self.bindings.iter_mut().flatten() {
                variant.take_if(|found| old(found.last_frame));
            }
            for variant in self.views.iter_mut().flatten() {
                variant.take_if(|found| old(found.last_frame));
            }
        }
    }
}

/// Puts `made` in the place of the variant that was used longest ago.
fn replace<T>(variants: &mut [Option<T>; 2], made: T, last_frame: impl Fn(&T) -> u64) {
    let age = |variant: &Option<T>| variant.as_ref().map_or(0, &last_frame);
    let oldest = usize::from(age(&variants[1]) < age(&variants[0]));
    variants[oldest] = Some(made);
}
