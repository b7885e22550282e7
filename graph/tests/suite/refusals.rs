//! Mistakes of every form are errors that name the place and the mend. That every kind of error has a row, with its whole text,
//! is seen to in `src/error/texts`.

use crate::Amount;
use lightloom_graph::{
    Buffer, BufferDesc, ComputeShader, Graph, GraphError, Handle, Initial, Load, PlanOptions, RasterShader, Sampler, ShaderError,
    Subresources, TextureDesc, WgslSources, shader_struct,
    wgpu::{self, TextureFormat as F},
};

shader_struct! {
    /// As the WGSL `Item` below.
    pub struct Item { pub position: [f32; 3], pub kind: u32 }
}
shader_struct! {
    /// One name differs.
    pub struct Renamed { pub position: [f32; 3], pub kinds: u32 }
}
shader_struct! {
    /// One field moved.
    pub struct Moved { pub kind: u32, pub position: [f32; 3] }
}
shader_struct! {
    /// One field too few.
    pub struct Short { pub position: [f32; 3], pub pad0: u32 }
}
shader_struct! {
    /// Too long.
    pub struct Long { pub position: [f32; 3], pub kind: u32, pub pad: [u32; 4] }
}
shader_struct! {
    /// A field of another size.
    pub struct Wide { pub position: [f32; 2], pub pad: f32, pub kind: u32 }
}

const WGSL: &str = "#import \"shared/item.wgsl\"
@group(0) @binding(0) var<uniform> params: Amount;
@group(0) @binding(1) var<storage, read> items: array<Item>;
@group(0) @binding(2) var<storage, read_write> result: array<u32>;
@group(0) @binding(3) var image: texture_2d<f32>;
@group(0) @binding(4) var store: texture_storage_2d<rgba16float, write>;
@group(0) @binding(5) var unused: texture_2d<f32>;
@group(0) @binding(6) var<storage, read_write> unused_words: array<u32>;
@compute @workgroup_size(1) fn work() {
    result[0] = items[params.count].kind + u32(textureLoad(image, vec2u(0u), 0).x);
    textureStore(store, vec2u(0u), vec4f(0.0));
}";

fn sources() -> WgslSources {
    WgslSources::new().with(&[
        ("passes/work.wgsl", WGSL),
        ("shared/item.wgsl", "struct Item { position: vec3f, kind: u32 }\nstruct Amount { value: f32, count: u32 }\n"),
    ])
}

/// The resources of a frame; a row changes one thing.
struct Parts {
    work: ComputeShader,
    items: BufferDesc,
    image: TextureDesc,
    store: TextureDesc,
}

impl Default for Parts {
    fn default() -> Self {
        let texture = TextureDesc::new_2d([4, 4], F::Rgba16Float);
        Self {
            work: ComputeShader::new(&sources(), "passes/work.wgsl").unwrap(),
            items: BufferDesc::array_of::<Item>(8),
            image: texture.clone(),
            store: texture,
        }
    }
}

const PARAMS: Amount = Amount { value: 0.0, count: 1 };

/// Plans the work pass with these parts.
fn work(parts: Parts) -> Result<(), GraphError> {
    let mut graph = Graph::new("work");
    let items = graph.import_buffer("my_items", parts.items, None);
    let image = graph.import_texture("my_image", parts.image, None);
    let mut store = graph.texture("my_store", parts.store);
    let mut result = graph.buffer("my_result", BufferDesc::words(4));
    graph
        .compute(&parts.work)
        .params(&PARAMS)
        .read("items", &items)
        .read("image", &image)
        .write("store", &mut store)
        .write("result", &mut result)
        .dispatch([1, 1, 1]);
    graph.plan(&PlanOptions::default()).map(|_| ())
}

fn planned(declare: impl FnOnce(&mut Graph<'_>)) -> Result<(), GraphError> {
    let mut graph = Graph::new("frame");
    declare(&mut graph);
    graph.plan(&PlanOptions::default()).map(|_| ())
}

fn one(wgsl: &str) -> ComputeShader {
    ComputeShader::from_wgsl("one", &format!("{wgsl} @compute @workgroup_size(1) fn one() {{ body(); }}")).unwrap()
}

fn raster() -> RasterShader {
    RasterShader::from_wgsl(
        "draw",
        "struct Output { @location(0) color: vec4f, @location(1) id: u32 }
        @vertex fn draw_vertex() -> @builtin(position) vec4f { return vec4f(0.0); }
        @fragment fn draw_fragment() -> Output { return Output(vec4f(0.0), 0u); }",
    )
    .unwrap()
}

/// Plans a draw with a colour and an id attachment.
fn draw(color: TextureDesc, id: TextureDesc, load: Load) -> Result<(), GraphError> {
    planned(|graph| {
        let mut color = graph.texture("my_color", color);
        let mut id = graph.texture("my_id", id);
        graph.raster(&raster()).color("color", &mut color, load).color("id", &mut id, Load::Clear([0.0; 4])).draw(3, 1);
    })
}

fn plain(format: F) -> TextureDesc {
    TextureDesc::new_2d([4, 4], format)
}

/// `name: expression => Variant, words of the message`.
macro_rules! refusals {
    ($($name:ident: $result:expr => $variant:ident, [$($word:expr),* $(,)?];)*) => {
        $(#[test]
        fn $name() {
            let error: GraphError = $result.expect_err(stringify!($name));
            let message = error.to_string();
            assert!(matches!(error, GraphError::$variant { .. }), "not {}: {message}", stringify!($variant));
            $(assert!(message.contains($word), "`{}` is not in: {message}", $word);)*
        })*
    };
}

#[test]
fn the_frame_that_rows_change_is_right() {
    work(Parts::default()).unwrap();
    draw(plain(F::Rgba8Unorm), plain(F::R32Uint), Load::Clear([0.0; 4])).unwrap();
}

refusals! {
    unknown_binding: planned(|graph| {
        let items = graph.import_buffer("my_items", BufferDesc::array_of::<Item>(8), None);
        let image = graph.import_texture("my_image", plain(F::Rgba16Float), None);
        let mut store = graph.texture("my_store", plain(F::Rgba16Float));
        let mut result = graph.buffer("my_result", BufferDesc::words(4));
        graph.compute(&Parts::default().work).params(&PARAMS).read("items", &items).read("image", &image)
            .write("store", &mut store).write("result", &mut result).read("itens", &items).dispatch([1, 1, 1]);
    }) => UnknownBinding, ["pass `work`", "refusals.rs:", "`itens`", "passes/work.wgsl", "did you mean `items`?"];

    unknown_params: planned(|graph| {
        let shader = one("@group(0) @binding(0) var<storage, read_write> words: array<u32>; fn body() { words[0] = 1u; }");
        let mut words = graph.buffer("words", BufferDesc::words(1));
        graph.compute(&shader).params(&PARAMS).write("words", &mut words).dispatch([1, 1, 1]);
    }) => UnknownBinding, ["`params`", "it has `words`"];

    unbound: planned(|graph| {
        let image = graph.import_texture("my_image", plain(F::Rgba16Float), None);
        let mut store = graph.texture("my_store", plain(F::Rgba16Float));
        let mut result = graph.buffer("my_result", BufferDesc::words(4));
        graph.compute(&Parts::default().work).params(&PARAMS).read("image", &image).write("store", &mut store).write("result", &mut result).dispatch([1, 1, 1]);
    }) => Unbound, ["pass `work`", "`items`", "passes/work.wgsl:3", "`.read(\"items\", &…)`"];

    unbound_params: planned(|graph| {
        let shader = one("struct P { a: u32 } @group(0) @binding(0) var<uniform> params: P;
            @group(0) @binding(1) var<storage, read_write> words: array<u32>; fn body() { words[0] = params.a; }");
        let mut words = graph.buffer("words", BufferDesc::words(1));
        graph.compute(&shader).write("words", &mut words).dispatch([1, 1, 1]);
    }) => Unbound, ["`params`", "`.params(&…)`"];

    buffer_for_a_texture: planned(|graph| {
        let shader = one("@group(0) @binding(0) var image: texture_storage_2d<r32float, write>; fn body() { textureStore(image, vec2u(0u), vec4f(0.0)); }");
        let mut words = graph.buffer("words", BufferDesc::words(1));
        graph.compute(&shader).write("image", &mut words).dispatch([1, 1, 1]);
    }) => Kind, ["`image` is texture_storage_2d<r32float>", "one:1", "`words` is a buffer", "bind a texture"];

    texture_for_a_buffer: planned(|graph| {
        let shader = one("@group(0) @binding(0) var<storage, read_write> words: array<u32>; fn body() { words[0] = 1u; }");
        let mut image = graph.texture("image", plain(F::R32Float));
        graph.compute(&shader).write("words", &mut image).dispatch([1, 1, 1]);
    }) => Kind, ["a storage buffer (read_write)", "`image` is a texture"];

    sampler_for_a_buffer: planned(|graph| {
        let shader = one("@group(0) @binding(0) var<storage, read_write> words: array<u32>; fn body() { words[0] = 1u; }");
        graph.compute(&shader).sampler("words", Sampler::LINEAR_CLAMP).dispatch([1, 1, 1]);
    }) => Kind, ["`words`", "a sampler"];

    read_is_written: planned(|graph| {
        let shader = one("@group(0) @binding(0) var<storage, read_write> words: array<u32>; fn body() { words[0] = 1u; }");
        let words = graph.buffer("my_words", BufferDesc::words(1));
        graph.compute(&shader).read("words", &words).dispatch([1, 1, 1]);
    }) => ReadIsWritten, ["pass `one`", "`my_words`", "one:1", "`.write(\"words\", &mut …)`"];

    write_is_not_written: planned(|graph| {
        let shader = one("@group(0) @binding(0) var<storage, read_write> words: array<u32>;
            @group(0) @binding(1) var<storage, read_write> out: array<u32>; fn body() { out[0] = words[0]; }");
        let mut words = graph.import_buffer("my_words", BufferDesc::words(1), None);
        let mut out = graph.buffer("out", BufferDesc::words(1));
        graph.compute(&shader).write("words", &mut words).write("out", &mut out).dispatch([1, 1, 1]);
    }) => WriteIsNotWritten, ["`my_words`", "never writes `words`", "`.read(\"words\", &…)`"];

    write_of_an_unused_variable: planned(|graph| {
        let mut words = graph.buffer("my_words", BufferDesc::words(1));
        graph.compute(&one("@group(0) @binding(0) var<storage, read_write> words: array<u32>; fn body() {}")).write("words", &mut words).dispatch([1, 1, 1]);
    }) => WriteIsNotWritten, ["`my_words`", "`words`"];

    sample_kind: work(Parts { image: plain(F::R32Uint), ..Parts::default() })
        => SampleKind, ["`image` is texture_2d<f32>", "passes/work.wgsl:5", "`my_image` is r32uint", "declare `image` as texture_2d<u32>"];

    sample_kind_of_depth: work(Parts { image: plain(F::Depth32Float), ..Parts::default() })
        => SampleKind, ["depth32float", "texture_depth_2d"];

    not_filterable: planned(|graph| {
        let shader = one("@group(0) @binding(0) var image: texture_2d<f32>; @group(0) @binding(1) var s: sampler;
            @group(0) @binding(2) var<storage, read_write> out: array<f32>; fn body() { out[0] = textureSampleLevel(image, s, vec2f(0.0), 0.0).x; }");
        let image = graph.import_texture("image", plain(F::Rgba32Float), None);
        let mut out = graph.buffer("out", BufferDesc::words(1));
        graph.compute(&shader).read("image", &image).sampler("s", Sampler::LINEAR_REPEAT).write("out", &mut out).dispatch([1, 1, 1]);
    }) => NotFilterable, ["`image`", "rgba32float", "textureLoad"];

    storage_format: work(Parts { store: plain(F::Rgba32Float), ..Parts::default() })
        => StorageFormat, ["`store`", "rgba16float", "passes/work.wgsl:6", "`my_store` is rgba32float"];

    texture_shape: work(Parts { image: plain(F::Rgba16Float).layers(3), ..Parts::default() })
        => TextureShape, ["`image` is 2d", "`my_image`", "4×4×3", "texture_2d_array"];

    texture_samples: work(Parts { image: plain(F::Rgba16Float).samples(4), ..Parts::default() })
        => TextureShape, ["`my_image`", "4 samples"];

    view_format: planned(|graph| {
        let shader = one("@group(0) @binding(0) var image: texture_2d<f32>; @group(0) @binding(1) var<storage, read_write> out: array<f32>;
            fn body() { out[0] = textureLoad(image, vec2u(0u), 0).x; }");
        let image = graph.import_texture("image", plain(F::Rgba8Unorm), None);
        let mut out = graph.buffer("out", BufferDesc::words(1));
        graph.compute(&shader).read_as("image", &image, F::Rgba8UnormSrgb).write("out", &mut out).dispatch([1, 1, 1]);
    }) => ViewFormat, ["`image` is rgba8unorm", "rgba8unorm-srgb", ".view_format("];

    layout_name: work(Parts { items: BufferDesc::array_of::<Renamed>(8), ..Parts::default() })
        => Layout, ["`Renamed`", "`Item`", "passes/work.wgsl:3", "no field `kinds`; did you mean `kind`?"];

    layout_offset: work(Parts { items: BufferDesc::array_of::<Moved>(8), ..Parts::default() })
        => Layout, ["field `kind` lies at byte 0 in Rust and 12 in WGSL"];

    layout_missing: work(Parts { items: BufferDesc::array_of::<Short>(8), ..Parts::default() })
        => Layout, ["Rust has no field `kind`"];

    layout_size: work(Parts { items: BufferDesc::array_of::<Long>(8), ..Parts::default() })
        => Layout, ["32 bytes in Rust and 16 in WGSL"];

    layout_field_size: work(Parts { items: BufferDesc::array_of::<Wide>(8), ..Parts::default() })
        => Layout, ["field `position` takes 8 bytes in Rust and 12 in WGSL"];

    layout_of_params: planned(|graph| {
        let shader = one("struct P { a: u32, b: vec3f } @group(0) @binding(0) var<uniform> params: P;
            @group(0) @binding(1) var<storage, read_write> words: array<f32>; fn body() { words[0] = params.b.x; }");
        let mut words = graph.buffer("words", BufferDesc::words(1));
        graph.compute(&shader).params(&Item::default()).write("words", &mut words).dispatch([1, 1, 1]);
    }) => Layout, ["`params`", "`Item`", "`P`"];

    layout_of_plain_elements: planned(|graph| {
        let shader = one("@group(0) @binding(0) var<storage, read_write> words: array<vec4u>; fn body() { words[0] = vec4u(1u); }");
        let mut items = graph.buffer("items", BufferDesc::array_of::<Item>(8));
        graph.compute(&shader).write("words", &mut items).dispatch([1, 1, 1]);
    }) => Layout, ["`vec4<u32>`", "BufferDesc::words"];

    buffer_too_small: work(Parts { items: BufferDesc::bytes(12), ..Parts::default() })
        => BufferTooSmall, ["`items` needs at least 16 bytes", "passes/work.wgsl:3", "`my_items` has 12"];

    write_conflict: planned(|graph| {
        let shader = one("@group(0) @binding(0) var<storage, read> first: array<u32>; @group(0) @binding(1) var<storage, read_write> second: array<u32>;
            fn body() { second[0] = first[0]; }");
        let mut words = graph.import_buffer("words", BufferDesc::words(4), None);
        graph.compute(&shader).read("first", &words).write("second", &mut words).dispatch([1, 1, 1]);
    }) => WriteConflict, ["`words`", "`first`", "`second`"];

    write_conflict_of_an_attachment: planned(|graph| {
        let shader = RasterShader::from_wgsl("feedback", "struct Output { @location(0) color: vec4f }
            @group(0) @binding(0) var image: texture_2d<f32>;
            @vertex fn feedback_vertex() -> @builtin(position) vec4f { return vec4f(0.0); }
            @fragment fn feedback_fragment() -> Output { return Output(textureLoad(image, vec2u(0u), 0)); }").unwrap();
        let mut image = graph.import_texture("image", plain(F::Rgba16Float), None);
        graph.raster(&shader).read("image", &image).color("color", &mut image, Load::Keep).draw(3, 1);
    }) => WriteConflict, ["pass `feedback`", "`image`", "`color`"];

    foreign_handle_in_a_pass: planned(|graph| {
        let mut words = Graph::new("other").buffer("yesterday", BufferDesc::words(4));
        let shader = one("@group(0) @binding(0) var<storage, read_write> words: array<u32>; fn body() { words[0] = 1u; }");
        graph.compute(&shader).write("words", &mut words).dispatch([1, 1, 1]);
    }) => ForeignHandle, ["pass `one`", "`yesterday`"];

    foreign_handle_in_a_closure: planned(|graph| {
        let words = Graph::new("other").buffer("yesterday", BufferDesc::words(4));
        graph.closure("closed").read(&words).record(|_| Ok(()));
    }) => ForeignHandle, ["pass `closed`", "`yesterday`"];

    foreign_attachment: planned(|graph| {
        let mut color = Graph::new("other").texture("yesterday", plain(F::Rgba8Unorm));
        let mut id = graph.texture("id", plain(F::R32Uint));
        graph.raster(&raster()).color("color", &mut color, Load::Keep).color("id", &mut id, Load::Clear([0.0; 4])).draw(3, 1);
    }) => ForeignHandle, ["pass `draw`", "`yesterday`"];

    kept_foreign_handle: planned(|graph| {
        let words = Graph::new("other").buffer("yesterday", BufferDesc::words(4));
        graph.keep(&words);
    }) => ForeignHandle, ["`yesterday`"];

    unknown_attachment: planned(|graph| {
        let [mut color, mut id, mut more] = [("color", F::Rgba8Unorm), ("id", F::R32Uint), ("more", F::Rgba8Unorm)].map(|(n, f)| graph.texture(n, plain(f)));
        graph.raster(&raster()).color("color", &mut color, Load::Clear([0.0; 4])).color("id", &mut id, Load::Clear([0.0; 4]))
            .color("colour", &mut more, Load::Clear([0.0; 4])).draw(3, 1);
    }) => UnknownAttachment, ["pass `draw`", "`colour`", "`color` and `id`"];

    missing_attachment: planned(|graph| {
        let mut color = graph.texture("color", plain(F::Rgba8Unorm));
        graph.raster(&raster()).color("color", &mut color, Load::Clear([0.0; 4])).draw(3, 1);
    }) => MissingAttachment, ["`id`", ".color(\"id\""];

    attachment_kind: draw(plain(F::Rgba8Unorm), plain(F::R32Float), Load::Clear([0.0; 4]))
        => Attachment, ["`id`", "`my_id` (r32float)", "another kind of value"];

    attachment_is_depth: draw(plain(F::Depth32Float), plain(F::R32Uint), Load::Clear([0.0; 4]))
        => Attachment, ["`my_color`", ".depth("];

    attachment_load: draw(plain(F::Rgba8Unorm), plain(F::R32Uint), Load::ClearDepth(1.0))
        => Attachment, ["`my_color`", "Load::Clear("];

    attachment_layers: draw(plain(F::Rgba8Unorm).layers(2), plain(F::R32Uint).layers(2), Load::Clear([0.0; 4]))
        .map_err(|error| match error { GraphError::Many(mut all) => all.remove(0), one => one })
        => Attachment, ["`my_color`", "several layers"];

    attachment_twice: planned(|graph| {
        let [mut color, mut id, mut more] = [("color", F::Rgba8Unorm), ("id", F::R32Uint), ("more", F::Rgba8Unorm)].map(|(n, f)| graph.texture(n, plain(f)));
        graph.raster(&raster()).color("color", &mut color, Load::Clear([0.0; 4])).color("id", &mut id, Load::Clear([0.0; 4]))
            .color("color", &mut more, Load::Clear([0.0; 4])).draw(3, 1);
    }) => Attachment, ["`more`", "already has a texture"];

    blend_of_a_format_that_does_not: planned(|graph| {
        let shader = RasterShader::from_wgsl("mix", "struct Output { @location(0) color: u32 }
            @vertex fn mix_vertex() -> @builtin(position) vec4f { return vec4f(0.0); }
            @fragment fn mix_fragment() -> Output { return Output(0u); }").unwrap().with_blend(wgpu::BlendState::ALPHA_BLENDING);
        let mut color = graph.texture("color", plain(F::R32Uint));
        graph.raster(&shader).color("color", &mut color, Load::Clear([0.0; 4])).draw(3, 1);
    }) => Attachment, ["r32uint", "blends", "integers"];

    depth_is_color: planned(|graph| {
        let [mut color, mut id, mut depth] = [("color", F::Rgba8Unorm), ("id", F::R32Uint), ("depth", F::R32Float)].map(|(n, f)| graph.texture(n, plain(f)));
        graph.raster(&raster()).color("color", &mut color, Load::Clear([0.0; 4])).color("id", &mut id, Load::Clear([0.0; 4])).depth(&mut depth, Load::ClearDepth(1.0)).draw(3, 1);
    }) => Attachment, ["`depth` (r32float)", "depth32float"];

    depth_load: planned(|graph| {
        let [mut color, mut id, mut depth] = [("color", F::Rgba8Unorm), ("id", F::R32Uint), ("depth", F::Depth32Float)].map(|(n, f)| graph.texture(n, plain(f)));
        graph.raster(&raster()).color("color", &mut color, Load::Clear([0.0; 4])).color("id", &mut id, Load::Clear([0.0; 4])).depth(&mut depth, Load::ClearDepth(2.0)).draw(3, 1);
    }) => Attachment, ["2 is outside 0…1"];

    attachment_size: draw(plain(F::Rgba8Unorm), TextureDesc::new_2d([4, 5], F::R32Uint), Load::Clear([0.0; 4]))
        => AttachmentSize, ["`my_color` (rgba8unorm 4×4)", "`my_id` (r32uint 4×5)"];

    no_such_mip: planned(|graph| {
        let shader = one("@group(0) @binding(0) var image: texture_2d<f32>; @group(0) @binding(1) var<storage, read_write> out: array<f32>;
            fn body() { out[0] = textureLoad(image, vec2u(0u), 0).x; }");
        let image = graph.import_texture("image", plain(F::R32Float).mip_levels(3), None);
        let mut out = graph.buffer("out", BufferDesc::words(1));
        graph.compute(&shader).read_at("image", &image, Subresources::mip(3)).write("out", &mut out).dispatch([1, 1, 1]);
    }) => NoSuchPart, ["pass `one`", "refusals.rs:", "`image` has no mip 3", "3 mips and 1 layers"];

    storage_of_several_mips: planned(|graph| {
        let shader = one("@group(0) @binding(0) var image: texture_storage_2d<r32float, write>; fn body() { textureStore(image, vec2u(0u), vec4f(0.0)); }");
        let mut image = graph.texture("image", plain(F::R32Float).mip_levels(3));
        graph.compute(&shader).write_at("image", &mut image, Subresources::mips(1..3)).dispatch([1, 1, 1]);
    }) => TextureShape, ["`image` is a storage texture, which is one mip level", "mips 1…2", "bind one"];

    clear_of_several_layers: planned(|graph| {
        let mut layers = graph.texture("layers", plain(F::R32Float).layers(2));
        graph.clear_texture(&mut layers, Load::Clear([0.0; 4]));
    }) => Attachment, ["`layers`", "several layers", "clear_texture_at"];

    clear_of_depth_with_a_colour: planned(|graph| {
        let mut depth = graph.texture("depth", plain(F::Depth32Float));
        graph.clear_texture(&mut depth, Load::Clear([0.0; 4]));
    }) => Attachment, ["`depth` (depth32float)", "Load::ClearDepth"];

    clear_that_keeps: planned(|graph| {
        let mut color = graph.texture("color", plain(F::Rgba8Unorm));
        graph.clear_texture(&mut color, Load::Keep);
    }) => Attachment, ["`color`", "Load::Clear("];

    conflict_of_parts: planned(|graph| {
        let shader = one("@group(0) @binding(0) var source: texture_2d<f32>; @group(0) @binding(1) var to: texture_storage_2d<r32float, write>;
            fn body() { textureStore(to, vec2u(0u), textureLoad(source, vec2u(0u), 0)); }");
        let mut image = graph.import_texture("image", plain(F::R32Float).mip_levels(3), None);
        graph.compute(&shader).read_at("source", &image, Subresources::mips(0..2)).write_at("to", &mut image, Subresources::mip(1)).dispatch([1, 1, 1]);
    }) => WriteConflict, ["`image`", "`source`", "`to`"];

    conflict_of_what_wgsl_may_write: planned(|graph| {
        let shader = one("@group(0) @binding(0) var<storage, read_write> first: array<u32>; @group(0) @binding(1) var<storage, read> second: array<u32>;
            @group(0) @binding(2) var<storage, read_write> out: array<u32>; fn body() { out[0] = first[0] + second[0]; }");
        let words = graph.import_buffer("words", BufferDesc::words(4), None);
        let mut out = graph.buffer("out", BufferDesc::words(1));
        graph.compute(&shader).read("first", &words).read("second", &words).write("out", &mut out).dispatch([1, 1, 1]);
    }) => WriteConflict, ["`words`", "`first`", "`second`"];

    optional_write: planned(|graph| {
        let shader = one("@group(0) @binding(0) var<storage, read_write> words: array<u32>; fn body() { words[0] = 1u; }");
        graph.compute(&shader).read_optional("words", None::<&Handle<Buffer>>).dispatch([1, 1, 1]);
    }) => Kind, ["`words`", "which only what is read can be"];

    indirect_unaligned: planned(|graph| {
        let arguments = graph.import_buffer("arguments", BufferDesc::words(8), None);
        let [mut color, mut id] = [("color", F::Rgba8Unorm), ("id", F::R32Uint)].map(|(n, f)| graph.texture(n, plain(f)));
        graph.raster(&raster()).color("color", &mut color, Load::Clear([0.0; 4])).color("id", &mut id, Load::Clear([0.0; 4])).draw_indirect(&arguments, 6);
    }) => Indirect, ["pass `draw`", "multiple of 4"];

    indirect_arguments_are_written: planned(|graph| {
        let mut words = graph.import_buffer("arguments", BufferDesc::words(8), None);
        let shader = one("@group(0) @binding(0) var<storage, read_write> words: array<u32>; fn body() { words[0] = 1u; }");
        graph.compute(&shader).write("words", &mut words).dispatch_indirect(&words, 0);
    }) => WriteConflict, ["`arguments`", "`indirect arguments`"];

    first_contents_of_depth24: planned(|graph| {
        graph.history_texture_from("old", plain(F::Depth24Plus), Initial::Bytes([0; 64].into()));
    }) => Initial, ["`old.previous`", "Initial::Zero"];

    copy_of_other_format: planned(|graph| {
        let a = graph.import_texture("a", plain(F::R32Float), None);
        let mut b = graph.texture("b", plain(F::R32Uint));
        graph.copy_texture(&a, &mut b);
    }) => CopyMismatch, ["`a` (r32float 4×4)", "`b` (r32uint 4×4)"];

    readback_of_depth24: planned(|graph| {
        let a = graph.import_texture("a", plain(F::Depth24Plus), None);
        graph.readback_texture(&a);
    }) => Readback, ["depth24plus", "depth32float"];

    empty_texture: planned(|graph| { graph.texture("nothing", TextureDesc::new_2d([0, 4], F::Rgba8Unorm)); })
        => EmptyResource, ["`nothing`"];

    stale_current: planned(|graph| {
        let total = graph.history_buffer("total", BufferDesc::words(4));
        graph.readback_buffer(&total.current);
    }) => StaleRead, ["`total.current`", "`previous`"];

    stale_kept_attachment: draw(plain(F::Rgba8Unorm), plain(F::R32Uint), Load::Keep)
        => StaleRead, ["pass `draw`", "`my_color`", "`Load::Clear`"];

    read_before_its_writer: planned(|graph| {
        let mut a = graph.buffer("a", BufferDesc::words(4));
        graph.readback_buffer(&a);
        graph.clear_buffer(&mut a);
    }) => StaleRead, ["`clear a` writes it later: record that first"];
}

#[test]
fn a_shared_binding_an_entry_point_leaves_alone_is_ignored() {
    // `unused` is declared by the module and not used by `work`: binding it for reading is no dependency.
    let mut graph = Graph::new("work");
    let parts = Parts::default();
    let items = graph.import_buffer("items", parts.items, None);
    let image = graph.import_texture("image", parts.image.clone(), None);
    let never_written = graph.texture("never written", parts.image);
    let mut store = graph.texture("store", parts.store);
    let mut result = graph.buffer("result", BufferDesc::words(4));
    graph
        .compute(&parts.work)
        .params(&PARAMS)
        .read("items", &items)
        .read("image", &image)
        .read("unused", &never_written)
        .write("store", &mut store)
        .write("result", &mut result)
        .dispatch([1, 1, 1]);
    assert_eq!(graph.declaration().unwrap().passes[0].accesses.len(), 4);
}

/// `name: expression => Variant, words of the message`, for shaders.
macro_rules! shader_refusals {
    ($($name:ident: $result:expr => $variant:ident, [$($word:expr),* $(,)?];)*) => {
        $(#[test]
        fn $name() {
            let error: ShaderError = $result.map(|_| ()).expect_err(stringify!($name));
            let message = error.to_string();
            assert!(matches!(error, ShaderError::$variant { .. }), "not {}: {message}", stringify!($variant));
            $(assert!(message.contains($word), "`{}` is not in: {message}", $word);)*
        })*
    };
}

fn shader(body: &str) -> Result<ComputeShader, ShaderError> {
    let sources = WgslSources::new().with(&[
        ("a.wgsl", &format!("#import \"b.wgsl\"\n\n{body}")),
        ("b.wgsl", "// one\nfn helper() -> f32 { return 1.0; }\n"),
        ("broken.wgsl", "#import \"c.wgsl\"\n@compute @workgroup_size(1) fn broken() {}"),
        ("c.wgsl", "fn fine() {}\nfn wrong() -> u32 { return 1.0; }"),
    ]);
    ComputeShader::new(&sources, if body.is_empty() { "broken.wgsl" } else { "a.wgsl" })
}

shader_refusals! {
    shader_file: ComputeShader::new(&sources(), "passes/wrk.wgsl") => UnknownFile, ["`passes/wrk.wgsl`", "`passes/work.wgsl`"];
    shader_import: WgslSources::new().with(&[("a.wgsl", "\n#import \"b.wgsl\"")]).flatten("a.wgsl") => UnknownImport, ["a.wgsl:2", "b.wgsl"];
    shader_directive: WgslSources::new().with(&[("a.wgsl", "#include <b>")]).flatten("a.wgsl") => Directive, ["a.wgsl:1", "#include <b>"];
    shader_syntax: shader("fn a( {") => Parse, ["a.wgsl:3"];
    shader_types: shader("fn x() -> u32 { return helper(); }\n@compute @workgroup_size(1) fn a() {}") => Validation, ["a.wgsl:3"];
    shader_types_in_an_import: shader("") => Parse, ["c.wgsl:2"];
    shader_entry: shader("@compute @workgroup_size(1) fn b() {}") => EntryPoint, ["a.wgsl", "compute entry point `a`", "`b`"];
    shader_stage: RasterShader::from_wgsl("a", "@compute @workgroup_size(1) fn a_vertex() {}") => EntryPoint, ["vertex entry point `a_vertex`"];
    shader_constant: shader("override n: u32 = 1;\n@compute @workgroup_size(n) fn a() {}").unwrap().with_constant("m", 2.0) => Constant, ["`m`", "`n`"];
    shader_constant_value: shader("override n: u32 = 1;\n@compute @workgroup_size(n) fn a() {}").unwrap().with_constant("n", -1.0) => Constant, ["`n` = -1"];
    shader_constant_nan: shader("override n: f32 = 1;\n@compute @workgroup_size(1) fn a() { _ = n; }").unwrap().with_constant("n", f64::NAN) => Constant, ["finite"];
    shader_slot: shader("@group(0) @binding(0) var<storage> x: array<u32>;\n@group(0) @binding(0) var<storage> y: array<u32>;\n@compute @workgroup_size(1) fn a() { _ = x[0] + y[0]; }")
        => Validation, ["a.wgsl"];
    shader_slot_across_stages: RasterShader::from_wgsl("a", "@group(0) @binding(0) var<storage> x: array<f32>;
        @group(0) @binding(0) var<storage> y: array<f32>;
        struct Output { @location(0) color: vec4f }
        @vertex fn a_vertex() -> @builtin(position) vec4f { return vec4f(x[0]); }
        @fragment fn a_fragment() -> Output { return Output(vec4f(y[0])); }") => SameSlot, ["a:2", "`y`", "`x`", "@group(0) @binding(0)"];
    shader_unsupported: shader("@group(0) @binding(0) var s: sampler_comparison; @group(0) @binding(1) var t: texture_depth_2d;
        @compute @workgroup_size(1) fn a() { _ = textureSampleCompareLevel(t, s, vec2f(0.0), 0.0); }") => Unsupported, ["a.wgsl:3", "`s`", "comparison sampler"];
    shader_output: RasterShader::from_wgsl("a", "@vertex fn a_vertex() -> @builtin(position) vec4f { return vec4f(0.0); }
        @fragment fn a_fragment() -> @location(0) vec4f { return vec4f(0.0); }") => FragmentOutput, ["`a_fragment`", "struct"];
}
