//! Two strategies in one frame: one for caustics, another for all other indirect light.
//!
//! ```text
//! G, C = estimates of both strategies, from the same photons         # C counts those whose earlier scatterings were all specular
//! for each pixel:
//!     indirect = max(0, G.indirect − G.caustic) + C.caustic          # G.caustic: what the same photons brought to G
//!     caustic  = C.caustic
//! ```
//!
//! Diffuse light varies slowly and bears wide kernels, caustics do not: [Jensen96] keeps them in a photon map of their own, and
//! [Kim19]'s is another such. Every photon is in one of the two terms and in no other: a
//! frame's light is that of `G`, but for what the biases of `G` and `C` make of the caustic photons. Where no photon is caustic the image is
//! that of `G` to the last bit.
//!
//! **Why subtract.** `G` could leave caustic photons out instead, at a test in each of its shaders, and would save what they cost it; here
//! any strategy with a caustic layer will do, without knowing of it. The difference of the two sums is off by their rounding, some 10⁻⁷
//! of `G.indirect` for each addition that does not cancel; `C.caustic` is about as bright as what went, so that this is the rounding of the
//! sum. The bound at 0 takes what rounding leaves where all light was caustic: both sums have no negative terms. Half-precision sums of
//! `splat-2.5d` round by 10⁻³, and dim light under a bright caustic is as coarse.
//!
//! Filters take the composed `indirect` itself, as no sum before reflection is left of it. Pixels whose first surface is specular are the
//! pipeline's, unless both strategies cover them.
//!
//! Bytes moved, beside both strategies', for X pixels:
//!
//! | pass | reads | writes |
//! |---|---|---|
//! | `composed_indirect` | 48 X | 16 X |
//!
//! [Jensen96]: https://doi.org/10.1007/978-3-7091-7484-5_3 "Global illumination using photon maps, Jensen, 1996"
//! [Kim19]: https://doi.org/10.1007/978-1-4842-4427-2_30 "Caustics using screen-space photon mapping, Kim, Ray Tracing Gems chapter 30, 2019"

use crate::parameter::Assignment;
use crate::{DeviceTraits, Estimate, FrameInputs, Parameter, Requirements, ScreenSpace, SortedGrid, Strategy, StrategyError};
use lightloom_graph::{ComputeShader, Graph, WgslSources, shader_struct};
use lightloom_passes::radiance_desc;
use lightloom_passes::scene::SceneInfo;
use std::borrow::Cow;

shader_struct! {
    /// Parameters of `composed_indirect`.
    struct Params {
        size: [u32; 2],
        pad0: u32,
        pad1: u32,
    }
}

/// Two strategies as one, named after both, such as `sorted-grid+screen-space`.
///
/// A parameter is that of a part, behind its name and a dot: `screen-space.denoiser`. A key without a part is set in each that has it.
pub struct Composed {
    name: String,
    description: String,
    /// Estimates everything.
    global: Box<dyn Strategy>,
    /// Estimates caustics alone.
    caustic: Box<dyn Strategy>,
    shader: ComputeShader,
    /// Whose measures the last frame has.
    measured: Option<Part>,
}

#[derive(Clone, Copy, Debug)]
enum Part {
    Global,
    Caustic,
}

impl std::fmt::Debug for Composed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Composed").field("name", &self.name).finish_non_exhaustive()
    }
}

impl Composed {
    /// What stands between the parts' names.
    pub const JOINT: char = '+';

    /// `parts` in one frame, in either order: one of the two, and no more, estimates [caustics alone](Strategy::caustics_only), and the other gathers
    /// photons. `sources` as for the parts.
    pub fn new(sources: &WgslSources, parts: [Box<dyn Strategy>; 2]) -> Result<Self, StrategyError> {
        let [first, second] = &parts;
        let names = [first.name(), second.name()];
        let name = format!("{}{}{}", names[0], Self::JOINT, names[1]);
        let both = format!("`{}` and `{}` both estimate", names[0], names[1]);
        let refuse = |reason: String| Err(StrategyError::NotComposable { name: name.clone(), reason });
        let [global, caustic] = match (first.caustics_only(), second.caustics_only()) {
            (false, true) => parts,
            (true, false) => {
                let [caustic, global] = parts;
                [global, caustic]
            }
            (false, false) => {
                let example = ScreenSpace::NAME;
                return refuse(format!(
                    "{both} all of the indirect light; name one that estimates caustics alone, such as `{example}`"
                ));
            }
            (true, true) => {
                let example = SortedGrid::NAME;
                return refuse(format!(
                    "{both} caustics alone; name one that estimates all of the indirect light, such as `{example}`"
                ));
            }
        };
        if !global.uses_photons() {
            return refuse(format!("`{}` gathers no photons that `{}` could share", global.name(), caustic.name()));
        }
        let description = format!("caustics by {}; other light by {}: {}", caustic.name(), global.name(), global.description());
        let shader = ComputeShader::new(sources, "strategies/composed_indirect.wgsl")?;
        Ok(Self { name, description, global, caustic, shader, measured: None })
    }

    fn parts(&self) -> [&dyn Strategy; 2] {
        [&*self.global, &*self.caustic]
    }

    fn parts_mut(&mut self) -> [&mut dyn Strategy; 2] {
        [&mut *self.global, &mut *self.caustic]
    }
}

impl Strategy for Composed {
    fn name(&self) -> &str {
        &self.name
    }

    fn description(&self) -> &str {
        &self.description
    }

    fn requirements(&self) -> Requirements {
        let [global, caustic] = self.parts().map(Strategy::requirements);
        Requirements {
            features: global.features | caustic.features,
            limits: global.limits.or_better_values_from(&caustic.limits),
        }
    }

    fn light_vertices(&self) -> bool {
        self.global.light_vertices()
    }

    fn reach_m(&self, info: &SceneInfo, emitted: u32) -> Option<f32> {
        let [global, caustic] = self.parts().map(|part| part.reach_m(info, emitted));
        Some(global?.max(caustic?))
    }

    fn declare(&mut self, graph: &mut Graph<'_>, frame: &FrameInputs<'_>) -> Result<Estimate, StrategyError> {
        let mut global = self.global.declare(graph, frame)?;
        let mut caustic = self.caustic.declare(graph, frame)?;
        let Some(replaced) = &global.caustic else {
            let reason = format!(
                "`{}` does not tell caustics apart, so they would be counted twice; name one that does, such as `{}`",
                self.global.name(),
                SortedGrid::NAME,
            );
            return Err(StrategyError::NotComposable { name: self.name.clone(), reason });
        };
        let caustics = caustic.caustic.unwrap_or(caustic.indirect);
        let mut indirect = graph.texture("composed_indirect", radiance_desc(frame.size));
        graph
            .compute(&self.shader)
            .params(&Params { size: frame.size, ..Params::default() })
            .read("indirect", &global.indirect)
            .read("replaced", replaced)
            .read("caustic", &caustics)
            .write("composed", &mut indirect)
            .dispatch_threads([frame.size[0], frame.size[1], 1]);

        for (part, stats) in [(&self.global, &mut global.stats), (&self.caustic, &mut caustic.stats)] {
            for stats in stats {
                stats.put_within(part.name());
            }
        }
        global.stats.append(&mut caustic.stats);
        // One part is heard in a frame: the other measures in a later one, for those that measure do so until they know.
        let measures = [(Part::Global, global.measures), (Part::Caustic, caustic.measures)];
        let heard = measures.into_iter().find_map(|(part, measures)| Some((part, measures?)));
        let (measured, measures) = heard.unzip();
        self.measured = measured;
        Ok(Estimate {
            caustic: Some(caustics),
            direct: global.direct.or(caustic.direct),
            covers_specular: global.covers_specular && caustic.covers_specular,
            stats: global.stats,
            measures,
            ..Estimate::new(indirect)
        })
    }

    fn reset(&mut self) {
        for part in self.parts_mut() {
            part.reset();
        }
    }

    fn meet_device(&mut self, device: &DeviceTraits) {
        for part in self.parts_mut() {
            part.meet_device(device);
        }
    }

    fn observe(&mut self, words: &[u32]) -> Result<(), StrategyError> {
        match self.measured.take() {
            Some(Part::Global) => self.global.observe(words),
            Some(Part::Caustic) => self.caustic.observe(words),
            None => Ok(()),
        }
    }

    fn choice(&self) -> Option<String> {
        let told: Vec<_> = self.parts().iter().filter_map(|part| Some(format!("{}: {}", part.name(), part.choice()?))).collect();
        (!told.is_empty()).then(|| told.join("; "))
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        let mut is_set = false;
        for part in self.parts_mut() {
            if let Some(key) = key.strip_prefix(part.name()).and_then(|rest| rest.strip_prefix('.')) {
                return part.set(key, value);
            }
            match part.set(key, value) {
                Ok(()) => is_set = true,
                Err(StrategyError::UnknownParameter { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        if is_set { Ok(()) } else { Err(Assignment { strategy: &self.name, key, value }.unknown(&self.parameters())) }
    }

    fn parameters(&self) -> Vec<Parameter> {
        let of_part = |part: &dyn Strategy| -> Vec<Parameter> {
            let prefixed =
                |parameter: Parameter| Parameter { name: Cow::Owned(format!("{}.{}", part.name(), parameter.name)), ..parameter };
            part.parameters().into_iter().map(prefixed).collect()
        };
        self.parts().into_iter().flat_map(of_part).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::by_name;
    use lightloom_graph::wgpu::Features;

    #[test]
    fn what_does_not_compose_is_refused_by_name() {
        for (name, words) in [
            ("tiled+exact", ["both estimate all", "`screen-space`"]),
            ("screen-space+screen-space", ["both estimate caustics alone", "`sorted-grid`"]),
            ("path+screen-space", ["`path`", "no photons"]),
            ("tiled+exact+screen-space", ["3 strategies", "two"]),
            ("tiled+tilde", ["no strategy `tilde`", "`tiled`"]),
            ("tiled+", ["no strategy ``", "`tiled`"]),
        ] {
            let error = by_name(name).err().expect("it does not compose").to_string();
            assert!(words.iter().all(|word| error.contains(word)), "{name}: {error}");
        }
    }

    #[test]
    fn parts_may_stand_in_either_order() {
        for name in ["splat-2.5d+screen-space", "screen-space+splat-2.5d", "auto+screen-space"] {
            let strategy = by_name(name).unwrap();
            assert_eq!(strategy.name(), name);
            assert!(!strategy.caustics_only() && strategy.uses_photons(), "{name}");
            assert!(strategy.description().contains("caustics by screen-space"), "{}", strategy.description());
        }
    }

    #[test]
    fn parameters_are_those_of_the_parts() {
        let mut strategy = by_name("screen-space+splat-compute").unwrap();
        let value = |strategy: &dyn Strategy, name: &str| {
            strategy.parameters().into_iter().find(|parameter| parameter.name == name).map(|parameter| parameter.value).unwrap()
        };
        strategy.set("sums", "fixed").unwrap();
        strategy.set("screen-space.sums", "float").unwrap();
        strategy.set("r_max", "0.5").unwrap();
        assert_eq!(value(&*strategy, "splat-compute.sums"), "fixed");
        assert_eq!(value(&*strategy, "screen-space.sums"), "float");
        assert_eq!(value(&*strategy, "splat-compute.r_max"), "0.5");
        assert_eq!(strategy.requirements().features, Features::SHADER_FLOAT32_ATOMIC, "one part's need is the frame's");
        for parameter in strategy.parameters() {
            strategy.set(&parameter.name, &parameter.value).expect("a shown value can be set again");
        }
        let error = strategy.set("colour", "red").unwrap_err().to_string();
        assert!(error.contains("`screen-space+splat-compute`") && error.contains("`screen-space.denoiser`"), "{error}");
        let error = strategy.set("screen-space.r_max", "1").unwrap_err().to_string();
        assert!(error.contains("strategy `screen-space` has no parameter `r_max`"), "{error}");
        assert!(strategy.set("sums", "wide").is_err(), "a value that does not fit");
    }
}
