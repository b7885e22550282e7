//! Frame files: reading, refusing, writing, and the frame of a shipped renderer.

use lightloom_graph::{
    BufferDesc, ComputeShader, Declaration, Graph, GraphError, Plan, PlanOptions, Sharing, TextureDesc, plan, to_dot, to_json,
    wgpu::TextureFormat,
};
use std::path::Path;

const SMALL: &str = r#"{
  "frame": "small",
  "resources": [
    {"name": "out", "kind": "texture", "origin": "imported", "format": "rgba8unorm", "size": [4, 4, 1], "mips": 1, "samples": 1, "bytes": 64},
    {"name": "a", "kind": "texture", "origin": "transient", "format": "rgba16float", "size": [4, 4, 1], "bytes": 1000},
    {"name": "b", "kind": "texture", "origin": "transient", "format": "rgba16float", "size": [4, 4, 1]},
    {"name": "old", "kind": "buffer", "origin": "history", "bytes": 16}],
  "passes": [
    {"name": "first", "kind": "compute", "reads": ["old"], "writes": [{"resource": "a"}]},
    {"name": "second", "kind": "raytrace", "reads": ["a"], "writes": [{"resource": "b"}, {"resource": "old", "preserve": true}]},
    {"name": "third", "kind": "raster", "reads": ["b"], "writes": [{"resource": "out"}]}]
}"#;

#[test]
fn bytes_are_authoritative_and_computed_where_missing() {
    let declaration = Declaration::from_frame_json(SMALL).unwrap();
    let plan = plan(&declaration, &PlanOptions::default()).unwrap();
    assert_eq!(plan.memory.unshared_bytes, 1000 + 128);
    assert_eq!(plan.memory.peak_live_bytes, 1128, "both are in use at the second pass");
    assert_eq!(plan.live_bytes, [1000, 1128, 128]);
    assert_eq!(plan.order, [0, 1, 2]);
}

#[test]
fn frames_round_trip() {
    let first = Declaration::from_frame_json(SMALL).unwrap();
    let second = Declaration::from_frame_json(&first.to_frame_json()).unwrap();
    assert_eq!(first, second);
    let third: Declaration = serde_json::from_str(&serde_json::to_string(&first).unwrap()).unwrap();
    assert_eq!(first, third, "serde uses the same form");
}

#[test]
fn a_graph_and_its_frame_file_plan_alike() {
    let shader = ComputeShader::from_wgsl(
        "paint",
        "@group(0) @binding(0) var<storage, read> source: array<u32>;
        @group(0) @binding(1) var image: texture_storage_2d<rgba16float, write>;
        @compute @workgroup_size(1) fn paint() { textureStore(image, vec2u(0u), vec4f(f32(source[0]))); }",
    )
    .unwrap();
    let mut graph = Graph::new("round trip");
    let mut source = graph.buffer("source", BufferDesc::words(4));
    let mut image = graph.texture("image", TextureDesc::new_2d([8, 8], TextureFormat::Rgba16Float));
    let mut kept = graph.texture("image", TextureDesc::new_2d([8, 8], TextureFormat::Rgba16Float));
    let mut history = graph.history_texture("old", TextureDesc::new_2d([8, 8], TextureFormat::Rgba16Float));
    graph.clear_buffer(&mut source);
    graph.compute(&shader).read("source", &source).write("image", &mut image).dispatch([1, 1, 1]);
    graph.compute(&shader).name("dead").read("source", &source).write("image", &mut image).dispatch([1, 1, 1]);
    graph.compute(&shader).read("source", &source).write("image", &mut kept).dispatch([1, 1, 1]);
    graph.copy_texture(&history.previous, &mut history.current);
    graph.closure("by hand").read(&source).side_effect().record(|_| Ok(()));
    graph.keep(&kept);
    let declaration = graph.declaration().unwrap();
    let direct = graph.plan(&PlanOptions::default()).unwrap();
    let read = Declaration::from_frame_json(&declaration.to_frame_json()).unwrap();
    let by_file = plan(&read, &PlanOptions::default()).unwrap();
    assert_eq!(direct.order, by_file.order);
    assert_eq!(direct.culled, by_file.culled);
    assert_eq!(direct.memory, by_file.memory);
    assert_eq!(direct.culled.len(), 2, "both writers of `image`: {:?}", direct.culled);
}

/// Each case: what is replaced in `SMALL`, by what, and the words of the error.
#[test]
fn malformed_frames_name_the_place() {
    let cases: &[(&str, &str, &[&str])] = &[
        ("\"passes\": [", "\"passes\": {", &["line 8", "column", "sequence"]),
        ("\"frame\": \"small\",", "", &["missing field `frame`", "line"]),
        ("\"kind\": \"raster\"", "\"kind\": \"draw\"", &["unknown variant `draw`", "line 11", "`raster`"]),
        ("\"origin\": \"history\"", "\"origin\": \"past\"", &["unknown variant `past`", "line 7"]),
        ("\"preserve\": true", "\"preserv\": true", &["unknown field `preserv`", "line 10"]),
        ("\"size\": [4, 4, 1], \"bytes\": 1000", "\"size\": [4, 4], \"bytes\": 1000", &["line 5", "length 2"]),
        ("\"size\": [4, 4, 1], \"bytes\": 1000", "\"size\": [4, -4, 1]", &["line 5", "-4"]),
        ("\"bytes\": 1000", "\"bytes\": 99999999999999999999999", &["line 5"]),
        ("\"name\": \"b\", ", "\"name\": \"a\", ", &["resource `a` appears twice", "1 and 2"]),
        ("\"name\": \"second\"", "\"name\": \"first\"", &["pass `first` appears twice", "0 and 1"]),
        ("\"reads\": [\"b\"]", "\"reads\": [\"bb\"]", &["pass `third` reads `bb`", "did you mean `b`"]),
        ("{\"resource\": \"out\"}", "{\"resource\": \"outt\"}", &["pass `third` writes `outt`", "did you mean `out`"]),
        ("rgba16float", "rgba16flout", &["resource `a`", "`rgba16flout`", "did you mean `rgba16float`"]),
        ("\"size\": [4, 4, 1], \"bytes\": 1000", "\"size\": [4, 0, 1]", &["resource `a`", "at least 1"]),
        ("\"origin\": \"history\", \"bytes\": 16", "\"origin\": \"history\"", &["resource `old`", "`bytes`"]),
        ("\"format\": \"rgba8unorm\", ", "", &["resource `out`", "`format`"]),
        ("\"reads\": [\"old\"]", "\"reads\": [\"b\"]", &["cycle", "`first`", "`second`", "`a`", "`b`"]),
        ("\"reads\": [\"b\"]", "\"reads\": [\"out\"]", &[]),
        ("{\"resource\": \"b\"}, ", "", &["pass `third`", "`b`", "nothing wrote"]),
        ("{\"resource\": \"a\"}", "{\"resource\": \"a\", \"preserve\": true}", &["pass `first`", "`a`", "nothing wrote"]),
    ];
    for (from, to, words) in cases {
        assert!(SMALL.contains(from), "{from}");
        let text = SMALL.replacen(from, to, 1);
        let result = Declaration::from_frame_json(&text).and_then(|declaration| plan(&declaration, &PlanOptions::default()));
        if words.is_empty() {
            result.unwrap();
            continue;
        }
        let error = result.expect_err(to).to_string();
        for word in *words {
            assert!(error.contains(word), "{to}: `{word}` is not in: {error}");
        }
    }
    for text in ["", "{", "[]", "null", "\u{feff}{}", &SMALL[..400]] {
        let error = Declaration::from_frame_json(text).unwrap_err();
        assert!(matches!(&error, GraphError::FrameSyntax { line, .. } if *line >= 1), "{text:?}: {error}");
    }
    let error = Declaration::from_frame_json(&SMALL.replacen("\"frame\"", "\"version\": 2, \"frame\"", 1)).unwrap_err();
    assert!(error.to_string().contains("version 2"), "{error}");
}

#[test]
fn several_mistakes_come_together() {
    let text = SMALL.replace("[\"b\"]", "[\"x\"]").replace("[\"old\"]", "[\"y\"]");
    let error = Declaration::from_frame_json(&text).unwrap_err();
    assert!(matches!(&error, GraphError::Many(errors) if errors.len() == 2), "{error}");
}

#[test]
fn plans_are_shown_as_dot_and_json_and_serialise() {
    let declaration =
        Declaration::from_frame_json(&SMALL.replace("{\"resource\": \"out\"}", "").replace("\"small\"", "\"a \\\"b\\\"\""))
            .unwrap();
    let plan = plan(&declaration, &PlanOptions::default()).unwrap();
    let dot = to_dot(&declaration, &plan);
    assert!(dot.starts_with("digraph \"a \\\"b\\\"\" {") && dot.ends_with("}\n"), "{dot}");
    assert!(dot.contains("style=dashed") && dot.contains("writes nothing"), "culled passes are dashed: {dot}");
    assert!(dot.contains("r1 -> p1") && dot.contains("p0 -> r1") && dot.contains("object 0 at 0"), "{dot}");
    let json = to_json(&declaration, &plan);
    assert_eq!(json["order"], serde_json::json!(["first", "second"]));
    assert_eq!(json["culled"][0]["pass"], "third");
    assert_eq!(json["unshared_bytes"], 1128);
    let again: Plan = serde_json::from_str(&serde_json::to_string(&plan).unwrap()).unwrap();
    assert_eq!(plan, again);
}

/// The frame of the kajiya renderer at 1920×1080, where the checkout has it.
fn kajiya() -> Option<Declaration> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/frames/kajiya_84.json");
    match std::fs::read_to_string(&path) {
        Ok(text) => Some(Declaration::from_frame_json(&text).unwrap()),
        Err(error) => {
            println!("SKIPPED: {}: {error}", path.display());
            None
        }
    }
}

#[test]
fn a_shipped_renderers_frame_meets_its_numbers() {
    let Some(declaration) = kajiya() else { return };
    let options = PlanOptions::default();
    let plan = plan(&declaration, &options).unwrap();
    let mib = |bytes: u64| (bytes as f64 / f64::from(1 << 20) * 10.0).round() / 10.0;
    let memory = plan.memory;
    let mut times: Vec<u128> = (0..50)
        .map(|_| {
            let started = std::time::Instant::now();
            let again = lightloom_graph::plan(&declaration, &options).unwrap();
            assert_eq!(again, plan, "planning is deterministic");
            started.elapsed().as_micros()
        })
        .collect();
    times.sort_unstable();
    println!("planned in {} µs (median of 50)", times[25]);
    println!(
        "unshared {} MiB, live {}, pooled {}, placed {}; {} passes run, {} culled: {:?}",
        mib(memory.unshared_bytes),
        mib(memory.peak_live_bytes),
        mib(memory.pooled_bytes),
        mib(memory.placed_bytes),
        plan.order.len(),
        plan.culled.len(),
        plan.culled
    );
    assert_eq!(mib(memory.unshared_bytes), 354.2);
    assert_eq!(mib(memory.peak_live_bytes), 134.7);
    assert!(mib(memory.pooled_bytes) <= 224.0, "sharing saves memory: {memory:?}");
    // Ordering wins back what packing loses: the frame fits where in recorded order not even its live bytes would leave room.
    assert!(memory.placed_bytes >= memory.ordered_peak_live_bytes && memory.placed_bytes <= memory.peak_live_bytes, "{memory:?}");
    let off = lightloom_graph::plan(&declaration, &PlanOptions::default().sharing(Sharing::Off)).unwrap();
    assert_eq!(off.memory.allocated_bytes, off.memory.unshared_bytes);
}
