//! The command line: what can be asked, and the words for it.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use lightloom_passes::{FirstHit as MapFirstHit, MapsBy, PhotonStore, RayBackend, RayBackendError, RsmSettings};

use crate::Error;
use crate::values::{
    Assignment, EnvironmentArg, ImageSize, LightPhotons, Shown, parse_count, parse_positive, parse_radius, parse_rate,
    parse_strategy, parse_time,
};

/// Renders glTF scenes by photon density estimation and compares the estimators.
///
/// Without a command: compares all strategies on a built-in scene, writes a report and says where it is.
#[derive(Clone, Debug, Parser)]
#[command(name = "lightloom", version, max_term_width = 110)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
}

#[derive(Clone, Debug, Subcommand)]
pub(crate) enum Command {
    /// Render one image of a scene by one strategy
    Render(RenderArgs),
    /// Render a scene by several strategies and write report.html, results.json and the images
    Compare(CompareArgs),
    /// Plan a frame description without a device: passes, memory, time
    Plan(PlanArgs),
    /// Write the render graph of one frame of a strategy
    Graph(GraphArgs),
    /// List what this machine offers and which strategies run on it
    Adapters,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// The image: .exr for linear radiance, .png tone-mapped
    #[arg(short, long, value_name = "OUT.{exr,png}")]
    pub(crate) output: PathBuf,
    /// How radiance is estimated; `path` is the reference; A+B takes caustics from the one that estimates nothing else, such as
    /// `screen-space`, and the rest from the other
    #[arg(long, value_name = "NAME", default_value = "tiled", value_parser = parse_strategy)]
    pub(crate) strategy: String,
    /// Paths per pixel of strategy `path`
    #[arg(long, value_name = "N", default_value = "64", value_parser = parse_positive, allow_negative_numbers = true)]
    pub(crate) samples: u32,
    /// Render N images of an animated scene, from --time on, as OUT.0000.png and so on. Each shows one pose, by its own --frames and
    /// the same seed; results.json beside them tells what moving the scene cost
    #[arg(long, value_name = "N", value_parser = parse_positive, allow_negative_numbers = true)]
    pub(crate) animate: Option<u32>,
    /// Images per second of the animation
    #[arg(long, value_name = "F", default_value = "24", value_parser = parse_rate, allow_negative_numbers = true, requires = "animate")]
    pub(crate) fps: f32,
    /// Also write the frames' times as a trace for Chrome's tracing page, Perfetto or Tracy
    #[arg(long, value_name = "FILE.json")]
    pub(crate) profile: Option<PathBuf>,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct CompareArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Strategies to compare; when not given all but `path`, `auto`, which is one of the others, `screen-space` and `caustic-map`, which show caustics alone, and `instant-radiosity`, which shows none
    #[arg(long, value_name = "A,B,…", value_delimiter = ',', value_parser = parse_strategy)]
    pub(crate) strategies: Vec<String>,
    /// What to compare with: `path` renders it here, a file is read
    #[arg(long, value_name = "path|FILE.exr")]
    pub(crate) reference: Option<PathBuf>,
    /// Paths per pixel of strategy `path` and of the reference
    #[arg(long, value_name = "N", default_value = "128", value_parser = parse_positive, allow_negative_numbers = true)]
    pub(crate) samples: u32,
    /// Folder for the report and the images
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Print results.json on stdout instead of the table
    #[arg(long)]
    pub(crate) json: bool,
}

/// What decides an image, whatever the command.
#[derive(Clone, Debug, Args)]
pub(crate) struct SceneArgs {
    /// A .gltf or .glb file, or builtin:NAME
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,
    /// Set a parameter of a strategy; with several strategies, or parts of one, also as NAME.K=V; of the filter as filter.K=V, K one of
    /// `history` (0.95), `iterations` (4), `clip` (3), `sigma_z` (1), `sigma_n` (32)
    #[arg(long = "set", value_name = "K=V")]
    pub(crate) assignments: Vec<Assignment>,
    /// Which part of the light, or of the surfaces: final, direct, indirect, caustic, albedo, normal, depth; for `render` also what
    /// a pass writes, as pass:NAME or pass:NAME.BINDING, with the names that `lightloom graph` shows
    #[arg(long, value_name = "NAME", default_value = "final")]
    pub(crate) layer: Shown,
    /// Image size in pixels
    #[arg(long, value_name = "WxH", default_value = "640x360")]
    pub(crate) size: ImageSize,
    /// A camera of the file; its first when not given
    #[arg(long, value_name = "NAME|INDEX")]
    pub(crate) camera: Option<String>,
    /// Show an animated scene S seconds into its animation; at rest when not given. After its last key it stays
    #[arg(long, value_name = "S", value_parser = parse_time, allow_negative_numbers = true)]
    pub(crate) time: Option<f32>,
    /// Photons emitted per frame, such as 250k or 1M
    #[arg(long, value_name = "N", default_value = "1M", value_parser = parse_count, allow_negative_numbers = true)]
    pub(crate) photons: u32,
    /// Bounces of a path at most; the default is as good as no limit, for roulette ends paths long before
    #[arg(long, value_name = "N", default_value = "32", value_parser = clap::value_parser!(u32).range(0..=256), allow_negative_numbers = true)]
    pub(crate) bounces: u32,
    /// Frames to average, each with other photons, all of the same pose; with `--filter on` each is filtered with what the frames before
    /// it left
    #[arg(long, value_name = "N", default_value = "1", value_parser = parse_positive, allow_negative_numbers = true)]
    pub(crate) frames: u32,
    /// Constant search radius in metres; the strategy's own when not given
    #[arg(long, value_name = "R", value_parser = parse_radius, allow_negative_numbers = true)]
    pub(crate) radius: Option<f32>,
    /// First number of the random sequences; the same seed gives the same photons
    #[arg(long, value_name = "N", default_value = "0", allow_negative_numbers = true)]
    pub(crate) seed: u32,
    /// Filter the indirect light over frames and neighbouring pixels; images of `--animate` are then filtered with those before them
    #[arg(long, value_enum, default_value_t)]
    pub(crate) filter: Switch,
    /// Darken the indirect light of the layer `final` where surfaces are nearer than RADIUS metres to each other, for the eye: photons find
    /// corners dark by themselves
    #[arg(long, value_name = "RADIUS", value_parser = parse_radius, allow_negative_numbers = true)]
    pub(crate) ambient_occlusion: Option<f32>,
    /// How rays find surfaces: `bvh`, a hierarchy in WGSL, on every adapter; `ray-query`, where the adapter has ray queries;
    /// `ray-pipeline`, photons by ray-tracing pipelines and other rays by `bvh`, on Vulkan, in builds with the feature of that name;
    /// `auto` takes what hardware runs, the first of `ray-query`, `ray-pipeline` and `bvh`
    #[arg(long, value_enum, default_value_t)]
    pub(crate) trace: Trace,
    /// How photons leave the lights: `lights`, evenly, or `maps`, more of them to where maps, drawn each frame, show bright surfaces, for
    /// less noise where much of the light meets nothing or black. `maps` traces its maps; `raster-maps` rasterises those of points, spots
    /// and directional lights
    #[arg(long, value_enum, default_value_t)]
    pub(crate) emission: Emission,
    /// Where the first hits of photons that follow maps come from: `traced`, rays, or `map`, what the map holds of points, spots and
    /// directional lights, quicker and a little wrong along outlines
    #[arg(long, value_enum, default_value_t)]
    pub(crate) first_hit: FirstHit,
    /// How photons are kept: `whole`, 32 bytes each, or `compact`, 20 bytes, a little coarser
    #[arg(long, value_enum, default_value_t)]
    pub(crate) photon_store: Store,
    /// How materials are read: `gltf`; `lambert` makes every opaque non-metal diffuse; `phong` has glossy surfaces reflect by a Blinn-Phong
    /// lobe of the same roughness, and keeps diffuse ones, mirrors and glass
    #[arg(long, value_enum, default_value_t)]
    pub(crate) materials: Materials,
    /// Light from infinitely far away: a latitude-longitude map (.exr or .hdr; its middle looks to −z), turned about +y by degrees, or a
    /// radiance as R,G,B in W·m⁻²·sr⁻¹ or as #rrggbb
    #[arg(long, value_name = "FILE[,DEGREES]|R,G,B|#rrggbb", allow_negative_numbers = true)]
    pub(crate) environment: Option<EnvironmentArg>,
    /// Give a light WEIGHT times the photons, 0.0625 to 16; a light, an emissive material or `environment` by its name
    #[arg(long, value_name = "NAME=WEIGHT")]
    pub(crate) light_photons: Vec<LightPhotons>,
    /// The same image bit for bit from run to run, whatever it costs
    #[arg(long)]
    pub(crate) deterministic: bool,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct PlanArgs {
    /// The description of a frame, as `lightloom graph --format frame` writes it
    #[arg(value_name = "FRAME.json")]
    pub(crate) frame: PathBuf,
    /// Print JSON instead of a table
    #[arg(long)]
    pub(crate) json: bool,
    /// Also write the plan as an HTML page
    #[arg(long, value_name = "FILE")]
    pub(crate) html: Option<PathBuf>,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct GraphArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// The strategy whose frame is written
    #[arg(long, value_name = "NAME", value_parser = parse_strategy)]
    pub(crate) strategy: String,
    /// html for a page to look at, trace for Chrome's tracing page, Perfetto or Tracy (both run the frame), dot for Graphviz, json for the
    /// plan, frame for `lightloom plan`
    #[arg(long, value_enum, default_value_t)]
    pub(crate) format: GraphFormat,
    /// The file; stdout when not given
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Switch {
    On,
    #[default]
    Off,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Trace {
    #[default]
    Auto,
    Bvh,
    RayQuery,
    RayPipeline,
}

impl Trace {
    /// The backend that was asked for; `None`: the best one.
    pub(crate) fn requested(self) -> Result<Option<RayBackend>, Error> {
        let requested = match self {
            Self::Auto => None,
            Self::Bvh => Some(RayBackend::Bvh),
            Self::RayQuery => Some(RayBackend::RayQuery),
            Self::RayPipeline => Some(RayBackend::Pipeline),
        };
        match requested.filter(|backend| !backend.is_built()) {
            Some(backend) => {
                let error = RayBackendError::NotBuilt { backend };
                Err(Error::Unavailable(format!("--trace {}: {error}", backend.name())))
            }
            None => Ok(requested),
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Emission {
    #[default]
    Lights,
    Maps,
    RasterMaps,
}

impl Emission {
    /// The word on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Lights => "lights",
            Self::Maps => "maps",
            Self::RasterMaps => "raster-maps",
        }
    }

    /// The maps, if any.
    pub(crate) fn maps(self, first_hit: FirstHit) -> Option<RsmSettings> {
        let maps_by = match self {
            Self::Lights => return None,
            Self::Maps => MapsBy::Rays,
            Self::RasterMaps => MapsBy::Raster,
        };
        let first_hit = match first_hit {
            FirstHit::Traced => MapFirstHit::Traced,
            FirstHit::Map => MapFirstHit::Map,
        };
        Some(RsmSettings { maps_by, first_hit, ..RsmSettings::default() })
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum FirstHit {
    #[default]
    Traced,
    Map,
}

impl FirstHit {
    /// The word on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Traced => "traced",
            Self::Map => "map",
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Store {
    #[default]
    Whole,
    Compact,
}

impl From<Store> for PhotonStore {
    fn from(store: Store) -> Self {
        match store {
            Store::Whole => Self::Whole,
            Store::Compact => Self::Compact,
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Materials {
    #[default]
    Gltf,
    Lambert,
    Phong,
}

impl Materials {
    /// The word on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Gltf => "gltf",
            Self::Lambert => "lambert",
            Self::Phong => "phong",
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum GraphFormat {
    #[default]
    Dot,
    Json,
    Html,
    Trace,
    Frame,
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn options_of_the_design_are_understood() {
        let line = "lightloom render a.glb -o o.exr --strategy hash-grid --set cell=0.1 --set levels=2 --layer indirect \
                    --size 320x180 --camera 1 --photons 1M --bounces 3 --frames 4 --radius 0.05 --seed 7 --filter off \
                    --trace bvh --materials lambert --deterministic --samples 16";
        let cli = Cli::try_parse_from(line.split_whitespace()).unwrap();
        let Some(Command::Render(args)) = cli.command else {
            panic!("not a render: {cli:?}");
        };
        assert_eq!(args.strategy, "hash-grid");
        assert_eq!(args.scene.assignments.len(), 2);
        assert_eq!(args.scene.size.0, [320, 180]);
        assert_eq!(args.scene.photons, 1_000_000);
        assert_eq!(args.scene.radius, Some(0.05));
        assert_eq!(args.scene.materials, Materials::Lambert);
        for materials in [Materials::Gltf, Materials::Lambert, Materials::Phong] {
            assert_eq!(
                Materials::from_str(materials.name(), false),
                Ok(materials),
                "the word that reports show is the one asked by"
            );
        }
        assert!(args.scene.deterministic, "--deterministic");
        let line = "lightloom compare a.glb --strategies exact,tiled --reference path -o out";
        let cli = Cli::try_parse_from(line.split_whitespace()).unwrap();
        let Some(Command::Compare(args)) = cli.command else {
            panic!("not a comparison: {cli:?}");
        };
        assert_eq!(args.strategies, ["exact", "tiled"]);
    }
}
