//! Objects behind the slots of plans, kept between frames.

use super::{Frame, Physical, create};
use crate::{
    TextureDesc,
    declaration::{Declaration, ResourceKind},
    plan::{Slot, SlotKind},
};
use std::collections::HashMap;

/// Frames after which an object nothing uses is dropped: a few graphs may alternate on one executor.
const IDLE_FRAMES: u64 = 8;

type Key = (ResourceKind, u32);

/// Objects by description and usage.
#[derive(Debug, Default)]
pub(super) struct Pool {
    objects: Vec<Option<Pooled>>,
    by_key: HashMap<Key, Vec<usize>>,
    /// Changes whenever an object comes or goes.
    generation: u64,
}

#[derive(Debug)]
struct Pooled {
    object: Physical,
    bytes: u64,
    first_frame: u64,
    last_frame: u64,
}

/// The objects a plan was given last; they are its own again while the pool has not changed.
#[derive(Debug, Default)]
pub(super) struct Acquired {
    generation: u64,
    /// Per slot of the plan: its object in the pool.
    objects: Vec<usize>,
}

impl Pool {
    /// Gives each slot of the plan an object. Slot by slot in order, so equal plans get equal objects.
    pub(super) fn acquire(&mut self, device: &wgpu::Device, frame: &mut Frame<'_>, acquired: &mut Acquired, number: u64) {
        if acquired.generation != self.generation || acquired.objects.len() != frame.plan.slots.len() {
            acquired.objects = self.find(device, frame, number);
            acquired.generation = self.generation;
        }
        for (slot, &index) in frame.plan.slots.iter().zip(&acquired.objects) {
            let Some(pooled) = self.objects.get_mut(index).and_then(Option::as_mut) else { continue };
            pooled.last_frame = number;
            for &resource in &slot.resources {
                frame.physical[resource] = match &pooled.object {
                    Physical::Buffer { buffer, .. } => Physical::Buffer {
                        buffer: buffer.clone(),
                        offset: frame.plan.offsets[resource].unwrap_or(0),
                        size: buffer_size(&frame.declaration, resource),
                    },
                    other => other.clone(),
                };
            }
        }
    }

    fn find(&mut self, device: &wgpu::Device, frame: &Frame<'_>, number: u64) -> Vec<usize> {
        let mut taken: HashMap<Key, usize> = HashMap::new();
        let mut found = Vec::with_capacity(frame.plan.slots.len());
        for (index, slot) in frame.plan.slots.iter().enumerate() {
            let Some(kind) = description(&frame.declaration, slot) else {
                found.push(usize::MAX);
                continue;
            };
            let key = (kind, slot.usage);
            let next = taken.entry(key.clone()).or_insert(0);
            let of_key = self.by_key.entry(key.clone()).or_default();
            if *next == of_key.len() {
                let object = create(device, &format!("pool slot {index}"), &key.0, slot.usage);
                of_key.push(self.objects.len());
                self.objects.push(Some(Pooled { object, bytes: slot.bytes, first_frame: number, last_frame: number }));
                self.generation += 1;
            }
            found.push(of_key[*next]);
            *next += 1;
        }
        found
    }

    /// Drops what was made for frame `number`: some of it may be an object wgpu could not make.
    pub(super) fn forget(&mut self, number: u64) {
        self.retain(|pooled| pooled.first_frame != number);
    }

    /// Drops what no recent frame used.
    pub(super) fn evict(&mut self, number: u64) {
        self.retain(|pooled| pooled.last_frame + IDLE_FRAMES > number);
    }

    fn retain(&mut self, keep: impl Fn(&Pooled) -> bool) {
        let gone = |object: &Option<Pooled>| object.as_ref().is_some_and(|pooled| !keep(pooled));
        if !self.objects.iter().any(gone) {
            return;
        }
        self.generation += 1;
        for object in &mut self.objects {
            object.take_if(|pooled| !keep(pooled));
        }
        // Close the gaps, so that nothing grows.
        let mut moved = vec![usize::MAX; self.objects.len()];
        let mut next = 0;
        for (index, object) in self.objects.iter().enumerate() {
            if object.is_some() {
                moved[index] = next;
                next += 1;
            }
        }
        self.objects.retain(Option::is_some);
        for indices in self.by_key.values_mut() {
            indices.retain_mut(|index| {
                *index = moved[*index];
                *index != usize::MAX
            });
        }
        self.by_key.retain(|_, indices| !indices.is_empty());
    }

    pub(super) fn objects(&self) -> usize {
        self.objects.len()
    }

    pub(super) fn bytes(&self) -> u64 {
        self.objects.iter().flatten().fold(0, |total, pooled| total.saturating_add(pooled.bytes))
    }
}

fn buffer_size(declaration: &Declaration, resource: usize) -> u64 {
    match &declaration.resources[resource].kind {
        ResourceKind::Buffer(desc) => desc.padded(),
        ResourceKind::Texture(_) | ResourceKind::Tlas => 0,
    }
}

/// The description of the object that serves all resources of a slot; `None` for what the pool does not hold.
fn description(declaration: &Declaration, slot: &Slot) -> Option<ResourceKind> {
    let kind = |resource: usize| &declaration.resources[resource].kind;
    match (slot.kind, kind(*slot.resources.first()?)) {
        (SlotKind::Object | SlotKind::Arena, ResourceKind::Buffer(_)) => {
            Some(ResourceKind::Buffer(crate::BufferDesc::bytes(slot.bytes.next_multiple_of(4))))
        }
        (SlotKind::Object, ResourceKind::Texture(first)) => {
            let others = slot.resources[1..].iter().filter_map(|&resource| match kind(resource) {
                ResourceKind::Texture(desc) => Some(desc),
                ResourceKind::Buffer(_) | ResourceKind::Tlas => None,
            });
            Some(ResourceKind::Texture(others.fold(first.clone(), merge)))
        }
        _ => None,
    }
}

/// A texture that serves both descriptions, which differ in mips, layers and view formats at most.
fn merge(mut all: TextureDesc, desc: &TextureDesc) -> TextureDesc {
    all.mip_level_count = all.mip_level_count.max(desc.mip_level_count);
    all.size[2] = all.size[2].max(desc.size[2]);
    desc.view_formats.iter().fold(all, |all, &format| all.view_format(format))
}
