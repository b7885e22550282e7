//! EXR in and out, PNG out.

use std::fs::File;
use std::io::{BufReader, Cursor};
use std::path::Path;

use image::codecs::openexr::{OpenExrDecoder, OpenExrEncoder};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageDecoder, ImageEncoder};

use crate::files::write_whole;
use crate::{Error, MAX_SIZE, Picture};

/// Reads the R, G and B channels of an EXR file (16- or 32-bit float, not deep); alpha is dropped.
pub fn read_exr(path: &Path) -> Result<Picture, Error> {
    let file = File::open(path).map_err(|error| Error::read(path, &error))?;
    let wrong = |error: image::ImageError| Error::read(path, &format!("not a readable EXR: {error}"));
    let decoder = OpenExrDecoder::with_alpha_preference(BufReader::new(file), Some(false)).map_err(wrong)?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 || width > MAX_SIZE || height > MAX_SIZE {
        let reason = format!("its size is {width}x{height}, and images are 1x1 to {MAX_SIZE}x{MAX_SIZE}");
        return Err(Error::read(path, &reason));
    }
    let mut bytes = vec![0_u8; width as usize * height as usize * 12];
    decoder.read_image(&mut bytes).map_err(wrong)?;
    let value = |b: &[u8]| f32::from_ne_bytes([b[0], b[1], b[2], b[3]]);
    let pixels = bytes.chunks_exact(12).map(|p| [value(&p[0..4]), value(&p[4..8]), value(&p[8..12])]).collect();
    Ok(Picture::new([width, height], pixels))
}

/// Writes 32-bit float channels R, G, B, linear, without tone mapping.
pub fn write_exr(path: &Path, picture: &Picture) -> Result<(), Error> {
    let [width, height] = picture.size();
    let bytes: Vec<u8> = picture.pixels().as_flattened().iter().flat_map(|x| x.to_ne_bytes()).collect();
    let mut file = Cursor::new(Vec::new());
    OpenExrEncoder::new(&mut file)
        .write_image(&bytes, width, height, ExtendedColorType::Rgb32F)
        .map_err(|error| Error::write(path, &error))?;
    write_whole(path, &file.into_inner())
}

/// An image of 8-bit RGB rows as a PNG in memory.
pub(crate) fn png(size: [u32; 2], rgb8: &[u8]) -> Result<Vec<u8>, Error> {
    let mut file = Vec::new();
    PngEncoder::new(&mut file)
        .write_image(rgb8, size[0], size[1], ExtendedColorType::Rgb8)
        .map_err(|error| Error::Unavailable(format!("a PNG could not be made: {error}")))?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exr_keeps_every_bit_and_names_its_channels() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let pixels = vec![[0.1, -2.0, 3e30], [1e-30, 0.0, 65504.5], [7.0, 8.0, 9.0], [1.0, 0.5, 0.25]];
        let picture = Picture::new([2, 2], pixels);
        write_exr(&path, &picture).unwrap();
        assert_eq!(read_exr(&path).unwrap(), picture);
        // The attribute `channels` lists each as: name, type (2 = float).
        let bytes = std::fs::read(&path).unwrap();
        for channel in [b"B\0\x02\0\0\0", b"G\0\x02\0\0\0", b"R\0\x02\0\0\0"] {
            assert!(bytes.windows(6).any(|w| w == channel), "{channel:?} is not there as 32-bit float");
        }
    }

    #[test]
    fn what_is_not_an_exr_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("b.exr");
        let missing = read_exr(&path).unwrap_err().to_string();
        assert!(missing.contains("b.exr") && missing.contains("cannot read"), "{missing}");
        std::fs::write(&path, b"not an image").unwrap();
        let wrong = read_exr(&path).unwrap_err().to_string();
        assert!(wrong.contains("b.exr") && wrong.contains("EXR"), "{wrong}");
    }

    #[test]
    fn a_truncated_exr_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c.exr");
        write_exr(&path, &Picture::new([64, 64], vec![[0.3, 0.1, 0.7]; 4096])).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        for length in [bytes.len() / 4, bytes.len() / 2, bytes.len() - 8] {
            std::fs::write(&path, &bytes[..length]).unwrap();
            assert!(read_exr(&path).is_err(), "cut at {length} of {}", bytes.len());
        }
    }

    #[test]
    fn png_decodes_to_the_same_bytes() {
        let rgb = [0_u8, 1, 2, 253, 254, 255];
        let file = png([2, 1], &rgb).unwrap();
        let back = image::load_from_memory(&file).unwrap().to_rgb8();
        assert_eq!(back.into_raw(), rgb);
    }
}
