//! One file per command.

mod adapters;
mod compare;
mod graph;
mod plan;
mod render;
mod sequence;

use crate::Error;
use crate::cli::{Cli, Command};

/// Does what the command line asks.
pub(crate) fn run(cli: Cli) -> Result<(), Error> {
    match cli.command {
        None => compare::built_in(),
        Some(Command::Render(args)) => render::run(&args),
        Some(Command::Compare(args)) => compare::run(&args),
        Some(Command::Plan(args)) => plan::run(&args),
        Some(Command::Graph(args)) => graph::run(&args),
        Some(Command::Adapters) => adapters::run(),
    }
}
