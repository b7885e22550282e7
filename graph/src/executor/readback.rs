//! Bytes from the GPU to the CPU.

use super::{Physical, gate::Gate};
use crate::{TextureDesc, declaration::ResourceKind, error::GraphError};

/// Row pitches of texture copies are multiples of this (bytes).
const ROW_ALIGN: u64 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as u64;

/// How a texture's first mip level lies in a buffer (bytes and rows of blocks).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rows {
    /// Bytes of a row's texels.
    pub(super) tight: u64,
    /// Bytes from row to row in the copy.
    pub(super) pitch: u64,
    /// Rows of blocks in one layer.
    pub(super) per_layer: u64,
    /// Layers.
    pub(super) layers: u64,
}

impl Rows {
    pub(super) fn of(desc: &TextureDesc) -> Self {
        let (block_w, block_h) = desc.format.block_dimensions();
        let block = u64::from(desc.format.block_copy_size(None).unwrap_or(4));
        let tight = u64::from(desc.size[0].div_ceil(block_w)) * block;
        let pitch = tight.div_ceil(ROW_ALIGN) * ROW_ALIGN;
        Self { tight, pitch, per_layer: desc.size[1].div_ceil(block_h).into(), layers: desc.size[2].into() }
    }

    /// Bytes of the copy.
    pub(super) fn bytes(self) -> u64 {
        self.pitch.saturating_mul(self.per_layer).saturating_mul(self.layers)
    }
}

/// A copy on its way to the CPU.
#[derive(Debug)]
pub(super) struct Staged {
    pub(super) index: u32,
    buffer: wgpu::Buffer,
    rows: Option<Rows>,
    size: u64,
}

/// Records the copy of a resource to a buffer the CPU can map.
pub(super) fn stage(
    device: &wgpu::Device,
    encoder: &mut wgpu::CommandEncoder,
    index: u32,
    kind: &ResourceKind,
    physical: &Physical,
) -> Option<Staged> {
    let create = |size| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("readback"),
            size,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    };
    match (kind, physical) {
        (ResourceKind::Buffer(desc), Physical::Buffer(source)) => {
            let buffer = create(desc.padded());
            encoder.copy_buffer_to_buffer(source, 0, &buffer, 0, desc.padded());
            Some(Staged { index, buffer, rows: None, size: desc.size })
        }
        (ResourceKind::Texture(desc), Physical::Texture(source)) => {
            let rows = Rows::of(desc);
            let buffer = create(rows.bytes());
            let (_, block_h) = desc.format.block_dimensions();
            encoder.copy_texture_to_buffer(
                source.as_image_copy(),
                wgpu::TexelCopyBufferInfo {
                    buffer: &buffer,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: u32::try_from(rows.pitch).ok(),
                        rows_per_image: u32::try_from(rows.per_layer).ok(),
                    },
                },
                wgpu::Extent3d {
                    width: desc.size[0].next_multiple_of(desc.format.block_dimensions().0),
                    height: desc.size[1].next_multiple_of(block_h),
                    depth_or_array_layers: desc.size[2],
                },
            );
            Some(Staged { index, buffer, rows: Some(rows), size: rows.tight * rows.per_layer * rows.layers })
        }
        _ => None,
    }
}

impl Staged {
    /// The bytes, rows tightly packed; call when the GPU is done.
    pub(super) fn bytes(&self, gate: &Gate) -> Result<Vec<u8>, GraphError> {
        let mut bytes = map(gate, &self.buffer)?;
        if let Some(rows) = self.rows
            && rows.tight != rows.pitch
        {
            for row in 1..(rows.per_layer * rows.layers) as usize {
                let from = row * rows.pitch as usize;
                bytes.copy_within(from..from + rows.tight as usize, row * rows.tight as usize);
            }
        }
        bytes.truncate(self.size as usize);
        Ok(bytes)
    }
}

/// Maps a buffer and copies it out.
pub(super) fn map(gate: &Gate, buffer: &wgpu::Buffer) -> Result<Vec<u8>, GraphError> {
    let (send, receive) = std::sync::mpsc::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |result| {
        let _ = send.send(result);
    });
    gate.wait(None)?;
    let refuse = |message: String| GraphError::Gpu { during: "a readback".to_owned(), message };
    match receive.try_recv() {
        Ok(Ok(())) => {}
        Ok(Err(error)) => return Err(refuse(error.to_string())),
        Err(_) => return Err(refuse("the buffer was never mapped".to_owned())),
    }
    let bytes = buffer.get_mapped_range(..).map_err(|error| refuse(error.to_string()))?.to_vec();
    buffer.unmap();
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_padded_to_256_bytes() {
        let rows = Rows::of(&TextureDesc::new_2d([5, 3], wgpu::TextureFormat::Rgba32Float).layers(2));
        assert_eq!(rows, Rows { tight: 80, pitch: 256, per_layer: 3, layers: 2 });
        assert_eq!(rows.bytes(), 256 * 6);
        let blocks = Rows::of(&TextureDesc::new_2d([9, 9], wgpu::TextureFormat::Bc1RgbaUnorm));
        assert_eq!(blocks, Rows { tight: 24, pitch: 256, per_layer: 3, layers: 1 });
    }
}
