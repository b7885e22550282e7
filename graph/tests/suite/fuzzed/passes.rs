//! Calls that declare compute and raster passes.

use super::{
    declaration::Frame,
    invariants::HELD,
    known::{Buffers, Bytes, Known, Part, pick, two},
    shaders::shaders,
};
use lightloom_graph::{Load, TextureDesc, wgpu::TextureFormat};

const CLEAR: Load = Load::Clear([0.0; 4]);

/// One layer, one mip level, whole numbers.
fn flat(desc: &TextureDesc) -> bool {
    desc.size[2] == 1 && desc.mip_level_count == 1 && whole_numbers(desc)
}

fn whole_numbers(desc: &TextureDesc) -> bool {
    desc.format == TextureFormat::R32Uint
}

/// What the last draw drew into.
#[derive(Clone, Copy)]
pub(super) struct Drawn {
    color: (usize, Part),
    depth: Option<(usize, Part)>,
}

impl Frame<'_> {
    /// A compute pass of buffers.
    pub(super) fn words(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        let Self { graph, buffers, careful, .. } = self;
        let careful = *careful;
        let indirect = arguments(buffers, bytes, careful);
        let from = pick(buffers, bytes, careful, Known::readable)?;
        let to = pick(buffers, bytes, careful, Known::writable)?;
        if from == to || indirect == Some(to) {
            return None;
        }
        buffers[to].goal();
        let pass = graph.compute(&shaders().words);
        let pass = if !careful && bytes.rarely(16) { pass } else { pass.read("a", &buffers[from].handle) };
        let pass = if bytes.rarely(4) { pass.pinned() } else { pass };
        let pass = if bytes.rarely(16) { pass.heavy() } else { pass };
        let pass = pass.write(if !careful && bytes.rarely(16) { "gaol" } else { "goal" }, &mut buffers[to].handle);
        match indirect {
            Some(arguments) => pass.dispatch_indirect(&buffers[arguments].handle, offset(bytes, careful)),
            None => pass.dispatch_1d(64),
        }
        Some(())
    }

    pub(super) fn update(&mut self, name: &str, bytes: &mut Bytes<'_>) -> Option<()> {
        let index = pick(&self.buffers, bytes, self.careful, |item| item.readable() && item.writable())?;
        let pass = self.graph.compute(&shaders().update).name(name);
        let pass = if bytes.rarely(4) { pass.pinned() } else { pass };
        pass.write("goal", &mut self.buffers[index].handle).dispatch_1d(64);
        Some(())
    }

    /// Reads a buffer that may be missing, and one that WGSL may write.
    pub(super) fn choose(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        let Self { graph, buffers, careful, .. } = self;
        let careful = *careful;
        let optional = if bytes.rarely(2) { pick(buffers, bytes, careful, Known::readable) } else { None };
        let held = pick(buffers, bytes, careful, Known::readable)?;
        let to = pick(buffers, bytes, careful, Known::writable)?;
        if to == held || optional == Some(held) || optional == Some(to) {
            return None;
        }
        buffers[to].goal();
        let pass = graph.compute(&shaders().choose).read_optional("a", optional.map(|index| &buffers[index].handle));
        let pass = pass.read(HELD, &buffers[held].handle);
        pass.write("goal", &mut buffers[to].handle).dispatch_1d(64);
        Some(())
    }

    /// A compute pass of whole textures.
    pub(super) fn texels(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        let (from, to) = two(&mut self.textures, bytes, self.careful, |a, b| flat(a) && flat(b))?;
        self.graph.compute(&shaders().texels).read("a", from).write("goal", to).dispatch_threads([8, 4, 1]);
        Some(())
    }

    /// A compute pass of parts of two textures, or of one.
    pub(super) fn levels(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        let Self { graph, textures, careful, .. } = self;
        let careful = *careful;
        let from = pick(textures, bytes, careful, |item| item.written != 0 && whole_numbers(item.handle.desc()))?;
        let to = pick(textures, bytes, careful, |item| item.writable() && whole_numbers(item.handle.desc()))?;
        let source = Part::any(textures[from].handle.desc(), bytes, careful);
        let source = if bytes.rarely(4) { source.and_smaller(textures[from].handle.desc()) } else { source };
        let goal = Part::any(textures[to].handle.desc(), bytes, careful);
        let apart = from != to || source.bits() & goal.bits() == 0;
        if careful && !(apart && textures[from].readable_at(source)) {
            return None;
        }
        let pass = graph.compute(&shaders().texels).read_at("a", &textures[from].handle, source.of(textures[from].handle.desc()));
        let pass = if bytes.rarely(8) { pass.pinned() } else { pass };
        let at = goal.of(textures[to].handle.desc());
        pass.write_at("goal", textures[to].goal_at(goal), at).dispatch_threads([8, 4, 1]);
        Some(())
    }

    pub(super) fn clear_part(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        let Self { graph, textures, careful, .. } = self;
        let index = pick(textures, bytes, *careful, Known::writable)?;
        let part = Part::any(textures[index].handle.desc(), bytes, *careful);
        let depth = textures[index].handle.desc().format == TextureFormat::Depth32Float;
        let at = part.of(textures[index].handle.desc());
        let load = if depth { Load::ClearDepth(1.0) } else { CLEAR };
        graph.clear_texture_at(textures[index].goal_at(part), at, load);
        Some(())
    }

    /// Draws into one texture, or into one and a depth texture.
    pub(super) fn draw(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        let Self { textures, careful, .. } = self;
        let careful = *careful;
        let color = pick(textures, bytes, careful, |item| item.writable() && whole_numbers(item.handle.desc()))?;
        let part = Part::any(textures[color].handle.desc(), bytes, careful);
        let size = |desc: &TextureDesc, part: Part| [0, 1].map(|axis: usize| (desc.size[axis] >> part.mip).max(1));
        let target = size(textures[color].handle.desc(), part);
        let depth = if bytes.rarely(3) {
            pick(textures, bytes, careful, |item| {
                let desc = item.handle.desc();
                let depth = desc.format == TextureFormat::Depth32Float;
                item.writable() && depth && size(desc, Part::FIRST) == target
            })
        } else {
            None
        };
        let depth = depth.map(|index| (index, Part::FIRST));
        self.draw_into(Drawn { color: (color, part), depth }, bytes)
    }

    /// Draws into what was drawn into last.
    pub(super) fn draw_again(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        self.draw_into(self.drawn?, bytes)
    }

    fn draw_into(&mut self, drawn: Drawn, bytes: &mut Bytes<'_>) -> Option<()> {
        let Self { graph, buffers, textures, careful, .. } = self;
        let careful = *careful;
        let Drawn { color: (color, part), depth } = drawn;
        if depth.is_some_and(|(depth, _)| depth == color) {
            return None;
        }
        let has = |(index, part): (usize, Part)| textures[index].readable_at(part);
        let keeps = !bytes.rarely(3) && (!careful || has(drawn.color) && depth.is_none_or(has));
        let arguments = arguments(buffers, bytes, careful);
        let pass = match bytes.next() % 4 {
            0 => {
                let seen = pick(buffers, bytes, careful, Known::readable);
                graph.raster(&shaders().lit).read_optional("a", seen.map(|index| &buffers[index].handle))
            }
            1 => {
                let counter = pick(buffers, bytes, careful, |item| item.writable() && item.readable())?;
                if arguments == Some(counter) {
                    return None;
                }
                graph.raster(&shaders().count).write("goal", buffers[counter].goal())
            }
            _ => graph.raster(&shaders().draw),
        };
        let pass = if bytes.rarely(8) { pass.pinned() } else { pass };
        let pass = if bytes.rarely(16) { pass.heavy() } else { pass };
        let at = part.of(textures[color].handle.desc());
        let pass = pass.color_at("color", textures[color].goal_at(part), at, if keeps { Load::Keep } else { CLEAR });
        let pass = match depth {
            None => pass,
            Some((depth, part)) => {
                let at = part.of(textures[depth].handle.desc());
                pass.depth_at(textures[depth].goal_at(part), at, if keeps { Load::Keep } else { Load::ClearDepth(1.0) })
            }
        };
        match arguments {
            Some(arguments) => pass.draw_indirect(&buffers[arguments].handle, offset(bytes, careful)),
            None => pass.draw(3, 1),
        }
        self.drawn = Some(drawn);
        Some(())
    }
}

/// Rarely, a buffer of arguments for an indirect call.
fn arguments(buffers: &Buffers, bytes: &mut Bytes<'_>, careful: bool) -> Option<usize> {
    bytes.rarely(4).then(|| pick(buffers, bytes, careful, |item| item.readable() && item.handle.desc().size >= 100))?
}

/// Where arguments lie in 100 bytes (bytes).
fn offset(bytes: &mut Bytes<'_>, careful: bool) -> u64 {
    let offset = u64::from(bytes.next());
    if careful { offset % 22 * 4 } else { offset }
}
