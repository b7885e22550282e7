//! Small files made by hand: what they must become, and what must be said of broken ones.

mod animated;
mod broken;
mod sound;

use crate::scene::{Scene, SceneError};
use base64::Engine as _;

/// Little-endian bytes of floats.
fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// A right triangle in the plane z = 0, front towards +z.
const CORNERS: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// A glTF document of one mesh over one embedded buffer. Each part can be replaced.
struct Document {
    bytes: Vec<u8>,
    /// Contents of the arrays and objects of that name, JSON.
    views: String,
    accessors: String,
    primitives: String,
    nodes: String,
    scene_nodes: String,
    /// Further members of the root, with a leading comma.
    more: String,
    /// Replaces the URI of the buffer.
    uri: Option<String>,
}

impl Default for Document {
    fn default() -> Self {
        let mut bytes = floats(&CORNERS);
        bytes.extend([0, 0, 1, 0, 2, 0, 0, 0]);
        Self {
            bytes,
            views: r#"{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}"#.into(),
            accessors: concat!(
                r#"{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},"#,
                r#"{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}"#
            )
            .into(),
            primitives: r#"{"attributes":{"POSITION":0},"indices":1}"#.into(),
            nodes: r#"{"mesh":0}"#.into(),
            scene_nodes: "0".into(),
            more: String::new(),
            uri: None,
        }
    }
}

impl Document {
    fn json(&self) -> String {
        let encoded = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
        let uri = self.uri.clone().unwrap_or(format!("data:application/octet-stream;base64,{encoded}"));
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{}],
            "meshes":[{{"name":"Roof","primitives":[{}]}}],"accessors":[{}],"bufferViews":[{}],
            "buffers":[{{"uri":"{uri}","byteLength":{}}}]{}}}"#,
            self.scene_nodes,
            self.nodes,
            self.primitives,
            self.accessors,
            self.views,
            self.bytes.len(),
            self.more
        )
    }

    fn load(&self) -> Result<Scene, SceneError> {
        Scene::from_slice(self.json().as_bytes(), "test.gltf")
    }

    /// The same as GLB.
    fn glb(&self) -> Vec<u8> {
        let encoded = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
        let uri = format!(r#""uri":"data:application/octet-stream;base64,{encoded}","#);
        let mut json = self.json().replace(&uri, "").into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bin = self.bytes.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let mut glb = b"glTF".to_vec();
        let words = |glb: &mut Vec<u8>, values: &[u32]| {
            glb.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        };
        words(&mut glb, &[2, (12 + 8 + json.len() + 8 + bin.len()) as u32]);
        words(&mut glb, &[json.len() as u32, u32::from_le_bytes(*b"JSON")]);
        glb.extend(&json);
        words(&mut glb, &[bin.len() as u32, u32::from_le_bytes(*b"BIN\0")]);
        glb.extend(&bin);
        glb
    }
}
