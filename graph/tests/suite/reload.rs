//! Shaders follow their files, and keep their last good version where they cannot.

use crate::executor;
use lightloom_graph::{
    BufferDesc, ComputeShader, Executor, Graph, GraphError, Load, PlanOptions, RasterShader, Reload, ShaderError, TextureDesc,
    WgslSources,
    wgpu::{Face, TextureFormat},
};
use std::{fs, path::PathBuf};
use tempfile::TempDir;

/// A folder of shaders that a test edits.
struct Folder(TempDir);

impl Folder {
    fn new(files: &[(&str, &str)]) -> Self {
        let folder = Self(TempDir::new().unwrap());
        for (path, text) in files {
            folder.write(path, text);
        }
        folder
    }

    fn path(&self, path: &str) -> PathBuf {
        self.0.path().join(path)
    }

    fn write(&self, path: &str, text: impl AsRef<[u8]>) {
        let path = self.path(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    fn sources(&self) -> WgslSources {
        WgslSources::from_dir(self.0.path()).unwrap()
    }
}

/// `words[i] = value()` for 8 words, where `value` is imported.
const FILL: &str = "#import \"shared/value.wgsl\"
override scale: u32 = 1;
@group(0) @binding(0) var<storage, read_write> words: array<u32>;
@compute @workgroup_size(8) fn fill(@builtin(global_invocation_id) id: vec3u) {
    words[id.x] = scale * value();
}
";

fn value(text: &str) -> String {
    format!("// What is written.\nfn value() -> u32 {{\n    return {text};\n}}\n")
}

fn folder() -> Folder {
    Folder::new(&[("fill.wgsl", FILL), ("shared/value.wgsl", &value("7u"))])
}

fn declare(graph: &mut Graph<'_>, fill: &ComputeShader) -> lightloom_graph::Readback {
    let mut words = graph.buffer("words", BufferDesc::words(8));
    graph.compute(fill).write("words", &mut words).dispatch_1d(8);
    graph.readback_buffer(&words)
}

/// The first word of a frame.
fn frame(executor: &mut Executor, fill: &ComputeShader) -> u32 {
    let mut graph = Graph::new("reload");
    let read = declare(&mut graph, fill);
    executor.execute(graph).unwrap().cast::<u32>(read)[0]
}

fn plan(fill: &ComputeShader) -> Result<(), GraphError> {
    let mut graph = Graph::new("reload");
    declare(&mut graph, fill);
    graph.plan(&PlanOptions::default()).map(|_| ())
}

/// What was refused, in words.
fn refused(reload: Option<Reload>) -> String {
    let reload = reload.expect("the change is seen");
    assert!(!reload.errors.is_empty() && reload.shaders.is_empty(), "{reload:?}");
    reload.to_string()
}

fn taken_up(reload: Option<Reload>) -> String {
    let reload = reload.expect("the change is seen");
    assert_eq!(reload.errors, [], "nothing is wrong");
    reload.to_string()
}

#[test]
fn an_edit_shows_in_the_next_frame() {
    let Some(mut executor) = executor() else { return };
    let folder = folder();
    let sources = folder.sources();
    let fill = ComputeShader::new(&sources, "fill.wgsl").unwrap();
    let (clone, double) = (fill.clone(), fill.clone().with_constant("scale", 2.0).unwrap());
    assert_eq!([&fill, &clone, &double].map(|shader| frame(&mut executor, shader)), [7, 7, 14]);
    assert_eq!(sources.poll(), None, "nothing changed");

    // Through an import, for clones and variants made before.
    folder.write("shared/value.wgsl", value("8u"));
    assert_eq!(taken_up(sources.poll()), "changed: `shared/value.wgsl`; running anew: `fill`");
    assert_eq!([&fill, &clone, &double].map(|shader| frame(&mut executor, shader)), [8, 8, 16]);
    assert_eq!(sources.poll(), None, "a change is reported once");

    // The file itself, with another workgroup size.
    let other = FILL.replace("workgroup_size(8)", "workgroup_size(4)").replace("value()", "value() + 1u");
    folder.write("fill.wgsl", &other);
    assert_eq!(taken_up(sources.poll()), "changed: `fill.wgsl`; running anew: `fill`");
    assert_eq!([&fill, &clone, &double].map(|shader| frame(&mut executor, shader)), [9, 9, 17]);
    assert_eq!(fill.workgroup_size(), [4, 1, 1]);
    assert_eq!(
        frame(&mut executor, &double.clone().with_constant("scale", 3.0).unwrap()),
        25,
        "new variants are of the new text"
    );
    assert_eq!(frame(&mut executor, &ComputeShader::new(&sources, "fill.wgsl").unwrap()), 9, "and so are new shaders");

    folder.write("new.wgsl", "fn nobody_calls() {}");
    assert_eq!(taken_up(sources.poll()), "changed: `new.wgsl`; no shader in use is another for it");
}

#[test]
fn a_mistake_keeps_the_last_good_version_until_it_is_mended() {
    let Some(mut executor) = executor() else { return };
    let folder = folder();
    let sources = folder.sources();
    let fill = ComputeShader::new(&sources, "fill.wgsl").unwrap();
    let double = fill.clone().with_constant("scale", 2.0).unwrap();
    let both = |executor: &mut Executor| [frame(executor, &fill), frame(executor, &double)];
    assert_eq!(both(&mut executor), [7, 14]);

    folder.write("fill.wgsl", FILL.replace("scale * value();", "scale * value()"));
    assert_eq!(
        refused(sources.poll()),
        "changed: `fill.wgsl`, which cannot be used; the last good version runs on until this is mended:\
        \n  - fill.wgsl:6: expected `;`, found \"}\""
    );
    assert_eq!(both(&mut executor), [7, 14]);
    assert_eq!(sources.poll(), None, "a mistake is reported once");
    assert_eq!(frame(&mut executor, &ComputeShader::new(&sources, "fill.wgsl").unwrap()), 7, "new shaders are of the good text");

    // A second mistake, in the import and of another kind: only the type is wrong. The first is still there.
    folder.write("fill.wgsl", FILL);
    folder.write("shared/value.wgsl", value("7i"));
    assert_eq!(
        refused(sources.poll()),
        "changed: `shared/value.wgsl`, which cannot be used; the last good version runs on until this is mended:\
        \n  - shared/value.wgsl:2: Function [0] 'value' is invalid: The `return` expression Some([0]) does not match the declared return type Some([0])"
    );
    assert_eq!(both(&mut executor), [7, 14]);

    folder.write("shared/value.wgsl", value("6u"));
    assert_eq!(taken_up(sources.poll()), "changed: `shared/value.wgsl`; running anew: `fill`");
    assert_eq!(both(&mut executor), [6, 12]);

    // A mistake taken back.
    folder.write("shared/value.wgsl", "");
    assert!(sources.poll().is_some_and(|reload| !reload.errors.is_empty()));
    folder.write("shared/value.wgsl", value("6u"));
    assert_eq!(taken_up(sources.poll()), "the shader files are again those that run");
    assert_eq!(both(&mut executor), [6, 12]);
}

#[test]
fn half_written_files_are_waited_for() {
    let folder = folder();
    let sources = folder.sources();
    let fill = ComputeShader::new(&sources, "fill.wgsl").unwrap();
    let head = |file: &str| {
        format!("changed: `{file}`, which cannot be used; the last good version runs on until this is mended:\n  - ")
    };
    folder.write("fill.wgsl", "");
    assert_eq!(
        refused(sources.poll()),
        head("fill.wgsl")
            + "fill.wgsl: no compute entry point `fill`; entry points here: none. An entry point carries the file's stem"
    );
    folder.write("fill.wgsl", &FILL[..FILL.find("id: vec3u").unwrap()]);
    assert_eq!(refused(sources.poll()), head("fill.wgsl") + "fill.wgsl:4: expected identifier, found \"\"");
    // Cut within a character.
    folder.write("fill.wgsl", &"// ≤".as_bytes()[..4]);
    assert_eq!(
        refused(sources.poll()),
        "the shader files cannot be used; the last good version runs on until this is mended:\
        \n  - cannot read shader file `fill.wgsl`: it is not UTF-8; save it as UTF-8 text"
    );
    assert!(plan(&fill).is_ok(), "the last good version is still there");
    folder.write("fill.wgsl", FILL.replace("scale *", "scale +"));
    assert_eq!(taken_up(sources.poll()), "changed: `fill.wgsl`; running anew: `fill`");
    assert!(fill.latest().wgsl().contains("scale + value()"));
    assert!(fill.wgsl().contains("scale * value()"), "a value's own text stays");
}

#[test]
fn deleted_files_give_way_to_embedded_ones() {
    let embedded = WgslSources::new().with(&[("fill.wgsl", FILL), ("shared/value.wgsl", &value("1u"))]);
    let folder = Folder::new(&[("shared/value.wgsl", &value("2u")), ("own.wgsl", "@compute @workgroup_size(1) fn own() {}")]);
    let sources = embedded.watch(folder.0.path()).unwrap();
    let fill = ComputeShader::new(&sources, "fill.wgsl").unwrap();
    assert!(fill.wgsl().contains("return 2u;"), "the folder's file comes first");
    assert_eq!(sources.paths(), ["fill.wgsl", "own.wgsl", "shared/value.wgsl"]);
    fs::remove_file(folder.path("shared/value.wgsl")).unwrap();
    assert_eq!(taken_up(sources.poll()), "changed: `shared/value.wgsl`; running anew: `fill`");
    assert!(fill.latest().wgsl().contains("return 1u;"));
    assert_eq!(embedded.poll(), None, "the embedded set is not live");

    // A file with nothing below it: its shaders stay as they are.
    let own = ComputeShader::new(&sources, "own.wgsl").unwrap();
    fs::remove_file(folder.path("own.wgsl")).unwrap();
    assert_eq!(
        refused(sources.poll()),
        "changed: `own.wgsl`, which cannot be used; the last good version runs on until this is mended:\
        \n  - no shader file `own.wgsl` in the source set; known files: `fill.wgsl` and `shared/value.wgsl`"
    );
    assert!(own.latest().wgsl().contains("fn own()"));
    // Nor does an import of what is not there pass.
    drop(own);
    folder.write("fill.wgsl", "\n#import \"shared/valeu.wgsl\"");
    assert_eq!(
        refused(sources.poll()),
        "changed: `fill.wgsl` and `own.wgsl`, which cannot be used; the last good version runs on until this is mended:\
        \n  - fill.wgsl:2: `#import \"shared/valeu.wgsl\"` names no file of the source set; write the path from the set's root, \
        such as \"shared/rng.wgsl\""
    );
    fs::remove_dir_all(folder.0.path()).unwrap();
    let error = sources.poll().unwrap().errors.remove(0);
    assert!(matches!(&error, ShaderError::Unreadable { path, .. } if *path == folder.0.path().to_string_lossy()), "{error}");
    assert!(WgslSources::from_dir(folder.0.path()).is_err(), "nor can it be watched from the start");
}

#[test]
fn constants_are_kept_and_a_lost_one_is_named() {
    let folder = folder();
    let sources = folder.sources();
    let general = ComputeShader::new(&sources, "fill.wgsl").unwrap();
    let variant = general.clone().with_constant("scale", 2.0).unwrap().with_constant("scale", 3.0).unwrap();
    folder.write("fill.wgsl", FILL.replace("scale", "factor"));
    assert_eq!(
        refused(sources.poll()),
        "changed: `fill.wgsl`, which cannot be used; the last good version runs on until this is mended:\
        \n  - fill.wgsl: override `scale` = 3: no such override; overrides here: `factor`"
    );
    assert!(general.latest().wgsl().contains("scale"), "the shader without the constant waits for the one with it");
    drop(variant);
    folder.write("fill.wgsl", FILL.replace("scale", "factor") + "// Again.");
    assert_eq!(taken_up(sources.poll()), "changed: `fill.wgsl`; running anew: `fill`", "nobody holds that variant any more");
    assert!(general.with_constant("factor", 2.0).is_ok(), "a variant is made of the new text, whatever it is made from");
}

#[test]
fn all_shaders_follow_or_none_does() {
    let other = "#import \"shared/value.wgsl\"
        @compute @workgroup_size(1) fn other() { let x: u32 = value(); }";
    let folder = folder();
    folder.write("other.wgsl", other);
    let sources = folder.sources();
    let fill = ComputeShader::new(&sources, "fill.wgsl").unwrap();
    let other = ComputeShader::new(&sources, "other.wgsl").unwrap();
    // `fill` could take this, `other` cannot.
    folder.write("fill.wgsl", FILL.replace("value()", "u32(value())"));
    folder.write("shared/value.wgsl", value("7i").replace("u32", "i32"));
    assert_eq!(
        refused(sources.poll()),
        "changed: `fill.wgsl` and `shared/value.wgsl`, which cannot be used; the last good version runs on until this is mended:\
        \n  - other.wgsl:2: the type of `x` is expected to be `u32`, but got `i32`: definition of `x`"
    );
    assert!([fill, other].iter().all(|shader| shader.latest().wgsl().contains("7u")));
}

#[test]
fn a_version_that_no_longer_fits_its_passes_is_an_ordinary_error_and_can_be_rejected() {
    let Some(mut executor) = executor() else { return };
    let folder = folder();
    let sources = folder.sources();
    let fill = ComputeShader::new(&sources, "fill.wgsl").unwrap();
    folder.write("fill.wgsl", FILL.replace("words", "numbers"));
    assert_eq!(sources.reject(), None, "there is nothing to go back to yet");
    taken_up(sources.poll());
    let error = plan(&fill).unwrap_err().to_string();
    assert!(error.contains("`words` is no binding of fill.wgsl; it has `numbers`"), "{error}");
    assert!(error.contains("reload.rs:"), "the Rust line is named: {error}");
    assert_eq!(taken_up(sources.reject()), "changed: `fill.wgsl`; running anew: `fill`");
    assert_eq!(frame(&mut executor, &fill), 7);
    assert_eq!((sources.poll(), sources.reject()), (None, None), "until a file changes");
    folder.write("fill.wgsl", FILL.replace("scale *", "scale +"));
    taken_up(sources.poll());
    assert_eq!(frame(&mut executor, &fill), 8);
}

#[test]
fn raster_shaders_keep_their_state() {
    let Some(mut executor) = executor() else { return };
    let wgsl = "struct Output { @location(0) id: u32 }
        override value: u32 = 1;
        // Counter-clockwise as seen: a front face.
        @vertex fn cover_vertex(@builtin(vertex_index) v: u32) -> @builtin(position) vec4f {
            return vec4f(vec2f(f32(v & 1u), f32(v >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
        }
        @fragment fn cover_fragment() -> Output { return Output(value); }";
    let folder = Folder::new(&[("cover.wgsl", wgsl)]);
    let sources = folder.sources();
    let shader = RasterShader::new(&sources, "cover.wgsl").unwrap();
    let culled = shader.clone().with_cull(Some(Face::Front)).with_constant("value", 5.0).unwrap();
    let five = shader.clone().with_constant("value", 5.0).unwrap().with_cull(Some(Face::Back));
    let mut draw = |shader: &RasterShader| {
        let mut graph = Graph::new("raster");
        let mut id = graph.texture("id", TextureDesc::new_2d([1, 1], TextureFormat::R32Uint));
        graph.raster(shader).color("id", &mut id, Load::Clear([9.0; 4])).draw(3, 1);
        let read = graph.readback_texture(&id);
        executor.execute(graph).unwrap().cast::<u32>(read)[0]
    };
    assert_eq!([&shader, &culled, &five].map(&mut draw), [1, 9, 5]);
    folder.write("cover.wgsl", wgsl.replace("Output(value)", "Output(value + 1u)"));
    taken_up(sources.poll());
    assert_eq!([&shader, &culled, &five].map(&mut draw), [2, 9, 6]);
}
