//! `results.json`: what a comparison measured.

use serde::{Deserialize, Serialize};

/// The whole file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// The scene as named on the command line.
    pub scene: String,
    /// The adapter's name.
    pub adapter: String,
    /// What traced rays: `bvh`, `ray-query` or `ray-pipeline`; empty in files from before there was a choice.
    #[serde(default)]
    pub trace: String,
    /// Width and height (pixels).
    pub size: [u32; 2],
    /// One per strategy, in the order asked for.
    pub strategies: Vec<StrategyResult>,
    /// What the strategies are compared with.
    pub reference: Option<Reference>,
    /// The images of `lightloom render --animate`, whose last one `strategies` is of; else left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sequence: Vec<SequenceImage>,
    /// What shines, and how many photons it is given.
    #[serde(default)]
    pub lights: Vec<LightPhotons>,
    /// Options that change the image.
    pub settings: Settings,
    /// How `gpu_ms` was measured.
    pub timing: String,
    /// What a reader should know before trusting the numbers.
    pub warnings: Vec<String>,
}

/// One image of an animation. Times to move the scene are wall-clock times on the CPU.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SequenceImage {
    /// Its name, beside this file.
    pub file: String,
    /// The pose shown (s).
    pub time: f32,
    /// Moving triangles, lights and cameras (ms).
    pub pose_ms: f64,
    /// How the hierarchy followed: `refit`, new boxes for the same nodes, or `rebuild`.
    pub hierarchy: String,
    /// That (ms).
    pub hierarchy_ms: f64,
    /// Handing the moved scene to the device's queue (ms).
    pub upload_ms: f64,
    /// Device time of one frame, the mean over the image's frames (ms); `null` where the adapter has no clock.
    pub gpu_ms: Option<f64>,
    /// Wall-clock time of the image's frames (ms).
    pub wall_ms: f64,
}

/// A lamp: a punctual light, the triangles of one emissive material, or the environment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LightPhotons {
    /// Its name, or that of the material.
    pub name: String,
    /// `point`, `spot`, `directional`, `emissive` or `environment`.
    pub kind: String,
    /// Photons of one frame, the first.
    pub photons: u32,
    /// Flux per linear RGB channel (W).
    pub power: [f32; 3],
}

/// The image that the metrics compare with.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// `path`, or the file.
    pub name: String,
    /// Paths per pixel, when it was rendered here.
    pub samples: Option<u32>,
    /// Wall-clock time to render it (ms), when it was rendered here.
    pub wall_ms: Option<f64>,
}

/// The options of the comparison that change images.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The compared layer.
    pub layer: String,
    /// The camera's name.
    pub camera: String,
    /// The pose shown, or the first of a sequence (s); `null`: at rest.
    #[serde(default)]
    pub time: Option<f32>,
    /// Photons emitted per frame.
    pub photons: u32,
    /// Bounces at most.
    pub bounces: u32,
    /// Frames averaged.
    pub frames: u32,
    /// How photons leave the lights: `lights`, `maps` or `raster-maps`; empty in files from before there was a choice.
    #[serde(default)]
    pub emission: String,
    /// Where the first hits of photons that follow maps come from: `traced` or `map`; empty in files from before there was a choice.
    #[serde(default)]
    pub first_hit: String,
    /// How photons are kept: `whole` or `compact`; empty in files from before there was a choice.
    #[serde(default)]
    pub photon_store: String,
    /// First number of the random sequences.
    pub seed: u32,
    /// Constant search radius (m); `null`: the strategy's own.
    pub radius: Option<f32>,
    /// `gltf` or `lambert`.
    pub materials: String,
    /// Whether the image is the same bit for bit from run to run.
    pub deterministic: bool,
    /// The filter's constants, or `off`; empty in files from before there was a choice.
    #[serde(default)]
    pub filter: String,
    /// Radius of ambient occlusion (m); `null`: none.
    #[serde(default)]
    pub ambient_occlusion: Option<f32>,
    /// The factor on radiance before the tone curve of the PNG files (m²·sr·W⁻¹).
    pub exposure: f32,
}

/// One strategy's row.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StrategyResult {
    /// As on the command line.
    pub name: String,
    /// Device time of one frame, the mean over the frames (ms); `null` where the adapter has no clock.
    pub gpu_ms: Option<f64>,
    /// Device time of each pass of one frame, in order.
    pub passes: Vec<PassTime>,
    /// Bytes of transient memory that the frame holds on the device.
    pub bytes: u64,
    /// The same memory against its bounds.
    pub memory: Memory,
    /// All zero for a strategy without photons.
    pub photons: PhotonCounts,
    /// All zero for a strategy without photons.
    pub flux: Flux,
    /// What the strategy chose, and why; left out if it has nothing to choose.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub choice: Option<String>,
    /// Mean of (x − r)²/(r² + 0.01); `null` without a reference.
    pub relmse: Option<f64>,
    /// Mean of the image over the mean of the reference; `null` without a reference.
    pub mean_ratio: Option<f64>,
    /// Mean FLIP of the tone-mapped images; `null` without a reference.
    pub flip: Option<f64>,
    /// Wall-clock time of all frames, with compiling shaders at their first use (ms).
    pub wall_ms: f64,
    /// Pixels with a NaN or an infinity; they count as black.
    pub nonfinite_pixels: u64,
    /// File names beside this one.
    pub files: Vec<String>,
}

impl StrategyResult {
    /// The choice as a line for people.
    pub(crate) fn said_choice(&self) -> Option<String> {
        self.choice.as_ref().map(|choice| format!("{}: {choice}", self.name))
    }
}

/// One pass of a frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PassTime {
    /// The pass's label.
    pub name: String,
    /// Device time (ms); `null` where the adapter has no clock.
    pub gpu_ms: Option<f64>,
}

/// Transient memory of one frame (bytes).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Memory {
    /// Every resource with memory of its own.
    pub unshared_bytes: u64,
    /// The lower bound: the most that is alive at one time.
    pub peak_live_bytes: u64,
    /// Resources of one shape sharing memory.
    pub pooled_bytes: u64,
}

/// Photons of all frames together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PhotonCounts {
    /// Paths begun at the lights.
    pub emitted: u64,
    /// Records in the buffer.
    pub stored: u64,
    /// Records that found the buffer full.
    pub dropped: u64,
    /// Records left out because no pixel could gather them.
    pub culled: u64,
    /// Records that the buffer holds in each frame.
    #[serde(default)]
    pub capacity: u64,
}

/// Where the emitted flux went, per linear RGB channel; the mean over the frames (W).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Flux {
    /// Left the lights.
    pub emitted: [f64; 3],
    /// Absorbed by surfaces.
    pub absorbed: [f64; 3],
    /// Left the scene.
    pub escaped: [f64; 3],
    /// Ended by roulette or by the limit on bounces.
    pub terminated: [f64; 3],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_has_every_agreed_key() {
        let row = StrategyResult { passes: vec![PassTime::default()], ..StrategyResult::default() };
        let results = Results { strategies: vec![row], ..Results::default() };
        let json = serde_json::to_value(&results).unwrap();
        for key in ["scene", "adapter", "trace", "size", "strategies", "lights"] {
            assert!(json.get(key).is_some(), "{key}");
        }
        let row = &json["strategies"][0];
        for key in ["name", "gpu_ms", "passes", "bytes", "photons", "flux", "relmse", "mean_ratio", "flip"] {
            assert!(row.get(key).is_some(), "strategies[].{key}");
        }
        for (object, keys) in [
            (&row["photons"], &["emitted", "stored", "dropped", "culled", "capacity"][..]),
            (&row["flux"], &["emitted", "absorbed", "escaped", "terminated"][..]),
            (&row["passes"][0], &["name", "gpu_ms"][..]),
        ] {
            for key in keys {
                assert!(object.get(key).is_some(), "{key} in {object}");
            }
        }
        let back: Results = serde_json::from_value(json).unwrap();
        assert_eq!(back, results);
    }
}
