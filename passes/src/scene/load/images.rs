//! Decodes the images that materials use, each once.

use super::{SceneError, Source, buffers, label};
use crate::scene::TextureData;
use std::collections::HashMap;

/// Images decoded so far, by their index in the document.
#[derive(Default)]
pub(super) struct Images {
    slots: HashMap<usize, u32>,
    pub(super) textures: Vec<TextureData>,
}

impl Images {
    /// The texture index of image `index`, decoding it at first use.
    pub(super) fn texture(&mut self, source: &Source<'_>, index: usize) -> Result<u32, SceneError> {
        if let Some(&slot) = self.slots.get(&index) {
            return Ok(slot);
        }
        let slot = self.textures.len() as u32;
        self.textures.push(decode(source, index)?);
        self.slots.insert(index, slot);
        Ok(slot)
    }
}

fn decode(source: &Source<'_>, index: usize) -> Result<TextureData, SceneError> {
    let images = &source.document.as_json().images;
    let json = images.get(index).ok_or_else(|| {
        let problem = format!("it does not exist, the file has {}", images.len());
        source.malformed(format!("image {index}"), problem)
    })?;
    let place = label("image", index, json.name.as_deref().or(short(json.uri.as_deref())));
    let owned;
    let bytes = match (json.buffer_view, &json.uri) {
        (Some(view), _) => {
            source.buffers.view(source.document, view.value()).map_err(|problem| source.malformed(&place, problem))?
        }
        (None, Some(uri)) => {
            owned = buffers::read_uri(source.file, source.folder, &place, uri)?;
            &owned
        }
        (None, None) => {
            return Err(source.malformed(place, "it has neither a buffer view nor a URI"));
        }
    };
    let decoded = image::load_from_memory(bytes).map_err(|error| SceneError::Image {
        file: source.file.into(),
        place: place.clone(),
        problem: error.to_string(),
    })?;
    let rgba = decoded.into_rgba8();
    let (width, height) = rgba.dimensions();
    if width == 0 || height == 0 {
        return Err(source.malformed(place, "it has no texels"));
    }
    Ok(TextureData { name: place, width, height, rgba8: rgba.into_raw() })
}

/// A URI that is fit for a message: data URIs are not.
fn short(uri: Option<&str>) -> Option<&str> {
    uri.filter(|uri| !uri.starts_with("data:"))
}
