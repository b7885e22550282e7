//! glTF 2.0 and GLB → [`Scene`].
//!
//! The `gltf` crate gives the typed JSON. Whatever it would read by index or unwrap is checked here
//! first, and accessors are read here with bounds, so that a broken file ends in a [`SceneError`].

mod accessor;
mod animations;
mod buffers;
mod container;
mod images;
mod materials;
mod motion;
mod nodes;
mod primitives;
mod skins;

#[cfg(test)]
mod tests;

use super::{Scene, SceneError};
use buffers::Buffers;
use std::path::Path;

/// The document with its bytes: what every reader below needs.
struct Source<'a> {
    /// Name of the file in messages.
    file: &'a str,
    /// Folder that relative URIs start from; none for a scene in memory.
    folder: Option<&'a Path>,
    /// Validated document.
    document: &'a gltf::Document,
    /// Contents of all buffers.
    buffers: &'a Buffers,
}

impl Source<'_> {
    /// An error at a place in this file.
    fn malformed(&self, place: impl Into<String>, problem: impl Into<String>) -> SceneError {
        malformed(self.file, place, problem)
    }
}

/// An error at a place in `file`.
fn malformed(file: &str, place: impl Into<String>, problem: impl Into<String>) -> SceneError {
    SceneError::Malformed { file: file.into(), place: place.into(), problem: problem.into() }
}

/// Loads a file; relative URIs start from its folder.
pub(super) fn file(path: &Path) -> Result<Scene, SceneError> {
    let bytes = std::fs::read(path).map_err(|source| SceneError::Read { file: path.into(), source })?;
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let folder = path.parent().unwrap_or(Path::new(""));
    scene(&bytes, &path.display().to_string(), stem.unwrap_or_default(), Some(folder))
}

/// Loads from memory.
pub(super) fn slice(bytes: &[u8], name: &str) -> Result<Scene, SceneError> {
    scene(bytes, name, name.to_owned(), None)
}

fn scene(bytes: &[u8], file: &str, name: String, folder: Option<&Path>) -> Result<Scene, SceneError> {
    let (document, blob) = container::parse(file, bytes)?;
    let buffers = Buffers::load(file, folder, &document, blob)?;
    let source = Source { file, folder, document: &document, buffers: &buffers };

    let mut scene = Scene { name, ..Scene::default() };
    materials::load(&source, &mut scene)?;
    let tracks = animations::load(&source, &mut scene.warnings)?;
    nodes::load(&source, tracks, &mut scene)?;
    if scene.triangles.is_empty() {
        return Err(SceneError::Empty { scene: scene.name });
    }
    scene.ensure_light();
    Ok(scene)
}

/// Kind, index and, when it has one, name in backticks.
fn label(kind: &str, index: usize, name: Option<&str>) -> String {
    name.map_or_else(|| format!("{kind} {index}"), |name| format!("{kind} {index} `{name}`"))
}
