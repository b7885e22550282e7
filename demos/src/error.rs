//! What can go wrong in the program, and the exit status of each.

use std::path::{Path, PathBuf};

use lightloom_graph::{GpuError, GraphError};
use lightloom_passes::scene::SceneError;
use lightloom_strategies::StrategyError;

/// A failure of the program. The message names the file or option, the place and the mend.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The command line asks for something that does not exist; exit status 2.
    #[error("{0}")]
    Usage(String),
    /// A file could not be read or makes no sense.
    #[error("cannot read {}: {reason}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and where.
        reason: String,
    },
    /// A file could not be written.
    #[error("cannot write {}: {reason}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// The command is right but cannot be carried out here.
    #[error("{0}")]
    Unavailable(String),
    /// No adapter, or none that suffices.
    #[error("{0}\n  on Debian and Ubuntu, `bash demos/run.sh` installs a software driver (mesa-vulkan-drivers) by itself")]
    Gpu(#[from] GpuError),
    /// The scene's file is wrong.
    #[error(transparent)]
    Scene(SceneError),
    /// The graph refused a frame, or running it failed.
    #[error(transparent)]
    Graph(GraphError),
    /// A strategy refused its frame or its parameters.
    #[error(transparent)]
    Strategy(StrategyError),
    /// Ctrl-C.
    #[error("interrupted")]
    Interrupted,
}

impl Error {
    /// The exit status: 2 for wrong usage, 1 for everything else.
    pub fn exit_status(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            _ => 1,
        }
    }

    /// A file that cannot be read.
    pub(crate) fn read(path: &Path, reason: &impl ToString) -> Self {
        Self::Read { path: path.to_owned(), reason: reason.to_string() }
    }

    /// A file that cannot be written.
    pub(crate) fn write(path: &Path, reason: &impl ToString) -> Self {
        Self::Write { path: path.to_owned(), reason: reason.to_string() }
    }
}

impl From<SceneError> for Error {
    fn from(error: SceneError) -> Self {
        match error {
            SceneError::UnknownCamera { .. } | SceneError::UnknownLight { .. } | SceneError::PhotonWeight { .. } => {
                Self::Usage(error.to_string())
            }
            other => Self::Scene(other),
        }
    }
}

impl From<GraphError> for Error {
    fn from(error: GraphError) -> Self {
        match error {
            GraphError::Cancelled { .. } => Self::Interrupted,
            other => Self::Graph(other),
        }
    }
}

impl From<StrategyError> for Error {
    fn from(error: StrategyError) -> Self {
        match error {
            StrategyError::UnknownStrategy { .. }
            | StrategyError::NotComposable { .. }
            | StrategyError::UnknownParameter { .. }
            | StrategyError::BadValue { .. }
            | StrategyError::BadSetting { .. }
            | StrategyError::Filter(_) => Self::Usage(error.to_string()),
            StrategyError::Graph(error) => error.into(),
            other => Self::Strategy(other),
        }
    }
}
