//! Animations in files: what moves, and what is said of channels that are broken.

use super::broken::refused;
use super::{CORNERS, Document, floats};
use crate::scene::{Light, Scene};
use glam::Vec3;

/// A channel that moves node 0 at 0.5 and 2.5 s. Each part can be replaced.
struct Channel {
    times: Vec<f32>,
    values: Vec<f32>,
    /// `VEC3` or `VEC4`.
    kind: &'static str,
    count: usize,
    path: &'static str,
    interpolation: &'static str,
    target: usize,
}

impl Default for Channel {
    fn default() -> Self {
        Self {
            times: vec![0.5, 2.5],
            values: vec![0.0, 0.0, 0.0, 4.0, 0.0, -2.0],
            kind: "VEC3",
            count: 2,
            path: "translation",
            interpolation: "LINEAR",
            target: 0,
        }
    }
}

impl Channel {
    fn document(&self) -> Document {
        let mut document = Document::default();
        let start = document.bytes.len();
        document.bytes.extend(floats(&self.times));
        document.bytes.extend(floats(&self.values));
        let (times, values) = (4 * self.times.len(), 4 * self.values.len());
        let between = start + times;
        let views = format!(
            r#",{{"buffer":0,"byteOffset":{start},"byteLength":{times}}},{{"buffer":0,"byteOffset":{between},"byteLength":{values}}}"#
        );
        document.views.push_str(&views);
        let accessors = format!(
            r#",{{"bufferView":2,"componentType":5126,"count":{},"type":"SCALAR"}},{{"bufferView":3,"componentType":5126,"count":{},"type":"{}"}}"#,
            self.times.len(),
            self.count,
            self.kind
        );
        document.accessors.push_str(&accessors);
        document.more = format!(
            r#","animations":[{{"name":"Sway","channels":[{{"sampler":0,"target":{{"node":{},"path":"{}"}}}}],"samplers":[{{"input":2,"output":3,"interpolation":"{}"}}]}}]"#,
            self.target, self.path, self.interpolation
        );
        document
    }
}

/// The scene of node 0 with these properties, standing still.
fn still(properties: &str) -> Scene {
    Document { nodes: format!(r#"{{"mesh":0,{properties}}}"#), ..Document::default() }.load().unwrap()
}

#[test]
fn a_pose_is_the_scene_that_stands_so() {
    let mut scene = Channel::default().document().load().unwrap();
    assert_eq!(scene.warnings.len(), 1, "only the light that was added: {:?}", scene.warnings);
    assert_eq!(scene.duration(), Some(2.5));
    assert_eq!(scene.triangles, Document::default().load().unwrap().triangles, "at rest");
    for (time, translation) in [(0.0, "0,0,0"), (1.0, "1,0,-0.5"), (2.5, "4,0,-2"), (9.0, "4,0,-2")] {
        scene.pose(time).unwrap();
        assert_eq!(scene.triangles, still(&format!(r#""translation":[{translation}]"#)).triangles, "at {time} s");
    }
    let stepping =
        Channel { interpolation: "STEP", path: "scale", values: vec![1.0, 2.0, 3.0, -1.0, 1.0, 1.0], ..Channel::default() };
    let mut scene = stepping.document().load().unwrap();
    for (time, scale) in [(2.4, "1,2,3"), (2.5, "-1,1,1")] {
        scene.pose(time).unwrap();
        assert_eq!(scene.triangles, still(&format!(r#""scale":[{scale}]"#)).triangles, "at {time} s, mirrored or not");
    }
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turning =
        Channel { path: "rotation", kind: "VEC4", values: vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half], ..Channel::default() };
    let mut scene = turning.document().load().unwrap();
    scene.pose(1.5).unwrap();
    let eighth = Vec3::new(half, half, 0.0);
    assert!(scene.triangles[0].positions_world[1].abs_diff_eq(eighth, 1e-6), "{:?}", scene.triangles[0]);
}

#[test]
fn cubic_splines_pass_through_their_keys() {
    let values = [[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3], [0.0; 3], [5.0, 0.0, 0.0], [0.0; 3]].concat();
    let spline = Channel { interpolation: "CUBICSPLINE", count: 6, values, ..Channel::default() };
    let mut scene = spline.document().load().unwrap();
    // Without slope at both ends: 3s² − 2s³ between 1 and 5.
    for (time, x) in [(0.5, 1.0), (1.0, 1.625), (1.5, 3.0), (2.5, 5.0)] {
        scene.pose(time).unwrap();
        let found = scene.triangles[0].positions_world[0].x;
        assert!((found - x).abs() < 1e-6, "{found} ≠ {x} at {time} s");
    }
}

#[test]
fn children_lights_and_cameras_go_along() {
    let mut document = Channel::default().document();
    document.nodes = concat!(
        r#"{"children":[1,2],"rotation":[0,0.70710678,0,0.70710678]},"#,
        r#"{"mesh":0,"camera":0,"translation":[0,1,0]},"#,
        r#"{"extensions":{"KHR_lights_punctual":{"light":0}}},{"camera":1,"translation":[7,7,7]}"#
    )
    .into();
    document.scene_nodes = "3,0".into();
    document.more += concat!(
        r#","cameras":[{"type":"perspective","perspective":{"yfov":0.5,"znear":0.1}},"#,
        r#"{"type":"perspective","perspective":{"yfov":0.6,"znear":0.1}}],"#,
        r#""extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","intensity":2,"spot":{"outerConeAngle":0.6}}]}},"#,
        r#""extensionsUsed":["KHR_lights_punctual"]"#
    );
    let mut scene = document.load().unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    scene.pose(2.5).unwrap();
    let Light::Spot { position_world, direction_world, cos_outer, .. } = scene.lights[0] else { panic!("a spot") };
    assert!(position_world.abs_diff_eq(Vec3::new(4.0, 0.0, -2.0), 1e-6), "{position_world}");
    // −z turned by 90° about y.
    assert!(direction_world.abs_diff_eq(Vec3::NEG_X, 1e-6) && (cos_outer - 0.6_f32.cos()).abs() < 1e-6, "{direction_world}");
    assert!(scene.cameras[0].position_world().abs_diff_eq(Vec3::new(4.0, 1.0, -2.0), 1e-6), "{:?}", scene.cameras[0]);
    assert_eq!(scene.cameras[1].position_world(), Vec3::splat(7.0), "the second camera stands still");
    assert!(scene.triangles[0].positions_world[0].abs_diff_eq(Vec3::new(4.0, 1.0, -2.0), 1e-6), "{:?}", scene.triangles);
}

/// The triangle bound to two joints: its first corner to node 1, which stands still, its second to node 2, which moves, its third to
/// both alike. The node of the mesh itself does not count. The second joint's inverse bind matrix moves by −1 along y.
fn skinned(joints: [u8; 12], weights: [f32; 12]) -> Document {
    let mut document = Channel { target: 2, ..Channel::default() }.document();
    document.nodes =
        r#"{"mesh":0,"skin":0,"translation":[9,9,9]},{"children":[2],"translation":[0,0,1]},{"translation":[0,1,0]}"#.into();
    document.scene_nodes = "0,1".into();
    document.primitives = r#"{"attributes":{"POSITION":0,"JOINTS_0":4,"WEIGHTS_0":5},"indices":1}"#.into();
    let start = document.bytes.len();
    document.bytes.extend(joints);
    document.bytes.extend(floats(&weights));
    let still = glam::Mat4::IDENTITY.to_cols_array();
    let below = glam::Mat4::from_translation(Vec3::NEG_Y).to_cols_array();
    document.bytes.extend(floats(&[still, below].concat()));
    let views = [(start, 12), (start + 12, 48), (start + 60, 128)];
    let views = views.map(|(at, length)| format!(r#",{{"buffer":0,"byteOffset":{at},"byteLength":{length}}}"#));
    document.views.push_str(&views.concat());
    document.accessors.push_str(concat!(
        r#",{"bufferView":4,"componentType":5121,"count":3,"type":"VEC4"},"#,
        r#"{"bufferView":5,"componentType":5126,"count":3,"type":"VEC4"},"#,
        r#"{"bufferView":6,"componentType":5126,"count":2,"type":"MAT4"}"#
    ));
    document.more += r#","skins":[{"name":"Arm","joints":[1,2],"inverseBindMatrices":6}]"#;
    document
}

const JOINTS: [u8; 12] = [0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0];
const WEIGHTS: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0];

#[test]
fn skinned_meshes_follow_their_joints() {
    let mut scene = skinned(JOINTS, WEIGHTS).load().unwrap();
    // At rest both joints bring the mesh to z = 1.
    let expected = [Vec3::Z, Vec3::new(1.0, 0.0, 1.0), Vec3::new(0.0, 1.0, 1.0)];
    assert_eq!(scene.triangles[0].positions_world, expected);
    // The track replaces the translation (0, 1, 0) of the second joint by (2, 0, −1).
    scene.pose(1.5).unwrap();
    let expected = [Vec3::Z, Vec3::new(3.0, -1.0, 0.0), Vec3::new(1.0, 0.5, 0.5)];
    for (found, expected) in scene.triangles[0].positions_world.iter().zip(expected) {
        assert!(found.abs_diff_eq(expected, 1e-6), "{found} ≠ {expected}");
    }
    // Without animation the mesh stands where its joints do.
    let mut still = skinned(JOINTS, WEIGHTS);
    still.more = still.more.replace("animations", "extras");
    let still = still.load().unwrap();
    assert!(still.animation.is_none() && still.triangles[0].positions_world[0] == Vec3::Z, "{:?}", still.triangles);
}

#[test]
fn broken_skins_are_named() {
    let mut joints = JOINTS;
    joints[4] = 2;
    refused(&skinned(joints, WEIGHTS), &["node 0", "bound to joint 2", "its skin has 2"]);
    let mut weights = WEIGHTS;
    weights[9] = -0.5;
    refused(&skinned(JOINTS, weights), &["mesh 0 `Roof`, primitive 0, WEIGHTS_0", "vertex 2", "0 and above"]);
    let mut few = skinned(JOINTS, WEIGHTS);
    few.accessors = few.accessors.replace(r#""count":2,"type":"MAT4""#, r#""count":1,"type":"MAT4""#);
    refused(&few, &["skin 0 `Arm`", "2 joints and 1 inverse bind matrices"]);
    let mut outside = skinned(JOINTS, WEIGHTS);
    outside.scene_nodes = "0".into();
    refused(&outside, &["node 0", "joint node 1", "not in the scene"]);
    let mut unbound = skinned(JOINTS, WEIGHTS);
    unbound.primitives = r#"{"attributes":{"POSITION":0},"indices":1}"#.into();
    refused(&unbound, &["node 0", "no JOINTS_0 and WEIGHTS_0"]);
    let mut short = skinned(JOINTS, WEIGHTS);
    short.accessors = short.accessors.replace(r#""componentType":5121,"count":3"#, r#""componentType":5121,"count":2"#);
    refused(&short, &["JOINTS_0", "2 elements, POSITION has 3"]);
    let mut absent = skinned(JOINTS, WEIGHTS);
    absent.nodes = absent.nodes.replace(r#""skin":0"#, r#""skin":3"#);
    refused(&absent, &["nodes[0].skin", "out of bounds"]);
}

#[test]
fn what_no_pose_shows_is_dropped_and_what_one_shows_is_kept() {
    let mut document = Channel { path: "scale", values: vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], ..Channel::default() }.document();
    document.nodes = r#"{"mesh":0,"scale":[0,0,0]}"#.into();
    let mut scene = document.load().unwrap();
    assert_eq!(scene.triangles.len(), 1, "it grows later");
    scene.pose(2.5).unwrap();
    assert_eq!(scene.triangles, still(r#""scale":[1,1,1]"#).triangles);
    // The second corner on the first.
    let mut document = Channel::default().document();
    document.bytes[..36].copy_from_slice(&floats(&[[0.0; 6].as_slice(), &CORNERS[6..]].concat()));
    refused(&document, &["has no triangles"]);
}

#[test]
fn a_dark_animated_light_leaves_the_added_one_alone() {
    let mut document = Channel::default().document();
    document.nodes = r#"{"mesh":0,"extensions":{"KHR_lights_punctual":{"light":0}}}"#.into();
    document.more += r#","extensions":{"KHR_lights_punctual":{"lights":[{"type":"directional","intensity":0}]}},"extensionsUsed":["KHR_lights_punctual"]"#;
    let mut scene = document.load().unwrap();
    let added = scene.lights.clone();
    assert!(scene.default_light, "{:?}", scene.warnings);
    scene.pose(1.0).unwrap();
    assert_eq!(scene.lights, added);
}

#[test]
fn what_is_not_animated_is_said() {
    let weights = Channel { path: "weights", ..Channel::default() };
    let scene = weights.document().load().unwrap();
    assert!(scene.animation.is_none() && scene.warnings[0].contains("animation 0 `Sway`: weights"), "{:?}", scene.warnings);
    let mut twice = Channel::default().document();
    let channel = r#"{"sampler":0,"target":{"node":0,"path":"translation"}}"#;
    twice.more = twice.more.replace(channel, &format!("{channel},{channel}"));
    let scene = twice.load().unwrap();
    let said = "animation 0 `Sway`, channel 1 (translation of node 0): an earlier channel moves it too";
    assert!(scene.warnings[0].starts_with(said), "{:?}", scene.warnings);
    let mut nothing = Channel { target: 1, ..Channel::default() }.document();
    nothing.nodes += ",{}";
    let scene = nothing.load().unwrap();
    assert!(scene.animation.is_none() && scene.warnings[0].contains("move no mesh"), "{:?}", scene.warnings);
}

#[test]
fn broken_channels_are_named() {
    let place = "animation 0 `Sway`, channel 0 (translation of node 0)";
    let with = |times: &[f32], values: &[f32]| {
        let count = values.len() / 3;
        Channel { times: times.to_vec(), values: values.to_vec(), count, ..Channel::default() }.document()
    };
    refused(&with(&[1.0, 0.5], &[0.0; 6]), &[place, "key 1 is at 0.5 s", "at 1 s", "sort the keys"]);
    refused(&with(&[1.0, 1.0], &[0.0; 6]), &[place, "key 1 is at 1 s"]);
    refused(&with(&[f32::NAN, 1.0], &[0.0; 6]), &[place, "key 0 is at NaN s"]);
    refused(&with(&[-1.0, 1.0], &[0.0; 6]), &[place, "key 0 is at -1 s"]);
    refused(&with(&[0.0, f32::INFINITY], &[0.0; 6]), &[place, "key 1 is at inf s"]);
    refused(&with(&[0.0, 1.0], &[0.0, 0.0, 0.0, f32::NAN, 0.0, 0.0]), &[place, "value 1", "not finite"]);
    refused(&with(&[0.0, 1.0], &[0.0; 9]), &[place, "2 keys have 3 values", "1 for each key"]);
    let cubic = Channel { interpolation: "CUBICSPLINE", ..Channel::default() };
    refused(&cubic.document(), &[place, "2 keys have 2 values", "3 for each key"]);
    let long = Channel { count: 7, ..Channel::default() };
    refused(&long.document(), &[place, "output, accessor 3", "7 elements", "24 bytes"]);
    let kind = Channel { kind: "VEC2", count: 3, ..Channel::default() };
    refused(&kind.document(), &[place, "output", "it is Vec2, expected Vec3"]);
    refused(&Channel { target: 9, ..Channel::default() }.document(), &["animation 0 `Sway`, channel 0", "node 9", "has 1"]);
    refused(&Channel { path: "colour", ..Channel::default() }.document(), &["animation 0 `Sway`, channel 0", "path is none of"]);
    refused(&Channel { interpolation: "BEZIER", ..Channel::default() }.document(), &["animations[0].samplers[0]", "invalid"]);
    let mut matrix = Channel::default().document();
    matrix.nodes = r#"{"mesh":0,"matrix":[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}"#.into();
    refused(&matrix, &[place, "has a matrix"]);
    let mut far = Channel { path: "scale", values: vec![1.0; 6], ..Channel::default() }.document();
    far.nodes = r#"{"mesh":0,"name":"moon","translation":[4e8,0,0]}"#.into();
    refused(&far, &["node 0 `moon`", "at rest", "1e8 m"]);
    let replaced = |from: &str, to: &str| {
        let mut document = Channel::default().document();
        document.more = document.more.replace(from, to);
        document
    };
    refused(&replaced(r#""sampler":0"#, r#""sampler":4"#), &["animations[0].channels[0].sampler", "out of bounds"]);
    refused(&replaced(r#""input":2"#, r#""input":44"#), &["animations[0].samplers[0].input", "out of bounds"]);
    refused(&replaced(r#""input":2"#, r#""input":3"#), &[place, "input, accessor 3", "it is Vec3, expected Scalar"]);
}

#[test]
fn every_byte_of_an_animated_glb_may_be_wrong() {
    for whole in [Channel::default().document().glb(), skinned(JOINTS, WEIGHTS).glb()] {
        assert!(Scene::from_slice(&whole, "t.glb").unwrap().animation.is_some(), "it moves");
        for at in 0..whole.len() {
            for flip in [0x01, 0x10, 0x80, 0xff] {
                let mut glb = whole.clone();
                glb[at] ^= flip;
                // Whatever comes out, it comes out, and can be posed or not.
                if let Ok(mut scene) = Scene::from_slice(&glb, "t.glb") {
                    let _ = scene.pose(1.0);
                }
            }
        }
    }
}
