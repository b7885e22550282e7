//! `--filter` and its constants, which `--set filter.NAME=VALUE` sets.

use lightloom_passes::{AmbientOcclusionSettings, FilterSettings};

use super::Session;
use crate::Error;
use crate::cli::{SceneArgs, Switch};
use crate::values::{Assignment, FILTER};

/// Whether the assignment is to the filter.
pub(super) fn is_for_filter(assignment: &Assignment) -> bool {
    assignment.strategy.as_deref() == Some(FILTER)
}

/// The filter asked for.
pub(super) fn filter(args: &SceneArgs) -> Result<Option<FilterSettings>, Error> {
    let mut filter = FilterSettings::default();
    for assignment in args.assignments.iter().filter(|assignment| is_for_filter(assignment)) {
        let Assignment { key, value, .. } = assignment;
        filter.set(key, value).map_err(|error| Error::Usage(error.to_string()))?;
        if args.filter == Switch::Off {
            return Err(Error::Usage(format!("--set {FILTER}.{key}={value}: the filter is off; say `--filter on`")));
        }
    }
    Ok((args.filter == Switch::On).then_some(filter))
}

/// The occlusion asked for.
pub(super) fn ambient_occlusion(args: &SceneArgs) -> Option<AmbientOcclusionSettings> {
    args.ambient_occlusion.map(AmbientOcclusionSettings::new)
}

impl Session {
    /// The filter in words: `off`, or its constants.
    pub(crate) fn filter(&self) -> String {
        let Some(filter) = &self.settings.filter else { return "off".to_owned() };
        let constants = filter.parameters().into_iter().map(|parameter| format!("{} {}", parameter.name, parameter.value));
        constants.collect::<Vec<_>>().join(", ")
    }

    /// Seed of image `index` of a sequence that begins with `seed`: images that are filtered together need photons of their own, others
    /// have the same, so that what flickers is what moves.
    pub(crate) fn seed_of_image(&self, seed: u32, index: u32) -> u32 {
        let filtered = self.settings.filter.is_some();
        let first = lightloom_strategies::Settings { seed, ..self.settings.clone() };
        if filtered { first.frame_seed(index.wrapping_mul(first.frames)) } else { seed }
    }
}
