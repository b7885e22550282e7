//! The tests of `placement.rs` again, under Vulkan's validation layer with synchronisation checks.
//!
//! The layer must be a recent one: that of Vulkan 1.3.239 misses the hazards between aliased resources. The variable
//! `LIGHTLOOM_VALIDATION_LAYERS` names the folder with the layer's library; without it the usual places are searched,
//! Debian's Chromium package among them. What the layer cannot see: it orders aliased buffers, and images of equal
//! descriptions, but not images of different ones.

use std::{
    env,
    path::{Path, PathBuf},
    process::Command,
};

/// Where the layer may be.
const FOLDERS: [&str; 5] =
    ["/usr/lib/chromium", "/opt/google/chrome", "/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/local/lib"];

const LIBRARY: &str = "libVkLayer_khronos_validation.so";

/// What no run may print.
const COMPLAINTS: [&str; 4] = ["Validation Error", "Validation Warning", "VUID-", "SYNC-HAZARD"];

/// The layer's library, or `None` and SKIPPED.
fn layer() -> Option<PathBuf> {
    let chosen = env::var("LIGHTLOOM_VALIDATION_LAYERS").ok().filter(|folder| !folder.is_empty());
    let folders = chosen.iter().map(String::as_str).chain(FOLDERS);
    let found = folders.map(|folder| Path::new(folder).join(LIBRARY)).find(|library| library.is_file());
    if found.is_none() {
        println!("SKIPPED: no {LIBRARY}; name its folder in LIGHTLOOM_VALIDATION_LAYERS");
    }
    found
}

/// Runs tests of this program under the layer; gives what they and the layer print.
fn under(library: &Path, arguments: &[&str]) -> String {
    let folder = env::temp_dir().join(format!("lightloom-validation-{}-{}", std::process::id(), arguments[0].replace(':', "")));
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
    let output = Command::new(env::current_exe().unwrap())
        .args(arguments)
        .args(["--test-threads=1", "--nocapture"])
        .env("VK_LAYER_PATH", &folder)
        .env("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation")
        .env("VK_LAYER_VALIDATE_SYNC", "1")
        .env("VK_LOADER_DEBUG", "layer")
        .output()
        .unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).join("\n");
    assert!(output.status.success(), "{text}");
    text
}

/// Whether the child's Vulkan took the layer; prints SKIPPED otherwise.
fn loaded(text: &str) -> bool {
    let loaded = text.contains("Insert instance layer \"VK_LAYER_KHRONOS_validation\"");
    if !loaded {
        println!("SKIPPED: Vulkan's loader did not take the layer");
    }
    loaded
}

#[test]
fn the_layer_has_nothing_to_say_about_placement() {
    let Some(library) = layer() else { return };
    let text = under(&library, &["placement::"]);
    if !loaded(&text) {
        return;
    }
    for line in text.lines().filter(|line| line.contains("SKIPPED")) {
        println!("{line}");
    }
    let complaint = text.lines().position(|line| COMPLAINTS.iter().any(|complaint| line.contains(complaint)));
    let context = complaint.map(|at| text.lines().skip(at).take(12).collect::<Vec<_>>().join("\n"));
    assert_eq!(context, None, "the first of the layer's complaints");
}

#[test]
fn the_layer_sees_memory_that_was_not_handed_over() {
    // Without this the silence above would prove nothing.
    let Some(library) = layer() else { return };
    let text = under(&library, &["placement::misuse", "--ignored"]);
    if !loaded(&text) || text.contains("SKIPPED") {
        return;
    }
    assert!(text.contains("SYNC-HAZARD-WRITE-AFTER-WRITE"), "{text}");
}
