//! Bytes behind the document: embedded, in data URIs, or in files beside it.

use super::{SceneError, label, malformed};
use base64::Engine as _;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Contents of every buffer, in the document's order.
pub(super) struct Buffers(Vec<Vec<u8>>);

impl Buffers {
    /// Reads all buffers; each must be as long as the document says.
    pub(super) fn load(
        file: &str,
        folder: Option<&Path>,
        document: &gltf::Document,
        blob: Option<&[u8]>,
    ) -> Result<Self, SceneError> {
        let mut contents = Vec::new();
        for (index, buffer) in document.as_json().buffers.iter().enumerate() {
            let place = label("buffer", index, buffer.name.as_deref());
            let bytes = match (&buffer.uri, blob) {
                (Some(uri), _) => read_uri(file, folder, &place, uri)?,
                (None, Some(blob)) if index == 0 => blob.to_vec(),
                (None, _) => {
                    return Err(malformed(file, place, "it has neither a URI nor a GLB chunk"));
                }
            };
            let needed = buffer.byte_length.0;
            if (bytes.len() as u64) < needed {
                let problem = format!("it should have {needed} bytes, it has {}", bytes.len());
                return Err(malformed(file, place, problem));
            }
            contents.push(bytes);
        }
        Ok(Self(contents))
    }

    /// The bytes of a buffer view, or what is wrong with it. A missing view is an error too.
    pub(super) fn view(&self, document: &gltf::Document, view: usize) -> Result<&[u8], String> {
        let views = &document.as_json().buffer_views;
        let json = views.get(view).ok_or_else(|| format!("buffer view {view} does not exist, there are {}", views.len()))?;
        let buffer = json.buffer.value();
        let bytes = self.0.get(buffer).ok_or_else(|| format!("buffer {buffer} does not exist"))?;
        let start = json.byte_offset.map_or(0, |offset| offset.0);
        let length = json.byte_length.0;
        start
            .checked_add(length)
            .and_then(|end| bytes.get(usize::try_from(start).ok()?..usize::try_from(end).ok()?))
            .ok_or_else(|| format!("buffer view {view} covers {length} bytes from {start}, buffer {buffer} has {}", bytes.len()))
    }
}

/// The bytes behind a URI.
pub(super) fn read_uri(file: &str, folder: Option<&Path>, place: &str, uri: &str) -> Result<Vec<u8>, SceneError> {
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((_, payload)) = data.split_once(";base64,") else {
            return Err(malformed(file, place, "its data URI is not base64"));
        };
        return base64::engine::general_purpose::STANDARD
            .decode(payload.trim_end())
            .map_err(|error| malformed(file, place, format!("its data URI is broken: {error}")));
    }
    if uri.contains("://") {
        return Err(malformed(file, place, format!("`{uri}` is not a file beside the scene")));
    }
    let Some(folder) = folder else {
        let problem = format!("it refers to `{uri}`, but a scene in memory has no folder");
        return Err(malformed(file, place, problem));
    };
    let resource: PathBuf = folder.join(percent_decoded(uri).as_ref());
    std::fs::read(&resource).map_err(|source| SceneError::Resource { file: file.into(), place: place.into(), resource, source })
}

/// Undoes `%20` and its like; anything else stays.
fn percent_decoded(uri: &str) -> Cow<'_, str> {
    if !uri.contains('%') {
        return uri.into();
    }
    let bytes = uri.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let hex = (bytes[at] == b'%')
            .then(|| bytes.get(at + 1..at + 3))
            .flatten()
            .and_then(|pair| std::str::from_utf8(pair).ok())
            .and_then(|pair| u8::from_str_radix(pair, 16).ok());
        decoded.push(hex.unwrap_or(bytes[at]));
        at += if hex.is_some() { 3 } else { 1 };
    }
    String::from_utf8(decoded).map_or_else(|_| uri.into(), Cow::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percent_codes_are_decoded() {
        assert_eq!(percent_decoded("a%20b.bin"), "a b.bin");
        assert_eq!(percent_decoded("100%.bin"), "100%.bin");
        assert_eq!(percent_decoded("%C3%A9"), "é");
    }
}
