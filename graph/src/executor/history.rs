//! Objects that live on between frames: history pairs and persistent resources.

use super::{Frame, Physical, create, readback::Rows};
use crate::declaration::{Origin, ResourceKind};
use std::{collections::HashMap, sync::Arc};

/// Kept objects by graph name and resource name.
#[derive(Debug, Default)]
pub(super) struct Histories {
    kept: HashMap<String, HashMap<Arc<str>, Kept>>,
}

/// A pair whose halves change roles, or a single object.
#[derive(Debug)]
struct Kept {
    kind: ResourceKind,
    usage: u32,
    /// The last frame's contents; of a persistent resource, the only object.
    previous: Physical,
    current: Option<Physical>,
    bytes: u64,
    first_frame: u64,
}

impl Kept {
    fn bytes(&self) -> u64 {
        self.bytes.saturating_mul(if self.current.is_some() { 2 } else { 1 })
    }
}

impl Histories {
    pub(super) fn clear(&mut self) {
        self.kept.clear();
    }

    pub(super) fn bytes(&self) -> u64 {
        self.kept.values().flat_map(HashMap::values).fold(0, |total, kept| total.saturating_add(kept.bytes()))
    }

    /// Gives each kept resource in use its objects. New objects are zero (wgpu clears them before their first use) or what
    /// the frame gives as their first contents.
    pub(super) fn acquire(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, frame: &mut Frame<'_>, number: u64) {
        for (first, second) in kept(frame) {
            let used = |index: usize| frame.plan.lifetimes[index].is_some();
            if !used(first) && !second.is_some_and(used) {
                continue;
            }
            let resource = &frame.declaration.resources[first];
            let mut kind = resource.kind.clone();
            if let ResourceKind::Buffer(desc) = &mut kind {
                desc.element = None;
            }
            let needed = frame.plan.usages[first] | second.map_or(0, |second| frame.plan.usages[second]);
            let of_graph = match self.kept.get_mut(&frame.declaration.name) {
                Some(found) => found,
                None => self.kept.entry(frame.declaration.name.clone()).or_default(),
            };
            let fits =
                |kept: &Kept| kept.kind == kind && kept.usage & needed == needed && kept.current.is_some() == second.is_some();
            if !of_graph.get(&resource.name).is_some_and(fits) {
                let usage = needed | generous(device, &kind);
                let make = |half| create(device, &format!("{} {half}", resource.name), &kind, usage);
                let (previous, current) = match second {
                    Some(_) => (make("previous"), Some(make("current"))),
                    None => (make("kept"), None),
                };
                if let Some((_, bytes)) = frame.initials.iter().find(|(index, _)| *index == first) {
                    fill(queue, &previous, &kind, bytes);
                }
                let made = Kept { kind, usage, previous, current, bytes: resource.bytes, first_frame: number };
                of_graph.insert(resource.name.clone(), made);
            }
            if let Some(kept) = of_graph.get(&resource.name) {
                frame.physical[first] = kept.previous.clone();
                if let (Some(second), Some(current)) = (second, &kept.current) {
                    frame.physical[second] = current.clone();
                }
            }
        }
    }

    /// Drops what was made for frame `number`: some of it may be an object wgpu could not make.
    pub(super) fn forget(&mut self, number: u64) {
        for of_graph in self.kept.values_mut() {
            of_graph.retain(|_, kept| kept.first_frame != number);
        }
    }

    /// After a frame has run: what it wrote becomes `previous`; what it no longer declares is dropped.
    pub(super) fn commit(&mut self, frame: &Frame<'_>) {
        let Some(of_graph) = self.kept.get_mut(&frame.declaration.name) else { return };
        let mut declared = Vec::new();
        for (first, second) in kept(frame) {
            let name = &*frame.declaration.resources[first].name;
            declared.push(name);
            let writes = |pass: &usize| {
                let accesses = &frame.declaration.passes[*pass].accesses;
                accesses.iter().any(|access| Some(access.resource) == second && access.writes())
            };
            if second.is_some_and(|second| frame.plan.lifetimes[second].is_some())
                && frame.plan.order.iter().any(writes)
                && let Some(kept) = of_graph.get_mut(name)
                && let Some(current) = &mut kept.current
            {
                std::mem::swap(&mut kept.previous, current);
            }
        }
        if of_graph.len() != declared.len() || declared.iter().any(|name| !of_graph.contains_key(*name)) {
            of_graph.retain(|name, _| declared.contains(&&**name));
        }
    }
}

/// Indices of the `previous` halves, each followed by its `current` half, and of persistent resources.
fn kept(frame: &Frame<'_>) -> Vec<(usize, Option<usize>)> {
    let resources = &frame.declaration.resources;
    let next_is_current = |index: usize| resources.get(index + 1).is_some_and(|next| next.origin == Origin::Current);
    let second = |index: usize| match resources[index].origin {
        Origin::Previous if next_is_current(index) => Some(Some(index + 1)),
        Origin::Persistent => Some(None),
        _ => None,
    };
    (0..resources.len()).filter_map(|index| Some((index, second(index)?))).collect()
}

/// Writes first contents.
fn fill(queue: &wgpu::Queue, object: &Physical, kind: &ResourceKind, bytes: &[u8]) {
    match (object, kind) {
        (Physical::Buffer { buffer, .. }, _) => {
            let mut words = bytes.to_vec();
            words.resize(bytes.len().next_multiple_of(4), 0);
            queue.write_buffer(buffer, 0, &words);
        }
        (Physical::Texture(texture), ResourceKind::Texture(desc)) => {
            let rows = Rows::of(desc);
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: u32::try_from(rows.tight).ok(),
                rows_per_image: u32::try_from(rows.per_layer).ok(),
            };
            queue.write_texture(texture.as_image_copy(), bytes, layout, desc.extent().physical_size(desc.format));
        }
        _ => {}
    }
}

/// Usages a later frame may ask for, so that it need not begin the history anew.
fn generous(device: &wgpu::Device, kind: &ResourceKind) -> u32 {
    match kind {
        ResourceKind::Buffer(_) => (wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::UNIFORM
            | wgpu::BufferUsages::INDIRECT
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST)
            .bits(),
        ResourceKind::Tlas => 0,
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
