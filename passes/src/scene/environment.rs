//! Light from infinitely far away out of every direction: a map of radiance, and how to draw directions from it.
//!
//! The map is a latitude-longitude image: its top row is +y, its middle column shows −z and columns further right +x, as
//! a camera at rest sees them. Radiance is constant within a texel, which makes the sampling exact: a texel is drawn by its
//! luminance times its solid angle (first the row, then the column), a direction within it uniformly.

use super::SceneError;
use glam::{DVec3, Vec3};
use image::{ImageFormat, ImageReader};
use std::f64::consts::PI;
use std::path::Path;

/// Radiance (W·m⁻²·sr⁻¹) that comes from every direction, out of a latitude-longitude map.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// Columns and rows.
    size: [u32; 2],
    /// Row by row from the top.
    radiance: Vec<[f32; 3]>,
    /// By which the map is turned about +y, counter-clockwise as seen from above (radians).
    rotation: f32,
}

impl Environment {
    /// The same radiance from everywhere (W·m⁻²·sr⁻¹).
    ///
    /// # Errors
    /// As [`Self::from_map`].
    pub fn constant(radiance: Vec3) -> Result<Self, SceneError> {
        Self::from_map("constant", [1, 1], vec![radiance.to_array()])
    }

    /// A map of `size` columns and rows, row by row from the top (W·m⁻²·sr⁻¹). `name` stands for it in messages.
    ///
    /// # Errors
    /// [`SceneError::Environment`] if a texel is missing, negative or not finite.
    pub fn from_map(name: &str, size: [u32; 2], radiance: Vec<[f32; 3]>) -> Result<Self, SceneError> {
        let wrong = |problem: String| SceneError::Environment { file: name.to_owned(), problem };
        let [width, height] = size;
        let texels = u64::from(width) * u64::from(height);
        if texels == 0 || texels != radiance.len() as u64 {
            return Err(wrong(format!("{width}×{height} texels were announced and {} given", radiance.len())));
        }
        // Rays and sums work in 32 bits.
        let sound = |c: &f32| (0.0..=1e12).contains(c);
        if let Some(bad) = radiance.iter().position(|texel| !texel.iter().all(sound)) {
            let (x, y) = (bad as u64 % u64::from(width), bad as u64 / u64::from(width));
            return Err(wrong(format!(
                "texel ({x}, {y}) is {:?}; radiance must lie between 0 and 10¹² W·m⁻²·sr⁻¹ in every channel",
                radiance[bad]
            )));
        }
        Ok(Self { size, radiance, rotation: 0.0 })
    }

    /// Reads an OpenEXR or Radiance HDR image, whose values are taken as W·m⁻²·sr⁻¹.
    ///
    /// # Errors
    /// [`SceneError::Environment`] names the file and what is wrong with it.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        let name = path.display().to_string();
        let wrong = |problem: String| SceneError::Environment { file: name.clone(), problem };
        let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
        let reader = reader.map_err(|error| wrong(format!("it cannot be read: {error}. Check the path")))?;
        if !matches!(reader.format(), Some(ImageFormat::OpenExr | ImageFormat::Hdr)) {
            return Err(wrong("it is neither OpenEXR nor Radiance HDR; images of 8 bits hold no radiance".into()));
        }
        let image = reader.decode().map_err(|error| wrong(format!("it does not decode: {error}")))?.into_rgb32f();
        let size = image.dimensions().into();
        let texels = image.into_raw().chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        Self::from_map(&name, size, texels)
    }

    /// The same, turned about +y by `radians`, counter-clockwise as seen from above.
    pub fn with_rotation(self, radians: f32) -> Self {
        Self { rotation: radians, ..self }
    }

    /// Radiance from `direction` (unit, towards the environment).
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let [x, y] = self.texel(direction);
        self.radiance[y as usize * self.size[0] as usize + x as usize].into()
    }

    /// ∫ L dω over all directions (W·m⁻²): π R² of it enter a sphere of radius R.
    pub fn irradiance_all_round(&self) -> Vec3 {
        let rows = self.radiance.chunks_exact(self.size[0] as usize).enumerate();
        let sum: DVec3 = rows
            .map(|(row, texels)| {
                texels.iter().map(|&texel| Vec3::from(texel).as_dvec3()).sum::<DVec3>() * self.solid_angle(row as u32)
            })
            .sum();
        sum.as_vec3()
    }

    /// Column and row in `direction` (unit).
    fn texel(&self, direction: Vec3) -> [u32; 2] {
        let d = glam::Quat::from_rotation_y(-self.rotation) * direction;
        let u = 0.5 + d.x.atan2(-d.z) / (2.0 * std::f32::consts::PI);
        let v = d.x.hypot(d.z).atan2(d.y) / std::f32::consts::PI;
        let place = |at: f32, size: u32| ((at * size as f32) as u32).min(size - 1);
        [place(u, self.size[0]), place(v, self.size[1])]
    }

    /// Solid angle of a texel in that row (sr).
    fn solid_angle(&self, row: u32) -> f64 {
        let [width, height] = self.size.map(f64::from);
        let edge = |row: u32| (PI * f64::from(row) / height).cos();
        2.0 * PI / width * (edge(row) - edge(row + 1))
    }
}

/// The map as shaders read it; `shared/environment.wgsl` says what is where.
pub(super) struct Map {
    /// One column more than the environment has.
    pub(super) size: [u32; 2],
    pub(super) texels: Vec<[f32; 4]>,
}

impl Map {
    /// A black texel stands for no environment: bindings must not be empty.
    pub(super) fn new(environment: Option<&Environment>) -> Self {
        let Some(environment) = environment else { return Self { size: [2, 1], texels: vec![[0.0, 0.0, 0.0, 1.0]; 2] } };
        let [width, height] = environment.size;
        let rows: Vec<&[[f32; 3]]> = environment.radiance.chunks_exact(width as usize).collect();
        let row_weights: Vec<f64> =
            (0..height).map(|row| rows[row as usize].iter().map(luminance).sum::<f64>() * environment.solid_angle(row)).collect();
        let of_rows = cumulative(&row_weights);
        let mut texels = Vec::with_capacity((width as usize + 1) * height as usize);
        for (row, before) in rows.iter().zip(of_rows) {
            let weights: Vec<f64> = row.iter().map(luminance).collect();
            let of_columns = cumulative(&weights);
            texels.extend(row.iter().zip(of_columns).map(|(&[r, g, b], before)| [r, g, b, before]));
            texels.push([0.0, 0.0, 0.0, before]);
        }
        let (sin, cos) = environment.rotation.sin_cos();
        texels[width as usize][0] = cos;
        texels[width as usize][1] = sin;
        Self { size: [width + 1, height], texels }
    }
}

/// Luminance of linear Rec. 709.
fn luminance(texel: &[f32; 3]) -> f64 {
    let [r, g, b] = texel.map(f64::from);
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// The cumulative distribution of `weights`, ending at one; all alike when there is no weight at all. The probability of a step is
/// what it is *after* rounding to 32 bits, so that densities fit exactly what a search selects; what is darker than 2⁻²⁴ of
/// its row may round away.
fn cumulative(weights: &[f64]) -> Vec<f32> {
    let total: f64 = weights.iter().sum();
    let uniform = 1.0 / weights.len().max(1) as f64;
    let share = |weight: f64| if total > 0.0 { weight / total } else { uniform };
    // Rounding must not leave a gap at the end, nor give it to a step without weight.
    let last = weights.iter().rposition(|&weight| share(weight) > 0.0);
    let mut sum = 0.0;
    let steps = weights.iter().enumerate().map(|(index, &weight)| {
        sum += share(weight);
        if Some(index) >= last { 1.0 } else { sum.min(1.0) as f32 }
    });
    steps.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_find_their_texels() {
        // Four columns: their middles look to (from the left edge) between +z and −x, −x and −z, −z and +x, +x and +z.
        let map = (0..8_u8).map(|i| [f32::from(i); 3]).collect();
        let environment = Environment::from_map("map", [4, 2], map).unwrap();
        let at = |x: f32, y: f32, z: f32| environment.radiance(Vec3::new(x, y, z).normalize()).x as u32;
        assert_eq!([at(-1., 1., 1.), at(-1., 1., -1.), at(1., 1., -1.), at(1., 1., 1.)], [0, 1, 2, 3]);
        assert_eq!([at(-1., -1., 1.), at(1., -9., 1.)], [4, 7]);
        // A quarter turn counter-clockwise brings what was at (1, −1) to (−1, −1).
        let turned = environment.clone().with_rotation(std::f32::consts::FRAC_PI_2);
        assert_eq!(turned.radiance(Vec3::new(-1.0, 1.0, -1.0).normalize()).x as u32, 2);
    }

    #[test]
    fn a_constant_sky_sums_to_four_pi() {
        let constant = Environment::constant(Vec3::new(1.0, 2.0, 0.0)).unwrap();
        let fine = Environment::from_map("map", [64, 32], vec![[1.0, 2.0, 0.0]; 2048]).unwrap();
        for environment in [constant, fine] {
            let sum = environment.irradiance_all_round() / std::f32::consts::PI;
            assert!(sum.abs_diff_eq(Vec3::new(4.0, 8.0, 0.0), 1e-5), "{sum}");
        }
    }

    #[test]
    fn distributions_end_at_one_and_leave_out_the_dark() {
        assert_eq!(cumulative(&[0.0, 1.0, 0.0, 3.0, 0.0]), [0.0, 0.25, 0.25, 1.0, 1.0]);
        assert_eq!(cumulative(&[0.0, 0.0]), [0.5, 1.0]);
        let thirds = cumulative(&[0.1; 30]);
        assert!(thirds.is_sorted() && thirds[29].to_bits() == 1.0_f32.to_bits(), "{thirds:?}");
    }

    #[test]
    fn what_is_no_radiance_is_named() {
        let texels = vec![[0.0; 3], [0.0, -1.0, 0.0]];
        let error = Environment::from_map("sky.hdr", [1, 2], texels).unwrap_err().to_string();
        assert!(error.contains("`sky.hdr`") && error.contains("(0, 1)"), "{error}");
        assert!(Environment::from_map("sky.hdr", [2, 2], vec![[0.0; 3]; 3]).is_err(), "a texel is missing");
        assert!(Environment::constant(Vec3::splat(f32::INFINITY)).is_err(), "not finite");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("photo.hdr");
        std::fs::write(&path, b"\x89PNG\r\n\x1a\n").unwrap();
        let error = Environment::load(&path).unwrap_err().to_string();
        assert!(error.contains("photo.hdr") && error.contains("OpenEXR"), "{error}");
        let missing = Environment::load(&folder.path().join("none.exr")).unwrap_err().to_string();
        assert!(missing.contains("none.exr") && missing.contains("cannot be read"), "{missing}");
    }

    #[test]
    fn both_formats_bring_their_values() {
        let folder = tempfile::tempdir().unwrap();
        // Powers of two and zero are exact in Radiance's shared exponent.
        let texels: Vec<[f32; 3]> = vec![[0.5, 0.25, 0.0], [2.0, 2.0, 2.0], [64.0, 32.0, 0.0], [1.0, 0.0, 0.5]];
        let image = image::Rgb32FImage::from_raw(2, 2, texels.concat()).unwrap();
        for name in ["sky.exr", "sky.hdr"] {
            let path = folder.path().join(name);
            image::DynamicImage::ImageRgb32F(image.clone()).save(&path).unwrap();
            assert_eq!(Environment::load(&path).unwrap(), Environment::from_map(name, [2, 2], texels.clone()).unwrap(), "{name}");
        }
    }
}
