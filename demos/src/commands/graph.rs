//! `lightloom graph`: the render graph of one frame of a strategy.

use lightloom_graph::{PlanOptions, Profile, plan, to_chrome_trace, to_dot, to_html, to_json};

use crate::cli::{GraphArgs, GraphFormat};
use crate::files::{prepare_parent, write_whole};
use crate::session::Session;
use crate::{Error, console};

pub(crate) fn run(args: &GraphArgs) -> Result<(), Error> {
    args.scene.layer.layer()?;
    if let Some(output) = &args.output {
        prepare_parent(output)?;
    }
    let text = if args.format == GraphFormat::Trace {
        format!("{}\n", to_chrome_trace(&open(args)?.measure(&args.strategy)?))
    } else {
        planned(args)?
    };
    match &args.output {
        Some(output) => write_whole(output, text.as_bytes()),
        None => console::print(&text),
    }
}

/// What needs a plan, and times only where they are to be had.
fn planned(args: &GraphArgs) -> Result<String, Error> {
    let (mut session, profile) =
        if args.format == GraphFormat::Html { opened_and_measured(args)? } else { (open_to_plan(args)?, None) };
    let declaration = session.declare(&args.strategy)?.declaration()?;
    let planned = plan(&declaration, &PlanOptions::default())?;
    Ok(match args.format {
        GraphFormat::Json => format!("{:#}\n", to_json(&declaration, &planned)),
        GraphFormat::Html => to_html(&declaration, &planned, profile.as_ref()),
        GraphFormat::Frame => format!("{}\n", declaration.to_frame_json()),
        GraphFormat::Dot | GraphFormat::Trace => to_dot(&declaration, &planned),
    })
}

/// Without an adapter the frame is still planned and drawn.
fn opened_and_measured(args: &GraphArgs) -> Result<(Session, Option<Profile>), Error> {
    match open(args) {
        Ok(mut session) => {
            let profile = session.measure(&args.strategy)?;
            Ok((session, Some(profile)))
        }
        Err(Error::Gpu(error)) => {
            console::warn(&format!("no times, since the frame cannot run: {error}"));
            Ok((open_to_plan(args)?, None))
        }
        Err(error) => Err(error),
    }
}

fn open(args: &GraphArgs) -> Result<Session, Error> {
    Session::open(&args.scene, std::slice::from_ref(&args.strategy))
}

fn open_to_plan(args: &GraphArgs) -> Result<Session, Error> {
    Session::open_to_plan(&args.scene, std::slice::from_ref(&args.strategy))
}
