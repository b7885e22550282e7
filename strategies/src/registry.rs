//! The strategies of this crate by name.

use lightloom_graph::WgslSources;

use crate::{
    Auto, CausticMap, Composed, Exact, HashGrid, InstantRadiosity, Path, Progressive, ScreenSpace, SortedGrid, Splat3d, Splat25d,
    SplatCompute, Strategy, StrategyError, Tiled, ViewGrid,
};

/// A strategy that can be built.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Identifier, as on the command line.
    pub name: &'static str,
    /// Builds it with its default parameters from the shaders given; see [`lightloom_passes::shaders`].
    pub build: fn(&WgslSources) -> Result<Box<dyn Strategy>, StrategyError>,
}

/// All strategies of this crate, the oracle first.
pub fn registry() -> &'static [Entry] {
    &[
        Entry { name: Exact::NAME, build: |sources| Ok(Box::new(Exact::new(sources)?)) },
        Entry { name: Tiled::NAME, build: |sources| Ok(Box::new(Tiled::new(sources)?)) },
        Entry { name: HashGrid::NAME, build: |sources| Ok(Box::new(HashGrid::new(sources)?)) },
        Entry { name: SortedGrid::NAME, build: |sources| Ok(Box::new(SortedGrid::new(sources)?)) },
        Entry { name: ViewGrid::NAME, build: |sources| Ok(Box::new(ViewGrid::new(sources)?)) },
        Entry { name: Splat3d::NAME, build: |sources| Ok(Box::new(Splat3d::new(sources)?)) },
        Entry { name: Splat25d::NAME, build: |sources| Ok(Box::new(Splat25d::new(sources)?)) },
        Entry { name: SplatCompute::NAME, build: |sources| Ok(Box::new(SplatCompute::new(sources)?)) },
        Entry { name: ScreenSpace::NAME, build: |sources| Ok(Box::new(ScreenSpace::new(sources)?)) },
        Entry { name: CausticMap::NAME, build: |sources| Ok(Box::new(CausticMap::new(sources)?)) },
        Entry { name: Progressive::NAME, build: |sources| Ok(Box::new(Progressive::new(sources)?)) },
        Entry { name: InstantRadiosity::NAME, build: |sources| Ok(Box::new(InstantRadiosity::new(sources)?)) },
        Entry { name: Auto::NAME, build: |sources| Ok(Box::new(Auto::new(sources)?)) },
        Entry { name: Path::NAME, build: |sources| Ok(Box::new(Path::new(sources)?)) },
    ]
}

/// Builds the strategy of that name, with Lightloom's shaders.
pub fn by_name(name: &str) -> Result<Box<dyn Strategy>, StrategyError> {
    by_name_with(name, &lightloom_passes::shaders())
}

/// Builds the strategy of that name, with the shaders of `sources`. Two names joined by a plus sign, such as `sorted-grid+screen-space`,
/// name their [composition](Composed).
pub fn by_name_with(name: &str, sources: &WgslSources) -> Result<Box<dyn Strategy>, StrategyError> {
    if !name.contains(Composed::JOINT) {
        return part(name, sources);
    }
    let parts: Vec<_> = name.split(Composed::JOINT).map(|name| part(name, sources)).collect::<Result<_, _>>()?;
    let count = parts.len();
    let parts: [Box<dyn Strategy>; 2] = parts.try_into().map_err(|_| StrategyError::NotComposable {
        name: name.to_owned(),
        reason: format!("{count} strategies are named; two make a frame"),
    })?;
    Ok(Box::new(Composed::new(sources, parts)?))
}

fn part(name: &str, sources: &WgslSources) -> Result<Box<dyn Strategy>, StrategyError> {
    let Some(entry) = registry().iter().find(|entry| entry.name == name) else {
        let names: Vec<_> = registry().iter().map(|entry| format!("`{}`", entry.name)).collect();
        return Err(StrategyError::UnknownStrategy { name: name.to_owned(), known: names.join(", ") });
    };
    (entry.build)(sources)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_builds_under_its_name_and_documents_its_parameters() {
        for entry in registry() {
            let mut strategy = by_name(entry.name).unwrap();
            assert_eq!(strategy.name(), entry.name);
            assert!(!strategy.description().is_empty(), "{} needs a description", entry.name);
            for parameter in strategy.parameters() {
                assert!(!parameter.doc.is_empty(), "{}: `{}` needs a description", entry.name, parameter.name);
                strategy.set(&parameter.name, &parameter.value).expect("a shown value can be set again");
            }
        }
    }

    #[test]
    fn unknown_names_list_the_known_ones() {
        let error = by_name("tilde").err().expect("there is no such strategy").to_string();
        assert!(error.contains("`tilde`") && error.contains("`tiled`"), "{error}");
        let error = by_name("exact").unwrap().set("colour", "red").unwrap_err().to_string();
        assert!(error.contains("`exact`") && error.contains("`colour`") && error.contains("`r_max`"), "{error}");
    }
}
