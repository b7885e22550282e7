//! The node hierarchy, flattened: instances, lights and cameras in world space.

use super::motion::{Motion, Placed};
use super::primitives::{Shape, decode_mesh};
use super::{SceneError, Source, label, skins};
use crate::scene::animation::Tracks;
use crate::scene::budget::is_weight;
use crate::scene::{Camera, Light, Scene, light};
use glam::{Mat4, Vec3};
use gltf::json::extensions::scene::khr_lights_punctual as punctual;
use gltf::json::validation::Checked;
use std::collections::hash_map::Entry;
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

/// Walks the default scene, or the first one, or all root nodes when the file has no scene. `tracks` move nodes, by their index.
pub(super) fn load(source: &Source<'_>, tracks: HashMap<usize, Tracks>, scene: &mut Scene) -> Result<(), SceneError> {
    let nodes: Vec<gltf::Node<'_>> = source.document.nodes().collect();
    let mut visited: Vec<Option<Placed>> = vec![None; nodes.len()];
    let mut meshes: HashMap<usize, Vec<Shape>> = HashMap::new();
    let mut warnings = BTreeSet::new();
    let mut cameras: Vec<(usize, Camera, Option<usize>)> = Vec::new();
    let animated = !tracks.is_empty();
    let mut motion = Motion { tracks, ..Motion::default() };
    // A mesh that follows joints comes when all of them are placed.
    let mut skinned = Vec::new();

    // Depth first with an own stack: a deep chain of nodes must not exhaust that of the thread.
    let mut stack: Vec<(usize, Placed)> = roots(source).into_iter().rev().map(|i| (i, Placed::WORLD)).collect();
    while let Some((index, parent)) = stack.pop() {
        let node = &nodes[index];
        let place = || label("node", index, node.name());
        if visited[index].is_some() {
            let problem = "it is reached twice: the hierarchy has a cycle or a shared child";
            return Err(source.malformed(place(), problem));
        }
        let placed = motion.place(node, parent, place);
        visited[index] = Some(placed);
        let world_from_node = placed.world_from_node;
        if !world_from_node.is_finite() {
            return Err(source.malformed(place(), "its transform is not finite"));
        }
        let json = &source.document.as_json().nodes[index];
        if let Some(mesh) = node.mesh() {
            let decoded = match meshes.entry(mesh.index()) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(new) => new.insert(decode_mesh(source, &mesh, &mut warnings)?),
            };
            match json.skin {
                Some(skin) => skinned.push((place(), mesh.index(), skin.value())),
                None => (decoded.iter())
                    .try_for_each(|shape| motion.instantiate(shape, placed, &mut scene.triangles))
                    .map_err(|problem| source.malformed(place(), problem))?,
            }
        }
        if let Some(camera) = json.camera {
            let camera = camera.value();
            let read = read_camera(source, camera, node.name(), world_from_node, &mut warnings)?;
            cameras.extend(read.map(|read| (camera, read, placed.moving)));
        }
        let extension = json.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        if let Some(extension) = extension {
            let index = extension.light.value();
            if let Some(node) = placed.moving {
                motion.animation.add_light(scene.lights.len(), node);
            }
            scene.lights.push(read_light(source, index, world_from_node)?);
            label_light(source, index, node.name(), scene)?;
        }
        stack.extend(node.children().map(|child| (child.index(), placed)).collect::<Vec<_>>().into_iter().rev());
    }
    for (place, mesh, skin) in skinned {
        let wrong = |problem| source.malformed(place.clone(), problem);
        let joints = skins::read_joints(source, skin)?.into_iter().map(|joint| {
            let placed = visited.get(joint.node).copied().flatten();
            placed.map(|placed| (placed, joint.joint_from_mesh)).ok_or(joint.node)
        });
        let joints = joints.collect::<Result<Vec<_>, _>>();
        let joints = joints.map_err(|node| wrong(format!("joint node {node} of its skin is not in the scene")))?;
        for shape in &meshes[&mesh] {
            motion.instantiate_skinned(shape, &joints, &place, &mut scene.triangles).map_err(wrong)?;
        }
    }
    // "The first camera" is the file's first, whichever node comes first.
    cameras.sort_by_key(|&(index, ..)| index);
    for (_, camera, moving) in cameras {
        if let Some(node) = moving {
            motion.animation.add_camera(scene.cameras.len(), node);
        }
        scene.cameras.push(camera);
    }
    scene.warnings.extend(warnings);
    let left_out = motion.left_out;
    if left_out > 0 {
        let all = scene.triangles.len() + left_out;
        scene.warnings.push(format!("{left_out} of {all} triangles have no area or no finite position and were dropped"));
    }
    if !motion.animation.is_idle() {
        scene.animation = Some(Arc::new(motion.animation));
    } else if animated {
        scene.warnings.push("its animations move no mesh, light or camera".into());
    }
    Ok(())
}

fn roots(source: &Source<'_>) -> Vec<usize> {
    let document = source.document;
    if let Some(scene) = document.default_scene().or_else(|| document.scenes().next()) {
        return scene.nodes().map(|node| node.index()).collect();
    }
    let children: BTreeSet<usize> =
        document.nodes().flat_map(|node| node.children().map(|child| child.index()).collect::<Vec<_>>()).collect();
    (0..document.nodes().len()).filter(|index| !children.contains(index)).collect()
}

/// Perspective cameras; orthographic ones are skipped with a warning.
fn read_camera(
    source: &Source<'_>,
    index: usize,
    node_name: Option<&str>,
    world_from_node: Mat4,
    warnings: &mut BTreeSet<String>,
) -> Result<Option<Camera>, SceneError> {
    let json = &source.document.as_json().cameras[index];
    let place = label("camera", index, json.name.as_deref());
    let Some(perspective) = &json.perspective else {
        warnings.insert(format!("{place} is orthographic and was skipped"));
        return Ok(None);
    };
    let yfov = perspective.yfov;
    if !(yfov > 0.0 && yfov < std::f32::consts::PI) {
        return Err(source.malformed(place, format!("yfov is {yfov}, it must lie in (0, π)")));
    }
    let name = json.name.as_deref().or(node_name);
    let name = name.map_or_else(|| format!("camera {index}"), str::to_owned);
    Ok(Some(Camera::from_node(&name, world_from_node, yfov)))
}

/// Notes the name of the light just added, its own or its node's, and the `photon_weight` of its extras.
fn label_light(source: &Source<'_>, index: usize, node_name: Option<&str>, scene: &mut Scene) -> Result<(), SceneError> {
    let extensions = source.document.as_json().extensions.as_ref();
    let json = extensions.and_then(|e| e.khr_lights_punctual.as_ref()).and_then(|e| e.lights.get(index));
    let name = json.and_then(|json| json.name.as_deref()).or(node_name);
    let name = name.map_or_else(|| format!("light {}", scene.light_names.len()), str::to_owned);
    scene.light_names.push(name.clone());
    let Some(extras) = json.and_then(|json| json.extras.as_ref()) else { return Ok(()) };
    let extras: gltf::json::Value = gltf::json::deserialize::from_str(extras.get()).unwrap_or_default();
    let Some(weight) = extras.get("photon_weight") else { return Ok(()) };
    let place = || label("light", index, json.and_then(|json| json.name.as_deref()));
    match weight.as_f64().map(|weight| weight as f32).filter(|&weight| is_weight(weight)) {
        Some(weight) => {
            scene.put_photon_weight(&name, weight);
            Ok(())
        }
        None => Err(source.malformed(place(), format!("extras.photon_weight is {weight}, give a number from 0.0625 to 16"))),
    }
}

fn read_light(source: &Source<'_>, index: usize, world_from_node: Mat4) -> Result<Light, SceneError> {
    let extensions = source.document.as_json().extensions.as_ref();
    let lights = extensions.and_then(|e| e.khr_lights_punctual.as_ref()).map(|e| &e.lights);
    let Some(json) = lights.and_then(|lights| lights.get(index)) else {
        return Err(source.malformed(format!("light {index}"), "it does not exist"));
    };
    let place = label("light", index, json.name.as_deref());
    let strength = Vec3::from(json.color) * json.intensity;
    if !strength.is_finite() || strength.min_element() < 0.0 {
        return Err(source.malformed(place, format!("its colour times intensity is {strength}")));
    }
    let (position_world, direction_world) = (Vec3::ZERO, Vec3::NEG_Z);
    let mut light = match json.type_ {
        Checked::Valid(punctual::Type::Directional) => Light::Directional { direction_world, irradiance: strength },
        Checked::Valid(punctual::Type::Spot) => {
            let spot = json.spot.clone().unwrap_or_default();
            let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
            if !(inner >= 0.0 && outer >= inner && outer <= std::f32::consts::FRAC_PI_2 + 1e-4) {
                let problem = format!("cone angles {inner} and {outer}: 0 ≤ inner ≤ outer ≤ π/2");
                return Err(source.malformed(place, problem));
            }
            let (cos_inner, cos_outer) = light::ordered_cosines(inner.cos(), outer.cos());
            Light::Spot { position_world, direction_world, intensity: strength, cos_inner, cos_outer }
        }
        Checked::Valid(punctual::Type::Point) | Checked::Invalid => Light::Point { position_world, intensity: strength },
    };
    light.move_to(world_from_node);
    Ok(light)
}
