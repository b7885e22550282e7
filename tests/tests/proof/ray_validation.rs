//! Ray-tracing pipelines again, under Vulkan's validation layer with synchronisation checks: what is made below wgpu's interface is
//! checked by nothing else. How the layer is found is told in `graph/tests/suite/validation.rs`.

use lightloom_passes::RayBackend;
use lightloom_tests::Lab;
use std::path::Path;
use std::process::Command;

/// Where the layer may be.
const FOLDERS: [&str; 5] =
    ["/usr/lib/chromium", "/opt/google/chrome", "/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/local/lib"];

const LIBRARY: &str = "libVkLayer_khronos_validation.so";

/// What no run may print.
const COMPLAINTS: [&str; 4] = ["Validation Error", "Validation Warning", "VUID-", "SYNC-HAZARD"];

/// naga 30 gives variables of functions and workgroups the types that it laid out for buffers: every kernel earns this one, those of
/// compute passes too.
const NAGAS: &str = "VUID-StandaloneSpirv-None-10684";

/// Alpha, poses for which the structure is built again, and photons over several bounces.
const TESTS: [&str; 3] = [
    "ray_backends::alpha_lets_the_same_rays_pass",
    "animation::hits_are_those_of_the_scene_that_stands_so",
    "ray_backends::photons_are_the_same",
];

#[test]
fn the_layer_has_nothing_to_say_about_pipelines() {
    if Lab::open_with(RayBackend::Pipeline).is_none() {
        return;
    }
    let chosen = std::env::var("LIGHTLOOM_VALIDATION_LAYERS").ok().filter(|folder| !folder.is_empty());
    let mut folders = chosen.iter().map(String::as_str).chain(FOLDERS).map(|folder| Path::new(folder).join(LIBRARY));
    let Some(library) = folders.find(|library| library.is_file()) else {
        println!("SKIPPED: no {LIBRARY}; name its folder in LIGHTLOOM_VALIDATION_LAYERS");
        return;
    };
    let folder = std::env::temp_dir().join(format!("lightloom-ray-validation-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    // A package may bring the library without the file by which Vulkan's loader finds it.
    let manifest = format!(
        r#"{{"file_format_version": "1.2.0", "layer": {{
            "name": "VK_LAYER_KHRONOS_validation", "type": "GLOBAL", "library_path": {:?}, "api_version": "1.3.0",
            "implementation_version": "1", "description": "Khronos validation"
        }}}}"#,
        library.display().to_string()
    );
    std::fs::write(folder.join("VkLayer_khronos_validation.json"), manifest).unwrap();
    let output = Command::new(std::env::current_exe().unwrap())
        .args(TESTS)
        .args(["--exact", "--test-threads=1", "--nocapture"])
        .env("VK_LAYER_PATH", &folder)
        .env("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation")
        .env("VK_LAYER_VALIDATE_SYNC", "1")
        // Without it the layer looks at copies and builds, and at no buffer that a shader writes.
        .env("VK_LAYER_SYNCVAL_SHADER_ACCESSES_HEURISTIC", "1")
        .env("VK_LOADER_DEBUG", "layer")
        .output()
        .unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).join("\n");
    assert!(output.status.success(), "{text}");
    if !text.contains("Insert instance layer \"VK_LAYER_KHRONOS_validation\"") {
        println!("SKIPPED: Vulkan's loader did not take the layer");
        return;
    }
    // An empty line ends a complaint.
    let complaint = text.split("\n\n").find(|part| COMPLAINTS.iter().any(|word| part.contains(word)) && !part.contains(NAGAS));
    assert_eq!(complaint, None, "the first of the layer's complaints");
}
