//! Frames with one mistake each, found without a device. Each function makes the error it is named after.

use lightloom_graph::{
    BufferDesc, ComputeShader, Declaration, Graph, GraphError, Handle, Initial, Load, PlanOptions, RasterShader, Sampler,
    Subresources, Texture, TextureDesc, shader_struct, wgpu::TextureFormat as F,
};

pub(super) const FILE: &str = file!();

shader_struct! {
    /// As in WGSL, but for the second field's name.
    pub(super) struct Item { pub(super) weight: f32, pub(super) kinds: u32 }
}

const WORDS: &str = "@group(0) @binding(0) var<storage, read_write> words: array<u32>; fn body() { words[0] = 1u; }";
const CLEAR: Load = Load::Clear([0.0; 4]);

type Planned = Result<(), GraphError>;

fn planned(declare: impl FnOnce(&mut Graph<'_>)) -> Planned {
    let mut graph = Graph::new("frame");
    declare(&mut graph);
    graph.plan(&PlanOptions::default()).map(|_| ())
}

/// A compute shader `one` that calls `body`.
pub(super) fn one(wgsl: &str) -> ComputeShader {
    ComputeShader::from_wgsl("one", &format!("{wgsl} @compute @workgroup_size(1) fn one() {{ body(); }}")).unwrap()
}

/// Reads a texture by this expression.
fn reader(image: &str, load: &str) -> ComputeShader {
    one(&format!(
        "@group(0) @binding(0) var image: {image};
        @group(0) @binding(1) var<storage, read_write> words: array<f32>;
        @group(0) @binding(2) var smooth_sampler: sampler;
        fn body() {{ words[0] = f32({load}.x); }}"
    ))
}

/// Binds a texture of this description to what [`reader`] reads.
fn reads(shader: &ComputeShader, desc: TextureDesc, sampled: bool) -> Planned {
    planned(|graph| {
        let image = graph.import_texture("my_image", desc, None);
        let mut words = graph.buffer("words", BufferDesc::words(4));
        let pass = graph.compute(shader).read("image", &image).write("words", &mut words);
        let pass = if sampled { pass.sampler("smooth_sampler", Sampler::LINEAR_CLAMP) } else { pass };
        pass.dispatch([1, 1, 1]);
    })
}

const LOAD: &str = "textureLoad(image, vec2u(0u), 0)";

/// Draws into `color`.
fn drawer() -> RasterShader {
    RasterShader::from_wgsl(
        "draw",
        "struct Output { @location(0) color: vec4f }
        @vertex fn draw_vertex() -> @builtin(position) vec4f { return vec4f(0.0); }
        @fragment fn draw_fragment() -> Output { return Output(vec4f(0.0)); }",
    )
    .unwrap()
}

fn plain(format: F) -> TextureDesc {
    TextureDesc::new_2d([4, 4], format)
}

fn image(graph: &mut Graph<'_>, name: &str, format: F) -> Handle<Texture> {
    graph.texture(name, plain(format))
}

pub(super) fn unknown_binding() -> Planned {
    planned(|graph| {
        let mut a = graph.buffer("a", BufferDesc::words(1));
        let b = graph.import_buffer("b", BufferDesc::words(1), None);
        graph.compute(&one(WORDS)).write("words", &mut a).read("wrods", &b).dispatch([1, 1, 1]);
    })
}

pub(super) fn unbound() -> Planned {
    planned(|graph| graph.compute(&one(WORDS)).dispatch([1, 1, 1]))
}

pub(super) fn bound_twice() -> Planned {
    planned(|graph| {
        let [mut a, mut b] = ["a", "b"].map(|name| graph.buffer(name, BufferDesc::words(1)));
        graph.compute(&one(WORDS)).write("words", &mut a).write("words", &mut b).dispatch([1, 1, 1]);
    })
}

pub(super) fn kind() -> Planned {
    planned(|graph| {
        let mut image = image(graph, "my_image", F::R32Float);
        graph.compute(&one(WORDS)).write("words", &mut image).dispatch([1, 1, 1]);
    })
}

pub(super) fn read_is_written() -> Planned {
    planned(|graph| {
        let words = graph.import_buffer("my_words", BufferDesc::words(1), None);
        graph.compute(&one(WORDS)).read("words", &words).dispatch([1, 1, 1]);
    })
}

pub(super) fn write_is_not_written() -> Planned {
    planned(|graph| {
        let shader = one("@group(0) @binding(0) var<storage, read_write> words: array<u32>; fn body() { _ = words[0]; }");
        let mut words = graph.import_buffer("my_words", BufferDesc::words(1), None);
        graph.compute(&shader).write("words", &mut words).dispatch([1, 1, 1]);
    })
}

pub(super) fn sample_kind() -> Planned {
    reads(&reader("texture_2d<f32>", LOAD), plain(F::R32Uint), false)
}

pub(super) fn not_filterable() -> Planned {
    let sampled = "textureSampleLevel(image, smooth_sampler, vec2f(0.0), 0.0)";
    reads(&reader("texture_2d<f32>", sampled), plain(F::Rgba32Float), true)
}

pub(super) fn storage_format() -> Planned {
    planned(|graph| {
        let shader = one("@group(0) @binding(0) var image: texture_storage_2d<r32float, write>;
            fn body() { textureStore(image, vec2u(0u), vec4f(0.0)); }");
        let mut image = image(graph, "my_image", F::R32Uint);
        graph.compute(&shader).write("image", &mut image).dispatch([1, 1, 1]);
    })
}

pub(super) fn texture_shape() -> Planned {
    reads(&reader("texture_2d<f32>", LOAD), plain(F::R32Float).layers(3), false)
}

pub(super) fn view_format() -> Planned {
    planned(|graph| {
        let image = graph.import_texture("my_image", plain(F::Rgba8Unorm), None);
        let mut words = graph.buffer("words", BufferDesc::words(4));
        let pass = graph.compute(&reader("texture_2d<f32>", LOAD)).read_as("image", &image, F::Rgba8UnormSrgb);
        pass.write("words", &mut words).dispatch([1, 1, 1]);
    })
}

/// Binds a buffer of this description to an array of a struct.
fn items(desc: BufferDesc) -> Planned {
    planned(|graph| {
        let shader = one("struct Item { weight: f32, kind: u32 }
            @group(0) @binding(0) var<storage, read_write> items: array<Item>; fn body() { items[0].kind = 1u; }");
        let mut items = graph.buffer("my_items", desc);
        graph.compute(&shader).write("items", &mut items).dispatch([1, 1, 1]);
    })
}

pub(super) fn layout() -> Planned {
    items(BufferDesc::array_of::<Item>(4))
}

pub(super) fn buffer_too_small() -> Planned {
    items(BufferDesc::bytes(4))
}

pub(super) fn write_conflict() -> Planned {
    planned(|graph| {
        let mut a = graph.import_buffer("a", BufferDesc::words(4), None);
        graph.closure("both").read(&a).write(&mut a).record(|_| Ok(()));
    })
}

pub(super) fn foreign_handle() -> Planned {
    planned(|graph| {
        let words = Graph::new("other").buffer("yesterday", BufferDesc::words(4));
        graph.readback_buffer(&words);
    })
}

pub(super) fn no_such_part() -> Planned {
    planned(|graph| {
        let mut layers = graph.texture("layers", plain(F::R32Float).layers(6));
        graph.clear_texture_at(&mut layers, Subresources::mip(0).layer(6), CLEAR);
    })
}

pub(super) fn indirect() -> Planned {
    planned(|graph| {
        let arguments = graph.import_buffer("arguments", BufferDesc::words(4), None);
        let mut words = graph.buffer("words", BufferDesc::words(1));
        graph.compute(&one(WORDS)).write("words", &mut words).dispatch_indirect(&arguments, 8);
    })
}

pub(super) fn unknown_attachment() -> Planned {
    planned(|graph| {
        let [mut a, mut b] = ["a", "b"].map(|name| image(graph, name, F::Rgba8Unorm));
        graph.raster(&drawer()).color("color", &mut a, CLEAR).color("colour", &mut b, CLEAR).draw(3, 1);
    })
}

pub(super) fn missing_attachment() -> Planned {
    planned(|graph| graph.raster(&drawer()).draw(3, 1))
}

pub(super) fn attachment() -> Planned {
    planned(|graph| {
        let mut color = image(graph, "my_color", F::R32Uint);
        graph.raster(&drawer()).color("color", &mut color, CLEAR).draw(3, 1);
    })
}

pub(super) fn attachment_size() -> Planned {
    planned(|graph| {
        let mut color = image(graph, "my_color", F::Rgba8Unorm);
        let mut depth = graph.texture("my_depth", TextureDesc::new_2d([4, 5], F::Depth32Float));
        graph.raster(&drawer()).color("color", &mut color, CLEAR).depth(&mut depth, Load::ClearDepth(1.0)).draw(3, 1);
    })
}

pub(super) fn no_attachment() -> Planned {
    let shader = "@vertex fn none_vertex() -> @builtin(position) vec4f { return vec4f(0.0); } @fragment fn none_fragment() {}";
    planned(|graph| graph.raster(&RasterShader::from_wgsl("none", shader).unwrap()).draw(3, 1))
}

pub(super) fn copy_mismatch() -> Planned {
    planned(|graph| {
        let a = graph.import_buffer("a", BufferDesc::words(4), None);
        let mut b = graph.buffer("b", BufferDesc::words(5));
        graph.copy_buffer(&a, &mut b);
    })
}

pub(super) fn readback() -> Planned {
    planned(|graph| {
        let a = graph.import_texture("a", plain(F::Rgba8Unorm).samples(4), None);
        graph.readback_texture(&a);
    })
}

pub(super) fn empty_resource() -> Planned {
    planned(|graph| drop(graph.buffer("nothing", BufferDesc::words(0))))
}

pub(super) fn initial() -> Planned {
    planned(|graph| drop(graph.persistent_buffer("sums", BufferDesc::words(4), Initial::Bytes([0; 12].into()))))
}

pub(super) fn writes_previous() -> Planned {
    planned(|graph| {
        let mut total = graph.history_buffer("total", BufferDesc::words(4));
        graph.clear_buffer(&mut total.previous);
    })
}

pub(super) fn stale_read() -> Planned {
    planned(|graph| {
        let a = graph.buffer("a", BufferDesc::words(4));
        graph.readback_buffer(&a);
    })
}

pub(super) fn cycle() -> Planned {
    planned(|graph| {
        let [mut a, mut b] = ["a", "b"].map(|name| graph.buffer(name, BufferDesc::words(4)));
        graph.closure("first").read(&a).write(&mut b).record(|_| Ok(()));
        graph.closure("second").read(&b).write(&mut a).record(|_| Ok(()));
    })
}

pub(super) fn many() -> Planned {
    planned(|graph| ["a", "b"].into_iter().for_each(|name| drop(graph.buffer(name, BufferDesc::words(0)))))
}

pub(super) const TWINS: &str =
    r#"{"frame": "f", "resources": [], "passes": [{"name": "p", "kind": "compute"}, {"name": "p", "kind": "compute"}]}"#;

pub(super) const NO_BYTES: &str =
    r#"{"frame": "f", "resources": [{"name": "image", "origin": "transient", "kind": "buffer"}], "passes": []}"#;

pub(super) const MISSPELT: &str = r#"{"frame": "f",
    "resources": [{"name": "image", "origin": "transient", "kind": "buffer", "bytes": 4}],
    "passes": [{"name": "p", "kind": "compute", "reads": ["imagé"]}]}"#;

pub(super) fn file(json: &str) -> Planned {
    Declaration::from_frame_json(json).map(|_| ())
}

/// A frame whose pass `fill` writes a buffer, with a tap at this pass.
pub(super) fn tapped(pass: &str) -> Result<(), GraphError> {
    let mut graph = Graph::new("f");
    let mut words = graph.buffer("words", BufferDesc::words(4));
    graph.compute(&one(WORDS)).name("fill").write("words", &mut words).dispatch([1, 1, 1]);
    graph.tap(pass, None).map(|_| ())
}
