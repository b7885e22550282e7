//! Memory blocks and the objects in them, kept between frames.

mod conv;
mod schedule;
mod vulkan;

use super::HeapError;
use crate::{
    declaration::{Declaration, ResourceKind},
    executor::Physical,
    plan::{Need, Plan, SlotKind},
};
use schedule::Schedule;
use std::{
    collections::HashMap,
    ops::Range,
    sync::{Arc, Weak},
};
use vulkan::{Image, Memory, Vulkan};

/// Frames after which a layout nothing uses is dropped: a few graphs may alternate on one executor.
const IDLE_FRAMES: u64 = 8;

/// Descriptions whose needs are remembered; a frame that resizes all the time must not fill memory with them.
const NEEDS: usize = 4096;

/// Description and usages.
type Key = (ResourceKind, u32);

/// What is held between frames.
#[derive(Debug)]
pub(in crate::executor) struct Heaps {
    kept: Vec<Kept>,
    objects: HashMap<(usize, u64, Key), Weak<Object>>,
    blocks: Vec<Arc<Memory>>,
    needs: HashMap<Key, Result<Need, HeapError>>,
    /// Whether a frame took a layout and has not come to its end.
    open: bool,
    vulkan: Arc<Vulkan>,
    device: wgpu::Device,
}

#[derive(Debug)]
struct Kept {
    plan: Arc<Plan>,
    layout: Arc<Layout>,
    last_frame: u64,
}

/// A resource's wgpu object.
#[derive(Debug)]
struct Object {
    physical: Physical,
    /// The state of a texture between its lives, and what a hand-over needs to move it there.
    home: Option<(wgpu::TextureUses, Image)>,
}

/// The objects of one plan, and where they take their memory.
#[derive(Debug)]
pub(in crate::executor) struct Layout {
    /// By resource.
    objects: HashMap<usize, Arc<Object>>,
    schedule: Schedule,
    /// Each block with the bytes used of it.
    blocks: Vec<(Arc<Memory>, u64)>,
    vulkan: Arc<Vulkan>,
}

/// A resource's description without what does not matter to memory.
fn key(kind: &ResourceKind, usage: u32) -> Key {
    let mut kind = kind.clone();
    match &mut kind {
        ResourceKind::Buffer(desc) => {
            desc.element = None;
            desc.size = desc.padded();
            (kind, usage)
        }
        // Always the caller's.
        ResourceKind::Tlas => (kind, 0),
        // In a heap a transient attachment is an attachment like others.
        ResourceKind::Texture(_) => (kind, usage & !wgpu::TextureUsages::TRANSIENT_ATTACHMENT.bits()),
    }
}

fn imported_only() -> HeapError {
    HeapError::Unsupported("acceleration structures are the caller's".to_owned())
}

impl Heaps {
    /// Heaps on a device, or why it can have none, in words for the user.
    pub(in crate::executor) fn new(device: &wgpu::Device) -> Result<Self, String> {
        Ok(Self {
            kept: Vec::new(),
            objects: HashMap::new(),
            blocks: Vec::new(),
            needs: HashMap::new(),
            open: false,
            vulkan: Vulkan::of(device)?,
            device: device.clone(),
        })
    }

    /// What a resource needs of a heap, as the driver says. The description has been compared with the device's limits.
    pub(in crate::executor) fn need(&mut self, kind: &ResourceKind, usage: u32) -> Result<Need, HeapError> {
        self.need_of(&key(kind, usage))
    }

    fn need_of(&mut self, key: &Key) -> Result<Need, HeapError> {
        if let Some(known) = self.needs.get(key) {
            return known.clone();
        }
        let found = match &key.0 {
            ResourceKind::Texture(desc) => self.vulkan.texture_need(desc, wgpu::TextureUsages::from_bits_retain(key.1)),
            ResourceKind::Buffer(desc) => self.vulkan.storage_need(desc, wgpu::BufferUsages::from_bits_retain(key.1)),
            ResourceKind::Tlas => Err(imported_only()),
        };
        if found != Err(HeapError::OutOfMemory) {
            if self.needs.len() >= NEEDS {
                self.needs.clear();
            }
            self.needs.insert(key.clone(), found.clone());
        }
        found
    }

    /// The objects of a plan for frame `number`, made now or found; equal plans get equal objects.
    pub(in crate::executor) fn acquire(
        &mut self,
        declaration: &Declaration,
        plan: &Arc<Plan>,
        number: u64,
    ) -> Result<Arc<Layout>, HeapError> {
        if self.open {
            // The last frame stopped half-way, so wgpu may believe textures to be anywhere.
            self.clear();
        }
        self.open = true;
        if let Some(kept) = self.kept.iter_mut().find(|kept| Arc::ptr_eq(&kept.plan, plan)) {
            kept.last_frame = number;
            return Ok(Arc::clone(&kept.layout));
        }
        let layout = Arc::new(self.lay_out(declaration, plan)?);
        self.kept.push(Kept { plan: Arc::clone(plan), layout: Arc::clone(&layout), last_frame: number });
        Ok(layout)
    }

    fn lay_out(&mut self, declaration: &Declaration, plan: &Plan) -> Result<Layout, HeapError> {
        let mut blocks: Vec<(Arc<Memory>, u64)> = Vec::new();
        let mut objects = HashMap::new();
        let mut bytes = HashMap::new();
        for slot in plan.slots.iter().filter(|slot| slot.kind == SlotKind::Heap) {
            let Some(&first) = slot.resources.first() else { continue };
            let need = |heaps: &mut Self, resource: usize| {
                let key = key(&declaration.resources[resource].kind, plan.usages[resource]);
                heaps.need_of(&key).map(|need| (need, key))
            };
            let class = need(self, first)?.0.class;
            let memory = self.block(class, slot.bytes.max(1), &blocks)?;
            for &resource in &slot.resources {
                let (need, key) = need(self, resource)?;
                let offset = plan.offsets[resource].unwrap_or(0);
                let end = offset.saturating_add(need.bytes);
                if need.class != class || !offset.is_multiple_of(need.align) || end > memory.bytes {
                    let name = &declaration.resources[resource].name;
                    let message = format!("the plan puts `{name}` at {offset} of {}, where it needs {need:?}", memory.bytes);
                    return Err(HeapError::Unsupported(message));
                }
                bytes.insert(resource, need.bytes);
                objects.insert(resource, self.object(&memory, offset, key)?);
            }
            blocks.push((memory, slot.bytes));
        }
        let schedule = schedule::schedule(plan, &|resource| bytes.get(&resource).copied().unwrap_or(0));
        Ok(Layout { objects, schedule, blocks, vulkan: Arc::clone(&self.vulkan) })
    }

    /// A block of at least so many bytes that is not among `taken`. A smaller one is given up for it.
    fn block(&mut self, class: u32, bytes: u64, taken: &[(Arc<Memory>, u64)]) -> Result<Arc<Memory>, HeapError> {
        let free = |block: &&Arc<Memory>| block.class == class && !taken.iter().any(|(other, _)| Arc::ptr_eq(other, block));
        let largest = self.blocks.iter().filter(free).max_by_key(|block| block.bytes).cloned();
        match largest {
            Some(block) if block.bytes >= bytes => return Ok(block),
            Some(block) => self.retire(&block),
            None => {}
        }
        let block = Memory::allocate(&self.vulkan, class, bytes)?;
        self.blocks.push(Arc::clone(&block));
        Ok(block)
    }

    fn object(&mut self, memory: &Arc<Memory>, offset: u64, key: Key) -> Result<Arc<Object>, HeapError> {
        let place = (Arc::as_ptr(memory) as usize, offset, key);
        if let Some(found) = self.objects.get(&place).and_then(Weak::upgrade) {
            return Ok(found);
        }
        let (kind, usage) = &place.2;
        let object = match kind {
            ResourceKind::Texture(desc) => {
                let usage = wgpu::TextureUsages::from_bits_retain(*usage);
                let label = format!("placed texture at {offset}");
                let (texture, home, image) = vulkan::texture(&self.device, memory, offset, (&label, desc, usage))?;
                Object { physical: Physical::Texture(texture), home: Some((home, image)) }
            }
            ResourceKind::Buffer(desc) => {
                let usage = wgpu::BufferUsages::from_bits_retain(*usage);
                let label = format!("placed buffer at {offset}");
                let buffer = vulkan::buffer(&self.device, memory, offset, (&label, desc, usage))?;
                let size = buffer.size();
                Object { physical: Physical::Buffer { buffer, offset: 0, size }, home: None }
            }
            ResourceKind::Tlas => return Err(imported_only()),
        };
        let object = Arc::new(object);
        self.objects.insert(place, Arc::downgrade(&object));
        Ok(object)
    }

    /// Gives up a block and all that lies in it; the memory is freed when the GPU is done.
    fn retire(&mut self, block: &Arc<Memory>) {
        self.blocks.retain(|other| !Arc::ptr_eq(other, block));
        self.kept.retain(|kept| kept.layout.used(block).is_none());
    }

    /// After a frame has been submitted whole: drops what no recent frame used.
    pub(in crate::executor) fn commit(&mut self, number: u64) {
        if self.open && !self.kept.iter().any(|kept| kept.last_frame == number) {
            // It is an earlier frame that never came to its end.
            self.clear();
        }
        self.open = false;
        self.kept.retain(|kept| kept.last_frame + IDLE_FRAMES > number);
        let used = |block: &Arc<Memory>| self.kept.iter().filter_map(|kept| kept.layout.used(block)).max().unwrap_or(0);
        let loose: Vec<Arc<Memory>> =
            self.blocks.iter().filter(|block| used(block).saturating_mul(2) < block.bytes).cloned().collect();
        for block in loose {
            self.retire(&block);
        }
        self.objects.retain(|_, object| object.strong_count() > 0);
    }

    /// Drops everything.
    pub(in crate::executor) fn clear(&mut self) {
        self.kept.clear();
        self.objects.clear();
        self.blocks.clear();
    }

    /// Bytes of device memory there are now, as allocated.
    pub(in crate::executor) fn allocated_bytes(&self) -> u64 {
        self.vulkan.bytes()
    }

    /// Images and buffers there are now.
    pub(in crate::executor) fn objects(&self) -> usize {
        self.vulkan.objects()
    }
}

impl Layout {
    /// Each placed resource with its object.
    pub(in crate::executor) fn physical(&self) -> impl Iterator<Item = (usize, &Physical)> {
        self.objects.iter().map(|(resource, object)| (*resource, &object.physical))
    }

    /// The commands to submit before those of `position`, where memory changes hands there. Those must begin with
    /// [`Layout::begin`].
    pub(in crate::executor) fn hand_over(&self, device: &wgpu::Device, position: usize) -> Option<wgpu::CommandBuffer> {
        let resources = self.schedule.hand_overs.get(&position)?;
        let images: Vec<Image> = self.objects_of(resources).filter_map(|object| object.home.map(|(_, image)| image)).collect();
        Some(vulkan::barrier(device, &self.vulkan, &images))
    }

    /// Tells wgpu which textures were handed over before `position`.
    pub(in crate::executor) fn begin(&self, position: usize, encoder: &mut wgpu::CommandEncoder) {
        if let Some(resources) = self.schedule.hand_overs.get(&position) {
            self.go_home(resources, encoder);
        }
    }

    /// Whether a life ends at one of these positions.
    pub(in crate::executor) fn ends(&self, positions: &Range<usize>) -> bool {
        positions.clone().any(|position| self.schedule.ends.contains_key(&position))
    }

    /// Moves the textures whose life ends with `position` home. To be called after its commands.
    pub(in crate::executor) fn end(&self, position: usize, encoder: &mut wgpu::CommandEncoder) {
        if let Some(resources) = self.schedule.ends.get(&position) {
            self.go_home(resources, encoder);
        }
    }

    fn go_home(&self, resources: &[usize], encoder: &mut wgpu::CommandEncoder) {
        let textures = self.objects_of(resources).filter_map(|object| match (&object.physical, object.home) {
            (Physical::Texture(texture), Some((state, _))) => Some(wgpu::TextureTransition { texture, selector: None, state }),
            _ => None,
        });
        let buffers: [wgpu::BufferTransition<&wgpu::Buffer>; 0] = [];
        encoder.transition_resources(buffers.into_iter(), textures);
    }

    fn objects_of<'a>(&'a self, resources: &'a [usize]) -> impl Iterator<Item = &'a Object> {
        resources.iter().filter_map(|resource| self.objects.get(resource)).map(Arc::as_ref)
    }

    /// Bytes of a block that this layout uses, if it does.
    fn used(&self, block: &Arc<Memory>) -> Option<u64> {
        self.blocks.iter().find(|(other, _)| Arc::ptr_eq(other, block)).map(|(_, bytes)| *bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BufferDesc, Gpu, Graph, PlanOptions, Sharing, TextureDesc, plan_with_needs};
    use std::cell::RefCell;

    /// Heaps on a test device; `None` prints SKIPPED.
    fn heaps() -> Option<(Gpu, Heaps)> {
        let gpu = Gpu::for_tests()?;
        match Heaps::new(&gpu.device) {
            Ok(heaps) => Some((gpu, heaps)),
            Err(why) => {
                println!("SKIPPED: {why}");
                None
            }
        }
    }

    /// Two textures and a buffer of `size`, in use together.
    fn planned(heaps: &mut Heaps, size: u32) -> (Declaration, Arc<Plan>) {
        let mut graph = Graph::new("heaps");
        let desc = TextureDesc::new_2d([size, size], wgpu::TextureFormat::Rgba8Unorm);
        let (mut a, mut b) = (graph.texture("a", desc.clone()), graph.texture("b", desc));
        let mut words = graph.buffer("words", BufferDesc::words(size.into()));
        graph.closure("all").write(&mut a).write(&mut b).write(&mut words).side_effect().record(|_| Ok(()));
        let declaration = graph.declaration().unwrap();
        let heaps = RefCell::new(heaps);
        let need = |resource: usize, usage: u32| heaps.borrow_mut().need(&declaration.resources[resource].kind, usage).unwrap();
        let plan = plan_with_needs(&declaration, &PlanOptions::default().sharing(Sharing::Placed), &need).unwrap();
        (declaration, Arc::new(plan))
    }

    fn textures(layout: &Layout) -> Vec<wgpu::Texture> {
        let mut found: Vec<_> = layout.physical().collect();
        found.sort_by_key(|(resource, _)| *resource);
        let texture = |physical: &Physical| match physical {
            Physical::Texture(texture) => Some(texture.clone()),
            _ => None,
        };
        found.into_iter().filter_map(|(_, physical)| texture(physical)).collect()
    }

    #[test]
    fn equal_plans_have_equal_objects_and_nothing_is_left_behind() {
        let Some((gpu, mut heaps)) = heaps() else { return };
        let vulkan = Arc::clone(&heaps.vulkan);
        let (declaration, plan) = planned(&mut heaps, 64);
        let first = textures(&heaps.acquire(&declaration, &plan, 1).unwrap());
        heaps.commit(1);
        // The same plan, made again: what a plan cache does that has forgotten it.
        let again = Arc::new(Plan::clone(&plan));
        let second = textures(&heaps.acquire(&declaration, &again, 2).unwrap());
        heaps.commit(2);
        assert_eq!(first, second, "bind groups made for one fit the other");
        assert_eq!((vulkan.objects(), vulkan.bytes()), (3, plan.memory.allocated_bytes));
        // A smaller plan lies in the same memory, a larger one takes its place.
        let (small_declaration, small) = planned(&mut heaps, 48);
        heaps.acquire(&small_declaration, &small, 3).unwrap();
        heaps.commit(3);
        assert_eq!((vulkan.objects(), vulkan.bytes()), (6, plan.memory.allocated_bytes));
        drop((first, second));
        let (large_declaration, large) = planned(&mut heaps, 256);
        heaps.acquire(&large_declaration, &large, 4).unwrap();
        heaps.commit(4);
        assert_eq!((vulkan.objects(), vulkan.bytes()), (3, large.memory.allocated_bytes), "all callbacks have run");
        // What is too large for what is still used is given back.
        for number in 5..20 {
            heaps.acquire(&small_declaration, &small, number).unwrap();
            heaps.commit(number);
        }
        assert_eq!((vulkan.objects(), vulkan.bytes()), (3, small.memory.allocated_bytes));
        // A frame that does not come to its end: all is made anew.
        let before = textures(&heaps.acquire(&small_declaration, &small, 20).unwrap());
        let after = textures(&heaps.acquire(&small_declaration, &small, 21).unwrap());
        assert_ne!(before, after);
        heaps.commit(21);
        drop(before);
        // A texture the caller has kept is good for as long as it is kept.
        drop(heaps);
        assert_eq!(vulkan.objects(), 2, "the two textures of `after`");
        assert!(vulkan.bytes() > 0, "and their memory");
        drop(after);
        drop(gpu);
        assert_eq!((vulkan.objects(), vulkan.bytes()), (0, 0), "each object and each piece of memory was given back");
    }

    #[test]
    fn a_plan_that_does_not_fit_is_refused() {
        let Some((_gpu, mut heaps)) = heaps() else { return };
        let (declaration, plan) = planned(&mut heaps, 64);
        for (offset, bytes) in [(1, None), (1 << 20, None), (0, Some(1))] {
            let mut bad = Plan::clone(&plan);
            bad.offsets[0] = Some(offset);
            bad.slots[0].bytes = bytes.unwrap_or(bad.slots[0].bytes);
            let error = heaps.acquire(&declaration, &Arc::new(bad), 1).unwrap_err();
            assert!(
                matches!(&error, HeapError::Unsupported(message) if message.contains("`a`") || message.contains("`b`")),
                "{error:?}"
            );
        }
        let mut huge = Plan::clone(&plan);
        huge.slots[0].bytes = u64::MAX;
        assert_eq!(heaps.acquire(&declaration, &Arc::new(huge), 1).unwrap_err(), HeapError::OutOfMemory);
        assert!(heaps.acquire(&declaration, &plan, 2).is_ok(), "and it goes on");
    }
}
