//! Parameters of strategies, as text: what `--set key=value` and a report can show.

use crate::StrategyError;
use std::borrow::Cow;
use std::str::FromStr;

/// One parameter of a strategy and its present value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Name, as in `--set name=value`.
    pub name: Cow<'static, str>,
    /// Present value, in the form [`Strategy::set`](crate::Strategy::set) reads; `auto` where the strategy chooses.
    pub value: String,
    /// Meaning, unit, and the effect of raising it.
    pub doc: &'static str,
}

impl Parameter {
    /// A parameter with its value; `None` reads `auto`.
    pub fn new<T: ToString>(name: &'static str, value: Option<T>, doc: &'static str) -> Self {
        let value = value.map_or_else(|| "auto".to_owned(), |value| value.to_string());
        Self { name: name.into(), value, doc }
    }
}

/// One attempt to set a parameter: who asks, what and to which value.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Assignment<'a> {
    pub(crate) strategy: &'a str,
    pub(crate) key: &'a str,
    pub(crate) value: &'a str,
}

impl Assignment<'_> {
    /// The error for a value that does not fit.
    pub(crate) fn refuse(&self, expected: &'static str) -> StrategyError {
        StrategyError::BadValue {
            strategy: self.strategy.to_owned(),
            key: self.key.to_owned(),
            value: self.value.to_owned(),
            expected,
        }
    }

    /// The error for a key that no parameter has.
    pub(crate) fn unknown(&self, parameters: &[Parameter]) -> StrategyError {
        let names: Vec<_> = parameters.iter().map(|parameter| format!("`{}`", parameter.name)).collect();
        StrategyError::UnknownParameter {
            strategy: self.strategy.to_owned(),
            key: self.key.to_owned(),
            known: if names.is_empty() { "none".to_owned() } else { names.join(", ") },
        }
    }

    /// The value as `T` where `fits`, `None` for `auto`.
    pub(crate) fn parse<T: FromStr>(
        &self,
        fits: impl Fn(&T) -> bool,
        expected: &'static str,
    ) -> Result<Option<T>, StrategyError> {
        if self.value == "auto" {
            return Ok(None);
        }
        match self.value.parse::<T>() {
            Ok(value) if fits(&value) => Ok(Some(value)),
            _ => Err(self.refuse(expected)),
        }
    }
}
