//! Objects behind transient resources, kept between frames.

use super::{Frame, Physical, create};
use crate::{declaration::ResourceKind, plan::SlotKind};
use std::collections::HashMap;

/// Frames after which an object nothing uses is dropped: a few graphs may alternate on one executor.
const IDLE_FRAMES: u64 = 8;

/// Objects by description and usage.
#[derive(Debug, Default)]
pub(super) struct Pool {
    objects: HashMap<(ResourceKind, u32), Vec<Pooled>>,
}

#[derive(Debug)]
struct Pooled {
    object: Physical,
    bytes: u64,
    first_frame: u64,
    last_frame: u64,
}

impl Pool {
    /// Gives each slot of the plan an object. Slot by slot in order, so equal plans get equal objects.
    pub(super) fn acquire(&mut self, device: &wgpu::Device, frame: &mut Frame<'_>, number: u64) {
        let mut taken: HashMap<(ResourceKind, u32), usize> = HashMap::new();
        for (index, slot) in frame.plan.slots.iter().enumerate().filter(|(_, slot)| slot.kind != SlotKind::Heap) {
            let Some(&first) = slot.resources.first() else { continue };
            let mut kind = frame.declaration.resources[first].kind.clone();
            if let ResourceKind::Buffer(desc) = &mut kind {
                desc.element = None;
                desc.size = desc.padded();
            }
            let key = (kind, slot.usage);
            let objects = self.objects.entry(key.clone()).or_default();
            let next = taken.entry(key.clone()).or_insert(0);
            if *next == objects.len() {
                let object = create(device, &format!("pool slot {index}"), &key.0, slot.usage);
                objects.push(Pooled { object, bytes: slot.bytes, first_frame: number, last_frame: number });
            }
            let pooled = &mut objects[*next];
            *next += 1;
            pooled.last_frame = number;
            for &resource in &slot.resources {
                frame.physical[resource] = pooled.object.clone();
            }
        }
    }

    /// Drops what was made for frame `number`: some of it may be an object wgpu could not make.
    pub(super) fn forget(&mut self, number: u64) {
        for objects in self.objects.values_mut() {
            objects.retain(|pooled| pooled.first_frame != number);
        }
        self.objects.retain(|_, objects| !objects.is_empty());
    }

    /// Drops what no recent frame used.
    pub(super) fn evict(&mut self, number: u64) {
        for objects in self.objects.values_mut() {
            objects.retain(|pooled| pooled.last_frame + IDLE_FRAMES > number);
        }
        self.objects.retain(|_, objects| !objects.is_empty());
    }

    pub(super) fn objects(&self) -> usize {
        self.objects.values().map(Vec::len).sum()
    }

    pub(super) fn bytes(&self) -> u64 {
        self.objects.values().flatten().fold(0, |total, pooled| total.saturating_add(pooled.bytes))
    }
}
