//! Pictures by an independent renderer, beside the workspace or where `LIGHTLOOM_SHARED` points.

use crate::{Image, Pixels};
use lightloom_passes::scene::Scene;
use std::env;
use std::path::{Path, PathBuf};

/// One scene with its reference pictures.
#[derive(Debug)]
pub struct Reference {
    /// The scene as given.
    pub scene: Scene,
    /// Radiance, all light, and its standard error.
    pub radiance: Pixels,
    /// Pixels inside one smooth, non-specular surface.
    pub smooth: Smooth,
    folder: PathBuf,
    name: String,
    halvings: u32,
}

/// A set of pixels: those inside one smooth, non-specular surface.
#[derive(Clone, Debug)]
pub struct Smooth {
    size: [u32; 2],
    /// Whether each pixel is in the set, rows from the top.
    pub pixels: Vec<bool>,
}

impl Smooth {
    /// Blocks of 2 × 2 pixels all of which are in the set.
    pub fn halved(&self) -> Self {
        let size = self.size.map(|side| side / 2);
        let at = |x: u32, y: u32| self.pixels[(y * self.size[0] + x) as usize];
        let block = |i: u32| {
            let (x, y) = (2 * (i % size[0]), 2 * (i / size[0]));
            at(x, y) && at(x + 1, y) && at(x, y + 1) && at(x + 1, y + 1)
        };
        Self { size, pixels: (0..size[0] * size[1]).map(block).collect() }
    }

    /// The pixels of `image` that are in the set.
    pub fn of<'a>(&'a self, image: &'a Image) -> impl Iterator<Item = &'a [f64; 3]> + Clone {
        image.pixels.iter().zip(&self.pixels).filter(|(_, smooth)| **smooth).map(|(pixel, _)| pixel)
    }

    /// Mean of the channels over the set.
    pub fn mean(&self, image: &Image) -> f64 {
        self.of(image).flatten().sum::<f64>() / (3 * self.of(image).count()) as f64
    }
}

/// The folder of the scenes; `None` where they are not present.
fn folder() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    let shared = env::var_os("LIGHTLOOM_SHARED").map_or(beside, PathBuf::from);
    Some(shared.join("scenes")).filter(|folder| folder.is_dir())
}

/// The path of a shared scene; `None`, with a message, where it is not present.
pub fn scene_path(name: &str) -> Option<PathBuf> {
    let path = folder().map(|folder| folder.join(format!("{name}.glb"))).filter(|path| path.is_file());
    if path.is_none() {
        println!("SKIPPED: the scene {name}.glb is not in the folder `scenes` of LIGHTLOOM_SHARED or ../shared");
    }
    path
}

impl Reference {
    /// Loads `name`, its pictures averaged over 2 × 2 pixels `halvings` times: pixels are box-filtered areas, so that the average is
    /// the picture at a smaller size, exactly. `None`, with a message, where it is not present.
    ///
    /// # Panics
    /// If what is present cannot be read.
    pub fn load(name: &str, halvings: u32) -> Option<Self> {
        let path = scene_path(name)?;
        let folder = path.parent()?.to_path_buf();
        let scene = Scene::load(&path).unwrap_or_else(|error| panic!("{error}"));
        let mask = image::open(folder.join(format!("{name}_mask.png"))).expect("the mask is a PNG").to_luma8();
        let size = [mask.width(), mask.height()];
        let mut smooth = Smooth { size, pixels: mask.pixels().map(|pixel| pixel.0[0] == 255).collect() };
        let [mean, standard_error] = ["", "_stderr"].map(|part| picture(&folder, name, part));
        let mut radiance = Pixels { mean, standard_error };
        for _ in 0..halvings {
            (smooth, radiance) = (smooth.halved(), radiance.halved());
        }
        Some(Self { scene, radiance, smooth, folder, name: name.to_owned(), halvings })
    }

    /// Width and height of the pictures (pixels).
    pub fn size(&self) -> [u32; 2] {
        self.radiance.mean.size
    }

    /// Another picture of the scene, `part` its suffix such as `_indirect`.
    pub fn part(&self, part: &str) -> Image {
        let average = |four: [f64; 4]| four.iter().sum::<f64>() / 4.0;
        (0..self.halvings).fold(picture(&self.folder, &self.name, part), |image, _| image.halved(average))
    }
}

fn picture(folder: &Path, name: &str, part: &str) -> Image {
    let path = folder.join(format!("{name}{part}.exr"));
    let picture = lightloom::read_exr(&path).unwrap_or_else(|error| panic!("{error}"));
    Image::from_rgb(picture.size(), picture.pixels())
}
