//! Sequences of calls of the graph from bytes, right and wrong ones.

use super::invariants::check;
use lightloom_graph::{
    Buffer, BufferDesc, ComputeShader, Graph, Handle, Load, PlanOptions, RasterShader, Resource, Texture, TextureDesc,
    wgpu::{TextureFormat, TextureUsages},
};
use std::sync::OnceLock;

/// Bytes, one after the other; zeroes past the end.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn next(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        first
    }

    /// The position of one of `count`.
    fn index(&mut self, count: usize) -> usize {
        usize::from(self.next()) % count.max(1)
    }

    /// True one time in `n`.
    fn rarely(&mut self, n: u8) -> bool {
        self.next() % n == n - 1
    }
}

struct Shaders {
    /// Reads a buffer and writes one.
    words: ComputeShader,
    /// Reads and writes one buffer.
    update: ComputeShader,
    /// Reads a texture and writes one.
    texels: ComputeShader,
    draw: RasterShader,
}

fn shaders() -> &'static Shaders {
    static SHADERS: OnceLock<Shaders> = OnceLock::new();
    SHADERS.get_or_init(|| Shaders {
        words: ComputeShader::from_wgsl(
            "words",
            "@group(0) @binding(0) var<storage, read> a: array<u32>;
            @group(0) @binding(1) var<storage, read_write> goal: array<u32>;
            @compute @workgroup_size(64) fn words(@builtin(global_invocation_id) id: vec3u) { goal[id.x] = a[id.x]; }",
        )
        .unwrap(),
        update: ComputeShader::from_wgsl(
            "update",
            "@group(0) @binding(1) var<storage, read_write> goal: array<u32>;
            @compute @workgroup_size(64) fn update(@builtin(global_invocation_id) id: vec3u) { goal[id.x] += 1u; }",
        )
        .unwrap(),
        texels: ComputeShader::from_wgsl(
            "texels",
            "@group(0) @binding(0) var a: texture_2d<u32>;
            @group(0) @binding(1) var goal: texture_storage_2d<r32uint, write>;
            @compute @workgroup_size(8, 8) fn texels(@builtin(global_invocation_id) id: vec3u) {
                textureStore(goal, id.xy, textureLoad(a, id.xy, 0));
            }",
        )
        .unwrap(),
        draw: RasterShader::from_wgsl(
            "draw",
            "struct Output { @location(0) color: u32 }
            @vertex fn draw_vertex() -> @builtin(position) vec4f { return vec4f(0.0); }
            @fragment fn draw_fragment() -> Output { return Output(0u); }",
        )
        .unwrap(),
    })
}

fn buffer_desc(bytes: &mut Bytes<'_>, careful: bool) -> BufferDesc {
    match bytes.next() {
        // Far more than there is.
        255 => BufferDesc::bytes(u64::MAX - u64::from(bytes.next())),
        n => BufferDesc::bytes(u64::from(n % 8 + u8::from(careful)) * 100),
    }
}

fn texture_desc(bytes: &mut Bytes<'_>, careful: bool) -> TextureDesc {
    let number = bytes.next();
    let size = [u32::from(number % 4 + u8::from(careful)) * 8, u32::from(number / 4 % 2) + 4];
    let format = if number / 8 % 4 == 3 { TextureFormat::Depth32Float } else { TextureFormat::R32Uint };
    let desc = TextureDesc::new_2d(size, format);
    match number / 32 {
        6 => desc.mip_levels(3),
        7 => desc.layers(if number % 8 == 1 { u32::MAX } else { 2 }),
        _ => desc,
    }
}

/// A handle and what a careful caller knows of it.
struct Known<T: Resource> {
    handle: Handle<T>,
    written: bool,
    previous: bool,
}

impl<T: Resource> Known<T> {
    fn new(handle: Handle<T>) -> Self {
        Self { handle, written: false, previous: false }
    }

    fn pair(pair: lightloom_graph::History<T>) -> [Self; 2] {
        let previous = Self { handle: pair.previous, written: true, previous: true };
        [previous, Self::new(pair.current)]
    }
}

/// One of the items that pass, or of all for a careless caller.
fn pick<T>(items: &[T], bytes: &mut Bytes<'_>, careful: bool, passes: impl Fn(&T) -> bool) -> Option<usize> {
    let fitting: Vec<usize> = (0..items.len()).filter(|&index| !careful || passes(&items[index])).collect();
    fitting.get(bytes.index(fitting.len())).copied()
}

/// One to write; it counts as written from now on.
fn goal<'a, T: Resource>(
    items: &'a mut [Known<T>],
    bytes: &mut Bytes<'_>,
    careful: bool,
    fits: impl Fn(&T::Desc) -> bool,
) -> Option<&'a mut Handle<T>> {
    let index = pick(items, bytes, careful, |item| !item.previous && fits(item.handle.desc()))?;
    items[index].written = true;
    Some(&mut items[index].handle)
}

/// One to read.
fn source<'a, T: Resource>(items: &'a [Known<T>], bytes: &mut Bytes<'_>, careful: bool) -> Option<&'a Handle<T>> {
    pick(items, bytes, careful, |item| item.written).map(|index| &items[index].handle)
}

/// One to read and another to write, of descriptions that fit.
fn two<'a, T: Resource>(
    items: &'a mut [Known<T>],
    bytes: &mut Bytes<'_>,
    careful: bool,
    fits: impl Fn(&T::Desc, &T::Desc) -> bool,
) -> Option<(&'a Handle<T>, &'a mut Handle<T>)> {
    let from = pick(items, bytes, careful, |item| item.written && fits(item.handle.desc(), item.handle.desc()))?;
    let desc = items[from].handle.desc().clone();
    let to = pick(items, bytes, careful, |item| !item.previous && fits(&desc, item.handle.desc()))?;
    let [first, second] = items.get_disjoint_mut([from, to]).ok()?;
    second.written = true;
    Some((&first.handle, &mut second.handle))
}

/// One layer, one mip level, whole numbers.
fn flat(desc: &TextureDesc) -> bool {
    desc.size[2] == 1 && desc.mip_level_count == 1 && desc.format == TextureFormat::R32Uint
}

/// A frame in the making.
struct Frame<'f> {
    graph: Graph<'f>,
    buffers: Vec<Known<Buffer>>,
    textures: Vec<Known<Texture>>,
    /// Whether calls are chosen that are likely to be accepted.
    careful: bool,
}

/// Declares what the bytes say; what is accepted is planned. Whether it could be.
pub(crate) fn declaration(bytes: &[u8]) -> bool {
    let bytes = &mut Bytes(bytes);
    let careful = bytes.next() % 4 > 0;
    let mut graph = Graph::new("fuzz");
    let mut other = Graph::new("other");
    let desc = TextureDesc::new_2d([8, 4], TextureFormat::R32Uint);
    // Careless callers have handles of another graph.
    let owner = if careful { &mut graph } else { &mut other };
    let buffer = owner.import_buffer("imported", BufferDesc::bytes(100), None);
    let texture = owner.import_texture("imported", desc, None);
    let buffers = vec![Known { written: true, ..Known::new(buffer) }];
    let textures = vec![Known { written: true, ..Known::new(texture) }];
    let mut frame = Frame { graph, buffers, textures, careful };
    while !bytes.0.is_empty() {
        // `None`: there was nothing to call it with.
        let _: Option<()> = frame.call(bytes);
    }
    let planned = frame.graph.plan(&PlanOptions::default());
    match frame.graph.declaration() {
        Ok(declaration) => check(&declaration),
        Err(error) => {
            assert_eq!(planned.err(), Some(error), "a frame with mistakes is not planned");
            false
        }
    }
}

impl Frame<'_> {
    fn call(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        let Self { graph, buffers, textures, careful } = self;
        let careful = *careful;
        let name = ["a", "b", "b#2", "", "clear b"][bytes.index(5)];
        match bytes.next() % 20 {
            0 | 1 => buffers.push(Known::new(graph.buffer(name, buffer_desc(bytes, careful)))),
            2 | 3 => textures.push(Known::new(graph.texture(name, texture_desc(bytes, careful)))),
            4 => buffers.extend(Known::pair(graph.history_buffer(name, buffer_desc(bytes, careful)))),
            5 => textures.extend(Known::pair(graph.history_texture(name, texture_desc(bytes, careful)))),
            6 | 7 => {
                let (from, to) = two(buffers, bytes, careful, |_, _| true)?;
                let pass = graph.compute(&shaders().words);
                let pass = if !careful && bytes.rarely(16) { pass } else { pass.read("a", from) };
                let pass = if bytes.rarely(8) { pass.pinned() } else { pass };
                pass.write(if !careful && bytes.rarely(16) { "gaol" } else { "goal" }, to).dispatch_1d(64);
            }
            8 => {
                let index = pick(buffers, bytes, careful, |item| item.written && !item.previous)?;
                graph.compute(&shaders().update).name(name).write("goal", &mut buffers[index].handle).dispatch_1d(64);
            }
            9 | 10 => {
                let (from, to) = two(textures, bytes, careful, |a, b| flat(a) && flat(b))?;
                graph.compute(&shaders().texels).read("a", from).write("goal", to).dispatch_threads([8, 4, 1]);
            }
            11 => {
                let to = goal(textures, bytes, careful, flat)?;
                graph.raster(&shaders().draw).color("color", to, Load::Clear([0.0; 4])).draw(3, 1);
            }
            12 => {
                let index = pick(textures, bytes, careful, |item| item.written && !item.previous && flat(item.handle.desc()))?;
                graph.raster(&shaders().draw).color("color", &mut textures[index].handle, Load::Keep).draw(3, 1);
            }
            13 => {
                let color = pick(textures, bytes, careful, |item| !item.previous && flat(item.handle.desc()))?;
                let desc = textures[color].handle.desc().clone();
                let depth = pick(textures, bytes, careful, |item| {
                    let other = item.handle.desc();
                    let depth = other.format == TextureFormat::Depth32Float && other.mip_level_count == 1;
                    !item.previous && depth && other.size == desc.size
                })?;
                let [color, depth] = textures.get_disjoint_mut([color, depth]).ok()?;
                (color.written, depth.written) = (true, true);
                let pass = graph.raster(&shaders().draw).color("color", &mut color.handle, Load::Clear([0.0; 4]));
                pass.depth(&mut depth.handle, Load::ClearDepth(1.0)).draw(3, 1);
            }
            14 => {
                let (from, to) = two(buffers, bytes, careful, |_, _| true)?;
                let pass = graph.closure(name).read(from).write(to);
                let pass = if bytes.rarely(4) { pass.side_effect() } else { pass };
                pass.record(|_| Ok(()));
            }
            15 => {
                let (from, to) = two(textures, bytes, careful, |_, _| true)?;
                let pass = graph.closure(name).read_as(from, TextureUsages::TEXTURE_BINDING);
                pass.write_as(to, TextureUsages::RENDER_ATTACHMENT).heavy().record(|_| Ok(()));
            }
            16 => graph.clear_buffer(goal(buffers, bytes, careful, |_| true)?),
            17 if bytes.rarely(2) => {
                let (from, to) = two(buffers, bytes, careful, |a, b| a == b)?;
                graph.copy_buffer(from, to);
            }
            17 => {
                let (from, to) = two(textures, bytes, careful, |a, b| a == b)?;
                graph.copy_texture(from, to);
            }
            18 if bytes.rarely(2) => {
                graph.readback_buffer(source(buffers, bytes, careful)?);
            }
            18 => {
                graph.readback_texture(source(textures, bytes, careful)?);
            }
            _ if bytes.rarely(2) => graph.keep(source(buffers, bytes, careful)?),
            _ => graph.keep(source(textures, bytes, careful)?),
        }
        Some(())
    }
}
