//! Every kind of error with its whole text, one row per kind. More forms of each kind are in `tests/suite/refusals.rs`.
//!
//! A kind without a row does not compile: the rows are also the arms of a `match` without a wildcard.

mod frames;
mod runs;

use super::{GraphError, ShaderError};
use lightloom_graph::{ComputeShader, Gpu, GpuError, GpuRequest, RasterShader, WgslSources, adapters};

/// `Kind: error => text`, where no error means that there is no adapter to provoke it on. A text that ends in `…` goes on in
/// the words of wgpu, naga or the system.
macro_rules! texts {
    ($test:ident, $enum:ident: $($kind:ident: $error:expr => $text:expr;)*) => {
        #[test]
        fn $test() {
            let kind = |error: &$enum| match error {
                $($enum::$kind { .. } => stringify!($kind),)*
            };
            let mut wrong = Vec::new();
            $(match &$error {
                None => println!("SKIPPED: {}", stringify!($kind)),
                Some(error) => {
                    let (text, found) = ($text, without_places(&error.to_string()));
                    let same = text.strip_suffix('…').map_or(found == text, |start| found.starts_with(start));
                    if kind(error) != stringify!($kind) || !same {
                        wrong.push(format!("{}, not {}: {found}", kind(error), stringify!($kind)));
                    }
                }
            })*
            assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        }
    };
}

/// Lines of this folder's files as `here`.
fn without_places(text: &str) -> String {
    [frames::FILE, runs::FILE].iter().fold(text.to_owned(), |text, file| {
        let line = format!("{file}:");
        let pieces = text.split(&line).enumerate();
        pieces.fold(String::new(), |text, (at, piece)| match at {
            0 => text + piece,
            _ => text + "here" + piece.trim_start_matches(|c: char| c.is_ascii_digit()),
        })
    })
}

/// The error of what a caller does.
fn by<T, E>(result: Result<T, E>) -> Option<E> {
    result.err()
}

texts! { every_graph_error, GraphError:
    UnknownBinding: by(frames::unknown_binding()) =>
        "pass `one` (here): `wrods` is no binding of one; it has `words`; did you mean `words`?";
    Unbound: by(frames::unbound()) =>
        "pass `one` (here): nothing is bound to `words` (one:1, a storage buffer (read_write)); add `.write(\"words\", \
        &mut …)`";
    BoundTwice: by(frames::bound_twice()) =>
        "pass `one` (here): `words` is bound twice, to `a` and to `b`; remove one";
    Kind: by(frames::kind()) =>
        "pass `one` (here): `words` is a storage buffer (read_write) (one:1) but `my_image` is a texture; bind a \
        buffer, or change the WGSL";
    ReadIsWritten: by(frames::read_is_written()) =>
        "pass `one` (here): `my_words` is declared as read, but the shader writes `words` (one:1); declare \
        `.write(\"words\", &mut …)`";
    WriteIsNotWritten: by(frames::write_is_not_written()) =>
        "pass `one` (here): `my_words` is declared as written, but the shader never writes `words` (one:1); declare \
        `.read(\"words\", &…)`";
    SampleKind: by(frames::sample_kind()) =>
        "pass `one` (here): `image` is texture_2d<f32> (one:1) but `my_image` is r32uint, which samples as u32; \
        declare `image` as texture_2d<u32>";
    NotFilterable: by(frames::not_filterable()) =>
        "pass `one` (here): `image` (one:1) is sampled through a sampler, but `my_image` is rgba32float, which cannot \
        be filtered everywhere; use textureLoad or a 16-bit float format";
    StorageFormat: by(frames::storage_format()) =>
        "pass `one` (here): `image` is texture_storage of r32float (one:1) but `my_image` is r32uint; make the two the \
        same";
    TextureShape: by(frames::texture_shape()) =>
        "pass `one` (here): `image` is 2d (one:1) but `my_image` is r32float 4×4×3; declare a texture_2d_array in \
        WGSL, or bind one layer (`read_at`, `write_at`)";
    ViewFormat: by(frames::view_format()) =>
        "pass `one` (here): `my_image` is rgba8unorm and does not list rgba8unorm-srgb as a view format; add \
        `.view_format(…)` to its description";
    Layout: by(frames::layout()) =>
        "pass `one` (here): `items`: Rust struct `Item` and WGSL struct `Item` (one:2) differ: WGSL has no field \
        `kinds`; did you mean `kind`?; add it, or call the Rust field `pad…`";
    BufferTooSmall: by(frames::buffer_too_small()) =>
        "pass `one` (here): `items` needs at least 8 bytes (one:2) but `my_items` has 4; make the buffer larger";
    WriteConflict: by(frames::write_conflict()) =>
        "pass `both` (here): `a` is bound as `read` and as `write`, and one of them writes; a pass sees a resource it \
        writes through one binding only: write to another resource";
    ForeignHandle: by(frames::foreign_handle()) =>
        "pass `readback yesterday` (here): the handle `yesterday` belongs to another graph; declare the resource in \
        this frame's graph";
    NoSuchPart: by(frames::no_such_part()) =>
        "pass `clear layers` (here): `layers` has no mip 0, layer 6: it has 1 mips and 6 layers, counted from 0; name \
        some of these";
    Indirect: by(frames::indirect()) =>
        "pass `one` (here): the arguments at byte 8 of `arguments` (16 bytes) take 12 bytes from a multiple of 4; move \
        them or make the buffer larger";
    UnknownAttachment: by(frames::unknown_attachment()) =>
        "pass `draw` (here): `colour` is no output of the fragment stage (draw); it has `color`";
    MissingAttachment: by(frames::missing_attachment()) =>
        "pass `draw` (here): the fragment stage writes `color` (draw) and no texture is attached; add \
        `.color(\"color\", &mut …, Load::Clear([0.0; 4]))`";
    Attachment: by(frames::attachment()) =>
        "pass `draw` (here): attachment `color`: `my_color` (r32uint) does not suit: the fragment stage writes another \
        kind of value (f32, u32 or i32); make format and WGSL type agree";
    AttachmentSize: by(frames::attachment_size()) =>
        "pass `draw` (here): attachments `my_color` (rgba8unorm 4×4) and `my_depth` (depth32float 4×5) differ in size \
        or samples; make them the same";
    NoAttachment: by(frames::no_attachment()) =>
        "pass `none` (here): no colour and no depth attachment; add `.color(…)` or `.depth(…)`";
    CopyMismatch: by(frames::copy_mismatch()) =>
        "pass `copy a to b` (here): cannot copy `a` (16 bytes) to `b` (20 bytes); make the descriptions the same";
    Readback: by(frames::readback()) =>
        "pass `readback a` (here): `a` (rgba8unorm 4×4, 4 samples) cannot be read back: it has several samples per \
        texel; resolve it first by a pass that reads them";
    EmptyResource: by(frames::empty_resource()) =>
        "resource `nothing` (here) has size zero; give it at least one element";
    Initial: by(frames::initial()) =>
        "resource `sums` (here): its first contents take 16 bytes and 12 were given; give them all";
    WritesPrevious: by(frames::writes_previous()) =>
        "pass `clear total.previous` (here): writes `total.previous`, the previous frame's contents; write the \
        `current` handle of the pair";
    StaleRead: by(frames::stale_read()) =>
        "pass `readback a` (here): reads `a` (readback), which nothing wrote earlier in the frame, so it would see \
        stale contents; write or clear it first (`clear_buffer`, `Load::Clear`), or keep it between frames as history";
    Cycle: by(frames::cycle()) =>
        "cycle: `first` writes `b` for `second` writes `a` for `first`; each reads what a later one writes: break it \
        with a history resource";
    FrameSyntax: by(frames::file(r#"{"frame": "f",}"#)) =>
        "frame file, line 1, column 15: …";
    DuplicateName: by(frames::file(frames::TWINS)) =>
        "frame `f`: pass `p` appears twice (numbers 0 and 1); rename one";
    UnknownResource: by(frames::file(frames::MISSPELT)) =>
        "frame `f`: pass `p` reads `imagé`, which is not among the resources; did you mean `image`?";
    BadResource: by(frames::file(frames::NO_BYTES)) =>
        "frame `f`: resource `image`: a buffer needs `bytes` (0: unknown)";
    UnknownPass: by(frames::tapped("fil")) =>
        "frame `f` has no pass `fil`; did you mean `fill`?";
    Tap: by(frames::tapped("fill")) =>
        "pass `fill` (here): cannot be tapped: it writes only buffers (`words`); tap a pass that writes a texture";
    ImportMissing: runs::import_missing() =>
        "pass `readback words` (here): imported `words` has no wgpu object, so the frame can be planned but not \
        executed; pass it to `import_…`";
    ImportMismatch: runs::import_mismatch() =>
        "pass `readback words` (here): imported `words`: declared with 16 bytes, but the wgpu buffer has 8; declare it \
        as it is";
    Limit: runs::limit() =>
        "buffer `words` asks for 268435460 where the device's max_buffer_size is 268435456; make it smaller, or ask \
        the adapter for higher limits";
    FormatUsage: runs::format_usage() =>
        "resource `snorm`: rgba8snorm cannot be used as TextureUsages(RENDER_ATTACHMENT) on this device; choose \
        another format";
    RayQuery: runs::ray_query() =>
        "acceleration structure `scene`: the device lacks EXPERIMENTAL_RAY_QUERY; ask for it when the device is opened \
        (`GpuRequest::experimental`), or trace by a hierarchy of your own";
    Closure: runs::closure() =>
        "pass `fails` (here): no such file";
    Gpu: runs::gpu() =>
        "wgpu refused frame `frame`: …";
    // Only a real shortage makes it; `running_out_of_memory_is_an_error` of `tests/suite/execution.rs` asks for 256 GiB.
    OutOfMemory: Some(GraphError::OutOfMemory { during: "recording".to_owned(), bytes: 4096 }) =>
        "the device ran out of memory during recording, with 4096 bytes in the graph's pool; use smaller images or \
        fewer photons";
    DeviceLost: runs::device_lost() =>
        "the device was lost (Destroyed: …";
    Cancelled: runs::cancelled() =>
        "cancelled after 1 of 2 passes";
    Many: by(frames::many()) =>
        "2 mistakes in one frame:\n  - resource `a` (here) has size zero; give it at least one element\n  - resource \
        `b` (here) has size zero; give it at least one element";
}

/// A compute shader `a.wgsl` of this text, with a file beside it.
fn shader(text: &str) -> Result<ComputeShader, ShaderError> {
    let sources = WgslSources::new().with(&[("a.wgsl", text), ("b.wgsl", "fn helper() -> f32 { return 1.0; }")]);
    ComputeShader::new(&sources, "a.wgsl")
}

/// A raster shader `a` whose fragment stage is this.
fn raster(fragment: &str) -> Result<RasterShader, ShaderError> {
    let vertex = "@vertex fn a_vertex() -> @builtin(position) vec4f { return vec4f(x[0]); }";
    RasterShader::from_wgsl("a", &format!("@group(0) @binding(0) var<storage> x: array<f32>;\n{vertex}\n{fragment}"))
}

texts! { every_shader_error, ShaderError:
    UnknownFile: by(ComputeShader::new(&WgslSources::new().with(&[("a.wgsl", "")]), "b.wgsl")) =>
        "no shader file `b.wgsl` in the source set; known files: `a.wgsl`";
    Unreadable: by(WgslSources::from_dir("no/such/folder")) =>
        "cannot read shader file `no/such/folder`: …";
    UnknownImport: by(shader("\n#import \"c.wgsl\"")) =>
        "a.wgsl:2: `#import \"c.wgsl\"` names no file of the source set; write the path from the set's root, such as \
        \"shared/rng.wgsl\"";
    Directive: by(shader("#include <b>")) =>
        "a.wgsl:1: cannot read `#include <b>`; the only directive is `#import \"path.wgsl\"`";
    Parse: by(shader("\nfn a( {")) =>
        "a.wgsl:2: …";
    Validation: by(shader("#import \"b.wgsl\"\nfn x() -> u32 { return helper(); }\n@compute @workgroup_size(1) fn a() {}")) =>
        "a.wgsl:2: …";
    EntryPoint: by(shader("@compute @workgroup_size(1) fn b() {}")) =>
        "a.wgsl: no compute entry point `a`; entry points here: `b`. An entry point carries the file's stem";
    Constant: by(shader("override n: u32 = 1; @compute @workgroup_size(n) fn a() {}").unwrap().with_constant("m", 2.0)) =>
        "a.wgsl: override `m` = 2: no such override; overrides here: `n`";
    Unsupported: by(shader("@group(0) @binding(0) var s: sampler_comparison; @group(0) @binding(1) var t: texture_depth_2d;
        @compute @workgroup_size(1) fn a() { _ = textureSampleCompareLevel(t, s, vec2f(0.0), 0.0); }")) =>
        "a.wgsl:1: binding `s`: a comparison sampler cannot be bound through the graph; use a closure pass";
    SameSlot: by(raster("struct Output { @location(0) color: vec4f }
        @group(0) @binding(0) var<storage> y: array<f32>;
        @fragment fn a_fragment() -> Output { return Output(vec4f(y[0])); }")) =>
        "a:4: `y` and `x` both sit at @group(0) @binding(0); give one another number";
    FragmentOutput: by(raster("@fragment fn a_fragment() -> @location(0) vec4f { return vec4f(0.0); }")) =>
        "a: fragment entry point `a_fragment` must return a struct of `@location` members (each member's name is an \
        attachment), or nothing";
}

/// The error of a request, without the machine's words.
fn request(request: &GpuRequest) -> Option<GpuError> {
    by(Gpu::new(request)).map(|error| match error {
        GpuError::NoMatch { wanted, .. } => GpuError::NoMatch { wanted, known: "those".to_owned() },
        GpuError::Features { .. } => GpuError::Features { adapter: "this one".to_owned(), features: "that".to_owned() },
        other => other,
    })
}

/// Asks a software adapter, if there is one, for what it lacks.
fn lacking() -> Option<GpuError> {
    let required_features = !Gpu::for_tests()?.adapter.features();
    request(&GpuRequest { required_features, prefer_software: true, ..GpuRequest::default() })
}

/// Asks for an adapter that is not among those there are.
fn unknown_adapter() -> Option<GpuError> {
    adapters().first()?;
    request(&GpuRequest { adapter: Some("Voodoo 5".to_owned()), ..GpuRequest::default() })
}

texts! { every_gpu_error, GpuError:
    // Needs a machine without an adapter.
    NoAdapter: Some(GpuError::NoAdapter) =>
        "no GPU adapter found: install a Vulkan, Metal or Direct3D 12 driver; on Debian or Ubuntu, `apt-get install \
        mesa-vulkan-drivers` gives a software one";
    NoMatch: unknown_adapter() =>
        "no adapter matches `Voodoo 5`; there are: those";
    Features: lacking() =>
        "adapter `this one` lacks that; choose another by LIGHTLOOM_ADAPTER";
    // Needs an adapter with less than WebGPU's limits.
    Device: Some(GpuError::Device { adapter: "this one".to_owned(), message: "no".to_owned() }) =>
        "adapter `this one` gives no device: no";
}
