//! What can go wrong between choosing a strategy and having its image.

use lightloom_graph::{GraphError, ShaderError};
use lightloom_passes::FilterError;

/// Why a strategy could not be built, set, declared or run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StrategyError {
    /// No strategy has this name.
    #[error("there is no strategy `{name}`; the strategies are {known}")]
    UnknownStrategy {
        /// The name asked for.
        name: String,
        /// The names there are, for a person to read.
        known: String,
    },
    /// These strategies cannot share a frame.
    #[error("strategies cannot be composed as `{name}`: {reason}")]
    NotComposable {
        /// The composition asked for.
        name: String,
        /// What is in the way and what would do, for a person to read.
        reason: String,
    },
    /// The strategy has no such parameter.
    #[error("strategy `{strategy}` has no parameter `{key}`; its parameters are {known}")]
    UnknownParameter {
        /// Name of the strategy.
        strategy: String,
        /// The parameter asked for.
        key: String,
        /// The parameters there are, for a person to read.
        known: String,
    },
    /// The value does not fit the parameter.
    #[error("parameter `{key}` of strategy `{strategy}` cannot be `{value}`: {expected}")]
    BadValue {
        /// Name of the strategy.
        strategy: String,
        /// The parameter.
        key: String,
        /// The value that was given.
        value: String,
        /// What would fit.
        expected: &'static str,
    },
    /// The strategy gathers photons and the frame has none.
    #[error("strategy `{strategy}` gathers photons, and the frame has none: trace some and pass them in `FrameInputs::photons`")]
    NeedsPhotons {
        /// Name of the strategy.
        strategy: String,
    },
    /// The adapter lacks what the strategy needs.
    #[error("strategy `{strategy}` cannot run on this adapter: {missing}")]
    Unsupported {
        /// Name of the strategy.
        strategy: String,
        /// What is missing, for a person to read.
        missing: String,
    },
    /// A setting of the frame makes no sense.
    #[error("setting `{setting}` cannot be {value}: {expected}")]
    BadSetting {
        /// Name of the setting.
        setting: &'static str,
        /// The value that was given.
        value: String,
        /// What would fit.
        expected: &'static str,
    },
    /// A constant of the filter makes no sense.
    #[error(transparent)]
    Filter(#[from] FilterError),
    /// A shader of the strategy does not compile: a fault of the strategy.
    #[error(transparent)]
    Shader(#[from] ShaderError),
    /// The graph refused the frame or could not run it.
    #[error(transparent)]
    Graph(#[from] GraphError),
}
