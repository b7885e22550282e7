//! Sequences of calls of the graph from bytes, right and wrong ones.

use super::{
    invariants::check,
    known::{Buffers, Bytes, Known, Textures, pick, two},
    passes::Drawn,
};
use lightloom_graph::{
    BufferDesc, Declaration, Graph, Initial, Plan, PlanOptions, TextureDesc,
    wgpu::{TextureFormat, TextureUsages},
};

fn buffer_desc(bytes: &mut Bytes<'_>, careful: bool) -> BufferDesc {
    match bytes.next() {
        // Far more than there is.
        255 => BufferDesc::bytes(u64::MAX - u64::from(bytes.next())),
        // More than half an arena.
        254 => BufferDesc::bytes(200 << 20),
        n => BufferDesc::bytes(u64::from(n % 8 + u8::from(careful)) * 256),
    }
}

fn texture_desc(bytes: &mut Bytes<'_>, careful: bool) -> TextureDesc {
    let number = bytes.next();
    let size = [u32::from(number % 4 + u8::from(careful)) * 8, u32::from(number / 4 % 2) + 4];
    let format = if number / 8 % 4 == 3 { TextureFormat::Depth32Float } else { TextureFormat::R32Uint };
    let desc = TextureDesc::new_2d(size, format);
    match number / 32 {
        4 => desc.mip_levels(3).layers(2),
        5 | 6 => desc.mip_levels(3),
        7 => desc.layers(if number % 8 == 1 { u32::MAX } else { 2 }),
        _ => desc,
    }
}

/// First contents; a careless caller's are of any length.
fn initial(bytes: &mut Bytes<'_>, careful: bool, needed: u64) -> Initial {
    let length = if careful { needed } else { u64::from(bytes.next()) };
    // Nobody has bytes for the largest.
    if bytes.rarely(2) && length < 1 << 16 { Initial::Bytes(vec![1; length as usize].into()) } else { Initial::Zero }
}

/// A frame in the making.
pub(super) struct Frame<'f> {
    pub(super) graph: Graph<'f>,
    pub(super) buffers: Buffers,
    pub(super) textures: Textures,
    pub(super) drawn: Option<Drawn>,
    /// Whether calls are chosen that are likely to be accepted.
    pub(super) careful: bool,
}

/// Declares what the bytes say; what is accepted is planned. The frame and its plan, if it could be.
pub(crate) fn declaration(bytes: &[u8]) -> Option<(Declaration, Plan)> {
    let bytes = &mut Bytes(bytes);
    let careful = bytes.next() % 4 > 0;
    let mut graph = Graph::new("fuzz");
    let mut other = Graph::new("other");
    let desc = TextureDesc::new_2d([8, 4], TextureFormat::R32Uint);
    // Careless callers have handles of another graph.
    let owner = if careful { &mut graph } else { &mut other };
    let buffer = owner.import_buffer("imported", BufferDesc::bytes(100), None);
    let texture = owner.import_texture("imported", desc, None);
    let buffers = vec![Known::full(buffer)];
    let textures = vec![Known::full(texture)];
    let mut frame = Frame { graph, buffers, textures, drawn: None, careful };
    while !bytes.0.is_empty() {
        let _: Option<()> = frame.call(bytes);
    }
    let planned = frame.graph.plan(&PlanOptions::default());
    match frame.graph.declaration() {
        Ok(declaration) => check(&declaration).map(|plan| (declaration, plan)),
        Err(error) => {
            assert_eq!(planned.err(), Some(error), "a frame with mistakes is not planned");
            None
        }
    }
}

impl Frame<'_> {
    /// `None`: there was nothing to call it with.
    fn call(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        let name = ["a", "b", "b#2", "", "clear b"][bytes.index(5)];
        match bytes.next() % 32 {
            0..6 => self.resource(name, bytes),
            6..9 => self.words(bytes)?,
            9 => self.update(name, bytes)?,
            10 => self.choose(bytes)?,
            11 => self.texels(bytes)?,
            12..16 => self.levels(bytes)?,
            16..18 => self.clear_part(bytes)?,
            18..20 => self.draw(bytes)?,
            20..24 => self.draw_again(bytes)?,
            _ => self.transfer(name, bytes)?,
        }
        Some(())
    }

    fn resource(&mut self, name: &str, bytes: &mut Bytes<'_>) {
        let Self { graph, buffers, textures, careful, .. } = self;
        let careful = *careful;
        let is_buffer = bytes.rarely(2);
        let (buffer, texture) = (buffer_desc(bytes, careful), texture_desc(bytes, careful));
        // A texture's first contents are those of its first mip.
        let first = texture.clone().mip_levels(1);
        match (bytes.next() % 8, is_buffer) {
            (0, true) => {
                let initial = initial(bytes, careful, buffer.size);
                buffers.extend(Known::pair(graph.history_buffer_from(name, buffer, initial)));
            }
            (0, false) => {
                let initial = initial(bytes, careful, first.bytes());
                textures.extend(Known::pair(graph.history_texture_from(name, texture, initial)));
            }
            (1, true) => {
                let initial = initial(bytes, careful, buffer.size);
                buffers.push(Known::full(graph.persistent_buffer(name, buffer, initial)));
            }
            (1, false) => {
                let initial = initial(bytes, careful, first.bytes());
                textures.push(Known::full(graph.persistent_texture(name, texture, initial)));
            }
            (_, true) => buffers.push(Known::new(graph.buffer(name, buffer))),
            (_, false) => textures.push(Known::new(graph.texture(name, texture))),
        }
    }

    /// Closures, clears of buffers, copies, readbacks, and what is kept.
    fn transfer(&mut self, name: &str, bytes: &mut Bytes<'_>) -> Option<()> {
        let Self { graph, buffers, textures, careful, .. } = self;
        let careful = *careful;
        match bytes.next() % 8 {
            0 => {
                let (from, to) = two(buffers, bytes, careful, |_, _| true)?;
                let pass = graph.closure(name).read(from).write(to);
                let pass = if bytes.rarely(4) { pass.side_effect() } else { pass };
                let pass = if bytes.rarely(4) { pass.pinned() } else { pass };
                pass.record(|_| Ok(()));
            }
            1 => {
                let (from, to) = two(textures, bytes, careful, |_, _| true)?;
                let pass = graph.closure(name).read_as(from, TextureUsages::TEXTURE_BINDING);
                pass.write_as(to, TextureUsages::RENDER_ATTACHMENT).heavy().record(|_| Ok(()));
            }
            2 | 3 => {
                let index = pick(buffers, bytes, careful, Known::writable)?;
                graph.clear_buffer(buffers[index].goal());
            }
            4 if bytes.rarely(2) => {
                let (from, to) = two(buffers, bytes, careful, |a, b| a == b)?;
                graph.copy_buffer(from, to);
            }
            4 => {
                let (from, to) = two(textures, bytes, careful, |a, b| a == b)?;
                graph.copy_texture(from, to);
            }
            5 => {
                let index = pick(buffers, bytes, careful, Known::readable)?;
                graph.readback_buffer(&buffers[index].handle);
            }
            6 => {
                let index = pick(textures, bytes, careful, Known::readable)?;
                graph.readback_texture(&textures[index].handle);
            }
            _ if bytes.rarely(2) => graph.keep(&buffers[pick(buffers, bytes, careful, Known::readable)?].handle),
            _ => graph.keep(&textures[pick(textures, bytes, careful, Known::readable)?].handle),
        }
        Some(())
    }
}
