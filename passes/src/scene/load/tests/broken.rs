//! What is said of broken files: each message must name the place. None of them may panic.

use super::{CORNERS, Document, floats};
use crate::scene::{Scene, SceneError};

/// Loads and returns the message, which must contain every one of `parts`.
pub(super) fn refused(document: &Document, parts: &[&str]) -> SceneError {
    let error = document.load().expect_err("the file is broken");
    contains(&error, parts);
    error
}

fn contains(error: &SceneError, parts: &[&str]) {
    let message = error.to_string();
    for part in parts {
        assert!(message.contains(part), "`{message}` should say `{part}`");
    }
}

fn with(change: impl FnOnce(&mut Document)) -> Document {
    let mut document = Document::default();
    change(&mut document);
    document
}

#[test]
fn a_missing_file() {
    let error = Scene::load("no/such/scene.glb".as_ref()).unwrap_err();
    contains(&error, &["cannot read `no/such/scene.glb`"]);
}

#[test]
fn truncated_glbs_at_every_length() {
    let whole = Document::default().glb();
    assert!(Scene::from_slice(&whole, "t.glb").is_ok(), "the whole file loads");
    for length in 0..whole.len() {
        assert!(Scene::from_slice(&whole[..length], "t.glb").is_err(), "cut to {length} bytes");
    }
    let error = Scene::from_slice(&whole[..whole.len() - 4], "t.glb").unwrap_err();
    contains(&error, &["`t.glb` is not a complete GLB", "announces"]);
}

#[test]
fn glb_chunks_that_overrun() {
    let mut glb = Document::default().glb();
    glb[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    contains(&Scene::from_slice(&glb, "t.glb").unwrap_err(), &["chunk at byte 12 announces 4294967295"]);
    let mut glb = Document::default().glb();
    glb[8..12].copy_from_slice(&3_u32.to_le_bytes());
    contains(&Scene::from_slice(&glb, "t.glb").unwrap_err(), &["no JSON chunk"]);
    glb[4] = 1;
    contains(&Scene::from_slice(&glb, "t.glb").unwrap_err(), &["version 1 is not 2"]);
}

#[test]
fn every_byte_of_a_glb_may_be_wrong() {
    let whole = Document::default().glb();
    for at in 0..whole.len() {
        for flip in [0x01, 0x10, 0x80, 0xff] {
            let mut glb = whole.clone();
            glb[at] ^= flip;
            // Whatever comes out, it comes out.
            let _ = Scene::from_slice(&glb, "t.glb");
        }
    }
}

#[test]
fn bad_json_names_line_and_column() {
    let error = Scene::from_slice(b"{\n \"asset\": }", "t.gltf").unwrap_err();
    contains(&error, &["`t.gltf`, JSON line 2, column 11"]);
    assert!(Scene::from_slice(b"", "t.gltf").is_err(), "empty file");
    assert!(Scene::from_slice(&vec![b'['; 100_000], "t.gltf").is_err(), "deep nesting");
}

#[test]
fn unsupported_extensions_are_named() {
    let document = with(|d| {
        d.more = r#","extensionsRequired":["KHR_draco_mesh_compression","KHR_lights_punctual","X"]"#.into();
    });
    refused(&document, &["requires glTF extensions", "KHR_draco_mesh_compression, X"]);
}

#[test]
fn indices_into_the_document() {
    let position = r#"{"attributes":{"POSITION":9}}"#;
    refused(&with(|d| d.primitives = position.into()), &["mesh 0, primitive 0", "accessor 9"]);
    let none = r#"{"attributes":{}}"#;
    refused(&with(|d| d.primitives = none.into()), &["meshes[0].primitives[0]", "missing"]);
    let material = r#"{"attributes":{"POSITION":0},"material":4}"#;
    refused(&with(|d| d.primitives = material.into()), &["primitives[0].material", "out of bounds"]);
    refused(&with(|d| d.scene_nodes = "7".into()), &["scenes[0].nodes[0]", "out of bounds"]);
    let light = r#"{"mesh":0,"extensions":{"KHR_lights_punctual":{"light":3}}}"#;
    refused(&with(|d| d.nodes = light.into()), &["nodes[0]", "out of bounds"]);
}

#[test]
fn accessors_that_overrun() {
    let long = Document::default().accessors.replacen("\"count\":3", "\"count\":4", 1);
    refused(&with(|d| d.accessors = long), &["mesh 0 `Roof`, primitive 0, POSITION, accessor 0", "4 elements", "36 bytes"]);
    let huge = Document::default().accessors.replacen("\"count\":3", "\"count\":18446744073709551615", 1);
    refused(&with(|d| d.accessors = huge), &["accessor 0"]);
    let view = r#"{"buffer":0,"byteOffset":40,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}"#;
    refused(&with(|d| d.views = view.into()), &["buffer view 0 covers 36 bytes from 40"]);
    let kind = Document::default().accessors.replacen("VEC3", "VEC2", 1);
    refused(&with(|d| d.accessors = kind), &["accessor 0", "it is Vec2, expected Vec3"]);
    let signed = Document::default().accessors.replacen("5123", "5122", 1);
    refused(&with(|d| d.accessors = signed), &["indices, accessor 1", "expected unsigned scalars"]);
    let zeros = r#"{"componentType":5126,"count":99999999999,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":0}}}"#;
    refused(
        &with(|d| {
            d.accessors = zeros.into();
            d.primitives = r#"{"attributes":{"POSITION":0}}"#.into();
        }),
        &["without data"],
    );
}

#[test]
fn vertex_indices_out_of_range() {
    let document = with(|d| d.bytes[38] = 200);
    refused(&document, &["mesh 0 `Roof`, primitive 0, indices", "index 1 is 200, but there are 3 vertices"]);
}

#[test]
fn attributes_of_different_length() {
    let document = with(|d| {
        d.accessors.push_str(r#",{"bufferView":0,"componentType":5126,"count":2,"type":"VEC3"}"#);
        d.primitives = r#"{"attributes":{"POSITION":0,"NORMAL":2}}"#.into();
    });
    refused(&document, &["NORMAL", "2 elements, POSITION has 3"]);
}

#[test]
fn positions_that_are_not_numbers() {
    let mut corners = CORNERS;
    corners[4] = f32::NAN;
    let document = with(|d| {
        d.bytes = floats(&corners);
        d.bytes.extend([0, 0, 1, 0, 2, 0, 0, 0]);
    });
    refused(&document, &["mesh 0 `Roof`, primitive 0, POSITION, accessor 0", "vertex 1", "not a finite point"]);
}

#[test]
fn missing_and_short_buffers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.gltf");
    let document = with(|d| d.uri = Some("gone.bin".into()));
    std::fs::write(&path, document.json()).unwrap();
    contains(&Scene::load(&path).unwrap_err(), &["buffer 0: cannot read", "gone.bin"]);
    refused(&document, &["buffer 0", "a scene in memory has no folder"]);
    refused(&with(|d| d.uri = Some("https://x/y.bin".into())), &["buffer 0", "not a file beside the scene"]);
    refused(&with(|d| d.uri = Some("data:;base64,!!".into())), &["buffer 0", "data URI is broken"]);
    refused(&with(|d| d.uri = Some("data:;base64,AAAA".into())), &["buffer 0", "should have 44 bytes, it has 3"]);
}

#[test]
fn images_that_do_not_decode() {
    let using = |images: &str| {
        with(|d| {
            d.more = format!(
                r#","images":[{images}],"textures":[{{"source":0}}],"materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}]"#
            );
        })
    };
    let noise = using(r#"{"name":"brick","bufferView":0,"mimeType":"image/png"}"#);
    refused(&noise, &["image 0 `brick`", "does not decode"]);
    refused(&using("{}"), &["image 0", "neither a buffer view nor a URI"]);
    refused(&using(r#"{"uri":"data:image/png;base64,iVBORw0KGgo="}"#), &["image 0", "does not decode"]);
    refused(&using(r#"{"bufferView":77}"#), &["images[0].bufferView", "out of bounds"]);
}

#[test]
fn cyclic_and_shared_nodes() {
    let cycle = with(|d| d.nodes = r#"{"mesh":0,"children":[1]},{"children":[0],"name":"loop"}"#.into());
    refused(&cycle, &["node 0", "reached twice"]);
    let own = with(|d| d.nodes = r#"{"name":"self","children":[0]}"#.into());
    refused(&own, &["node 0 `self`", "reached twice"]);
    // 60 nodes that each name the next one twice would be 2^60 instances.
    let nodes: Vec<String> = (1..60).map(|i| format!(r#"{{"children":[{i},{i}]}}"#)).chain(["{}".into()]).collect();
    refused(&with(|d| d.nodes = nodes.join(",")), &["reached twice"]);
}

#[test]
fn a_chain_of_many_nodes_does_not_exhaust_the_stack() {
    let nodes: Vec<String> = (1..20_000).map(|i| format!(r#"{{"children":[{i}]}}"#)).chain([r#"{"mesh":0}"#.into()]).collect();
    let scene = with(|d| d.nodes = nodes.join(",")).load().unwrap();
    assert_eq!(scene.triangles.len(), 1);
}

#[test]
fn transforms_cameras_and_lights_out_of_range() {
    let scale = r#"{"mesh":0,"scale":[1e38,1,1],"children":[1]},{"scale":[1e38,1,1]}"#;
    refused(&with(|d| d.nodes = scale.into()), &["node 1", "not finite"]);
    let camera = |json: &str| {
        with(|d| {
            d.nodes = r#"{"mesh":0,"camera":0}"#.into();
            d.more = format!(r#","cameras":[{json}]"#);
        })
    };
    refused(&camera(r#"{"name":"c","type":"perspective","perspective":{"yfov":0,"znear":1}}"#), &["camera 0 `c`", "yfov is 0"]);
    refused(&camera(r#"{"type":"perspective"}"#), &["cameras[0]", "missing"]);
    let orthographic = r#"{"type":"orthographic","orthographic":{"xmag":1,"ymag":1,"zfar":9,"znear":0}}"#;
    let scene = camera(orthographic).load().unwrap();
    assert!(scene.warnings[0].contains("orthographic"), "{:?}", scene.warnings);
    let light = |json: &str| {
        with(|d| {
            d.nodes = r#"{"mesh":0,"extensions":{"KHR_lights_punctual":{"light":0}}}"#.into();
            d.more = format!(r#","extensions":{{"KHR_lights_punctual":{{"lights":[{json}]}}}}"#);
        })
    };
    refused(&light(r#"{"name":"l","type":"point","intensity":-1}"#), &["light 0 `l`"]);
    refused(&light(r#"{"type":"spot"}"#), &["lights[0].spot", "missing"]);
    refused(&light(r#"{"type":"spot","spot":{"innerConeAngle":1,"outerConeAngle":0.5}}"#), &["light 0", "cone angles"]);
    let weighed = |weight: &str| light(&format!(r#"{{"name":"l","type":"point","extras":{{"photon_weight":{weight}}}}}"#));
    refused(&weighed("17"), &["light 0 `l`", "photon_weight is 17", "0.0625 to 16"]);
    refused(&weighed("\"many\""), &["light 0 `l`", "photon_weight", "number"]);
    refused(&light(r#"{"type":"area"}"#), &["lights[0].type", "invalid"]);
}

#[test]
fn nothing_to_render() {
    let flat = with(|d| {
        d.bytes = floats(&[0.0; 9]);
        d.bytes.extend([0, 0, 1, 0, 2, 0, 0, 0]);
    });
    refused(&flat, &["scene `test.gltf` has no triangles"]);
    refused(&with(|d| d.primitives = r#"{"attributes":{"POSITION":0},"mode":1}"#.into()), &["no triangles"]);
}
