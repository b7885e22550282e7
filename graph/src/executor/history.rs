//! Pairs of objects that live on between frames.

use super::{Frame, Physical, create};
use crate::declaration::{Origin, ResourceKind};
use std::collections::HashMap;

/// Pairs by graph name and resource name.
#[derive(Debug, Default)]
pub(super) struct Histories {
    pairs: HashMap<(String, String), Pair>,
}

#[derive(Debug)]
struct Pair {
    kind: ResourceKind,
    usage: u32,
    previous: Physical,
    current: Physical,
    bytes: u64,
    first_frame: u64,
}

impl Histories {
    pub(super) fn clear(&mut self) {
        self.pairs.clear();
    }

    pub(super) fn bytes(&self) -> u64 {
        self.pairs.values().fold(0, |total, pair| total.saturating_add(pair.bytes.saturating_mul(2)))
    }

    /// Gives each pair in use its objects. New objects are zero: wgpu clears them before their first use.
    pub(super) fn acquire(&mut self, device: &wgpu::Device, frame: &mut Frame<'_>, number: u64) {
        for previous in pairs(frame) {
            let current = previous + 1;
            let used = frame.plan.lifetimes[previous].is_some() || frame.plan.lifetimes[current].is_some();
            if !used {
                continue;
            }
            let resource = &frame.declaration.resources[previous];
            let mut kind = resource.kind.clone();
            if let ResourceKind::Buffer(desc) = &mut kind {
                desc.element = None;
            }
            let needed = frame.plan.usages[previous] | frame.plan.usages[current];
            let key = (frame.declaration.name.clone(), resource.name.clone());
            let fits = |pair: &Pair| pair.kind == kind && pair.usage & needed == needed;
            if !self.pairs.get(&key).is_some_and(fits) {
                let usage = needed | generous(device, &kind);
                let [first, second] =
                    ["previous", "current"].map(|half| create(device, &format!("{} {half}", key.1), &kind, usage));
                self.pairs.insert(
                    key.clone(),
                    Pair { kind, usage, previous: first, current: second, bytes: resource.bytes, first_frame: number },
                );
            }
            if let Some(pair) = self.pairs.get(&key) {
                frame.physical[previous] = pair.previous.clone();
                frame.physical[current] = pair.current.clone();
            }
        }
    }

    /// Drops what was made for frame `number`: some of it may be an object wgpu could not make.
    pub(super) fn forget(&mut self, number: u64) {
        self.pairs.retain(|_, pair| pair.first_frame != number);
    }

    /// After a frame has run: what it wrote becomes `previous`; pairs it no longer declares are dropped.
    pub(super) fn commit(&mut self, frame: &Frame<'_>) {
        let mut declared = Vec::new();
        for previous in pairs(frame) {
            let current = previous + 1;
            let name = &frame.declaration.resources[previous].name;
            declared.push(name.as_str());
            let written = frame
                .plan
                .order
                .iter()
                .flat_map(|&pass| &frame.declaration.passes[pass].accesses)
                .any(|access| access.resource == current && access.writes());
            if written && let Some(pair) = self.pairs.get_mut(&(frame.declaration.name.clone(), name.clone())) {
                std::mem::swap(&mut pair.previous, &mut pair.current);
            }
        }
        self.pairs.retain(|(graph, name), _| *graph != frame.declaration.name || declared.contains(&name.as_str()));
    }
}

/// Indices of the `previous` halves; a `current` half follows each.
fn pairs(frame: &Frame<'_>) -> Vec<usize> {
    let resources = &frame.declaration.resources;
    (0..resources.len().saturating_sub(1))
        .filter(|&index| resources[index].origin == Origin::Previous && resources[index + 1].origin == Origin::Current)
        .collect()
}

/// Usages a later frame may ask for, so that it need not begin the history anew.
fn generous(device: &wgpu::Device, kind: &ResourceKind) -> u32 {
    match kind {
        ResourceKind::Buffer(_) => (wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::UNIFORM
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST)
            .bits(),
        ResourceKind::Texture(desc) => {
            let wanted = wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::COPY_SRC
                | wgpu::TextureUsages::COPY_DST;
            let allowed = desc.format.guaranteed_format_features(device.features()).allowed_usages;
            let mut usage = wanted & allowed;
            if desc.sample_count > 1 {
                usage -= wgpu::TextureUsages::STORAGE_BINDING;
            }
            usage.bits()
        }
    }
}
