//! What splats look like, and what they are blended into.

use super::{SplatParams, scale};
use crate::parameter::{Assignment, Parameter};
use crate::splat_kernel::SplatKernel;
use crate::{FrameInputs, KNearest, KernelRadius, StrategyError};
use lightloom_graph::{Graph, wgpu::TextureFormat};
use lightloom_passes::Photons;
use lightloom_passes::scene::SceneInfo;
use std::fmt;

/// The kernel of a photon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplatShape {
    /// [MML13]'s: a sphere around the photon, summed as outgoing radiance, light by light. Radii by [`KernelRadius`].
    ///
    /// [MML13]: https://doi.org/10.1145/2448196.2448207 "Toward practical real-time photon mapping: efficient GPU density estimation, Mara, McGuire and Luebke, 2013"
    Sphere,
    /// [SA19]'s: an ellipse on the surface, summed as irradiance, reflected from its mean direction. Sizes by [`SplatKernel`].
    ///
    /// [SA19]: https://doi.org/10.1007/978-1-4842-4427-2_24 "Real-time global illumination with photon mapping, Smal and Aizenshtein, Ray Tracing Gems chapter 24, 2019"
    Ellipsoid,
}

/// Bits of the targets that splats are blended into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplatPrecision {
    /// 16: what every WebGPU device blends. Each photon rounds a pixel's sum by up to 2⁻¹¹ of it, or by up to 2⁻¹⁰ and always down where the
    /// device rounds towards zero, as llvmpipe does: that loses one or two hundredths of a percent of the light for each photon a pixel holds.
    /// One that is less than 2⁻¹² of the sum may leave no trace: good for a hundred photons a pixel.
    Half,
    /// 32, on devices with `FLOAT32_BLENDABLE`.
    Float,
}

/// Size of the targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplatResolution {
    /// The image's.
    Full,
    /// Half the image's on both sides: a quarter of the fragments, for [`SplatShape::Ellipsoid`] alone.
    Half,
}

/// The kernels of splats, and their sizes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplatKernels {
    /// Which.
    pub shape: SplatShape,
    /// Radii of spheres.
    pub radius: KernelRadius,
    /// Sizes of ellipsoids.
    pub kernel: SplatKernel,
}

/// What a user can choose of a strategy that draws splats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplatConfig {
    /// The kernels.
    pub kernels: SplatKernels,
    /// Bits of the targets. Automatic: 16, for a frame is declared before its device is known.
    pub precision: Option<SplatPrecision>,
    /// Size of the targets.
    pub resolution: SplatResolution,
}

impl SplatKernels {
    /// Automatic sizes.
    pub(crate) fn new(shape: SplatShape) -> Self {
        Self { shape, radius: KernelRadius::default(), kernel: SplatKernel::default() }
    }

    /// Distance (m) over which photons are gathered.
    pub(crate) fn reach_m(&self, info: &SceneInfo, emitted: u32) -> Option<f32> {
        match self.shape {
            SplatShape::Sphere => self.radius.reach_m(info, emitted),
            SplatShape::Ellipsoid => self.kernel.reach_m(info, emitted),
        }
    }

    /// The photons with radii by their neighbours, if spheres are to have such.
    pub(crate) fn by_neighbours(
        &self,
        nearest: &mut KNearest,
        graph: &mut Graph<'_>,
        frame: &FrameInputs<'_>,
        photons: &Photons,
    ) -> Result<Option<Photons>, StrategyError> {
        match self.shape {
            SplatShape::Sphere => nearest.add(graph, frame.info, photons, &self.radius),
            SplatShape::Ellipsoid => Ok(None),
        }
    }

    /// Parameters of passes that splat `photons` at the image's resolution.
    pub(crate) fn params(&self, frame: &FrameInputs<'_>, photons: &Photons) -> Result<SplatParams, StrategyError> {
        let radii = self.radius.resolve(frame.info, photons.emitted)?;
        Ok(SplatParams {
            camera: *frame.camera,
            kernel: self.kernel.resolve(frame.info, photons.emitted, frame.camera)?,
            r_min: radii.r_min_m,
            r_max: radii.r_max_m,
            scale: scale(frame.info, self.shape),
            texel: 1,
            film_size: frame.size.map(|pixels| pixels as f32),
            ..SplatParams::default()
        })
    }

    /// Sets the parameter of that key; `false` if the key is another.
    pub(crate) fn set(&mut self, assignment: &Assignment<'_>) -> Result<bool, StrategyError> {
        if assignment.key != "shape" {
            return Ok(self.radius.set(assignment)? || self.kernel.set(assignment)?);
        }
        self.shape = match assignment.value {
            "sphere" => SplatShape::Sphere,
            "ellipsoid" => SplatShape::Ellipsoid,
            _ => return Err(assignment.refuse("`sphere` or `ellipsoid` is needed")),
        };
        Ok(true)
    }

    pub(crate) fn parameters(&self) -> Vec<Parameter> {
        let shape = "kernel: `sphere` [MML13], sized by r_min, r_max and nearest, or `ellipsoid` [SA19], sized by the parameters marked so";
        let mut parameters = vec![Parameter::new("shape", Some(self.shape), shape)];
        parameters.extend(self.radius.parameters());
        parameters.extend(self.kernel.parameters());
        parameters
    }
}

impl SplatConfig {
    /// Automatic sizes, 16 bits, full resolution.
    pub(crate) fn new(shape: SplatShape) -> Self {
        Self { kernels: SplatKernels::new(shape), precision: None, resolution: SplatResolution::Full }
    }

    pub(crate) fn precision(&self) -> SplatPrecision {
        self.precision.unwrap_or(SplatPrecision::Half)
    }

    /// Edge of a target's texel (pixels).
    pub(crate) fn texel(&self) -> Result<u32, StrategyError> {
        match (self.resolution, self.kernels.shape) {
            (SplatResolution::Full, _) => Ok(1),
            (SplatResolution::Half, SplatShape::Ellipsoid) => Ok(2),
            (SplatResolution::Half, SplatShape::Sphere) => Err(StrategyError::BadSetting {
                setting: "resolution",
                value: "half".to_owned(),
                expected: "spheres are summed as reflected light, which has the detail of the image; use `full`, or `shape=ellipsoid`",
            }),
        }
    }

    /// Sets the parameter of that key; `false` if the key is another.
    pub(crate) fn set(&mut self, assignment: &Assignment<'_>) -> Result<bool, StrategyError> {
        match assignment.key {
            "precision" => {
                self.precision = match assignment.value {
                    "half" => Some(SplatPrecision::Half),
                    "float" => Some(SplatPrecision::Float),
                    "auto" => None,
                    _ => return Err(assignment.refuse("`half`, `float` or `auto` is needed")),
                }
            }
            "resolution" => {
                self.resolution = match assignment.value {
                    "full" => SplatResolution::Full,
                    "half" => SplatResolution::Half,
                    _ => return Err(assignment.refuse("`full` or `half` is needed")),
                }
            }
            _ => return self.kernels.set(assignment),
        }
        Ok(true)
    }

    pub(crate) fn parameters(&self) -> Vec<Parameter> {
        let precision = "bits of the blended targets: `half`, or `float` where the device blends 32-bit floats; `auto` is `half`";
        let resolution =
            "size of the targets: `full`, or `half` on both sides, for ellipsoids; a quarter of the fragments, less detail";
        let mut parameters = self.kernels.parameters();
        parameters.push(Parameter::new("precision", self.precision, precision));
        parameters.push(Parameter::new("resolution", Some(self.resolution), resolution));
        parameters
    }
}

impl SplatPrecision {
    /// Formats of targets of four and of two components.
    pub(crate) fn formats(self) -> [TextureFormat; 2] {
        match self {
            Self::Half => [TextureFormat::Rgba16Float, TextureFormat::Rg16Float],
            Self::Float => [TextureFormat::Rgba32Float, TextureFormat::Rg32Float],
        }
    }

    /// Largest number of the format, at which sums are cut and counted.
    pub(crate) fn largest(self) -> f32 {
        match self {
            Self::Half => 65_504.0,
            Self::Float => f32::MAX,
        }
    }
}

impl fmt::Display for SplatShape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sphere => "sphere",
            Self::Ellipsoid => "ellipsoid",
        })
    }
}

impl fmt::Display for SplatPrecision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Half => "half",
            Self::Float => "float",
        })
    }
}

impl fmt::Display for SplatResolution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Full => "full",
            Self::Half => "half",
        })
    }
}
