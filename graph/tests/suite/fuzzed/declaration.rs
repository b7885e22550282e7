//! Sequences of calls of the graph from bytes, right and wrong ones.

use super::invariants::check;
use lightloom_graph::{
    Buffer, BufferDesc, ComputeShader, Graph, Handle, Load, PlanOptions, RasterShader, Texture, TextureDesc,
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

fn buffer_desc(bytes: &mut Bytes<'_>) -> BufferDesc {
    match bytes.next() {
        // Far more than there is.
        255 => BufferDesc::bytes(u64::MAX - u64::from(bytes.next())),
        n => BufferDesc::bytes(u64::from(n % 8) * 100),
    }
}

fn texture_desc(bytes: &mut Bytes<'_>) -> TextureDesc {
    let number = bytes.next();
    let size = [u32::from(number % 4) * 8, u32::from(number / 4 % 2) + 4];
    let format = if number / 8 % 8 == 7 { TextureFormat::Depth32Float } else { TextureFormat::R32Uint };
    let desc = TextureDesc::new_2d(size, format);
    match number / 64 {
        2 => desc.mip_levels(3),
        3 => desc.layers(if number % 8 == 1 { u32::MAX } else { 2 }),
        _ => desc,
    }
}

/// The handles so far; a few of another graph among them.
struct Handles {
    buffers: Vec<Handle<Buffer>>,
    textures: Vec<Handle<Texture>>,
}

/// Two of a list, the second to be written; `None` where there are no two.
fn two<'a, T>(items: &'a mut [T], bytes: &mut Bytes<'_>) -> Option<(&'a T, &'a mut T)> {
    let (a, b) = (bytes.index(items.len()), bytes.index(items.len()));
    let [first, second] = items.get_disjoint_mut([a, b]).ok()?;
    Some((first, second))
}

/// Declares what the bytes say; what is accepted is planned.
pub(crate) fn declaration(bytes: &[u8]) {
    let bytes = &mut Bytes(bytes);
    let mut other = Graph::new("other");
    let mut graph = Graph::new("fuzz");
    let desc = TextureDesc::new_2d([8, 4], TextureFormat::R32Uint);
    let mut handles = Handles {
        buffers: vec![other.import_buffer("foreign", BufferDesc::words(4), None)],
        textures: vec![other.import_texture("foreign", desc.clone(), None)],
    };
    if bytes.next() % 8 > 0 {
        // Frames without foreign handles are seldom refused.
        handles = Handles {
            buffers: vec![graph.import_buffer("imported", BufferDesc::bytes(100), None)],
            textures: vec![graph.import_texture("imported", desc, None)],
        };
    }
    while !bytes.0.is_empty() {
        call(&mut graph, &mut handles, bytes);
    }
    let planned = graph.plan(&PlanOptions::default());
    match graph.declaration() {
        Ok(declaration) => check(&declaration),
        Err(error) => assert_eq!(planned.err(), Some(error), "a frame with mistakes is not planned"),
    }
}

fn call(graph: &mut Graph<'_>, Handles { buffers, textures }: &mut Handles, bytes: &mut Bytes<'_>) {
    let name = ["a", "b", "b#2", "", "clear b"][bytes.index(5)];
    match bytes.next() % 20 {
        0 | 1 => buffers.push(graph.buffer(name, buffer_desc(bytes))),
        2 | 3 => textures.push(graph.texture(name, texture_desc(bytes))),
        4 => {
            let pair = graph.history_buffer(name, buffer_desc(bytes));
            buffers.extend([pair.previous, pair.current]);
        }
        5 => {
            let pair = graph.history_texture(name, texture_desc(bytes));
            textures.extend([pair.previous, pair.current]);
        }
        6 | 7 => {
            let Some((from, to)) = two(buffers, bytes) else { return };
            let pass = graph.compute(&shaders().words);
            let pass = if bytes.rarely(16) { pass } else { pass.read("a", from) };
            let pass = if bytes.rarely(16) { pass.pinned() } else { pass };
            pass.write(if bytes.rarely(16) { "gaol" } else { "goal" }, to).dispatch_1d(64);
        }
        8 => {
            let index = bytes.index(buffers.len());
            graph.compute(&shaders().update).name(name).write("goal", &mut buffers[index]).dispatch_1d(64);
        }
        9 | 10 => {
            let Some((from, to)) = two(textures, bytes) else { return };
            graph.compute(&shaders().texels).read("a", from).write("goal", to).dispatch_threads([8, 4, 1]);
        }
        11 | 12 => {
            let index = bytes.index(textures.len());
            let load = if bytes.rarely(3) { Load::Keep } else { Load::Clear([0.0; 4]) };
            graph.raster(&shaders().draw).color("color", &mut textures[index], load).draw(3, 1);
        }
        13 => {
            let Some((color, depth)) = two(textures, bytes) else { return };
            let _ = color;
            graph.raster(&shaders().draw).depth(depth, Load::ClearDepth(1.0)).draw(3, 1);
        }
        14 => {
            let Some((from, to)) = two(buffers, bytes) else { return };
            let pass = graph.closure(name).read(from).write(to);
            let pass = if bytes.rarely(4) { pass.side_effect() } else { pass };
            pass.record(|_| Ok(()));
        }
        15 => {
            let Some((from, to)) = two(textures, bytes) else { return };
            let pass = graph.closure(name).read_as(from, TextureUsages::TEXTURE_BINDING);
            pass.write_as(to, TextureUsages::RENDER_ATTACHMENT).heavy().record(|_| Ok(()));
        }
        16 => {
            let index = bytes.index(buffers.len());
            graph.clear_buffer(&mut buffers[index]);
        }
        17 => match (bytes.rarely(2), two(buffers, bytes), two(textures, bytes)) {
            (true, Some((from, to)), _) => graph.copy_buffer(from, to),
            (false, _, Some((from, to))) => graph.copy_texture(from, to),
            _ => {}
        },
        18 => {
            let (buffer, texture) = (bytes.index(buffers.len()), bytes.index(textures.len()));
            if bytes.rarely(2) {
                graph.readback_buffer(&buffers[buffer])
            } else {
                graph.readback_texture(&textures[texture])
            };
        }
        _ => {
            let (buffer, texture) = (bytes.index(buffers.len()), bytes.index(textures.len()));
            if bytes.rarely(2) { graph.keep(&buffers[buffer]) } else { graph.keep(&textures[texture]) }
        }
    }
}
