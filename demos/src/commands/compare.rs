//! `lightloom compare`: strategies on the same photons, against a reference.

use std::path::Path;

use clap::Parser;
use lightloom_passes::PhotonStore;
use lightloom_strategies::{Auto, CausticMap, InstantRadiosity, Layer, ScreenSpace};

use crate::cli::{Cli, Command, CompareArgs, SceneArgs};
use crate::display::Display;
use crate::files::{prepare_folder, write_whole};
use crate::format::{bytes, columns, count, number, ratio};
use crate::image_io::png;
use crate::report::{self, Figure, error_map_rgb8};
use crate::results::{Reference, Results, Settings, StrategyResult};
use crate::session::{Job, REFERENCE_STRATEGY, Session, strategy_names};
use crate::{Error, Picture, console, flip, mean_ratio, read_exr, relative_mse, signed_error, write_exr};

/// Sets the seed of the reference apart, so that strategy `path` is not compared with its own paths.
const REFERENCE_SEED: u32 = 0x9e37_79b9;

/// The comparison of all strategies on a built-in scene, as a command line.
const BUILT_IN: &str = "lightloom compare builtin:caustics --reference path --size 160x120 --photons 40k --frames 4 \
                        --samples 64 -o out/caustics";

/// What the program does without arguments.
pub(crate) fn built_in() -> Result<(), Error> {
    let cli = Cli::try_parse_from(BUILT_IN.split_whitespace());
    let Ok(Cli { command: Some(Command::Compare(args)) }) = cli else {
        return Err(Error::Usage("name a command; `lightloom --help` lists them".to_owned()));
    };
    console::note(&format!("no arguments: the same as `{BUILT_IN}`"));
    run(&args)
}

pub(crate) fn run(args: &CompareArgs) -> Result<(), Error> {
    let layer = args.scene.layer.layer()?;
    let size = args.scene.size.0;
    prepare_folder(&args.output)?;
    // A wrong file is told before the work, not after it.
    let file = match &args.reference {
        Some(name) if name != Path::new(REFERENCE_STRATEGY) => Some(reference_file(name, size)?),
        _ => None,
    };
    let strategies = chosen(&args.strategies);
    let mut session = Session::open(&args.scene, &prepared(&strategies, args, file.is_some()))?;
    let mut results = describe(&args.scene, layer, &session);
    let reference = match (file, &args.reference) {
        (Some(picture), Some(name)) => {
            results.reference = Some(Reference { name: name.display().to_string(), ..Reference::default() });
            Some(picture)
        }
        (None, Some(_)) => Some(render_reference(args, &mut session, &mut results)?),
        _ => None,
    };
    let mut pictures = Vec::new();
    for name in &strategies {
        let rendering = session.render(&Job {
            label: name,
            strategy: name,
            samples: args.samples,
            seed: args.scene.seed,
            profile: false,
            plain: false,
            continues: false,
        })?;
        results.timing.clone_from(&rendering.timing);
        results.warnings.extend(rendering.warnings);
        results.strategies.push(rendering.row);
        pictures.push(rendering.picture);
    }
    let exposed = reference.as_ref().or(pictures.first());
    let Some(display) = exposed.map(|picture| Display::choose(layer, picture)) else {
        return Err(Error::Usage("name at least one strategy".to_owned()));
    };
    results.settings.exposure = display.exposure();
    let output = Output { folder: &args.output, display, reference: reference.as_ref() };
    output.write(&mut results, &pictures)?;
    for warning in &results.warnings {
        console::warn(warning);
    }
    if args.json {
        console::print(&format!("{}\n", json(&results)?))?;
    } else {
        console::print(&table(&results))?;
    }
    for choice in results.strategies.iter().filter_map(StrategyResult::said_choice) {
        console::note(&choice);
    }
    console::note(&format!("rays traced by {}", results.trace));
    console::note(&format!("report: {}", args.output.join("report.html").display()));
    Ok(())
}

/// The strategies asked for, each once; when none was, all that estimate all of the indirect light, but for the path tracer and `auto`,
/// which would show one of the others again.
fn chosen(asked: &[String]) -> Vec<String> {
    let others = [REFERENCE_STRATEGY, Auto::NAME, ScreenSpace::NAME, CausticMap::NAME, InstantRadiosity::NAME];
    let all = || strategy_names().into_iter().filter(|name| !others.contains(name)).map(str::to_owned).collect();
    if asked.is_empty() {
        return all();
    }
    let mut strategies: Vec<String> = Vec::new();
    for name in asked {
        if !strategies.contains(name) {
            strategies.push(name.clone());
        }
    }
    strategies
}

/// The strategies to build: those compared, and the one that renders the reference.
fn prepared(strategies: &[String], args: &CompareArgs, from_file: bool) -> Vec<String> {
    let mut names = strategies.to_vec();
    if args.reference.is_some() && !from_file && !names.iter().any(|name| name == REFERENCE_STRATEGY) {
        names.push(REFERENCE_STRATEGY.to_owned());
    }
    names
}

fn reference_file(path: &Path, size: [u32; 2]) -> Result<Picture, Error> {
    let picture = read_exr(path)?;
    let [w, h] = picture.size();
    if [w, h] != size {
        let reason = format!(
            "the reference is {w}x{h} and the comparison {}x{}; give --size {w}x{h}, or a reference of that size",
            size[0], size[1]
        );
        return Err(Error::read(path, &reason));
    }
    match picture.nonfinite_pixels() {
        0 => Ok(picture),
        bad => Err(Error::read(path, &format!("{bad} pixels are NaN or infinite: no reference"))),
    }
}

fn render_reference(args: &CompareArgs, session: &mut Session, results: &mut Results) -> Result<Picture, Error> {
    let rendering = session.render(&Job {
        label: "reference",
        strategy: REFERENCE_STRATEGY,
        samples: args.samples,
        seed: args.scene.seed ^ REFERENCE_SEED,
        profile: false,
        plain: true,
        continues: false,
    })?;
    results.reference = Some(Reference {
        name: REFERENCE_STRATEGY.to_owned(),
        samples: Some(args.samples),
        wall_ms: Some(rendering.row.wall_ms),
    });
    results.warnings.extend(rendering.warnings.iter().map(|w| format!("reference: {w}")));
    Ok(rendering.picture)
}

/// What is known before anything is rendered.
pub(super) fn describe(scene: &SceneArgs, layer: Layer, session: &Session) -> Results {
    Results {
        scene: scene.scene.display().to_string(),
        adapter: session.adapter().to_owned(),
        trace: session.trace().to_owned(),
        size: scene.size.0,
        lights: session.lights(),
        settings: Settings {
            layer: layer.name().to_owned(),
            camera: session.camera_name().to_owned(),
            time: scene.time,
            photons: scene.photons,
            bounces: scene.bounces,
            frames: scene.frames,
            emission: scene.emission.name().to_owned(),
            first_hit: scene.first_hit.name().to_owned(),
            photon_store: PhotonStore::from(scene.photon_store).name().to_owned(),
            seed: scene.seed,
            radius: scene.radius,
            materials: scene.materials.name().to_owned(),
            deterministic: scene.deterministic,
            filter: session.filter(),
            ambient_occlusion: scene.ambient_occlusion,
            exposure: 1.0,
        },
        warnings: session.warnings().to_vec(),
        ..Results::default()
    }
}

/// Where and how images, numbers and report are written.
struct Output<'a> {
    folder: &'a Path,
    display: Display,
    reference: Option<&'a Picture>,
}

impl Output<'_> {
    /// Fills in the metrics and writes every file.
    fn write(&self, results: &mut Results, pictures: &[Picture]) -> Result<(), Error> {
        let mut images = Vec::new();
        let mut errors = Vec::new();
        let mut shown_reference = None;
        if let Some(reference) = self.reference {
            let rgb8 = self.display.rgb8(reference);
            images.push(self.image("reference", reference, &rgb8)?);
            shown_reference = Some(rgb8);
        }
        for (row, picture) in results.strategies.iter_mut().zip(pictures) {
            let rgb8 = self.display.rgb8(picture);
            images.push(self.image(&row.name, picture, &rgb8)?);
            row.files = vec![format!("{}.png", row.name), format!("{}.exr", row.name)];
            if let (Some(reference), Some(shown)) = (self.reference, &shown_reference) {
                measure(row, picture, reference);
                row.flip = flip(&rgb8, shown, picture.size());
                let name = format!("{}_error", row.name);
                let map = error_map_rgb8(&signed_error(picture, reference));
                errors.push(Figure { name: row.name.clone(), png: self.png(&name, picture.size(), &map)? });
                row.files.push(format!("{name}.png"));
            }
        }
        write_whole(&self.folder.join("results.json"), json(results)?.as_bytes())?;
        let page = report::html(results, &images, &errors);
        write_whole(&self.folder.join("report.html"), page.as_bytes())
    }

    fn image(&self, name: &str, picture: &Picture, rgb8: &[u8]) -> Result<Figure, Error> {
        write_exr(&self.folder.join(format!("{name}.exr")), picture)?;
        Ok(Figure { name: name.to_owned(), png: self.png(name, picture.size(), rgb8)? })
    }

    fn png(&self, name: &str, size: [u32; 2], rgb8: &[u8]) -> Result<Vec<u8>, Error> {
        let png = png(size, rgb8)?;
        write_whole(&self.folder.join(format!("{name}.png")), &png)?;
        Ok(png)
    }
}

fn measure(row: &mut StrategyResult, picture: &Picture, reference: &Picture) {
    row.relmse = relative_mse(picture, reference);
    row.mean_ratio = mean_ratio(picture, reference);
}

pub(super) fn json(results: &Results) -> Result<String, Error> {
    serde_json::to_string_pretty(results).map_err(|error| Error::Unavailable(format!("results.json could not be made: {error}")))
}

fn table(results: &Results) -> String {
    let heads = ["strategy", "relMSE", "mean ratio", "FLIP", "GPU ms", "wall s", "memory", "stored", "dropped"];
    let mut rows = vec![heads.map(str::to_owned).to_vec()];
    for row in &results.strategies {
        rows.push(vec![
            row.name.clone(),
            number(row.relmse),
            ratio(row.mean_ratio),
            number(row.flip),
            number(row.gpu_ms),
            number(Some(row.wall_ms / 1000.0)),
            bytes(row.bytes),
            count(row.photons.stored),
            count(row.photons.dropped),
        ]);
    }
    columns(&rows)
}

#[cfg(test)]
mod tests {
    use lightloom_strategies::Layer;

    use super::*;

    #[test]
    fn the_built_in_comparison_is_a_command_line() {
        let cli = Cli::try_parse_from(BUILT_IN.split_whitespace()).unwrap();
        assert!(matches!(cli.command, Some(Command::Compare(_))), "{cli:?}");
    }

    #[test]
    fn each_strategy_is_compared_once() {
        let asked = ["tiled", "exact", "tiled"].map(str::to_owned);
        assert_eq!(chosen(&asked), ["tiled", "exact"]);
        let all = chosen(&[]);
        assert!(all.iter().any(|name| name == "hash-grid"), "{all:?}");
        let others = ["path", "auto", "screen-space", "caustic-map", "instant-radiosity"];
        assert!(!all.iter().any(|name| others.contains(&name.as_str())), "{all:?}");
    }

    #[test]
    fn a_comparison_writes_every_file_with_its_metrics() {
        let folder = tempfile::tempdir().unwrap();
        let flat = |value| Picture::new([16, 12], vec![[value; 3]; 192]);
        let (reference, picture) = (flat(1.0), flat(1.1));
        let row = StrategyResult { name: "tiled".to_owned(), ..StrategyResult::default() };
        let mut results = Results { size: [16, 12], strategies: vec![row], ..Results::default() };
        let output =
            Output { folder: folder.path(), display: Display::choose(Layer::Final, &reference), reference: Some(&reference) };
        output.write(&mut results, std::slice::from_ref(&picture)).unwrap();
        let row = &results.strategies[0];
        assert!((row.mean_ratio.unwrap() - 1.1).abs() < 1e-6, "{row:?}");
        assert!((row.relmse.unwrap() - 0.01 / 1.01).abs() < 1e-6, "{row:?}");
        assert!(row.flip.unwrap() > 0.0, "{row:?}");
        for file in row.files.iter().map(String::as_str).chain(["reference.exr", "reference.png", "results.json", "report.html"])
        {
            assert!(folder.path().join(file).exists(), "{file} is missing");
        }
        assert_eq!(read_exr(&folder.path().join("tiled.exr")).unwrap(), picture);
        let json = std::fs::read_to_string(folder.path().join("results.json")).unwrap();
        assert_eq!(serde_json::from_str::<Results>(&json).unwrap(), results);
    }

    #[test]
    fn a_reference_of_another_size_names_both() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.exr");
        write_exr(&path, &Picture::new([4, 2], vec![[1.0; 3]; 8])).unwrap();
        let error = reference_file(&path, [8, 4]).unwrap_err();
        let text = error.to_string();
        assert!(text.contains("4x2") && text.contains("8x4") && text.contains("r.exr"), "{text}");
        assert_eq!(error.exit_status(), 1);
        assert!(reference_file(&path, [4, 2]).is_ok(), "the same size is right");
    }
}
