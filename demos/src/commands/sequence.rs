//! `lightloom render --animate`: a sequence of images, and what it cost to move the scene for each.

use std::path::{Path, PathBuf};

use lightloom_strategies::Layer;

use super::compare::{describe, json};
use super::render::{ImageFormat, left_aligned, write};
use crate::cli::{RenderArgs, SceneArgs};
use crate::console;
use crate::display::Display;
use crate::files::write_whole;
use crate::format::number;
use crate::results::{Results, SequenceImage};
use crate::session::{Job, Session};
use crate::{Error, Picture};

/// Renders `count` images. Each is the mean of its own frames, for light of different poses is not to be averaged; with the filter,
/// which follows surfaces from pose to pose, of frames that remember the images before.
pub(super) fn run(args: &RenderArgs, format: ImageFormat, layer: Layer, count: u32) -> Result<(), Error> {
    if args.profile.is_some() {
        return Err(Error::Usage("--profile is for one image: leave out --animate".to_owned()));
    }
    // A sequence without --time begins at 0.
    let begin = args.scene.time.unwrap_or(0.0);
    let scene = SceneArgs { time: Some(begin), ..args.scene.clone() };
    let mut session = Session::open(&scene, std::slice::from_ref(&args.strategy))?;
    let mut results = describe(&scene, layer, &session);
    let mut display: Option<Display> = None;
    for index in 0..count {
        let time = begin + (f64::from(index) / f64::from(args.fps)) as f32;
        let cost = session.pose(time)?;
        let rendering = session.render(&Job {
            label: &format!("{} {}/{count}", args.strategy, index + 1),
            strategy: &args.strategy,
            samples: args.samples,
            seed: session.seed_of_image(args.scene.seed, index),
            profile: false,
            plain: false,
            continues: index > 0,
        })?;
        let picture: &Picture = &rendering.picture;
        // One exposure for all: the sequence is not to flicker.
        let display = *display.get_or_insert_with(|| Display::choose(layer, picture));
        results.settings.exposure = display.exposure();
        let file = numbered(&args.output, index);
        write(&file, format, picture, || display)?;
        results.sequence.push(SequenceImage {
            file: file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            time,
            pose_ms: cost.pose_ms,
            hierarchy: cost.followed.name().to_owned(),
            hierarchy_ms: cost.hierarchy_ms,
            upload_ms: cost.upload_ms,
            gpu_ms: rendering.row.gpu_ms,
            wall_ms: rendering.row.wall_ms,
        });
        results.timing.clone_from(&rendering.timing);
        for warning in rendering.warnings {
            if !results.warnings.contains(&warning) {
                results.warnings.push(warning);
            }
        }
        results.strategies = vec![rendering.row];
    }
    let file = args.output.with_file_name("results.json");
    write_whole(&file, json(&results)?.as_bytes())?;
    for warning in &results.warnings {
        console::warn(warning);
    }
    console::print(&summary(&results, &file))
}

/// `out.png` → `out.0007.png`.
fn numbered(output: &Path, index: u32) -> PathBuf {
    let extension = output.extension().unwrap_or_default().to_string_lossy();
    output.with_extension(format!("{index:04}.{extension}"))
}

fn summary(results: &Results, file: &Path) -> String {
    let images = &results.sequence;
    let mean = |of: fn(&SequenceImage) -> f64| images.iter().map(of).sum::<f64>() / images.len().max(1) as f64;
    let rebuilt = images.iter().filter(|image| image.hierarchy == "rebuild").count();
    let ms = |of: fn(&SequenceImage) -> f64| format!("{} ms", number(Some(mean(of))));
    left_aligned(vec![
        vec!["adapter".to_owned(), results.adapter.clone()],
        vec!["rays".to_owned(), results.trace.clone()],
        vec!["images".to_owned(), format!("{}, {rebuilt} of them after a new hierarchy", images.len())],
        vec!["pose".to_owned(), ms(|image| image.pose_ms)],
        vec!["hierarchy".to_owned(), ms(|image| image.hierarchy_ms)],
        vec!["upload".to_owned(), ms(|image| image.upload_ms)],
        vec!["rendering".to_owned(), ms(|image| image.wall_ms)],
        vec!["results".to_owned(), file.display().to_string()],
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_numbered_before_their_extension() {
        assert_eq!(numbered(Path::new("a/out.png"), 7), Path::new("a/out.0007.png"));
        assert_eq!(numbered(Path::new("b.c.EXR"), 12_345), Path::new("b.c.12345.EXR"));
    }
}
