//! Pictures in f64 and their statistics.

/// RGB per pixel, rows from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Width and height (pixels).
    pub size: [u32; 2],
    /// Linear RGB.
    pub pixels: Vec<[f64; 3]>,
}

impl Image {
    /// A picture from RGBA texels as a texture holds them.
    ///
    /// # Panics
    /// If the texels do not fill the size.
    pub fn from_rgba(size: [u32; 2], texels: &[[f32; 4]]) -> Self {
        assert_eq!(texels.len(), (size[0] * size[1]) as usize, "one texel per pixel");
        let pixels = texels.iter().map(|t| [t[0], t[1], t[2]].map(f64::from)).collect();
        Self { size, pixels }
    }

    /// A picture from RGB pixels.
    ///
    /// # Panics
    /// If the pixels do not fill the size.
    pub fn from_rgb(size: [u32; 2], pixels: &[[f32; 3]]) -> Self {
        assert_eq!(pixels.len(), (size[0] * size[1]) as usize, "one value per pixel");
        Self { size, pixels: pixels.iter().map(|p| p.map(f64::from)).collect() }
    }

    /// The pixel at column `x` and row `y`.
    pub fn at(&self, x: u32, y: u32) -> [f64; 3] {
        self.pixels[(y * self.size[0] + x) as usize]
    }

    /// Mean over all pixels.
    pub fn mean(&self) -> [f64; 3] {
        let count = self.pixels.len() as f64;
        [0, 1, 2].map(|c| self.pixels.iter().map(|p| p[c]).sum::<f64>() / count)
    }

    /// Pixel by pixel `f(self, other)`.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn zip(&self, other: &Self, f: impl Fn(f64, f64) -> f64) -> Self {
        assert_eq!(self.size, other.size, "pictures of one size");
        let pair = |(a, b): (&[f64; 3], &[f64; 3])| [0, 1, 2].map(|c| f(a[c], b[c]));
        Self { size: self.size, pixels: self.pixels.iter().zip(&other.pixels).map(pair).collect() }
    }

    /// Each 2 × 2 block of pixels combined by `f`: half as wide and half as high.
    pub fn halved(&self, f: impl Fn([f64; 4]) -> f64) -> Self {
        let size = self.size.map(|side| side / 2);
        let block = |i: u32| {
            let (x, y) = (2 * (i % size[0]), 2 * (i / size[0]));
            let four = [self.at(x, y), self.at(x + 1, y), self.at(x, y + 1), self.at(x + 1, y + 1)];
            [0, 1, 2].map(|c| f(four.map(|p| p[c])))
        };
        Self { size, pixels: (0..size[0] * size[1]).map(block).collect() }
    }
}

/// The mean of independent frames, and its standard error, per pixel.
#[derive(Clone, Debug, Default)]
pub struct Pixels {
    /// Mean over the frames.
    pub mean: Image,
    /// Standard error of that mean.
    pub standard_error: Image,
}

impl Pixels {
    /// Each 2 × 2 block of independent pixels averaged.
    pub fn halved(&self) -> Self {
        Self {
            mean: self.mean.halved(|four| four.iter().sum::<f64>() / 4.0),
            standard_error: self.standard_error.halved(|four| four.iter().map(|e| e * e).sum::<f64>().sqrt() / 4.0),
        }
    }

    /// The same with each standard error replaced by the root mean square over the 3 × 3 pixels around it that `counts` has. A
    /// pixel that happened to miss rare bright paths is too dark *and* believes itself too sure; its neighbours know better.
    pub fn pooled(&self, counts: &[bool]) -> Self {
        let [width, height] = self.mean.size;
        let around = |i: u32, side: u32| i.saturating_sub(1)..(i + 2).min(side);
        let pool = |i: u32| {
            let (x, y) = (i % width, i / width);
            let near = around(y, height).flat_map(|v| around(x, width).map(move |u| (u, v)));
            let errors: Vec<[f64; 3]> =
                near.filter(|&(u, v)| counts[(v * width + u) as usize]).map(|(u, v)| self.standard_error.at(u, v)).collect();
            [0, 1, 2].map(|c| (errors.iter().map(|e| e[c] * e[c]).sum::<f64>() / errors.len().max(1) as f64).sqrt())
        };
        let pixels = (0..width * height).map(pool).collect();
        Self { mean: self.mean.clone(), standard_error: Image { size: self.mean.size, pixels } }
    }

    /// Mean over pixels of the channel means, and its standard error: pixels are independent.
    pub fn grey(&self) -> Mean {
        let count = self.mean.pixels.len() as f64;
        let grey = |p: &[f64; 3]| p.iter().sum::<f64>() / 3.0;
        let value = self.mean.pixels.iter().map(grey).sum::<f64>() / count;
        // Channels share their paths: the standard error of their mean is at most the mean of theirs.
        let variance = self.standard_error.pixels.iter().map(|p| grey(p).powi(2)).sum::<f64>();
        Mean { value, standard_error: variance.sqrt() / count }
    }
}

/// Sums over frames as they come, in f64 [Welford62].
///
/// [Welford62]: https://doi.org/10.1080/00401706.1962.10490022 "Note on a method for calculating corrected sums of squares and products, Welford, 1962"
#[derive(Clone, Debug, Default)]
pub(crate) struct Accumulator {
    mean: Image,
    deviations: Vec<[f64; 3]>,
    frames: u32,
}

impl Accumulator {
    pub(crate) fn add(&mut self, frame: &Image) {
        self.frames += 1;
        if self.frames == 1 {
            self.mean = frame.clone();
            self.deviations = vec![[0.0; 3]; frame.pixels.len()];
            return;
        }
        for ((mean, deviation), x) in self.mean.pixels.iter_mut().zip(&mut self.deviations).zip(&frame.pixels) {
            for c in 0..3 {
                let before = x[c] - mean[c];
                mean[c] += before / f64::from(self.frames);
                deviation[c] += before * (x[c] - mean[c]);
            }
        }
    }

    pub(crate) fn finish(self) -> Pixels {
        let n = f64::from(self.frames);
        let error = |d: &[f64; 3]| d.map(|d| (d / (n * (n - 1.0).max(1.0))).sqrt());
        let pixels = self.deviations.iter().map(error).collect();
        Pixels { standard_error: Image { size: self.mean.size, pixels }, mean: self.mean }
    }
}

/// A measured number and its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// The number.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}

impl Mean {
    /// Mean of independent measurements, and its standard error from their scatter.
    pub fn of(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let value = values.iter().sum::<f64>() / count;
        let scatter = values.iter().map(|x| (x - value).powi(2)).sum::<f64>() / (count - 1.0);
        Self { value, standard_error: (scatter / count).sqrt() }
    }

    /// Asserts that `expected` lies within four standard errors and the bound `bias` of the number. Four: a right
    /// answer fails once in 16,000 times if the errors are Gaussian.
    ///
    /// # Panics
    /// If it does not.
    #[track_caller]
    pub fn assert_near(&self, expected: f64, bias: f64, what: &str) {
        let Self { value, standard_error } = self;
        println!("{what}: {value:.6} ± {standard_error:.6}, expected {expected:.6} ± {bias:.6} (bias bound)");
        let apart = (value - expected).abs();
        assert!(
            apart <= 4.0 * standard_error + bias,
            "{what}: measured {value:.6} ± {standard_error:.6}, expected {expected:.6}: \
             apart by {apart:.6}, allowed 4 σ + {bias:.6}"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standard_errors_are_those_of_the_mean() {
        let mean = Mean::of(&[1.0, 2.0, 3.0, 4.0]);
        assert!((mean.value - 2.5).abs() < 1e-12, "{mean:?}");
        assert!((mean.standard_error - (5.0_f64 / 3.0 / 4.0).sqrt()).abs() < 1e-12, "{mean:?}");
        let mut sums = Accumulator::default();
        for x in [1.0, 2.0, 3.0, 4.0] {
            sums.add(&Image { size: [1, 1], pixels: vec![[x; 3]] });
        }
        let pixels = sums.finish();
        assert_eq!(pixels.grey(), mean, "one pixel is one measurement");
    }

    #[test]
    fn errors_of_blocks_and_neighbourhoods() {
        let image = |values: &[f64]| Image { size: [2, 2], pixels: values.iter().map(|&x| [x; 3]).collect() };
        let pixels = Pixels { mean: image(&[1.0, 2.0, 3.0, 6.0]), standard_error: image(&[3.0, 1.0, 1.0, 5.0]) };
        let halved = pixels.halved();
        assert_eq!(halved.mean.pixels, [[3.0; 3]], "mean of four");
        assert_eq!(halved.standard_error.pixels, [[1.5; 3]], "root of 36 over 4");
        let pooled = pixels.pooled(&[true, true, true, false]);
        let error = pooled.standard_error.pixels[0][1];
        assert!((error * error - 11.0 / 3.0).abs() < 1e-12, "without the fourth: {error}");
        assert_eq!(pooled.mean, pixels.mean, "means stay");
    }

    #[test]
    fn blocks_are_halved_in_place() {
        let pixels = (0..8).map(|i| [f64::from(i); 3]).collect();
        let halved = Image { size: [4, 2], pixels }.halved(|four| four.iter().sum::<f64>() / 4.0);
        assert_eq!(halved, Image { size: [2, 1], pixels: vec![[2.5; 3], [4.5; 3]] });
    }
}
