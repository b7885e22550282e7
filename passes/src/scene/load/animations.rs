//! Animation channels → the tracks of each node.

use super::{SceneError, Source, accessor, label};
use crate::scene::animation::{Interpolation, Track, Tracks, Value};
use glam::{Quat, Vec3};
use gltf::json::animation::{Animation, Channel, Interpolation as Named, Property};
use gltf::json::validation::Checked;
use std::collections::HashMap;

/// What moves each node, by its index. All animations are played together; where two channels move one property the earlier holds.
pub(super) fn load(source: &Source<'_>, warnings: &mut Vec<String>) -> Result<HashMap<usize, Tracks>, SceneError> {
    let mut moving: HashMap<usize, Tracks> = HashMap::new();
    for (index, animation) in source.document.as_json().animations.iter().enumerate() {
        let animation_label = label("animation", index, animation.name.as_deref());
        for (index, channel) in animation.channels.iter().enumerate() {
            let reader = Reader::new(source, animation, channel, format!("{animation_label}, channel {index}"))?;
            let Some((node, property, reader)) = reader else {
                let warning = format!("{animation_label}: weights of morph targets are not animated");
                if !warnings.contains(&warning) {
                    warnings.push(warning);
                }
                continue;
            };
            let tracks = moving.entry(node).or_default();
            let taken = match property {
                Property::Translation => keep(&mut tracks.translation, reader.track(Vec3::from_array)?),
                Property::Rotation => keep(&mut tracks.rotation, reader.track(Quat::from_array)?),
                Property::Scale | Property::MorphTargetWeights => keep(&mut tracks.scale, reader.track(Vec3::from_array)?),
            };
            if !taken {
                warnings.push(format!("{}: an earlier channel moves it too, and holds", reader.place));
            }
        }
    }
    Ok(moving)
}

/// Whether there was room for it.
fn keep<V>(slot: &mut Option<Track<V>>, track: Track<V>) -> bool {
    let free = slot.is_none();
    slot.get_or_insert(track);
    free
}

/// Reads the keys of one channel.
struct Reader<'a> {
    source: &'a Source<'a>,
    place: String,
    /// Indices of accessors.
    input: usize,
    output: usize,
    interpolation: Interpolation,
}

impl<'a> Reader<'a> {
    /// With the node and its property; `None` for morph targets. The crate does not check what a channel refers to.
    fn new(
        source: &'a Source<'a>,
        animation: &Animation,
        channel: &Channel,
        place: String,
    ) -> Result<Option<(usize, Property, Self)>, SceneError> {
        let node = channel.target.node.value();
        let Some(target) = source.document.as_json().nodes.get(node) else {
            let count = source.document.as_json().nodes.len();
            return Err(source.malformed(place, format!("it moves node {node}, the file has {count}")));
        };
        let node_label = label("node", node, target.name.as_deref());
        let (property, word) = match channel.target.path {
            Checked::Valid(Property::MorphTargetWeights) => return Ok(None),
            Checked::Valid(Property::Translation) => (Property::Translation, "translation"),
            Checked::Valid(Property::Rotation) => (Property::Rotation, "rotation"),
            Checked::Valid(Property::Scale) => (Property::Scale, "scale"),
            Checked::Invalid => {
                let problem = "its path is none of translation, rotation, scale and weights";
                return Err(source.malformed(place, problem));
            }
        };
        let place = format!("{place} ({word} of {node_label})");
        if target.matrix.is_some() {
            let problem = "the node has a matrix; export it with translation, rotation and scale, which can be animated";
            return Err(source.malformed(place, problem));
        }
        let Some(sampler) = animation.samplers.get(channel.sampler.value()) else {
            return Err(source.malformed(place, format!("sampler {} does not exist", channel.sampler.value())));
        };
        let interpolation = match sampler.interpolation {
            Checked::Valid(Named::Step) => Interpolation::Step,
            Checked::Valid(Named::CubicSpline) => Interpolation::Cubic,
            Checked::Valid(Named::Linear) | Checked::Invalid => Interpolation::Linear,
        };
        let (input, output) = (sampler.input.value(), sampler.output.value());
        Ok(Some((node, property, Self { source, place, input, output, interpolation })))
    }

    fn track<V: Value, const N: usize>(&self, value: impl Fn([f32; N]) -> V) -> Result<Track<V>, SceneError> {
        let times: Vec<f32> = self.read(self.input, "input")?.into_iter().map(|[time]| time).collect();
        let wrong = |problem: String| self.source.malformed(self.place.clone(), problem);
        if times.is_empty() {
            return Err(wrong("it has no keys; leave the channel out".into()));
        }
        if let Some(key) = times.iter().position(|time| !(time.is_finite() && *time >= 0.0)) {
            return Err(wrong(format!("key {key} is at {} s; times start at 0 and are finite", times[key])));
        }
        if let Some(key) = times.windows(2).position(|pair| pair[0] >= pair[1]) {
            let (before, after) = (times[key], times[key + 1]);
            let key = key + 1;
            return Err(wrong(format!("key {key} is at {after} s, the one before at {before} s; sort the keys by time")));
        }
        let values = self.read::<N>(self.output, "output")?;
        if let Some(index) = values.iter().position(|value| !value.iter().all(|c| c.is_finite())) {
            return Err(wrong(format!("value {index} is {:?}, which is not finite", values[index])));
        }
        let (keys, given) = (times.len(), values.len());
        let track = Track::new(times, values.into_iter().map(value).collect(), self.interpolation);
        track.ok_or_else(|| {
            let per_key = Track::<V>::values_per_key(self.interpolation);
            wrong(format!("{keys} keys have {given} values; {:?} takes {per_key} for each key", self.interpolation))
        })
    }

    fn read<const N: usize>(&self, index: usize, role: &str) -> Result<Vec<[f32; N]>, SceneError> {
        let what = format!("{}, {role}", self.place);
        let Some(accessor) = self.source.document.accessors().nth(index) else {
            return Err(self.source.malformed(what, format!("accessor {index} does not exist")));
        };
        accessor::read_vectors(self.source, &accessor, &what)
    }
}
