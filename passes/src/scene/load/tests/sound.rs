//! What sound files become.

use super::{CORNERS, Document, floats};
use crate::scene::{Alpha, Light, Scene, TextureUse, Wrap};
use glam::{Vec2, Vec3};
use std::path::PathBuf;

#[test]
fn json_glb_and_external_buffer_are_the_same() {
    let document = Document::default();
    let from_json = document.load().unwrap();
    let from_glb = Scene::from_slice(&document.glb(), "test.glb").unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("the corners.bin"), &document.bytes).unwrap();
    let external = Document { uri: Some("the%20corners.bin".into()), ..Document::default() };
    let path = folder.path().join("roof.gltf");
    std::fs::write(&path, external.json()).unwrap();
    let from_file = Scene::load(&path).unwrap();
    assert_eq!(from_json.triangles.len(), 1);
    assert_eq!(from_json.triangles, from_glb.triangles);
    assert_eq!(from_json.triangles, from_file.triangles);
    assert_eq!(from_file.name, "roof");
    assert_eq!(from_json.triangles[0].normals_world, [Vec3::Z; 3], "missing normals are flat");
}

#[test]
fn nodes_compose_their_transforms() {
    let document = Document {
        nodes: concat!(
            r#"{"children":[1],"translation":[10,0,0],"scale":[2,2,2]},"#,
            r#"{"mesh":0,"rotation":[0,0,0.70710678,0.70710678]}"#
        )
        .into(),
        ..Document::default()
    };
    let scene = document.load().unwrap();
    // Turned by 90° about z, doubled, moved.
    let expected = [Vec3::new(10.0, 0.0, 0.0), Vec3::new(10.0, 2.0, 0.0), Vec3::new(8.0, 0.0, 0.0)];
    for (found, expected) in scene.triangles[0].positions_world.iter().zip(expected) {
        assert!(found.abs_diff_eq(expected, 1e-5), "{found} ≠ {expected}");
    }
}

#[test]
fn instances_multiply_and_mirrored_ones_keep_their_front() {
    let document = Document {
        nodes: r#"{"mesh":0},{"mesh":0,"matrix":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,5,1]}"#.into(),
        scene_nodes: "0,1".into(),
        ..Document::default()
    };
    let scene = document.load().unwrap();
    assert_eq!(scene.triangles.len(), 2);
    for triangle in &scene.triangles {
        assert!(triangle.normal_world().abs_diff_eq(Vec3::Z, 1e-6), "front towards +z");
    }
}

#[test]
fn quantized_and_sparse_positions_are_read() {
    let mut bytes: Vec<u8> = vec![];
    // Three corners as normalised bytes, 4 apart, then one sparse replacement.
    bytes.extend([0, 0, 0, 9, 127, 0, 0, 9, 0, 127, 0, 9]);
    bytes.extend([2, 0, 0, 0]);
    bytes.extend([0_u8, 127, 127, 0]);
    let document = Document {
        bytes,
        views: concat!(
            r#"{"buffer":0,"byteLength":12,"byteStride":4},"#,
            r#"{"buffer":0,"byteOffset":12,"byteLength":1},{"buffer":0,"byteOffset":16,"byteLength":3}"#
        )
        .into(),
        accessors: concat!(
            r#"{"bufferView":0,"componentType":5120,"normalized":true,"count":3,"type":"VEC3","#,
            r#""sparse":{"count":1,"indices":{"bufferView":1,"componentType":5121},"values":{"bufferView":2}}}"#
        )
        .into(),
        primitives: r#"{"attributes":{"POSITION":0}}"#.into(),
        more: r#","extensionsRequired":["KHR_mesh_quantization"],"extensionsUsed":["KHR_mesh_quantization"]"#.into(),
        ..Document::default()
    };
    let scene = document.load().unwrap();
    assert_eq!(scene.triangles[0].positions_world, [Vec3::ZERO, Vec3::X, Vec3::new(0.0, 1.0, 1.0)]);
}

#[test]
fn cameras_and_lights_come_with_their_units() {
    let document = Document {
        nodes: concat!(
            r#"{"mesh":0},{"camera":1,"translation":[0,0,3],"scale":[5,5,5]},{"camera":0,"name":"side"},"#,
            r#"{"translation":[1,2,3],"extensions":{"KHR_lights_punctual":{"light":0}}},"#,
            r#"{"rotation":[-0.70710678,0,0,0.70710678],"extensions":{"KHR_lights_punctual":{"light":1}}},"#,
            r#"{"extensions":{"KHR_lights_punctual":{"light":2}}}"#
        )
        .into(),
        scene_nodes: "0,1,2,3,4,5".into(),
        more: concat!(
            r#","cameras":[{"type":"perspective","perspective":{"yfov":0.5,"znear":0.1}},"#,
            r#"{"name":"main","type":"perspective","perspective":{"yfov":0.7,"znear":0.1}}],"#,
            r#""extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","color":[1,0.5,0],"intensity":4},"#,
            r#"{"name":"sun","type":"directional","intensity":3,"extras":{"photon_weight":2.5}},{"type":"spot","intensity":2,"spot":{"innerConeAngle":0.2,"outerConeAngle":0.6}}]}},"#,
            r#""extensionsUsed":["KHR_lights_punctual"]"#
        )
        .into(),
        ..Document::default()
    };
    let scene = document.load().unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let names: Vec<&str> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    assert_eq!(names, ["side", "main"], "in the file's order");
    let camera = scene.camera(Some("main")).unwrap();
    assert!((camera.yfov - 0.7).abs() < 1e-6, "yfov is kept");
    assert_eq!(camera.position_world(), Vec3::new(0.0, 0.0, 3.0));
    let Light::Point { position_world, intensity } = scene.lights[0] else { panic!("point first") };
    assert_eq!((position_world, intensity), (Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 2.0, 0.0)));
    let Light::Directional { direction_world, irradiance } = scene.lights[1] else { panic!("sun") };
    assert!(direction_world.abs_diff_eq(Vec3::NEG_Y, 1e-6), "−z turned down: {direction_world}");
    assert_eq!(irradiance, Vec3::splat(3.0));
    assert_eq!(scene.light_names, ["light 0", "sun", "light 2"]);
    assert_eq!(scene.photon_weights, [("sun".to_owned(), 2.5)]);
    let Light::Spot { cos_inner, cos_outer, .. } = scene.lights[2] else { panic!("spot") };
    assert!((cos_inner - 0.2_f32.cos()).abs() < 1e-6 && (cos_outer - 0.6_f32.cos()).abs() < 1e-6, "cones");
}

#[test]
fn materials_come_with_extensions_and_textures() {
    let mut png = Vec::new();
    let image = image::RgbaImage::from_raw(2, 1, vec![255, 0, 0, 255, 0, 255, 0, 0]).unwrap();
    image.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
    let mut bytes = floats(&CORNERS);
    bytes.extend(floats(&[0.0, 0.0, 0.5, 0.0, 0.0, 0.5]));
    let start = bytes.len();
    bytes.extend(&png);
    let document = Document {
        bytes,
        views: format!(
            r#"{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":24}},{{"buffer":0,"byteOffset":{start},"byteLength":{}}}"#,
            png.len()
        ),
        accessors: concat!(
            r#"{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},"#,
            r#"{"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"}"#
        )
        .into(),
        primitives: r#"{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}"#.into(),
        more: concat!(
            // No MIME type: the bytes say what they are.
            r#","images":[{"bufferView":2}],"samplers":[{"wrapS":33071,"wrapT":33648}],"textures":[{"source":0,"sampler":0}],"#,
            r#""materials":[{"name":"glass","doubleSided":true,"alphaMode":"MASK","alphaCutoff":0.25,"emissiveFactor":[1,0.5,0],"#,
            r#""pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1],"metallicFactor":0,"roughnessFactor":0.25,"#,
            r#""baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":{"offset":[0.25,0],"scale":[2,3]}}}},"#,
            r#""normalTexture":{"index":0,"scale":0.5},"#,
            r#""extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":4},"KHR_materials_transmission":{"transmissionFactor":1},"#,
            r#""KHR_materials_ior":{"ior":1.3},"KHR_materials_volume":{"thicknessFactor":0.1,"attenuationDistance":2,"attenuationColor":[0.5,1,1]}}}],"#,
            r#""extensionsRequired":["KHR_materials_volume"]"#
        )
        .into(),
        ..Document::default()
    };
    let scene = document.load().unwrap();
    let material = &scene.materials[0];
    assert_eq!(Vec3::from(material.emissive), Vec3::new(4.0, 2.0, 0.0));
    assert!(material.double_sided, "emits on both sides");
    assert_eq!((material.transmission, material.ior, material.thickness_m), (1.0, 1.3, 0.1));
    assert_eq!(material.alpha, Alpha::Mask(0.25));
    assert!((material.absorption().x - 0.5 * 2.0_f32.ln()).abs() < 1e-6, "σ_a = −ln ½ / 2 m");
    let slot = material.base_color_texture.unwrap();
    assert_eq!(slot.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert_eq!(slot.image_uv(Vec2::new(0.5, 0.5)), Vec2::new(1.25, 1.5));
    let expected = TextureUse::new(0).with_wrap([Wrap::Clamp, Wrap::Mirror]);
    assert_eq!(material.normal_texture, Some((expected, 0.5)));
    assert_eq!(scene.textures.len(), 1, "an image is decoded once");
    assert_eq!(scene.textures[0].rgba8, [255, 0, 0, 255, 0, 255, 0, 0]);
    assert_eq!(scene.triangles[0].uvs[1], Vec2::new(0.5, 0.0));
    assert!(material.lets_rays_pass(&scene.textures), "a texel's alpha is below the cutoff");
}

#[test]
fn a_scene_without_light_or_surface_of_interest_says_so() {
    let document = Document {
        primitives: r#"{"attributes":{"POSITION":0},"indices":1},{"attributes":{"POSITION":0},"mode":0}"#.into(),
        ..Document::default()
    };
    let scene = document.load().unwrap();
    assert_eq!(scene.triangles.len(), 1);
    let warnings = scene.warnings.join("\n");
    assert!(warnings.contains("mesh 0 `Roof`, primitive 1 is made of Points"), "{warnings}");
    assert!(warnings.contains("added a directional light"), "{warnings}");
}

/// The folder of the shared scenes, when it is there.
fn shared(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("LIGHTLOOM_SHARED")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared")), PathBuf::from);
    let path = root.join("scenes").join(name);
    if path.exists() {
        return Some(path);
    }
    println!("SKIPPED: {} is not there; set LIGHTLOOM_SHARED", path.display());
    None
}

#[test]
fn shared_scenes_load_whole() {
    let expected = [
        ("sponza.glb", 262_087, 3, 4),
        ("cornell_area.glb", 0, 0, 2),
        ("cornell_point.glb", 0, 1, 2),
        ("furnace_box.glb", 12, 1, 2),
        ("caustics_point.glb", 0, 1, 2),
        // 178,852 in the file, of which three have no area.
        ("chess_glass.glb", 178_849, 1, 2),
    ];
    for (name, triangles, lights, cameras) in expected {
        let Some(path) = shared(name) else { continue };
        let scene = Scene::load(&path).unwrap();
        assert_eq!(scene.lights.len(), lights, "{name}: lights");
        assert_eq!(scene.cameras.len(), cameras, "{name}: cameras");
        assert!(triangles == 0 || scene.triangles.len() == triangles, "{name}: {}", scene.triangles.len());
        let expected: &[&str] = match name {
            "chess_glass.glb" => &["3 of 178852 triangles have no area or no finite position and were dropped"],
            _ => &[],
        };
        assert_eq!(scene.warnings, expected, "{name}");
    }
}

#[test]
fn the_shared_cornell_lamp_has_its_flux() {
    let Some(path) = shared("cornell_area.glb") else { return };
    let scene = Scene::load(&path).unwrap();
    let list = crate::scene::light_list::LightList::new(&scene, scene.bounding_sphere().1);
    let flux = Vec3::new(72.90, 51.46, 17.15);
    assert!(list.total_power.abs_diff_eq(flux, 0.02), "{} ≠ {flux}", list.total_power);
}
