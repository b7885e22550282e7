//! `lightloom render`: one image.

use std::path::Path;

use crate::cli::RenderArgs;
use crate::display::Display;
use crate::files::{prepare_parent, write_whole};
use crate::format::{bytes, columns, count, number};
use crate::image_io::png;
use crate::session::{Job, Rendering, Session};
use crate::{Error, Picture, console, write_exr};

pub(crate) fn run(args: &RenderArgs) -> Result<(), Error> {
    let format = ImageFormat::of(&args.output)?;
    prepare_parent(&args.output)?;
    let mut session = Session::open(&args.scene, std::slice::from_ref(&args.strategy))?;
    let rendering =
        session.render(&Job { label: &args.strategy, strategy: &args.strategy, samples: args.samples, seed: args.scene.seed })?;
    for warning in session.warnings().iter().chain(&rendering.warnings) {
        console::warn(warning);
    }
    let picture = &rendering.picture;
    match format {
        ImageFormat::Exr => write_exr(&args.output, picture)?,
        ImageFormat::Png => {
            let rgb8 = Display::choose(args.scene.layer, picture).rgb8(picture);
            write_whole(&args.output, &png(picture.size(), &rgb8)?)?;
        }
    }
    console::print(&summary(&session, &rendering, &args.output, picture))
}

#[derive(Clone, Copy)]
enum ImageFormat {
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
