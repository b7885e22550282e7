//! How far an image is from its reference.
//!
//! FLIP is [And20] on the tone-mapped images, at the reference implementation's default viewing distance
//! (67 pixels per degree).
//!
//! [And20]: https://doi.org/10.1145/3406183 "Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, FLIP: a difference evaluator for alternating images, 2020"

use crate::picture::{Picture, luminance};

/// Keeps relative errors finite where the reference is black (W²·m⁻⁴·sr⁻²).
const EPSILON: f64 = 0.01;

/// Mean of (x − r)² / (r² + 0.01) over pixels and channels. `None` when the sizes differ or there is no pixel.
pub fn relative_mse(image: &Picture, reference: &Picture) -> Option<f64> {
    let error = |x: f64, r: f64| (x - r).powi(2) / (r * r + EPSILON);
    mean_of_pairs(image, reference, error)
}

/// Mean of the image over the mean of the reference. `None` when the sizes differ or the reference is black.
pub fn mean_ratio(image: &Picture, reference: &Picture) -> Option<f64> {
    let image_mean = mean_of_pairs(image, reference, |x, _| x)?;
    let reference_mean = mean_of_pairs(image, reference, |_, r| r)?;
    (reference_mean.abs() > 1e-12).then(|| image_mean / reference_mean)
}

/// Mean FLIP error, 0 (equal) to 1, of two 8-bit sRGB images of one size.
pub fn flip(image_srgb8: &[u8], reference_srgb8: &[u8], size: [u32; 2]) -> Option<f64> {
    let bytes = size[0] as usize * size[1] as usize * 3;
    if bytes == 0 || image_srgb8.len() != bytes || reference_srgb8.len() != bytes {
        return None;
    }
    let image = nv_flip::FlipImageRgb8::with_data(size[0], size[1], image_srgb8);
    let reference = nv_flip::FlipImageRgb8::with_data(size[0], size[1], reference_srgb8);
    let map = nv_flip::flip(reference, image, nv_flip::DEFAULT_PIXELS_PER_DEGREE);
    Some(f64::from(nv_flip::FlipPool::from_image(&map).mean()))
}

/// Signed relative error per pixel, (y − s) / √(s² + 0.01) of luminances y and s of image and reference: negative where the image is too dark.
/// Empty when the sizes differ.
pub fn signed_error(image: &Picture, reference: &Picture) -> Vec<f32> {
    if image.size() != reference.size() {
        return Vec::new();
    }
    let pairs = image.pixels().iter().zip(reference.pixels());
    pairs
        .map(|(x, r)| {
            let (x, r) = (luminance(*x), luminance(*r));
            (x - r) / (r * r + EPSILON as f32).sqrt()
        })
        .collect()
}

fn mean_of_pairs(image: &Picture, reference: &Picture, term: impl Fn(f64, f64) -> f64) -> Option<f64> {
    if image.size() != reference.size() || image.pixels().is_empty() {
        return None;
    }
    let x = image.pixels().as_flattened().iter();
    let r = reference.pixels().as_flattened();
    let sum: f64 = x.zip(r).map(|(x, r)| term(f64::from(*x), f64::from(*r))).sum();
    Some(sum / r.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: f32) -> Picture {
        Picture::new([16, 16], vec![[value; 3]; 256])
    }

    #[test]
    fn an_image_does_not_differ_from_itself() {
        let picture = flat(0.7);
        assert_eq!(relative_mse(&picture, &picture), Some(0.0));
        assert_eq!(mean_ratio(&picture, &picture), Some(1.0));
        let bytes = vec![128; 16 * 16 * 3];
        assert_eq!(flip(&bytes, &bytes, [16, 16]), Some(0.0));
        assert!(signed_error(&picture, &picture).iter().all(|e| *e == 0.0));
    }

    #[test]
    fn relative_mse_is_the_formula() {
        // (2 − 1)² / (1 + 0.01), and (0.1 − 0)² / 0.01 on black.
        let error = relative_mse(&flat(2.0), &flat(1.0)).unwrap();
        assert!((error - 1.0 / 1.01).abs() < 1e-12);
        let on_black = relative_mse(&flat(0.1), &flat(0.0)).unwrap();
        assert!((on_black - 1.0).abs() < 1e-6);
        // One channel of one of two pixels off by 1: a sixth.
        let r = Picture::new([2, 1], vec![[1.0; 3]; 2]);
        let x = Picture::new([2, 1], vec![[1.0; 3], [1.0, 2.0, 1.0]]);
        assert!((relative_mse(&x, &r).unwrap() - 1.0 / 1.01 / 6.0).abs() < 1e-12);
    }

    #[test]
    fn ratio_and_sign_tell_dark_from_bright() {
        assert!((mean_ratio(&flat(0.5), &flat(1.0)).unwrap() - 0.5).abs() < 1e-9);
        assert!(signed_error(&flat(0.5), &flat(1.0))[0] < -0.4);
        assert!(signed_error(&flat(1.5), &flat(1.0))[0] > 0.4);
        assert_eq!(mean_ratio(&flat(0.5), &flat(0.0)), None);
    }

    #[test]
    fn different_sizes_have_no_metric() {
        let small = Picture::new([2, 2], vec![[1.0; 3]; 4]);
        assert_eq!(relative_mse(&small, &flat(1.0)), None);
        assert_eq!(mean_ratio(&small, &flat(1.0)), None);
        assert_eq!(flip(&[0; 12], &[0; 27], [2, 2]), None);
        assert!(signed_error(&small, &flat(1.0)).is_empty());
    }

    #[test]
    fn flip_of_black_and_white_is_large() {
        let (black, white) = (vec![0; 16 * 16 * 3], vec![255; 16 * 16 * 3]);
        assert!(flip(&black, &white, [16, 16]).unwrap() > 0.8);
    }
}
