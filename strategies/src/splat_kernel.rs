//! The ellipsoid kernel of photon splatting: one meaning for all strategies that splat. The formulas are in `shared/splat_kernel.wgsl`.
//!
//! A photon lights an ellipse in the plane of its surface: a disc of radius `r = s_l · s_d`, stretched towards the light by `s_u`, with
//! a slab of half thickness `s_n · r` about the plane [SA19, section 24.3.1]:
//!
//! ```text
//! s_d = clamp(√(z² c_tile / (π n_p)), disc_min, disc_max) · n_tile      n_p photons in a tile that covers z² c_tile at depth z
//! s_l = clamp(l / l_max, 0.1, 1)                                        l: length of the ray that brought the photon
//! s_u = min(1 / cos θ, s_max)                                           θ: between normal and light
//! ```
//!
//! The source gives no numbers. Those chosen here follow from what the numbers mean:
//!
//! - `n_tile`: a disc holds one photon, a kernel `n_tile² s_l² s_u` of them. 8 leaves some 20 photons at the mean ray length, a standard
//!   error near a quarter, for the filters to calm.
//! - `disc_max`: kernels 1.5 times as wide as the widest that [`KernelRadius`] chooses, 0.15 R · N^(−1/6), for many rays are shorter than
//!   `l_max`; `disc_min`: an eighth of it. Both fall with the number of photons N; between them a kernel holds the same number of photons
//!   whatever N, which alone would never calm: `disc_min` makes it consistent. In the built-in Cornell box the error is a fifth below that of
//!   [`KernelRadius`], and two thirds of a percent of the light lie beyond the edges of surfaces.
//! - `l_max`: half the radius R of the scene's bounding sphere; the source, too, has it follow from the scene's bounds.
//! - `s_max`: 4, the bound of the correction for shading normals too: the source has one constant for both.
//! - `s_n`: a quarter: surfaces as curved as a sphere of twice the kernel's radius are not cut.
//! - `tile`: 16 pixels: some hundreds of photons, so that the count itself is within a tenth.
//!
//! [SA19, section 24.3.1]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems chapter 24, 2019"

use crate::parameter::{Assignment, Parameter};
use crate::{KernelRadius, StrategyError};
use lightloom_graph::shader_struct;
use lightloom_passes::CameraUniform;
use lightloom_passes::scene::SceneInfo;

/// Automatic values, see the module's documentation.
const WIDEST_TO_KERNEL_RADIUS: f32 = 1.5;
const L_MAX_SHARE: f32 = 0.5;
const DISC_MIN_SHARE: f32 = 0.125;
const N_TILE: f32 = 8.0;
const S_N: f32 = 0.25;
const S_MAX: f32 = 4.0;
const TILE: u32 = 16;

shader_struct! {
    /// What the kernels of a frame have in common; the struct `SplatKernel` of `shared/splat_kernel.wgsl`.
    pub struct SplatKernelUniform {
        /// Least radius of a disc that holds one photon (m).
        pub disc_min: f32,
        /// Largest radius of such a disc (m).
        pub disc_max: f32,
        /// Kernel radii to discs' radii.
        pub n_tile: f32,
        /// Ray length of kernels of full size (m).
        pub l_max: f32,
        /// Half the thickness of the kernel to its radius.
        pub s_n: f32,
        /// Largest stretch towards the light.
        pub s_max: f32,
        /// Area of a tile at depth 1 m (m²).
        pub c_tile: f32,
        /// Edge of a tile (pixels).
        pub tile_size: u32,
        /// Tiles in the image.
        pub tiles: [u32; 2],
        /// Padding.
        pub pad0: u32,
        /// Padding.
        pub pad1: u32,
    }
}

/// The kernel as a user states it; `None` is automatic.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SplatKernel {
    /// Least radius of a disc that holds one photon (m); raising it blurs where photons lie densely, as in caustics. Automatic: an
    /// eighth of `disc_max`.
    pub disc_min_m: Option<f32>,
    /// Largest radius of such a disc (m); raising it blurs and calms where photons are sparse. Automatic: 0.15 R · N^(−1/6) /
    /// `n_tile`, R the radius of the scene's bounding sphere (m).
    pub disc_max_m: Option<f32>,
    /// Kernel radii to such discs' radii: kernels overlap `n_tile²` deep before rays' lengths shrink them. Raising it blurs and calms
    /// everywhere, up to the widest kernel. Automatic: 8.
    pub n_tile: Option<f32>,
    /// Ray length (m) of kernels of full size; raising it sharpens everywhere. Automatic: half the radius of the scene's
    /// bounding sphere.
    pub l_max_m: Option<f32>,
    /// Half the thickness of a kernel to its radius, in (0, 1]; raising it follows curved surfaces and leaks to other surfaces beside.
    /// Automatic: ¼.
    pub s_n: Option<f32>,
    /// Largest stretch towards the light, at least 1; raising it spreads light that grazes. Automatic: 4.
    pub s_max: Option<f32>,
    /// Edge of a density tile (pixels), 4 to 256; raising it evens the count of photons out and blurs its borders. Automatic: 16.
    pub tile: Option<u32>,
}

impl SplatKernel {
    /// The kernel for a frame of `emitted` photons.
    ///
    /// An automatic disc gives way to a stated one: a stated `disc_min` above the automatic `disc_max` raises that.
    ///
    /// # Errors
    /// If a value is out of its range.
    pub fn resolve(&self, info: &SceneInfo, emitted: u32, camera: &CameraUniform) -> Result<SplatKernelUniform, StrategyError> {
        let refuse =
            |setting, value: f32, expected| Err(StrategyError::BadSetting { setting, value: value.to_string(), expected });
        let n_tile = self.n_tile.unwrap_or(N_TILE);
        if !is_length(n_tile) {
            return refuse("n_tile", n_tile, "a positive number is needed");
        }
        let widest = WIDEST_TO_KERNEL_RADIUS * KernelRadius::default().resolve(info, emitted)?.r_max_m;
        let disc_max = self.disc_max_m.unwrap_or_else(|| (widest / n_tile).max(self.disc_min_m.unwrap_or(0.0)));
        if !is_length(disc_max) {
            return refuse("disc_max", disc_max, "a positive length in metres is needed");
        }
        let disc_min = self.disc_min_m.unwrap_or(DISC_MIN_SHARE * disc_max);
        if !(disc_min > 0.0 && disc_min <= disc_max) {
            return refuse("disc_min", disc_min, "a positive length in metres, at most disc_max, is needed");
        }
        // A scene without extent still needs a length; nothing will be splatted there.
        let l_max = self.l_max_m.unwrap_or(if is_length(info.bounds_radius) { L_MAX_SHARE * info.bounds_radius } else { 1.0 });
        if !is_length(l_max) {
            return refuse("l_max", l_max, "a positive length in metres is needed");
        }
        let (s_n, s_max) = (self.s_n.unwrap_or(S_N), self.s_max.unwrap_or(S_MAX));
        if !is_thickness(s_n) {
            return refuse("s_n", s_n, "a number above 0, at most 1, is needed");
        }
        if !is_stretch(s_max) {
            return refuse("s_max", s_max, "a number of at least 1 is needed");
        }
        let tile_size = self.tile.unwrap_or(TILE);
        if !is_tile(tile_size) {
            return refuse("tile", tile_size as f32, "a number of pixels from 4 to 256 is needed");
        }
        // PHYSICS: c_tile = 4 tan(α_x/2) tan(α_y/2) t_x t_y / (r_x r_y); the printed Eq. 3 lacks the 4.
        let edge = |axis: usize| 2.0 * camera.tan_half[axis] * tile_size as f32 / camera.size[axis] as f32;
        let tiles = camera.size.map(|pixels| pixels.div_ceil(tile_size));
        let c_tile = edge(0) * edge(1);
        Ok(SplatKernelUniform { disc_min, disc_max, n_tile, l_max, s_n, s_max, c_tile, tile_size, tiles, ..Default::default() })
    }

    /// Distance (m) beyond which no kernel reaches, of kernels that can be resolved: from the centre to the rim of the widest and most
    /// stretched one.
    pub(crate) fn reach_m(&self, info: &SceneInfo, emitted: u32) -> Option<f32> {
        // Tiles bound no kernel: any camera will do.
        let camera = CameraUniform { size: [1, 1], ..CameraUniform::default() };
        self.resolve(info, emitted, &camera).ok().map(|kernel| kernel.reach_m())
    }

    /// Sets the parameter of that key; `false` if the key is another.
    pub(crate) fn set(&mut self, assignment: &Assignment<'_>) -> Result<bool, StrategyError> {
        let length = |assignment: &Assignment<'_>| {
            assignment.parse(|&value| is_length(value), "a positive length in metres, or `auto`, is needed")
        };
        match assignment.key {
            "disc_min" => self.disc_min_m = length(assignment)?,
            "disc_max" => self.disc_max_m = length(assignment)?,
            "l_max" => self.l_max_m = length(assignment)?,
            "n_tile" => self.n_tile = assignment.parse(|&value| is_length(value), "a positive number, or `auto`, is needed")?,
            "s_n" => {
                self.s_n = assignment.parse(|&value| is_thickness(value), "a number above 0, at most 1, or `auto`, is needed")?;
            }
            "s_max" => {
                self.s_max = assignment.parse(|&value| is_stretch(value), "a number of at least 1, or `auto`, is needed")?;
            }
            "tile" => {
                self.tile =
                    assignment.parse(|&value| is_tile(value), "a number of pixels from 4 to 256, or `auto`, is needed")?;
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    pub(crate) fn parameters(&self) -> Vec<Parameter> {
        vec![
            Parameter::new(
                "disc_min",
                self.disc_min_m,
                "ellipsoid: least radius of a disc that holds one photon (m); raising it blurs where photons lie densely",
            ),
            Parameter::new(
                "disc_max",
                self.disc_max_m,
                "ellipsoid: largest radius of such a disc (m); raising it blurs and calms where photons are sparse",
            ),
            Parameter::new("n_tile", self.n_tile, "ellipsoid: kernel radii to such discs' radii; raising it blurs and calms"),
            Parameter::new("l_max", self.l_max_m, "ellipsoid: ray length of kernels of full size (m); raising it sharpens"),
            Parameter::new(
                "s_n",
                self.s_n,
                "ellipsoid: half the thickness of a kernel to its radius; raising it follows curves and leaks",
            ),
            Parameter::new(
                "s_max",
                self.s_max,
                "ellipsoid: largest stretch towards the light; raising it spreads light that grazes",
            ),
            Parameter::new(
                "tile",
                self.tile,
                "ellipsoid: edge of a density tile (pixels); raising it evens counts and blurs their borders",
            ),
        ]
    }
}

impl SplatKernelUniform {
    /// Distance (m) beyond which no kernel reaches: from the centre to the rim of the widest and most stretched one.
    pub fn reach_m(&self) -> f32 {
        self.disc_max * self.n_tile * self.s_max.hypot(self.s_n)
    }
}

fn is_length(value: f32) -> bool {
    value.is_finite() && value > 0.0
}

fn is_thickness(value: f32) -> bool {
    value > 0.0 && value <= 1.0
}

fn is_stretch(value: f32) -> bool {
    value.is_finite() && value >= 1.0
}

fn is_tile(value: u32) -> bool {
    (4..=256).contains(&value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::unit_scene;

    /// 90° by 90° over 64 × 32 pixels.
    fn camera() -> CameraUniform {
        CameraUniform { tan_half: [1.0, 1.0], size: [64, 32], ..CameraUniform::default() }
    }

    #[test]
    fn automatic_kernels_follow_the_scene_and_the_photons() {
        let scene = unit_scene();
        let kernel = |photons| SplatKernel::default().resolve(&scene, photons, &camera()).unwrap();
        let million = kernel(1_000_000);
        assert!((million.disc_max * million.n_tile / scene.bounds_radius - 0.015).abs() < 1e-5, "{million:?}: 0.15 R · N^(−1/6)");
        assert!((kernel(64_000_000).disc_max * 2.0 / million.disc_max - 1.0).abs() < 1e-4, "64 = 2⁶");
        assert_eq!((million.l_max, million.tiles), (0.5 * scene.bounds_radius, [4, 2]));
        // The image is 2 m × 2 m at 1 m, 4 × 2 tiles.
        assert!((million.c_tile - 0.5).abs() < 1e-6, "{million:?}");
        let wider = SplatKernel { n_tile: Some(16.0), ..SplatKernel::default() }.resolve(&scene, 1_000_000, &camera()).unwrap();
        assert!((wider.reach_m() / million.reach_m() - 1.0).abs() < 1e-5, "the widest kernel does not depend on n_tile");
    }

    #[test]
    fn stated_values_win_and_reach_bounds_them() {
        let stated =
            SplatKernel { disc_min_m: Some(10.0), n_tile: Some(2.0), s_max: Some(3.0), s_n: Some(1.0), ..SplatKernel::default() };
        let kernel = stated.resolve(&unit_scene(), 10, &camera()).unwrap();
        assert_eq!((kernel.disc_min, kernel.disc_max), (10.0, 10.0), "a stated disc_min raises the automatic disc_max");
        assert!((kernel.reach_m() - 20.0 * 10.0_f32.sqrt()).abs() < 1e-3, "{}", kernel.reach_m());
        let point = SceneInfo { bounds_radius: 0.0, ..unit_scene() };
        let kernel = SplatKernel::default().resolve(&point, 0, &camera()).unwrap();
        assert!(kernel.disc_min > 0.0 && kernel.l_max > 0.0, "a scene without extent has kernels: {kernel:?}");
    }

    #[test]
    fn values_out_of_range_are_refused() {
        let refused = [
            ("disc_min", "0"),
            ("disc_max", "-1"),
            ("disc_max", "inf"),
            ("l_max", "nan"),
            ("n_tile", "0"),
            ("n_tile", "many"),
            ("s_n", "0"),
            ("s_n", "1.5"),
            ("s_max", "0.9"),
            ("s_max", "inf"),
            ("tile", "3"),
            ("tile", "257"),
        ];
        let mut kernel = SplatKernel::default();
        for (key, value) in refused {
            let error = kernel.set(&Assignment { strategy: "splat-3d", key, value }).unwrap_err().to_string();
            assert!(error.contains(key) && error.contains(value) && error.contains("is needed"), "{error}");
        }
        assert_eq!(kernel, SplatKernel::default(), "what is refused changes nothing");
        assert!(
            !kernel.set(&Assignment { strategy: "splat-3d", key: "colour", value: "1" }).unwrap(),
            "an unknown key is left to others"
        );
        for parameter in kernel.parameters() {
            let set = kernel.set(&Assignment { strategy: "splat-3d", key: &parameter.name, value: "4" });
            assert!(parameter.name == "s_n" || set.unwrap(), "{} is set by its name", parameter.name);
        }
        // And by code.
        for wrong in [
            SplatKernel { disc_min_m: Some(2.0), disc_max_m: Some(1.0), ..SplatKernel::default() },
            SplatKernel { n_tile: Some(f32::NAN), ..SplatKernel::default() },
            SplatKernel { s_n: Some(-1.0), ..SplatKernel::default() },
            SplatKernel { s_max: Some(0.0), ..SplatKernel::default() },
            SplatKernel { l_max_m: Some(0.0), ..SplatKernel::default() },
            SplatKernel { tile: Some(0), ..SplatKernel::default() },
        ] {
            assert!(wrong.resolve(&unit_scene(), 10, &camera()).unwrap_err().to_string().contains("is needed"), "{wrong:?}");
        }
    }
}
