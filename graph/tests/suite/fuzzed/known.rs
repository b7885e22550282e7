//! Bytes as choices, and handles with what a careful caller knows of them.

use lightloom_graph::{Buffer, BufferDesc, Handle, History, Resource, Subresources, Texture, TextureDesc};

/// Bytes, one after the other; zeroes past the end.
pub(super) struct Bytes<'a>(pub(super) &'a [u8]);

impl Bytes<'_> {
    pub(super) fn next(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        first
    }

    /// The position of one of `count`.
    pub(super) fn index(&mut self, count: usize) -> usize {
        usize::from(self.next()) % count.max(1)
    }

    /// True one time in `n`.
    pub(super) fn rarely(&mut self, n: u8) -> bool {
        self.next() % n == n - 1
    }
}

/// Mips and layers as bits: of each mip, its first two layers.
pub(super) trait Parts {
    fn all(&self) -> u32;
}

impl Parts for BufferDesc {
    fn all(&self) -> u32 {
        1
    }
}

impl Parts for TextureDesc {
    fn all(&self) -> u32 {
        let layers = if self.size[2] < 2 { 0b01 } else { 0b11 };
        (0..self.mip_level_count.min(16)).fold(0, |bits, mip| bits | layers << (2 * mip))
    }
}

/// Some mips of one layer.
#[derive(Clone, Copy)]
pub(super) struct Part {
    pub(super) mip: u32,
    pub(super) mips: u32,
    pub(super) layer: u32,
}

impl Part {
    pub(super) const FIRST: Self = Self { mip: 0, mips: 1, layer: 0 };

    /// One of those there are; a careless caller's may be outside.
    pub(super) fn any(desc: &TextureDesc, bytes: &mut Bytes<'_>, careful: bool) -> Self {
        let outside = u8::from(!careful);
        let one_of = |count: u32, bytes: &mut Bytes<'_>| {
            u32::from(bytes.next() % (u8::try_from(count.clamp(1, 3)).unwrap_or(1) + outside))
        };
        let (mip, layer) = (one_of(desc.mip_level_count, bytes), one_of(desc.size[2].min(2), bytes));
        Self { mip, mips: 1, layer }
    }

    /// The same and all smaller mips.
    pub(super) fn and_smaller(self, desc: &TextureDesc) -> Self {
        Self { mips: desc.mip_level_count.saturating_sub(self.mip).max(1), ..self }
    }

    /// As it is named in a texture of this description.
    pub(super) fn of(self, desc: &TextureDesc) -> Subresources {
        if desc.all() == self.bits() {
            Subresources::ALL
        } else {
            Subresources::mips(self.mip..self.mip + self.mips).layer(self.layer)
        }
    }

    pub(super) fn bits(self) -> u32 {
        (self.mip..self.mip + self.mips).fold(0, |bits, mip| bits | 1 << (2 * mip + self.layer))
    }
}

/// A handle and what a careful caller knows of it.
pub(super) struct Known<T: Resource> {
    pub(super) handle: Handle<T>,
    /// The parts that have contents.
    pub(super) written: u32,
    pub(super) previous: bool,
}

impl<T: Resource<Desc: Parts>> Known<T> {
    /// One without contents.
    pub(super) fn new(handle: Handle<T>) -> Self {
        Self { handle, written: 0, previous: false }
    }

    /// One that the frame finds with contents.
    pub(super) fn full(handle: Handle<T>) -> Self {
        Self { written: handle.desc().all(), ..Self::new(handle) }
    }

    pub(super) fn pair(pair: History<T>) -> [Self; 2] {
        [Self { previous: true, ..Self::full(pair.previous) }, Self::new(pair.current)]
    }

    /// Whether all of it has contents.
    pub(super) fn readable(&self) -> bool {
        self.written == self.handle.desc().all()
    }

    pub(super) fn writable(&self) -> bool {
        !self.previous
    }

    /// The handle to write the whole.
    pub(super) fn goal(&mut self) -> &mut Handle<T> {
        self.written = self.handle.desc().all();
        &mut self.handle
    }
}

impl Known<Texture> {
    /// The handle to write this part.
    pub(super) fn goal_at(&mut self, part: Part) -> &mut Handle<Texture> {
        self.written |= part.bits() & self.handle.desc().all();
        &mut self.handle
    }

    pub(super) fn readable_at(&self, part: Part) -> bool {
        part.bits() & !self.written == 0
    }
}

/// One of the items that pass, or of all for a careless caller.
pub(super) fn pick<T>(items: &[T], bytes: &mut Bytes<'_>, careful: bool, passes: impl Fn(&T) -> bool) -> Option<usize> {
    let fitting: Vec<usize> = (0..items.len()).filter(|&index| !careful || passes(&items[index])).collect();
    fitting.get(bytes.index(fitting.len())).copied()
}

/// One to read and another to write, of descriptions that fit.
pub(super) fn two<'a, T: Resource<Desc: Parts>>(
    items: &'a mut [Known<T>],
    bytes: &mut Bytes<'_>,
    careful: bool,
    fits: impl Fn(&T::Desc, &T::Desc) -> bool,
) -> Option<(&'a Handle<T>, &'a mut Handle<T>)> {
    let from = pick(items, bytes, careful, |item| item.readable() && fits(item.handle.desc(), item.handle.desc()))?;
    let desc = items[from].handle.desc().clone();
    let to = pick(items, bytes, careful, |item| item.writable() && fits(&desc, item.handle.desc()))?;
    let [first, second] = items.get_disjoint_mut([from, to]).ok()?;
    Some((&first.handle, second.goal()))
}

/// Handles of buffers and textures.
pub(super) type Buffers = Vec<Known<Buffer>>;
pub(super) type Textures = Vec<Known<Texture>>;
