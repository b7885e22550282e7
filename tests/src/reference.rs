//! Pictures by an independent renderer, beside the workspace or where `LIGHTLOOM_SHARED` points.

use crate::Image;
use lightloom_passes::scene::Scene;
use std::env;
use std::path::{Path, PathBuf};

/// One scene with its reference pictures, averaged over 2 × 2 pixels: pixels are box-filtered areas, so that the average is
/// the picture at half the size, exactly.
#[derive(Debug)]
pub struct Reference {
    /// The scene as given.
    pub scene: Scene,
    /// Width and height of the pictures (pixels).
    pub size: [u32; 2],
    /// Radiance, all light.
    pub radiance: Image,
    /// Its standard error.
    pub standard_error: Image,
    /// Which pixels lie inside one smooth, non-specular surface.
    pub smooth: Vec<bool>,
    folder: PathBuf,
    name: String,
}

/// The folder of the scenes; `None` where they are not present.
fn folder() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    let shared = env::var_os("LIGHTLOOM_SHARED").map_or(beside, PathBuf::from);
    Some(shared.join("scenes")).filter(|folder| folder.is_dir())
}

/// The path of a shared scene; `None`, with a message, where it is not present.
///
/// # Panics
/// If `LIGHTLOOM_REQUIRE` is set and the scene is not there.
pub fn scene_path(name: &str) -> Option<PathBuf> {
    let path = folder().map(|folder| folder.join(format!("{name}.glb"))).filter(|path| path.is_file());
    if path.is_none() {
        let why = format!("the scene {name}.glb is not in the folder `scenes` of LIGHTLOOM_SHARED or ../shared");
        assert!(env::var_os("LIGHTLOOM_REQUIRE").is_none(), "{why}, and LIGHTLOOM_REQUIRE is set");
        println!("SKIPPED: {why}");
    }
    path
}

impl Reference {
    /// Loads `name`; `None`, with a message, where it is not present.
    ///
    /// # Panics
    /// If what is present cannot be read.
    pub fn load(name: &str) -> Option<Self> {
        let path = scene_path(name)?;
        let folder = path.parent()?.to_path_buf();
        let scene = Scene::load(&path).unwrap_or_else(|error| panic!("{error}"));
        let mask = image::open(folder.join(format!("{name}_mask.png"))).expect("the mask is a PNG").to_luma8();
        let size = [mask.width() / 2, mask.height() / 2];
        let is_smooth = |x: u32, y: u32| mask.get_pixel(x, y).0[0] == 255;
        let smooth = (0..size[0] * size[1])
            .map(|i| (2 * (i % size[0]), 2 * (i / size[0])))
            .map(|(x, y)| is_smooth(x, y) && is_smooth(x + 1, y) && is_smooth(x, y + 1) && is_smooth(x + 1, y + 1))
            .collect();
        let [radiance, error] = [String::new(), "_stderr".to_owned()].map(|part| picture(&folder, name, &part));
        Some(Self {
            scene,
            size,
            radiance: radiance.halved(average),
            // Errors of a mean of four independent pixels.
            standard_error: error.halved(|four| four.iter().map(|e| e * e).sum::<f64>().sqrt() / 4.0),
            smooth,
            folder,
            name: name.to_owned(),
        })
    }

    /// Another picture of the scene, `part` its suffix such as `_indirect`.
    pub fn part(&self, part: &str) -> Image {
        picture(&self.folder, &self.name, part).halved(average)
    }

    /// Mean of the channels over the smooth pixels.
    pub fn smooth_mean(&self, image: &Image) -> f64 {
        let smooth = self.smooth_pixels(image);
        let count = smooth.clone().count() as f64;
        smooth.map(|p| p.iter().sum::<f64>() / 3.0).sum::<f64>() / count
    }

    /// The smooth pixels of `image`.
    pub fn smooth_pixels<'a>(&'a self, image: &'a Image) -> impl Iterator<Item = &'a [f64; 3]> + Clone {
        image.pixels.iter().zip(&self.smooth).filter(|(_, smooth)| **smooth).map(|(pixel, _)| pixel)
    }
}

fn average(four: [f64; 4]) -> f64 {
    four.iter().sum::<f64>() / 4.0
}

fn picture(folder: &Path, name: &str, part: &str) -> Image {
    let path = folder.join(format!("{name}{part}.exr"));
    let picture = lightloom::read_exr(&path).unwrap_or_else(|error| panic!("{error}"));
    Image::from_rgb(picture.size(), picture.pixels())
}
