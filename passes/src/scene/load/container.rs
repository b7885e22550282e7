//! From the bytes of a file to a validated document: GLB chunks, JSON, extensions, indices.

use super::{SceneError, malformed};
use gltf::json::{self, validation::Validate};

/// Extensions that a file may require.
const SUPPORTED: &[&str] = &[
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Parses and validates; returns the document and the GLB's binary chunk.
pub(super) fn parse<'a>(file: &str, bytes: &'a [u8]) -> Result<(gltf::Document, Option<&'a [u8]>), SceneError> {
    let (text, blob) = if bytes.starts_with(b"glTF") { split_glb(file, bytes)? } else { (bytes, None) };
    let root: json::Root = json::deserialize::from_slice(text).map_err(|error| SceneError::Json {
        file: file.into(),
        line: error.line(),
        column: error.column(),
        problem: error.to_string(),
    })?;
    check_extensions(file, &root)?;
    check_positions(file, &root)?;
    check_root(file, &root)?;
    Ok((gltf::Document::from_json_without_validation(root), blob))
}

/// The JSON chunk and the BIN chunk of a GLB; unknown chunks are skipped, as the format asks.
fn split_glb<'a>(file: &str, bytes: &'a [u8]) -> Result<(&'a [u8], Option<&'a [u8]>), SceneError> {
    let broken = |problem: String| SceneError::Container { file: file.into(), problem };
    let word = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(broken(format!("its header ends after {} of 12 bytes", bytes.len())));
    };
    if version != 2 {
        return Err(broken(format!("container version {version} is not 2")));
    }
    let length = length as usize;
    if length > bytes.len() {
        return Err(broken(format!("its header announces {length} bytes, it has {}", bytes.len())));
    }
    let (mut text, mut blob) = (None, None);
    let mut at = 12;
    while at < length {
        let (Some(size), Some(kind)) = (word(at), word(at + 4)) else {
            return Err(broken(format!("a chunk header at byte {at} is cut off")));
        };
        let start = at + 8;
        let Some(chunk) = bytes[..length].get(start..).and_then(|b| b.get(..size as usize)) else {
            return Err(broken(format!(
                "the chunk at byte {at} announces {size} bytes, {} follow",
                length.saturating_sub(start)
            )));
        };
        match &kind.to_le_bytes() {
            b"JSON" if text.is_none() => text = Some(chunk),
            b"BIN\0" if blob.is_none() => blob = Some(chunk),
            _ => {}
        }
        at = start + (size as usize).next_multiple_of(4);
    }
    let text = text.ok_or_else(|| broken("it has no JSON chunk".into()))?;
    Ok((text, blob))
}

fn check_extensions(file: &str, root: &json::Root) -> Result<(), SceneError> {
    let missing: Vec<&str> =
        root.extensions_required.iter().map(String::as_str).filter(|name| !SUPPORTED.contains(name)).collect();
    if missing.is_empty() {
        return Ok(());
    }
    Err(SceneError::UnsupportedExtensions { file: file.into(), extensions: missing.join(", ") })
}

/// The crate's validation indexes accessors by POSITION before it has checked that index.
fn check_positions(file: &str, root: &json::Root) -> Result<(), SceneError> {
    use json::{mesh::Semantic, validation::Checked};
    for (mesh_index, mesh) in root.meshes.iter().enumerate() {
        for (index, primitive) in mesh.primitives.iter().enumerate() {
            let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            if let Some(accessor) = positions.filter(|a| a.value() >= root.accessors.len()) {
                return Err(malformed(
                    file,
                    format!("mesh {mesh_index}, primitive {index}"),
                    format!("POSITION refers to accessor {}, the file has {}", accessor.value(), root.accessors.len()),
                ));
            }
        }
    }
    Ok(())
}

/// The crate's own validation, less what is judged above or not needed: the list of required
/// extensions, and the bounds of POSITION, which are never read.
fn check_root(file: &str, root: &json::Root) -> Result<(), SceneError> {
    let mut errors = Vec::new();
    root.validate(root, json::Path::new, &mut |path, error| {
        let path = path().as_str().to_owned();
        let of_no_account = path.starts_with("extensionsRequired")
            || path.ends_with("[\"POSITION\"].min")
            || path.ends_with("[\"POSITION\"].max");
        if !of_no_account {
            errors.push((path, error));
        }
    });
    let Some((path, error)) = errors.first() else { return Ok(()) };
    let others = match errors.len() - 1 {
        0 => String::new(),
        more => format!(" (and {more} more problems)"),
    };
    let place = if path.is_empty() { "JSON".to_owned() } else { format!("JSON `{path}`") };
    Err(malformed(file, place, format!("{}{others}", error.to_string().to_lowercase())))
}
