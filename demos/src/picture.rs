//! A linear RGB image in memory.

/// Linear Rec.709 RGB; row 0 on top. Radiance in W·m⁻²·sr⁻¹ unless the layer says otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    size: [u32; 2],
    pixels: Vec<[f32; 3]>,
}

impl Picture {
    /// A picture of `size` (width, height) from its pixels in rows; missing pixels are black, surplus ones dropped.
    pub fn new(size: [u32; 2], mut pixels: Vec<[f32; 3]>) -> Self {
        pixels.resize(size[0] as usize * size[1] as usize, [0.0; 3]);
        Self { size, pixels }
    }

    /// A picture from RGBA rows, such as a texture that was read back; alpha is dropped.
    pub fn from_rgba(size: [u32; 2], rgba: &[f32]) -> Self {
        let pixels = rgba.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect();
        Self::new(size, pixels)
    }

    /// Width and height (pixels).
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Pixels in rows from the top.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// How many pixels have a channel that is NaN or infinite.
    pub fn nonfinite_pixels(&self) -> u64 {
        let bad = |p: &&[f32; 3]| p.iter().any(|x| !x.is_finite());
        self.pixels.iter().filter(bad).count() as u64
    }

    /// The picture with every NaN and infinity replaced by 0, so that one of them does not swallow every mean.
    pub fn with_finite_values(mut self) -> Self {
        for channel in self.pixels.as_flattened_mut() {
            if !channel.is_finite() {
                *channel = 0.0;
            }
        }
        self
    }
}

/// Luminance of linear Rec.709 RGB.
pub(crate) fn luminance(rgb: [f32; 3]) -> f32 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonfinite_pixels_are_counted_once_each_and_become_black() {
        let picture = Picture::new([3, 1], vec![[f32::NAN, 1.0, f32::INFINITY], [1.0; 3], [0.0, 2.0, f32::NAN]]);
        assert_eq!(picture.nonfinite_pixels(), 2);
        let mended = picture.with_finite_values();
        assert_eq!(mended.pixels(), [[0.0, 1.0, 0.0], [1.0; 3], [0.0, 2.0, 0.0]]);
    }

    #[test]
    fn a_short_buffer_is_filled_with_black() {
        let picture = Picture::from_rgba([2, 1], &[1.0, 2.0, 3.0, 9.0]);
        assert_eq!(picture.pixels(), [[1.0, 2.0, 3.0], [0.0; 3]]);
    }
}
