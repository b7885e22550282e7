//! Tests of this program again, under Vulkan's validation layer with synchronisation checks.
//!
//! The layer must be a recent one: that of Vulkan 1.3.239 misses the hazards between aliased resources. The variable
//! `LIGHTLOOM_VALIDATION_LAYERS` names the folder with the layer's library; without it the usual places are searched,
//! Debian's Chromium package among them.

#![allow(clippy::unwrap_used, reason = "a helper of a test fails like the test")]

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
pub(crate) fn layer() -> Option<PathBuf> {
    let chosen = env::var("LIGHTLOOM_VALIDATION_LAYERS").ok().filter(|folder| !folder.is_empty());
    let folders = chosen.iter().map(String::as_str).chain(FOLDERS);
    let found = folders.map(|folder| Path::new(folder).join(LIBRARY)).find(|library| library.is_file());
    if found.is_none() {
        println!("SKIPPED: no {LIBRARY}; name its folder in LIGHTLOOM_VALIDATION_LAYERS");
    }
    found
}

/// Runs tests of this program under the layer, which has the settings `envs` besides; gives what they and the layer print, or
/// `None` and SKIPPED where Vulkan did not take the layer.
pub(crate) fn under(library: &Path, arguments: &[&str], envs: &[(&str, &str)]) -> Option<String> {
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
        .envs(envs.iter().copied())
        .output()
        .unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).join("\n");
    assert!(output.status.success(), "{text}");
    if !text.contains("Insert instance layer \"VK_LAYER_KHRONOS_validation\"") {
        println!("SKIPPED: Vulkan's loader did not take the layer");
        return None;
    }
    Some(text)
}

/// The first of the layer's complaints, but those that hold one of `excused`.
pub(crate) fn complaint<'a>(text: &'a str, excused: &[&str]) -> Option<&'a str> {
    // An empty line ends a complaint.
    let holds = |part: &str, words: &[&str]| words.iter().any(|word| part.contains(word));
    text.split("\n\n").find(|part| holds(part, &COMPLAINTS) && !holds(part, excused))
}
