//! The filters' constants, and their names.

use std::ops::RangeInclusive;
use std::str::FromStr;

/// Constants of the filters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSettings {
    /// Largest weight of the history, 0 to 0.99. Nearer to 1: calmer, and slower to follow light that moves. 0: frames stand alone.
    pub history: f32,
    /// Levels of the à-trous transform, 0 to 8; n of them reach 2 (2ⁿ − 1) pixels. More: smoother. 0: no filter over pixels.
    pub iterations: u32,
    /// Details that are kept, in standard deviations of the light around less its noise, 0 to 10⁶. More: sharper and noisier; 0: all is blurred.
    pub clip: f32,
    /// `σ_z`, how far depths may differ in slopes of the surface, 0.01 to 100. More: filters reach over steps.
    pub sigma_z: f32,
    /// `σ_n`, the power of the normals' cosine, 0 to 1024. More: less is filtered on curved surfaces.
    pub sigma_n: f32,
}

impl Default for FilterSettings {
    /// α, `σ_z`, `σ_n` and the levels of [SA19] §24.4, which gives no clip. Below 3 bright details lose more than their neighbours gain.
    ///
    /// [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems chapter 24, 2019"
    fn default() -> Self {
        Self { history: 0.95, iterations: 4, clip: 3.0, sigma_z: 1.0, sigma_n: 32.0 }
    }
}

/// A constant by its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilterParameter {
    /// Its name.
    pub name: &'static str,
    /// Its value, as [`FilterSettings::set`] reads it.
    pub value: String,
    /// Meaning, range, and the effect of raising it.
    pub doc: &'static str,
}

/// Why a constant was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FilterError {
    /// There is none of this name.
    #[error("the filter has no parameter `{name}`; its parameters are {known}")]
    UnknownParameter {
        /// The name asked for.
        name: String,
        /// The names there are, for a person to read.
        known: String,
    },
    /// The value is no number, or out of range.
    #[error("parameter `{name}` of the filter cannot be `{value}`: {expected}")]
    BadValue {
        /// The parameter.
        name: &'static str,
        /// The value that was given.
        value: String,
        /// What would fit.
        expected: String,
    },
}

const HISTORY: RangeInclusive<f32> = 0.0..=0.99;
const ITERATIONS: RangeInclusive<u32> = 0..=8;
const CLIP: RangeInclusive<f32> = 0.0..=1.0e6;
const SIGMA_Z: RangeInclusive<f32> = 0.01..=100.0;
const SIGMA_N: RangeInclusive<f32> = 0.0..=1024.0;

impl FilterSettings {
    /// All constants and their present values.
    pub fn parameters(&self) -> Vec<FilterParameter> {
        let row = |name, value: &dyn ToString, doc| FilterParameter { name, value: value.to_string(), doc };
        vec![
            row(
                "history",
                &self.history,
                "largest weight of earlier frames, 0 to 0.99; raising it calms, and follows moving light later",
            ),
            row("iterations", &self.iterations, "levels of the filter over pixels, 0 to 8; each doubles its reach"),
            row("clip", &self.clip, "details that are kept, in standard deviations around, 0 to 1000000; raising it sharpens"),
            row("sigma_z", &self.sigma_z, "how far depths may differ, 0.01 to 100; raising it filters over steps"),
            row("sigma_n", &self.sigma_n, "how well normals must agree, 0 to 1024; raising it filters curved surfaces less"),
        ]
    }

    /// Sets a constant from text.
    ///
    /// # Errors
    /// [`FilterError`] names the constants, or the range.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), FilterError> {
        match name {
            "history" => self.history = parse("history", value, &HISTORY)?,
            "iterations" => self.iterations = parse("iterations", value, &ITERATIONS)?,
            "clip" => self.clip = parse("clip", value, &CLIP)?,
            "sigma_z" => self.sigma_z = parse("sigma_z", value, &SIGMA_Z)?,
            "sigma_n" => self.sigma_n = parse("sigma_n", value, &SIGMA_N)?,
            _ => {
                let names: Vec<_> = self.parameters().iter().map(|parameter| format!("`{}`", parameter.name)).collect();
                return Err(FilterError::UnknownParameter { name: name.to_owned(), known: names.join(", ") });
            }
        }
        Ok(())
    }

    /// Refuses constants out of their range.
    ///
    /// # Errors
    /// [`FilterError::BadValue`].
    pub fn check(&self) -> Result<(), FilterError> {
        // A value in range is read again as itself.
        self.parameters().into_iter().try_for_each(|FilterParameter { name, value, .. }| Self::default().set(name, &value))
    }
}

fn parse<T: FromStr + PartialOrd + ToString>(
    name: &'static str,
    value: &str,
    range: &RangeInclusive<T>,
) -> Result<T, FilterError> {
    match value.parse() {
        Ok(number) if range.contains(&number) => Ok(number),
        _ => {
            let expected = format!("a number from {} to {} is needed", range.start().to_string(), range.end().to_string());
            Err(FilterError::BadValue { name, value: value.to_owned(), expected })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_checked_and_read_back() {
        let mut settings = FilterSettings::default();
        assert_eq!(settings.check(), Ok(()));
        for parameter in settings.parameters() {
            settings.set(parameter.name, &parameter.value).unwrap();
        }
        assert_eq!(settings, FilterSettings::default());
        settings.set("iterations", "2").unwrap();
        assert_eq!(settings.iterations, 2);
        for (name, value) in [("history", "1"), ("iterations", "9"), ("clip", "nan"), ("sigma_z", "0"), ("sigma_n", "-1")] {
            let error = settings.set(name, value).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains(value) && error.contains(" to "), "{error}");
        }
        assert!(settings.set("strength", "1").unwrap_err().to_string().contains("`sigma_n`"));
        assert!(FilterSettings { history: f32::NAN, ..settings }.check().is_err());
        assert!(FilterSettings { iterations: 31, ..settings }.check().is_err());
    }
}
