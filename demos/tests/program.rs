//! The program from outside: exit statuses, messages and files.
//!
//! Wrong input is told before a device is opened, so these tests need none; those that render say so.

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
fn unknown_names_list_those_there_are() {
    let place = Place::new();
    let line = "render builtin:cornell -o a.exr";
    place.refuses(&format!("{line} --strategy voxels"), 2, &["voxels", "tiled", "hash-grid", "exact", "path"]);
    place.refuses(&format!("{line} --layer shadows"), 2, &["shadows", "indirect", "caustic"]);
    place.refuses(&format!("{line} --camera nowhere"), 2, &["nowhere", "camera"]);
    place.refuses(&format!("{line} --camera 99"), 2, &["99"]);
    place.refuses(&format!("{line} --strategy tiled --set colour=red"), 2, &["colour", "r_max"]);
    place.refuses(&format!("{line} --strategy tiled --set radius=wide"), 2, &["radius", "wide"]);
    place.refuses(&format!("{line} --set radius"), 2, &["K=V"]);
    place.refuses("render builtin:castle -o a.exr", 2, &["castle", "cornell"]);
    place.refuses("graph builtin:cornell --strategy tiled --format svg", 2, &["svg", "dot", "frame"]);
}

#[test]
fn what_this_release_lacks_is_said() {
    let place = Place::new();
    let line = "render builtin:cornell -o a.exr";
    place.refuses(&format!("{line} --filter on"), 2, &["filter", "off"]);
    place.refuses(&format!("{line} --trace ray-query"), 1, &["ray-query", "bvh"]);
    place.refuses(&format!("{line} --trace pipeline"), 1, &["pipeline", "bvh"]);
    place.refuses("graph builtin:cornell --strategy tiled --format html", 2, &["html", "dot"]);
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
    let output = place.run("plan frame.json --json");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let plan: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(plan["frame"], "two");
    assert_eq!(plan["order"], serde_json::json!(["one", "two", "three"]));
    assert_eq!(plan["culled"][0]["pass"], "dead");
    assert_eq!(plan["peak_live_bytes"], 2048);
    for key in ["passes", "resources", "unshared_bytes", "pooled_bytes", "placed_bytes", "plan_us", "cached_plan_us"] {
        assert!(plan.get(key).is_some(), "{key} is missing: {plan}");
    }
    let text = place.run("plan frame.json");
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("three") && text.contains("dead"), "{text}");
}

#[test]
fn render_writes_linear_exr_and_png() {
    if !has_adapter() {
        return;
    }
    let place = Place::new();
    let line = "render builtin:cornell --strategy tiled --size 32x18 --photons 20k --bounces 3";
    for name in ["sub/a.exr", "a.png"] {
        let output = place.run(&format!("{line} -o {name}"));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
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
    let output = place.run(
        "compare builtin:cornell --strategies exact,tiled --reference path --samples 4 --size 24x16 --photons 5k --bounces 2 -o out --json",
    );
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let file = std::fs::read(place.path("out/results.json")).unwrap();
    let results: serde_json::Value = serde_json::from_slice(&file).unwrap();
    assert_eq!(results, serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap());
    assert_eq!(results["size"], serde_json::json!([24, 16]));
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
    let plan = place.run("plan frame.json --json");
    assert!(plan.status.success(), "{}", String::from_utf8_lossy(&plan.stderr));
}

#[test]
fn adapters_lists_strategies() {
    let place = Place::new();
    let output = place.run("adapters");
    let text = String::from_utf8_lossy(&output.stdout);
    if has_adapter() {
        assert!(output.status.success(), "{text}");
        for name in ["exact", "tiled", "hash-grid", "path"] {
            assert!(text.contains(name), "{name} is missing:\n{text}");
        }
    }
}
