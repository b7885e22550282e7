//! `lightloom render`: one image.

use std::path::Path;

use lightloom_graph::to_chrome_trace;

use super::sequence;
use crate::cli::RenderArgs;
use crate::display::Display;
use crate::files::{prepare_parent, write_whole};
use crate::format::{bytes, columns, count, number};
use crate::image_io::png;
use crate::session::{Job, Rendering, Session, Tapped};
use crate::values::Shown;
use crate::{Error, Picture, console, write_exr};

pub(crate) fn run(args: &RenderArgs) -> Result<(), Error> {
    let format = ImageFormat::of(&args.output)?;
    prepare_parent(&args.output)?;
    if let Some(profile) = &args.profile {
        prepare_parent(profile)?;
    }
    let layer = match &args.scene.layer {
        Shown::Layer(layer) => *layer,
        Shown::Pass(pass) => return run_pass(args, format, pass),
    };
    if let Some(count) = args.animate {
        return sequence::run(args, format, layer, count);
    }
    let mut session = Session::open(&args.scene, std::slice::from_ref(&args.strategy))?;
    let rendering = session.render(&Job {
        label: &args.strategy,
        strategy: &args.strategy,
        samples: args.samples,
        seed: args.scene.seed,
        profile: args.profile.is_some(),
        plain: false,
        continues: false,
    })?;
    for warning in session.warnings().iter().chain(&rendering.warnings) {
        console::warn(warning);
    }
    let picture = &rendering.picture;
    write(&args.output, format, picture, || Display::choose(layer, picture))?;
    if let Some(profile) = &args.profile {
        write_whole(profile, format!("{}\n", to_chrome_trace(&rendering.profile)).as_bytes())?;
    }
    console::print(&summary(&session, &rendering, &args.output, picture))?;
    if let Some(choice) = rendering.row.said_choice() {
        console::note(&choice);
    }
    Ok(())
}

/// Shows what a pass writes.
fn run_pass(args: &RenderArgs, format: ImageFormat, pass: &str) -> Result<(), Error> {
    if args.profile.is_some() {
        return Err(Error::Usage(
            "--profile needs a layer of light or surfaces: a frame that is cut short has other times".to_owned(),
        ));
    }
    if args.animate.is_some() {
        return Err(Error::Usage("--animate needs a layer of light or surfaces; for a pass, name one pose by --time".to_owned()));
    }
    let mut session = Session::open(&args.scene, std::slice::from_ref(&args.strategy))?;
    let tapped = session.tap(&args.strategy, args.samples, pass)?;
    for warning in session.warnings() {
        console::warn(warning);
    }
    let texels = &tapped.texels;
    let display = Display::choose_for(texels);
    match texels.picture.nonfinite_pixels() {
        0 => {}
        bad => console::warn(&format!("pass `{pass}`: {bad} pixels are NaN or infinite")),
    }
    if texels.more_layers > 0 {
        console::note(&format!("the first of {} layers is shown", texels.more_layers + 1));
    }
    write(&args.output, format, &texels.picture, || display)?;
    console::print(&tap_summary(&session, pass, &tapped, format, display, &args.output))
}

fn tap_summary(session: &Session, pass: &str, tapped: &Tapped, format: ImageFormat, display: Display, output: &Path) -> String {
    let shown = match format {
        ImageFormat::Exr => "the values as they are".to_owned(),
        ImageFormat::Png => display.describe(),
    };
    left_aligned(vec![
        vec!["adapter".to_owned(), session.adapter().to_owned()],
        vec!["rays".to_owned(), session.trace().to_owned()],
        vec!["pass".to_owned(), pass.to_owned()],
        vec!["texture".to_owned(), format!("{}, {}", tapped.resource, tapped.description)],
        vec!["shown".to_owned(), shown],
        vec!["time".to_owned(), format!("{} s", number(Some(tapped.wall_ms / 1000.0)))],
        vec!["image".to_owned(), output.display().to_string()],
    ])
}

pub(super) fn write(
    output: &Path,
    format: ImageFormat,
    picture: &Picture,
    display: impl FnOnce() -> Display,
) -> Result<(), Error> {
    match format {
        ImageFormat::Exr => write_exr(output, picture),
        ImageFormat::Png => write_whole(output, &png(picture.size(), &display().rgb8(picture))?),
    }
}

#[derive(Clone, Copy)]
pub(super) enum ImageFormat {
    Exr,
    Png,
}

impl ImageFormat {
    fn of(path: &Path) -> Result<Self, Error> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match extension.as_str() {
            "exr" => Ok(Self::Exr),
            "png" => Ok(Self::Png),
            _ => Err(Error::Usage(format!(
                "the image {} must end in .exr (linear radiance) or .png (tone-mapped)",
                path.display()
            ))),
        }
    }
}

fn summary(session: &Session, rendering: &Rendering, output: &Path, picture: &Picture) -> String {
    let row = &rendering.row;
    let mut rows = vec![
        vec!["adapter".to_owned(), session.adapter().to_owned()],
        vec!["rays".to_owned(), session.trace().to_owned()],
        vec!["size".to_owned(), format!("{}x{}", picture.size()[0], picture.size()[1])],
        vec!["time".to_owned(), format!("{} s", number(Some(row.wall_ms / 1000.0)))],
        vec!["GPU time".to_owned(), format!("{} ms per frame", number(row.gpu_ms))],
        vec!["memory".to_owned(), bytes(row.bytes)],
    ];
    if row.photons.emitted > 0 {
        let photons = row.photons;
        let text = format!("{} emitted, {} stored", count(photons.emitted), count(photons.stored));
        rows.push(vec!["photons".to_owned(), text]);
    }
    rows.push(vec!["image".to_owned(), output.display().to_string()]);
    left_aligned(rows)
}

pub(super) fn left_aligned(mut rows: Vec<Vec<String>>) -> String {
    // Left-aligned values read better here than `columns`' right-aligned numbers.
    let widest = rows.iter().map(|row| row[1].chars().count()).max().unwrap_or(0);
    for row in &mut rows {
        row[1] = format!("{:<widest$}", row[1]);
    }
    columns(&rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_decides_and_others_are_wrong_usage() {
        assert!(matches!(ImageFormat::of(Path::new("a/b.EXR")), Ok(ImageFormat::Exr)), "exr");
        assert!(matches!(ImageFormat::of(Path::new("b.png")), Ok(ImageFormat::Png)), "png");
        for wrong in ["a.jpg", "a", "exr"] {
            let error = ImageFormat::of(Path::new(wrong)).err().map(|e| e.exit_status());
            assert_eq!(error, Some(2), "{wrong}");
        }
    }
}
