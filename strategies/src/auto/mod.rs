//! Picks a strategy and says why: from photon density, depth complexity and what the adapter can do.
//!
//! ```text
//! a frame unlike those before:   measure a sample of its pixels and photons; estimate by the choice before, at first `sorted-grid`
//! after it:                      choice = the cheapest candidate, by predicted cost, that the device can run
//! further frames of the kind:    estimate by the choice
//! ```
//!
//! Frames are of a kind if image size, number of photons and parameters are the same, and the scene as far as its extent, its triangles
//! and its lights tell; cameras may move. [`Pipeline::measure`](crate::Pipeline::measure) measures without rendering, for those who render
//! one frame.
//!
//! The candidates are `sorted-grid`, `tiled`, `splat-2.5d` with 32-bit targets, `splat-compute` and `exact`: whichever is chosen, the image
//! is that of the others to the rounding of sums. `hash-grid` and `view-grid` are not among them: what they search, `sorted-grid` and
//! `tiled` search in less time or about the same, wherever it was measured; nor is `splat-3d`, whose hulls cover more than the polygons of
//! `splat-2.5d`. `choice.rs` has the costs.

mod choice;
mod measure;

use crate::parameter::Assignment;
use crate::{
    DeviceTraits, Estimate, FrameInputs, KNearest, KernelRadius, Parameter, Strategy, StrategyError, registry::by_name_with,
};
use choice::{Candidate, Costs};
use lightloom_graph::{Graph, WgslSources};
use lightloom_passes::Photons;
use lightloom_passes::scene::SceneInfo;
use measure::{Measure, Measures};

/// Kinds of frames whose choices are remembered: some views of some sizes.
const REMEMBERED: usize = 8;

/// What a user can choose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AutoConfig {
    /// Kernel radii (m), of whatever is chosen.
    pub radius: KernelRadius,
}

/// The strategy `auto`.
pub struct Auto {
    /// Parameters; may change between frames.
    pub config: AutoConfig,
    sources: WgslSources,
    nearest: KNearest,
    measure: Measure,
    device: DeviceTraits,
    /// Those built so far.
    built: Vec<(Candidate, Box<dyn Strategy>)>,
    /// The latest last.
    choices: Vec<Choice>,
    /// The kind of the frame whose measures are still to come.
    measuring: Option<Kind>,
    /// What the last frame was declared by, and its kind.
    current: (Candidate, Option<Kind>),
}

/// What frames have in common that one choice serves.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Kind {
    radius: KernelRadius,
    size: [u32; 2],
    emitted: u32,
    capacity: u32,
    triangles: u32,
    lights: u32,
    /// Of the radius of the scene's bounds: what moves a little is of one kind.
    octave: i32,
}

#[derive(Clone, Debug)]
struct Choice {
    kind: Kind,
    candidate: Candidate,
    /// For people.
    reason: String,
}

impl std::fmt::Debug for Auto {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Auto").field("config", &self.config).field("choices", &self.choices).finish_non_exhaustive()
    }
}

impl Kind {
    fn of(radius: KernelRadius, size: [u32; 2], info: &SceneInfo, photons: &Photons) -> Self {
        Self {
            radius,
            size,
            emitted: photons.emitted,
            capacity: photons.capacity,
            triangles: info.triangle_count,
            lights: info.light_count,
            octave: info.bounds_radius.max(f32::MIN_POSITIVE).log2().round() as i32,
        }
    }
}

impl Auto {
    /// Its name in the registry.
    pub const NAME: &'static str = "auto";

    /// The strategy with default parameters; `sources` holds its shaders, see [`lightloom_passes::shaders`].
    pub fn new(sources: &WgslSources) -> Result<Self, StrategyError> {
        Ok(Self {
            config: AutoConfig::default(),
            sources: sources.clone(),
            nearest: KNearest::new(sources),
            measure: Measure::new(sources)?,
            device: DeviceTraits::default(),
            built: Vec::new(),
            choices: Vec::new(),
            measuring: None,
            current: (Candidate::SortedGrid, None),
        })
    }

    /// The name of what the last frame was declared by.
    pub fn chosen(&self) -> &'static str {
        self.current.0.name()
    }

    fn build(&mut self, candidate: Candidate) -> Result<&mut dyn Strategy, StrategyError> {
        let found = self.built.iter().position(|(built, _)| *built == candidate);
        let at = found.unwrap_or(self.built.len());
        if found.is_none() {
            let mut strategy = by_name_with(candidate.name(), &self.sources)?;
            for (key, value) in candidate.settings() {
                strategy.set(key, value)?;
            }
            self.built.push((candidate, strategy));
        }
        let strategy = &mut *self.built[at].1;
        for parameter in self.config.radius.parameters() {
            strategy.set(&parameter.name, &parameter.value)?;
        }
        Ok(strategy)
    }

    /// The cheapest that runs, and why.
    fn choose(&mut self, frame: &Measures) -> Result<(Candidate, String), StrategyError> {
        let costs = Costs::of(self.device.kind);
        let ranked = costs.ranked(frame);
        let mut lacking = Vec::new();
        for (place, &(candidate, cost)) in ranked.iter().enumerate() {
            let requirements = self.build(candidate)?.requirements();
            let missing = requirements.missing(self.device.features, &self.device.limits);
            if !missing.is_empty() {
                lacking.push(format!("; {} cannot run: {}", candidate.name(), missing.join(", ")));
                continue;
            }
            let next = ranked.get(place + 1).map_or(String::new(), |(next, others)| {
                format!(", {} {:.1} times its cost", next.name(), others / cost.max(f64::MIN_POSITIVE))
            });
            return Ok((candidate, format!("{}{next} ({}){}", describe(frame), costs.source, lacking.concat())));
        }
        // `sorted-grid` needs nothing: not reached unless that changes.
        Ok((Candidate::SortedGrid, format!("nothing runs here{}", lacking.concat())))
    }
}

fn describe(frame: &Measures) -> String {
    format!(
        "{:.1} of {:.0} photons are in reach of a pixel, {:.0} meet a tile, {:.0} % of the tiles are deeper than kernels, which have radii of {:.1} pixels",
        frame.near,
        frame.stored,
        frame.in_tile,
        100.0 * frame.deep_tiles,
        frame.kernel_radius_pixels(),
    )
}

impl Strategy for Auto {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        "the strategy of the least predicted cost, by measured density of photons, depths and the adapter; biased by its radius, consistent"
    }

    fn reach_m(&self, info: &SceneInfo, emitted: u32) -> Option<f32> {
        self.config.radius.reach_m(info, emitted)
    }

    fn declare(&mut self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>) -> Result<Estimate, StrategyError> {
        let photons = frame.need_photons(Self::NAME)?;
        let kind = Kind::of(self.config.radius, frame.size, frame.info, photons);
        let known = self.choices.iter().find(|choice| choice.kind == kind);
        let is_known = known.is_some();
        let candidate = known.or(self.choices.last()).map_or(Candidate::SortedGrid, |choice| choice.candidate);
        self.current = (candidate, Some(kind));
        let mut estimate = self.build(candidate)?.declare(graph, frame)?;
        if !is_known {
            let radius = self.config.radius;
            let by_neighbours = self.nearest.add(graph, frame.info, photons, &radius)?;
            let radii = radius.resolve(frame.info, photons.emitted)?;
            let photons = by_neighbours.as_ref().unwrap_or(photons);
            estimate.measures = Some(self.measure.add(graph, frame.camera, frame.gbuffer, photons, radii));
            self.measuring = Some(kind);
        }
        Ok(estimate)
    }

    fn reset(&mut self) {
        for (_, strategy) in &mut self.built {
            strategy.reset();
        }
    }

    fn meet_device(&mut self, device: &DeviceTraits) {
        if device.kind != self.device.kind || device.features != self.device.features || device.limits != self.device.limits {
            self.device = device.clone();
            self.choices.clear();
        }
    }

    fn observe(&mut self, words: &[u32]) -> Result<(), StrategyError> {
        let Some(kind) = self.measuring.take() else { return Ok(()) };
        let (candidate, reason) = self.choose(&Measures::new(words, kind.size))?;
        if self.choices.len() == REMEMBERED {
            self.choices.remove(0);
        }
        self.choices.push(Choice { kind, candidate, reason });
        Ok(())
    }

    fn choice(&self) -> Option<String> {
        let (current, kind) = self.current;
        let choice = self.choices.iter().find(|choice| Some(choice.kind) == kind)?;
        let Choice { candidate, reason, .. } = choice;
        let until =
            if current == *candidate { String::new() } else { format!("{} until it was measured, then ", current.name()) };
        Some(format!("{until}{}, because {reason}", candidate.name()))
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        let assignment = Assignment { strategy: Self::NAME, key, value };
        if self.config.radius.set(&assignment)? { Ok(()) } else { Err(assignment.unknown(&self.parameters())) }
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.config.radius.parameters()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightloom_graph::wgpu::{DeviceType, Features};

    /// Few photons, whose kernels cover some pixels each.
    const SPARSE: Measures = Measures {
        stored: 2000.0,
        pixels: 2e6,
        near: 0.03,
        in_rows: 0.1,
        tiles: 32_400.0,
        in_tile: 0.3,
        deep_tiles: 0.1,
        seen: 2000.0,
        covered: 30.0,
    };

    #[test]
    fn what_the_device_lacks_is_not_chosen() {
        let mut auto = Auto::new(&lightloom_passes::shaders()).unwrap();
        auto.meet_device(&DeviceTraits {
            kind: DeviceType::DiscreteGpu,
            features: Features::FLOAT32_BLENDABLE,
            ..DeviceTraits::default()
        });
        let (candidate, reason) = auto.choose(&SPARSE).unwrap();
        assert_eq!(candidate, Candidate::Splat25d, "{reason}");
        assert!(!reason.contains("cannot run"), "{reason}");
        auto.meet_device(&DeviceTraits { kind: DeviceType::DiscreteGpu, ..DeviceTraits::default() });
        let (candidate, reason) = auto.choose(&SPARSE).unwrap();
        assert_ne!(candidate, Candidate::Splat25d, "{reason}");
        assert!(reason.contains("splat-2.5d cannot run: no feature FLOAT32_BLENDABLE"), "{reason}");
    }

    #[test]
    fn what_is_built_has_the_radii_that_were_set() {
        let mut auto = Auto::new(&lightloom_passes::shaders()).unwrap();
        auto.set("nearest", "7").unwrap();
        for candidate in Candidate::ALL {
            auto.set("r_max", "0.5").unwrap();
            auto.build(candidate).unwrap();
            auto.set("r_max", "0.25").unwrap();
            let parameters = auto.build(candidate).unwrap().parameters();
            for (name, value) in [("nearest", "7"), ("r_max", "0.25"), ("r_min", "auto")] {
                let found = parameters.iter().find(|parameter| parameter.name == name).unwrap();
                assert_eq!(found.value, value, "{candidate:?}, {name}");
            }
        }
    }

    #[test]
    fn words_become_measures_of_the_whole_frame() {
        // Half of the pixels gather; one photon in four is sampled; 10 of 1000 pairs are in reach.
        let words = [4000, 1000, 32, 64, 1000, 10, 25, 500, 1, 1, 800, 1600];
        let found = Measures::new(&words, [16, 8]);
        let expected = Measures {
            stored: 4000.0,
            pixels: 64.0,
            near: 40.0,
            in_rows: 100.0,
            tiles: 2.0,
            in_tile: 1000.0,
            deep_tiles: 1.0,
            seen: 3200.0,
            covered: 2.0,
        };
        assert_eq!(found, expected);
        assert_eq!(Measures::new(&[0; 12], [16, 8]), Measures { tiles: 2.0, ..Measures::default() }, "of nothing, nothing");
    }
}
