//! All textures of a scene in one array texture, texel after texel.
//!
//! WebGPU's default limits have no arrays of bindings, and images differ in size. So their texels are
//! laid one after the other and cut into pages, the layers of one texture:
//!
//! ```text
//! texel i  →  column i % 4096, row (i / 4096) % 2048, layer i / (4096 · 2048)
//! ```
//!
//! Shaders look texels up by index and filter themselves. A storage buffer was the alternative; it
//! would spend one of eight bindings twice (no sRGB decoding) and 128 MiB end at 33 million texels.

use super::gpu_types::{NONE, TextureSlot};
use super::{TextureData, TextureUse};

/// Texels across a page.
pub(super) const PAGE_WIDTH: u32 = 4096;
/// Texels down a page.
pub(super) const PAGE_HEIGHT: u32 = 2048;
/// Texels that a 32-bit index can name.
pub(super) const MOST_TEXELS: u64 = NONE as u64;

/// Where each texture starts and how large the array texture is.
#[derive(Debug)]
pub(super) struct Pages {
    first: Vec<u64>,
    total: u64,
}

/// Texels of whole rows to be written at once.
pub(super) struct Strip {
    /// Layer.
    pub(super) layer: u32,
    /// First row on that layer.
    pub(super) row: u32,
    /// Texels across: the texture's width.
    pub(super) width: u32,
    /// Rows.
    pub(super) rows: u32,
}

impl Pages {
    pub(super) fn new(textures: &[TextureData]) -> Self {
        let mut total = 0;
        let first = textures
            .iter()
            .map(|data| {
                let first = total;
                total += u64::from(data.width) * u64::from(data.height);
                first
            })
            .collect();
        Self { first, total }
    }

    /// Texels of all textures.
    pub(super) fn total(&self) -> u64 {
        self.total
    }

    /// Width, height and layers of the array texture; at least one texel.
    pub(super) fn size(&self) -> [u32; 3] {
        let total = self.total.max(1);
        let rows = total.div_ceil(PAGE_WIDTH.into());
        [total.min(PAGE_WIDTH.into()) as u32, rows.min(PAGE_HEIGHT.into()) as u32, rows.div_ceil(PAGE_HEIGHT.into()) as u32]
    }

    /// The slot of a texture as a material uses it.
    pub(super) fn slot(&self, textures: &[TextureData], using: Option<TextureUse>) -> TextureSlot {
        let found = using.and_then(|using| {
            let index = using.texture as usize;
            Some((using, textures.get(index)?, *self.first.get(index)?))
        });
        let Some((using, data, first)) = found else {
            return TextureSlot { first_texel: NONE, ..TextureSlot::default() };
        };
        TextureSlot {
            first_texel: first as u32,
            width: data.width,
            height: data.height,
            wrap: using.wrap[0].code() | using.wrap[1].code() << 2,
            uv_x: using.image_from_mesh_uv[0].to_array(),
            pad0: 0,
            uv_y: using.image_from_mesh_uv[1].to_array(),
            pad1: 0,
        }
    }

    /// Hands out all texels in strips of whole rows, at most `most_rows` each. The last row is filled
    /// up with zeros, so that only one strip is in memory at a time.
    pub(super) fn write(&self, textures: &[TextureData], most_rows: u32, mut write: impl FnMut(&Strip, &[u8])) {
        let [width, height, layers] = self.size();
        let row_bytes = width as usize * 4;
        let mut source = textures.iter().flat_map(|data| data.rgba8.chunks(row_bytes)).peekable();
        let mut rest: &[u8] = &[];
        let mut strip = Vec::new();
        let rows_in_all = self.total.max(1).div_ceil(width.into()) as u32;
        for layer in 0..layers {
            let mut row = 0;
            let rows_here = (rows_in_all - layer * height).min(height);
            while row < rows_here {
                let rows = most_rows.max(1).min(rows_here - row);
                let bytes = rows as usize * row_bytes;
                strip.clear();
                while strip.len() < bytes {
                    if rest.is_empty() {
                        let Some(next) = source.next() else { break };
                        rest = next;
                    }
                    let (now, later) = rest.split_at(rest.len().min(bytes - strip.len()));
                    strip.extend_from_slice(now);
                    rest = later;
                }
                strip.resize(bytes, 0);
                write(&Strip { layer, row, width, rows }, &strip);
                row += rows;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, seed: u32) -> TextureData {
        let texels = (0..width * height).flat_map(|i| (i.wrapping_mul(2_654_435_761) ^ seed).to_le_bytes());
        TextureData { name: format!("{seed}"), width, height, rgba8: texels.collect() }
    }

    /// Writes into an array in memory and reads every texel back as a shader would.
    fn round_trip(textures: &[TextureData], most_rows: u32) {
        let pages = Pages::new(textures);
        let [width, height, layers] = pages.size();
        let mut memory = vec![0xee_u8; (width * height * layers) as usize * 4];
        pages.write(textures, most_rows, |strip, bytes| {
            assert_eq!(bytes.len(), (strip.width * strip.rows * 4) as usize);
            let at = ((strip.layer * height + strip.row) * width) as usize * 4;
            memory[at..at + bytes.len()].copy_from_slice(bytes);
        });
        for (index, data) in textures.iter().enumerate() {
            let slot = pages.slot(textures, Some(TextureUse::new(index as u32)));
            for texel in 0..data.width * data.height {
                let i = slot.first_texel + texel;
                let (x, y) = (i % PAGE_WIDTH, (i / PAGE_WIDTH) % PAGE_HEIGHT);
                let layer = i / (PAGE_WIDTH * PAGE_HEIGHT);
                let at = ((layer * height + y) * width + x) as usize * 4;
                let expected = data.texel(texel % data.width, texel / data.width);
                assert_eq!(memory[at..at + 4], expected, "texel {texel} of texture {index}");
            }
        }
    }

    #[test]
    fn every_texel_is_where_shaders_look_for_it() {
        round_trip(&[], 16);
        round_trip(&[image(3, 5, 1)], 16);
        round_trip(&[image(3, 5, 1), image(4096, 2, 2), image(1, 1, 3), image(777, 13, 4)], 2);
        // More than one page: 2 × 4096 × 1030 texels and a little.
        round_trip(&[image(4096, 1030, 5), image(5, 7, 6), image(4096, 1030, 7)], 300);
    }

    #[test]
    fn sizes_grow_from_one_texel_to_whole_pages() {
        assert_eq!(Pages::new(&[]).size(), [1, 1, 1]);
        assert_eq!(Pages::new(&[image(3, 5, 0)]).size(), [15, 1, 1]);
        assert_eq!(Pages::new(&[image(4096, 3, 0), image(1, 1, 0)]).size(), [4096, 4, 1]);
        let large = [image(4096, 2048, 0), image(1, 1, 0)];
        assert_eq!(Pages::new(&large).size(), [4096, 2048, 2]);
    }

    #[test]
    fn an_empty_slot_says_so() {
        assert_eq!(Pages::new(&[]).slot(&[], None).first_texel, NONE);
        assert_eq!(Pages::new(&[]).slot(&[], Some(TextureUse::new(3))).first_texel, NONE);
    }
}
