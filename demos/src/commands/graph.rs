//! `lightloom graph`: the render graph of one frame of a strategy.

use lightloom_graph::{PlanOptions, plan, to_dot, to_json};

use crate::cli::{GraphArgs, GraphFormat};
use crate::files::{prepare_parent, write_whole};
use crate::session::Session;
use crate::{Error, console};

pub(crate) fn run(args: &GraphArgs) -> Result<(), Error> {
    if args.format == GraphFormat::Html {
        let text = "--format html is not in this release; there are: dot, json, frame";
        return Err(Error::Usage(text.to_owned()));
    }
    if let Some(output) = &args.output {
        prepare_parent(output)?;
    }
    let mut session = Session::open(&args.scene, std::slice::from_ref(&args.strategy))?;
    let declaration = session.declare(&args.strategy)?.declaration()?;
    let planned = plan(&declaration, &PlanOptions::default())?;
    let text = match args.format {
        GraphFormat::Dot | GraphFormat::Html => to_dot(&declaration, &planned),
        GraphFormat::Json => format!("{:#}\n", to_json(&declaration, &planned)),
        GraphFormat::Frame => format!("{}\n", declaration.to_frame_json()),
    };
    match &args.output {
        Some(output) => write_whole(output, text.as_bytes()),
        None => console::print(&text),
    }
}
