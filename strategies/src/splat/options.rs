//! What splats look like, and what they are blended into.

use crate::parameter::{Assignment, Parameter};
use crate::splat_kernel::SplatKernel;
use crate::{KernelRadius, StrategyError};
use lightloom_graph::wgpu::TextureFormat;
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
    /// 16: what every WebGPU device blends. Each photon rounds a pixel's sum by up to 2⁻¹¹ of it, and one that is less than 2⁻¹² of the
    /// sum leaves no trace: good for hundreds of photons a pixel.
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

/// What a user can choose of a strategy that splats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplatConfig {
    /// The kernel.
    pub shape: SplatShape,
    /// Radii of spheres.
    pub radius: KernelRadius,
    /// Sizes of ellipsoids.
    pub kernel: SplatKernel,
    /// Bits of the targets. Automatic: 16, for a frame is declared before its device is known.
    pub precision: Option<SplatPrecision>,
    /// Size of the targets.
    pub resolution: SplatResolution,
}

impl SplatConfig {
    /// Automatic sizes, 16 bits, full resolution.
    pub(crate) fn new(shape: SplatShape) -> Self {
        Self {
            shape,
            radius: KernelRadius::default(),
            kernel: SplatKernel::default(),
            precision: None,
            resolution: SplatResolution::Full,
        }
    }

    pub(crate) fn precision(&self) -> SplatPrecision {
        self.precision.unwrap_or(SplatPrecision::Half)
    }

    /// Edge of a target's texel (pixels).
    pub(crate) fn texel(&self) -> Result<u32, StrategyError> {
        match (self.resolution, self.shape) {
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
            "shape" => self.shape = SplatShape::parse(assignment)?,
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
            _ => return Ok(self.radius.set(assignment)? || self.kernel.set(assignment)?),
        }
        Ok(true)
    }

    pub(crate) fn parameters(&self) -> Vec<Parameter> {
        let shape =
            "kernel: `sphere` [MML13], sized by r_min and r_max, or `ellipsoid` [SA19], sized by the parameters marked so";
        let precision = "bits of the blended targets: `half`, or `float` where the device blends 32-bit floats; `auto` is `half`";
        let resolution =
            "size of the targets: `full`, or `half` on both sides, for ellipsoids; a quarter of the fragments, less detail";
        let mut parameters = vec![
            Parameter::new("shape", Some(self.shape), shape),
            Parameter::new("precision", self.precision, precision),
            Parameter::new("resolution", Some(self.resolution), resolution),
        ];
        parameters.extend(self.radius.parameters());
        parameters.extend(self.kernel.parameters());
        parameters
    }
}

impl SplatShape {
    /// The shape that the value names.
    pub(crate) fn parse(assignment: &Assignment<'_>) -> Result<Self, StrategyError> {
        match assignment.value {
            "sphere" => Ok(Self::Sphere),
            "ellipsoid" => Ok(Self::Ellipsoid),
            _ => Err(assignment.refuse("`sphere` or `ellipsoid` is needed")),
        }
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
