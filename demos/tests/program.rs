//! The program from outside: exit statuses, messages and files.
//!
//! Wrong input is told before a device is opened, so these tests need none; those that render say so.

use lightloom_passes::RayBackend;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

/// A folder to run in, thrown away afterwards.
struct Place(TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn file(&self, name: &str, contents: &[u8]) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, contents).expect("a file in it");
        path
    }

    /// Runs the program here with the words of `line`.
    fn run(&self, line: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_lightloom"))
            .args(line.split_whitespace())
            .current_dir(self.0.path())
            .output()
            .expect("the program to start")
    }

    /// Runs the program, which must succeed.
    #[track_caller]
    fn does(&self, line: &str) -> Output {
        let output = self.run(line);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        output
    }

    /// Runs the program, which must fail with `status`, and say `error: …` with each of `words` in it and no panic.
    #[track_caller]
    fn refuses(&self, line: &str, status: i32, words: &[&str]) {
        let output = self.run(line);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "`{line}` said:\n{stderr}");
        assert!(stderr.contains("error: "), "`{line}` said:\n{stderr}");
        assert!(!stderr.contains("panicked"), "`{line}` said:\n{stderr}");
        assert!(output.stdout.is_empty(), "`{line}` wrote results to stdout");
        for word in words {
            assert!(stderr.contains(word), "`{line}` does not say `{word}`:\n{stderr}");
        }
    }
}

/// Whether an adapter is there; prints SKIPPED otherwise.
fn has_adapter() -> bool {
    lightloom_graph::Gpu::for_tests().is_some()
}

fn example_exr(path: &Path, size: [u32; 2]) {
    let pixels = vec![[0.5; 3]; (size[0] * size[1]) as usize];
    lightloom::write_exr(path, &lightloom::Picture::new(size, pixels)).expect("an EXR");
}

#[test]
fn unknown_commands_and_options_are_wrong_usage() {
    let place = Place::new();
    place.refuses("rendr builtin:cornell", 2, &["rendr", "render"]);
    place.refuses("render builtin:cornell -o a.exr --photon 5", 2, &["--photon"]);
    place.refuses("render -o a.exr", 2, &["SCENE"]);
    place.refuses("render builtin:cornell", 2, &["--output"]);
}

#[test]
fn environments_and_photon_weights_are_checked() {
    let place = Place::new();
    let line = "render builtin:caustics -o a.exr";
    place.refuses(&format!("{line} --light-photons lamp=2"), 2, &["`lamp`", "`light 0`"]);
    place.refuses(&format!("{line} --environment 1,1,1 --light-photons environment=99"), 2, &["99", "0.0625"]);
    place.refuses(&format!("{line} --light-photons lamp"), 2, &["NAME=WEIGHT"]);
    place.refuses(&format!("{line} --environment #12"), 2, &["#rrggbb"]);
    place.refuses(&format!("{line} --environment none.hdr,90"), 1, &["none.hdr", "cannot be read"]);
    place.file("photo.hdr", b"not an image");
    place.refuses(&format!("{line} --environment photo.hdr"), 1, &["photo.hdr", "does not decode"]);
}

#[test]
fn sizes_and_counts_out_of_range_are_wrong_usage() {
    let place = Place::new();
    let line = "render builtin:cornell -o a.exr";
    place.refuses(&format!("{line} --size 0x10"), 2, &["--size", "16384"]);
    place.refuses(&format!("{line} --size 20000x10"), 2, &["--size", "16384"]);
    place.refuses(&format!("{line} --size 10"), 2, &["--size", "WxH"]);
    place.refuses(&format!("{line} --photons 0"), 2, &["--photons", "250k"]);
    place.refuses(&format!("{line} --radius -1"), 2, &["--radius"]);
    place.refuses(&format!("{line} --radius nan"), 2, &["--radius", "metres"]);
    place.refuses(&format!("{line} --bounces 257"), 2, &["--bounces", "256"]);
    place.refuses(&format!("{line} --frames 0"), 2, &["--frames"]);
    place.refuses(&format!("{line} --seed -1"), 2, &["--seed"]);
}

#[test]
fn times_of_what_does_not_move_are_wrong_usage() {
    let place = Place::new();
    place.refuses("render builtin:cornell -o a.exr --time 1", 2, &["`builtin:cornell` has no animation", "--time"]);
    place.refuses("render builtin:cornell -o a.exr --animate 3", 2, &["`builtin:cornell` has no animation", "--animate"]);
    let line = "render builtin:moving -o a.exr";
    for wrong in ["-1", "nan", "inf", "now"] {
        place.refuses(&format!("{line} --time {wrong}"), 2, &["--time", "seconds"]);
    }
    place.refuses(&format!("{line} --animate 0"), 2, &["--animate"]);
    place.refuses(&format!("{line} --animate 2 --fps 0"), 2, &["--fps", "images per second"]);
    place.refuses(&format!("{line} --fps 12"), 2, &["--animate"]);
    place.refuses(&format!("{line} --animate 2 --profile p.json"), 2, &["--profile"]);
    place.refuses(&format!("{line} --animate 2 --layer pass:gbuffer"), 2, &["--animate", "--time"]);
}

#[test]
fn unknown_names_list_those_there_are() {
    let place = Place::new();
    let line = "render builtin:cornell -o a.exr";
    place.refuses(&format!("{line} --strategy voxels"), 2, &["voxels", "tiled", "hash-grid", "exact", "path"]);
    place.refuses(&format!("{line} --strategy tiled+voxels"), 2, &["`voxels`", "tiled", "sorted-grid+screen-space"]);
    place.refuses(&format!("{line} --strategy tiled+exact"), 2, &["tiled+exact", "both", "screen-space"]);
    place.refuses(&format!("{line} --layer shadows"), 2, &["shadows", "indirect", "caustic", "pass:NAME"]);
    place.refuses(&format!("{line} --layer pass:"), 2, &["pass:gbuffer"]);
    place.refuses("compare builtin:cornell -o out --layer pass:gbuffer", 2, &["pass:gbuffer", "lightloom render"]);
    place.refuses("graph builtin:cornell --strategy tiled --layer pass:gbuffer", 2, &["pass:gbuffer", "lightloom render"]);
    place.refuses(&format!("{line} --layer pass:gbuffer --profile p.json"), 2, &["--profile"]);
    place.refuses(&format!("{line} --camera nowhere"), 2, &["nowhere", "camera"]);
    place.refuses(&format!("{line} --camera 99"), 2, &["99"]);
    place.refuses(&format!("{line} --strategy tiled --set colour=red"), 2, &["colour", "r_max"]);
    place.refuses(&format!("{line} --strategy tiled --set radius=wide"), 2, &["radius", "wide"]);
    place.refuses(&format!("{line} --set radius"), 2, &["K=V"]);
    place.refuses("render builtin:castle -o a.exr", 2, &["castle", "cornell"]);
    place.refuses("graph builtin:cornell --strategy tiled --format svg", 2, &["svg", "dot", "html", "trace", "frame"]);
}

#[test]
fn what_this_release_lacks_is_said() {
    let place = Place::new();
    let line = "render builtin:cornell -o a.exr";
    if !RayBackend::Pipeline.is_built() {
        place.refuses(&format!("{line} --trace ray-pipeline"), 1, &["--trace ray-pipeline", "feature `ray-pipeline`", "`bvh`"]);
    }
}

#[test]
fn filter_and_occlusion_are_set_by_name() {
    let place = Place::new();
    let line = "render builtin:cornell -o a.exr --size 16x12 --photons 500 --frames 2";
    place.refuses(&format!("{line} --filter on --set filter.strength=1"), 2, &["strength", "clip", "history"]);
    place.refuses(&format!("{line} --filter on --set filter.iterations=9"), 2, &["iterations", "9", "0 to 8"]);
    place.refuses(&format!("{line} --set filter.clip=1"), 2, &["filter.clip", "--filter on"]);
    place.refuses(&format!("{line} --ambient-occlusion 0"), 2, &["--ambient-occlusion", "metres"]);
    if !has_adapter() {
        return;
    }
    place.does(&format!("{line} --filter on --set filter.iterations=2 --ambient-occlusion 0.2"));
}

#[test]
fn output_names_are_checked_before_the_work() {
    let place = Place::new();
    place.refuses("render builtin:cornell -o a.jpg", 2, &["a.jpg", ".exr", ".png"]);
    place.file("taken", b"");
    place.refuses("render builtin:cornell -o taken/a.exr", 1, &["cannot write", "taken"]);
    place.refuses("compare builtin:cornell --strategies tiled -o taken", 1, &["cannot write", "taken"]);
}

#[test]
fn missing_and_malformed_scenes_are_named() {
    let place = Place::new();
    place.refuses("render no/such.glb -o a.exr", 1, &["no/such.glb"]);
    place.file("text.glb", b"this is no scene");
    place.refuses("render text.glb -o a.exr", 1, &["text.glb"]);
    // A GLB header that promises more bytes than there are.
    place.file("cut.glb", b"glTF\x02\0\0\0\xff\0\0\0\x10\0\0\0JSON{}");
    place.refuses("render cut.glb -o a.exr", 1, &["cut.glb"]);
    place.file("broken.gltf", b"{\"asset\": {\"version\": \"2.0\"}, \"meshes\": [}");
    place.refuses("render broken.gltf -o a.exr", 1, &["broken.gltf", "line 1"]);
    assert!(!place.path("a.exr").exists(), "a failed rendering left a file");
}

#[test]
fn references_that_do_not_fit_are_named() {
    let place = Place::new();
    let line = "compare builtin:cornell --strategies tiled --size 64x36 -o out --reference";
    place.refuses(&format!("{line} none.exr"), 1, &["none.exr"]);
    place.file("text.exr", b"no image");
    place.refuses(&format!("{line} text.exr"), 1, &["text.exr", "EXR"]);
    example_exr(&place.path("small.exr"), [8, 4]);
    place.refuses(&format!("{line} small.exr"), 1, &["small.exr", "8x4", "64x36"]);
}

#[test]
fn frame_descriptions_are_checked() {
    let place = Place::new();
    place.refuses("plan none.json", 1, &["none.json"]);
    place.file("syntax.json", b"{\"frame\": \"f\",\n \"resources\": [}");
    place.refuses("plan syntax.json", 1, &["syntax.json", "line 2"]);
    let unknown = br#"{"frame": "f", "resources": [],
        "passes": [{"name": "p", "kind": "compute", "reads": ["ghost"], "writes": []}]}"#;
    place.file("unknown.json", unknown);
    place.refuses("plan unknown.json", 1, &["unknown.json", "ghost", "`p`"]);
}

#[test]
fn no_adapter_is_an_error_with_a_mend() {
    let output = Command::new(env!("CARGO_BIN_EXE_lightloom"))
        .args(["render", "builtin:cornell", "-o", "a.exr", "--size", "8x8"])
        .current_dir(Place::new().0.path())
        .env("LIGHTLOOM_ADAPTER", "no such adapter")
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("error: ") && stderr.contains("mesa-vulkan-drivers"), "{stderr}");
}

#[test]
fn help_and_version_succeed() {
    let place = Place::new();
    let help = place.run("--help");
    let text = String::from_utf8_lossy(&help.stdout);
    assert!(help.status.success(), "{text}");
    for command in ["render", "compare", "plan", "graph", "adapters"] {
        assert!(text.contains(command), "{command} is missing:\n{text}");
    }
    assert!(!text.contains("view"), "offers what there is not:\n{text}");
    assert!(place.run("--version").status.success(), "--version");
}

#[test]
fn plan_prints_the_agreed_keys() {
    let place = Place::new();
    let frame = br#"{"frame": "two", "resources": [
        {"name": "a", "kind": "buffer", "origin": "transient", "bytes": 1024},
        {"name": "b", "kind": "buffer", "origin": "transient", "bytes": 1024},
        {"name": "c", "kind": "buffer", "origin": "transient", "bytes": 4096},
        {"name": "out", "kind": "buffer", "origin": "imported", "bytes": 64}],
      "passes": [
        {"name": "one", "kind": "compute", "reads": [], "writes": [{"resource": "a", "preserve": false}]},
        {"name": "dead", "kind": "compute", "reads": ["a"], "writes": [{"resource": "c", "preserve": false}]},
        {"name": "two", "kind": "compute", "reads": ["a"], "writes": [{"resource": "b", "preserve": false}]},
        {"name": "three", "kind": "compute", "reads": ["b"], "writes": [{"resource": "out", "preserve": false}]}]}"#;
    place.file("frame.json", frame);
    let output = place.does("plan frame.json --json");
    let plan: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(plan["frame"], "two");
    assert_eq!(plan["order"], serde_json::json!(["one", "two", "three"]));
    assert_eq!(plan["culled"][0]["pass"], "dead");
    assert_eq!(plan["peak_live_bytes"], 2048);
    for key in [
        "passes",
        "resources",
        "unshared_bytes",
        "ordered_peak_live_bytes",
        "pooled_bytes",
        "placed_bytes",
        "allocated_bytes",
        "slots",
        "slot_kinds",
        "plan_us",
        "cached_plan_us",
    ] {
        assert!(plan.get(key).is_some(), "{key} is missing: {plan}");
    }
    let text = place.run("plan frame.json");
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("three") && text.contains("dead"), "{text}");
    assert!(place.run("plan frame.json --html sub/plan.html").status.success(), "--html");
    let page = std::fs::read_to_string(place.path("sub/plan.html")).unwrap();
    stands_alone(&page);
    for text in ["one", "two", "three", "dead", "which nothing reads", "planned and not run"] {
        assert!(page.contains(text), "no {text} in the page");
    }
}

/// A page that reaches outside itself is one that breaks when it is sent.
#[track_caller]
fn stands_alone(page: &str) {
    for outside in ["http:", "https:", "src=", "<link", "@import", "url("] {
        assert!(!page.contains(outside), "the page has `{outside}`");
    }
}

#[test]
fn render_writes_linear_exr_and_png() {
    if !has_adapter() {
        return;
    }
    let place = Place::new();
    let line = "render builtin:cornell --strategy tiled --size 32x18 --photons 20k --bounces 3";
    for name in ["sub/a.exr", "a.png"] {
        place.does(&format!("{line} -o {name}"));
        assert!(place.path(name).exists(), "{name}");
    }
    let picture = lightloom::read_exr(&place.path("sub/a.exr")).unwrap();
    assert_eq!(picture.size(), [32, 18]);
    assert_eq!(picture.nonfinite_pixels(), 0);
    assert!(picture.pixels().iter().any(|p| p[0] > 0.0), "the image is black");
    let same = place.run(&format!("{line} --deterministic -o b.exr"));
    let again = place.run(&format!("{line} --deterministic -o c.exr"));
    assert!(same.status.success() && again.status.success(), "--deterministic");
    assert_eq!(std::fs::read(place.path("b.exr")).unwrap(), std::fs::read(place.path("c.exr")).unwrap());
}

#[test]
fn a_sequence_shows_a_pose_an_image_and_tells_its_cost() {
    if !has_adapter() {
        return;
    }
    let place = Place::new();
    let line = "render builtin:moving --size 24x16 --photons 3k --frames 2 --deterministic";
    place.does(&format!("{line} -o out/m.exr --animate 3 --fps 2 --time 0.5"));
    let image = |name: &str| lightloom::read_exr(&place.path(name)).expect("an image");
    let images = [image("out/m.0000.exr"), image("out/m.0001.exr"), image("out/m.0002.exr")];
    assert!(images[0] != images[1] && images[1] != images[2], "nothing moves");
    let json = std::fs::read_to_string(place.path("out/results.json")).expect("results.json");
    let results: lightloom::Results = serde_json::from_str(&json).expect("the agreed keys");
    assert_eq!(results.settings.time, Some(0.5));
    assert_eq!(results.sequence.len(), 3);
    for (image, time) in results.sequence.iter().zip([0.5_f32, 1.0, 1.5]) {
        assert!((image.time - time).abs() < 1e-6 && place.path("out").join(&image.file).exists(), "{image:?}");
        assert!(["refit", "rebuild"].contains(&image.hierarchy.as_str()), "{image:?}");
        assert!(image.pose_ms > 0.0 && image.hierarchy_ms > 0.0 && image.upload_ms > 0.0, "{image:?}");
    }
    // The same pose by itself, and at rest with a word that there is more.
    place.does(&format!("{line} -o one.exr --time 1"));
    let alone = image("one.exr");
    // Its hierarchy is a new one; where a ray meets two triangles at once, another may count, which few rays do.
    let apart = alone.pixels().iter().zip(images[1].pixels()).filter(|(a, b)| a.map(f32::to_bits) != b.map(f32::to_bits)).count();
    assert!(apart * 100 <= alone.pixels().len(), "{apart} pixels differ");
    let output = place.run(&format!("{line} -o rest.exr"));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && stderr.contains("moves for 4 s") && stderr.contains("--time"), "{stderr}");
}

#[test]
fn rays_are_traced_as_asked_and_it_is_said_how() {
    if !has_adapter() {
        return;
    }
    let place = Place::new();
    let line = "render builtin:cornell --strategy tiled --size 24x16 --photons 5k --bounces 3 --deterministic";
    let rendered = |trace: &str, backends: &[&str]| {
        let output = place.run(&format!("{line} --trace {trace} -o {trace}.exr"));
        let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let said = stdout.lines().find_map(|line| line.strip_prefix("rays")).map(str::trim);
        assert!(said.is_some_and(|said| backends.contains(&said)), "--trace {trace} said:\n{stdout}");
        lightloom::read_exr(&place.path(&format!("{trace}.exr"))).expect("an image")
    };
    let bvh = rendered("bvh", &["bvh"]);
    rendered("auto", &RayBackend::ALL.map(RayBackend::name));
    for backend in [RayBackend::RayQuery, RayBackend::Pipeline].into_iter().filter(|backend| backend.is_built()) {
        let name = backend.name();
        if !lightloom_graph::adapters().iter().all(|adapter| adapter.features.contains(backend.features())) {
            place.refuses(&format!("{line} --trace {name} -o a.exr"), 1, &[&format!("--trace {name}"), "adapter", "`bvh`"]);
            continue;
        }
        let traced = rendered(name, &[name]);
        // The same triangles, so the same photons, unless a ray meets an edge.
        let apart = bvh.pixels().iter().zip(traced.pixels()).filter(|(a, b)| a.map(f32::to_bits) != b.map(f32::to_bits)).count();
        assert!(apart * 20 < bvh.pixels().len(), "{name}: {apart} pixels differ");
        place.does(&format!("compare builtin:cornell --strategies exact --size 24x16 --photons 5k --trace {name} -o out"));
        let results = std::fs::read_to_string(place.path("out/results.json")).expect("the results");
        assert!(results.contains(&format!("\"trace\": \"{name}\"")), "{results}");
    }
}

#[test]
fn photons_leave_and_lie_as_asked_and_it_is_said_how() {
    let place = Place::new();
    for wrong in ["--emission map", "--photon-store 20"] {
        place.refuses(&format!("render builtin:caustics {wrong} -o a.exr"), 2, &["possible values"]);
    }
    place.refuses("render builtin:caustics --first-hit map -o a.exr", 2, &["--first-hit map", "--emission maps"]);
    if !has_adapter() {
        return;
    }
    let line = "compare builtin:caustics --strategies tiled --size 24x16 --photons 5k --bounces 3";
    place.does(&format!("{line} --emission raster-maps --first-hit map --photon-store compact -o out"));
    let results = std::fs::read_to_string(place.path("out/results.json")).expect("the results");
    let results: serde_json::Value = serde_json::from_str(&results).expect("JSON");
    assert_eq!(results["settings"]["emission"], "raster-maps");
    assert_eq!(results["settings"]["first_hit"], "map");
    assert_eq!(results["settings"]["photon_store"], "compact");
    let row = &results["strategies"][0];
    assert!(row["photons"]["capacity"].as_u64() >= row["photons"]["stored"].as_u64(), "{row}");
    assert!(row["passes"].as_array().is_some_and(|passes| passes.iter().any(|pass| pass["name"] == "rsm_view")), "{row}");
}

#[test]
fn layers_add_up() {
    if !has_adapter() {
        return;
    }
    let place = Place::new();
    let layer = |name: &str| {
        let line =
            format!("render builtin:cornell --size 24x16 --photons 10k --bounces 3 --deterministic --layer {name} -o {name}.exr");
        let output = place.run(&line);
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        lightloom::read_exr(&place.path(&format!("{name}.exr"))).unwrap()
    };
    let [all, direct, indirect, caustic] = ["final", "direct", "indirect", "caustic"].map(layer);
    for (i, sum) in all.pixels().iter().enumerate() {
        for (c, sum) in sum.iter().enumerate() {
            let [direct, indirect, caustic] = [&direct, &indirect, &caustic].map(|layer| layer.pixels()[i][c]);
            assert!((sum - direct - indirect).abs() <= 1e-4 * sum.max(1e-3), "pixel {i}: {sum} ≠ {direct} + {indirect}");
            assert!(caustic <= indirect * 1.0001 + 1e-6, "pixel {i}: caustic {caustic} of indirect {indirect}");
        }
    }
    for name in ["albedo", "normal", "depth"] {
        assert!(layer(name).pixels().iter().any(|p| p[0] != 0.0), "{name} is empty");
    }
}

#[test]
fn compare_writes_results_and_report() {
    if !has_adapter() {
        return;
    }
    let place = Place::new();
    let output = place.does(
        "compare builtin:cornell --strategies exact,tiled --reference path --samples 4 --size 24x16 --photons 5k --bounces 2 -o out --json",
    );
    let file = std::fs::read(place.path("out/results.json")).unwrap();
    let results: serde_json::Value = serde_json::from_slice(&file).unwrap();
    assert_eq!(results, serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap());
    assert_eq!(results["size"], serde_json::json!([24, 16]));
    assert!(
        results["trace"].as_str().is_some_and(|trace| RayBackend::ALL.iter().any(|backend| backend.name() == trace)),
        "{results}"
    );
    let rows = results["strategies"].as_array().unwrap();
    assert_eq!(rows.len(), 2);
    // The same photons for both.
    assert_eq!(rows[0]["photons"], rows[1]["photons"]);
    assert_eq!(rows[0]["photons"]["emitted"], 5000);
    for row in rows {
        assert!(row["relmse"].as_f64().is_some_and(|x| x >= 0.0), "{row}");
        assert!(row["bytes"].as_u64().is_some_and(|x| x > 0), "{row}");
    }
    let report = std::fs::read_to_string(place.path("out/report.html")).unwrap();
    assert!(report.contains("tiled") && report.contains("data:image/png;base64,"), "the report is incomplete");
    assert!(!place.path("out/reference.exr.partial").exists(), "a partial file stayed");
}

#[test]
fn graph_speaks_dot_json_and_frame() {
    if !has_adapter() {
        return;
    }
    let place = Place::new();
    let line = "graph builtin:cornell --strategy hash-grid --size 32x18 --photons 5k";
    let dot = place.run(&format!("{line} --format dot"));
    let text = String::from_utf8_lossy(&dot.stdout);
    assert!(dot.status.success() && text.starts_with("digraph"), "{text}{}", String::from_utf8_lossy(&dot.stderr));
    let json = place.run(&format!("{line} --format json"));
    assert!(serde_json::from_slice::<serde_json::Value>(&json.stdout).is_ok(), "no JSON");
    // A frame that `graph` writes is one that `plan` reads.
    assert!(place.run(&format!("{line} --format frame -o frame.json")).status.success(), "--format frame");
    place.does("plan frame.json --json");
    let composed = place
        .does("graph builtin:cornell --strategy tiled+screen-space --set screen-space.denoiser=none --size 32x18 --format json");
    let plan = String::from_utf8_lossy(&composed.stdout);
    assert!(plan.contains("composed_indirect") && plan.contains("tiled_gather"), "{plan}");
    assert!(plan.contains("screen_space_deposit") && !plan.contains("screen_space_guided"), "{plan}");
}

/// Runs the program with an adapter asked for that there is not.
fn without_adapter(place: &Place, line: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightloom"));
    let command = command.args(line.split_whitespace()).current_dir(place.0.path());
    command.env("LIGHTLOOM_ADAPTER", "no such adapter").output().expect("the program to start")
}

#[test]
fn graph_draws_without_an_adapter_and_says_that_there_are_no_times() {
    let place = Place::new();
    let line = "graph builtin:cornell --strategy hash-grid --size 32x18 --photons 5k";
    let html = without_adapter(&place, &format!("{line} --format html -o graph.html"));
    let stderr = String::from_utf8_lossy(&html.stderr);
    assert!(html.status.success() && stderr.contains("no times"), "{stderr}");
    let page = std::fs::read_to_string(place.path("graph.html")).unwrap();
    stands_alone(&page);
    assert!(page.contains("planned and not run"), "the page does not say that there are no times");
    let frame = without_adapter(&place, &format!("{line} --format json"));
    let plan: serde_json::Value = serde_json::from_slice(&frame.stdout).unwrap();
    for pass in plan["order"].as_array().unwrap() {
        let name = pass.as_str().unwrap();
        assert!(page.contains(&format!("aria-label=\"pass {name}, ")), "pass `{name}` is not drawn");
    }
    let queried = without_adapter(&place, &format!("{line} --trace ray-query --format frame"));
    assert!(String::from_utf8_lossy(&queried.stdout).contains("\"ray_query_scene\""), "{queried:?}");
    if RayBackend::Pipeline.is_built() {
        let pipelined = without_adapter(&place, &format!("{line} --trace ray-pipeline --format frame"));
        assert!(String::from_utf8_lossy(&pipelined.stdout).contains("\"closure\""), "{pipelined:?}");
    }
    let trace = without_adapter(&place, &format!("{line} --format trace"));
    assert_eq!(trace.status.code(), Some(1), "a trace of nothing");
}

#[test]
fn graph_measures_pages_and_traces() {
    if !has_adapter() {
        return;
    }
    let place = Place::new();
    let line = "graph builtin:cornell --strategy hash-grid --size 32x18 --photons 5k";
    let html = place.does(&format!("{line} --format html"));
    let page = String::from_utf8(html.stdout).unwrap();
    stands_alone(&page);
    assert!(page.contains("GPU time per pass, ") || page.contains("no clock"), "where times come from");
    assert!(place.run(&format!("{line} --format trace -o trace.json")).status.success(), "--format trace");
    is_trace(&place.path("trace.json"), "hash_grid_gather");
}

/// The file is a Chrome trace in which events are sorted and passes of that name ran.
#[track_caller]
fn is_trace(path: &Path, pass: &str) {
    let trace: serde_json::Value = serde_json::from_slice(&std::fs::read(path).expect("a trace")).expect("JSON");
    let events = trace["traceEvents"].as_array().expect("events");
    let starts: Vec<f64> = events.iter().filter_map(|event| event["ts"].as_f64()).collect();
    assert!(starts.is_sorted() && starts.len() > 10, "{starts:?}");
    let whole: Vec<&serde_json::Value> = events.iter().filter(|event| event["ph"] == "X").collect();
    assert!(whole.iter().all(|event| event["dur"].as_f64().is_some_and(|dur| dur >= 0.0)), "an event without a duration");
    let timed = lightloom_graph::Gpu::for_tests().is_none_or(|gpu| gpu.device.features().contains(TIMED));
    assert!(!timed || whole.iter().any(|event| event["name"] == pass), "no pass `{pass}`");
}

const TIMED: lightloom_graph::wgpu::Features = lightloom_graph::wgpu::Features::TIMESTAMP_QUERY;

#[test]
fn render_profiles_its_frames() {
    if !has_adapter() {
        return;
    }
    let place = Place::new();
    let line = "render builtin:cornell --strategy tiled --size 24x16 --photons 5k --frames 3 -o a.exr --profile sub/p.json";
    place.does(line);
    is_trace(&place.path("sub/p.json"), "tiled_gather");
    let trace: serde_json::Value = serde_json::from_slice(&std::fs::read(place.path("sub/p.json")).unwrap()).unwrap();
    let plans = trace["traceEvents"].as_array().unwrap().iter().filter(|event| event["name"] == "plan").count();
    assert_eq!(plans, 3, "one per frame, and none of the warm-up");
}

#[test]
fn render_shows_what_a_pass_writes() {
    if !has_adapter() {
        return;
    }
    let place = Place::new();
    let line = "render builtin:cornell --strategy tiled --size 24x16 --photons 5k --bounces 3 --deterministic";
    // The sum that `final` shows is what `compose` writes.
    assert!(place.run(&format!("{line} --layer final -o final.exr")).status.success(), "final");
    place.does(&format!("{line} --layer pass:compose -o compose.exr"));
    let [shown, expected] = ["compose.exr", "final.exr"].map(|name| lightloom::read_exr(&place.path(name)).unwrap());
    assert_eq!(shown, expected);
    // What nothing reads in this frame is kept by being asked for.
    let surfaces = place.run(&format!("{line} --layer pass:surface_layers.albedo -o albedo.png"));
    let text = String::from_utf8_lossy(&surfaces.stdout);
    assert!(surfaces.status.success() && text.contains("rgba32float"), "{text}");
    let depth = place.run(&format!("{line} --layer pass:visibility.depth -o depth.png"));
    let text = String::from_utf8_lossy(&depth.stdout);
    assert!(depth.status.success() && text.contains("as black to"), "the range is missing: {text}");
    place.refuses(&format!("{line} --layer pass:gbufer -o a.png"), 2, &["gbufer", "did you mean `gbuffer`?"]);
    place.refuses(&format!("{line} --layer pass:gbuffer -o a.png"), 2, &["several textures", "`position`"]);
    place.refuses(&format!("{line} --layer pass:gbuffer.colour -o a.png"), 2, &["does not write `colour`"]);
    place.refuses(&format!("{line} --layer pass:tiled_count -o a.png"), 2, &["only buffers"]);
}

#[test]
fn the_page_runs_in_a_browser() {
    let found = ["chromium", "chromium-browser", "google-chrome"].into_iter().find(|name| {
        let version = Command::new(name).arg("--version").output();
        version.is_ok_and(|output| output.status.success())
    });
    let Some(browser) = found else {
        println!("SKIPPED: no Chromium");
        return;
    };
    let place = Place::new();
    let page =
        without_adapter(&place, "graph builtin:cornell --strategy tiled --size 32x18 --photons 5k --format html -o graph.html");
    assert!(page.status.success(), "{}", String::from_utf8_lossy(&page.stderr));
    let profile = format!("--user-data-dir={}", place.path("browser").display());
    let address = format!("file://{}#pass=gbuffer", place.path("graph.html").display());
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-sync", "--dump-dom"])
        .args([&profile, &address])
        .output()
        .expect("the browser to start");
    let dom = String::from_utf8_lossy(&output.stdout);
    let ready = dom.split("data-ready=\"").nth(1).and_then(|rest| rest.split('"').next()).and_then(|n| n.parse::<usize>().ok());
    assert!(
        ready.is_some_and(|passes| passes > 10),
        "the script did not come to its end:\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(dom.contains("<h2>gbuffer</h2>"), "the panel does not show the pass of the address");
    assert!(dom.contains("class=\"dag dim\""), "nothing is highlighted");
}

#[test]
fn adapters_lists_strategies() {
    let place = Place::new();
    let output = place.run("adapters");
    let text = String::from_utf8_lossy(&output.stdout);
    if has_adapter() {
        assert!(output.status.success(), "{text}");
        for name in lightloom_strategies::registry().iter().map(|entry| entry.name) {
            assert!(text.contains(&format!("strategy {name}: ")), "{name} is missing:\n{text}");
        }
    }
}
