//! Bytes from the GPU to the CPU.

use super::{Physical, gate::Gate};
use crate::{TextureDesc, declaration::ResourceKind, error::GraphError};
use std::sync::{Arc, OnceLock};

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

/// Where a copy to the CPU lands.
#[derive(Debug)]
pub(super) struct Staged {
    index: u32,
    buffer: wgpu::Buffer,
    rows: Option<Rows>,
    size: u64,
}

impl Staged {
    /// A buffer for the readback `index`, of a resource of this kind.
    pub(super) fn new(device: &wgpu::Device, index: u32, kind: &ResourceKind) -> Self {
        let (rows, size, allocated) = match kind {
            ResourceKind::Buffer(desc) => (None, desc.size, desc.padded()),
            ResourceKind::Texture(desc) => {
                let rows = Rows::of(desc);
                (Some(rows), rows.tight * rows.per_layer * rows.layers, rows.bytes())
            }
            // No handle to one can be asked for its bytes.
            ResourceKind::Tlas => (None, 0, 0),
        };
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("readback"),
            size: allocated,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { index, buffer, rows, size }
    }
}

/// Records the copy of a resource to where the CPU can map it.
pub(super) fn copy(encoder: &mut wgpu::CommandEncoder, source: &Physical, kind: &ResourceKind, staged: &Staged) {
    match (kind, source, staged.rows) {
        (ResourceKind::Buffer(desc), Physical::Buffer { buffer, offset, .. }, _) => {
            encoder.copy_buffer_to_buffer(buffer, *offset, &staged.buffer, 0, desc.padded());
        }
        (ResourceKind::Texture(desc), Physical::Texture(source), Some(rows)) => {
            let (block_w, block_h) = desc.format.block_dimensions();
            encoder.copy_texture_to_buffer(
                source.as_image_copy(),
                wgpu::TexelCopyBufferInfo {
                    buffer: &staged.buffer,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: u32::try_from(rows.pitch).ok(),
                        rows_per_image: u32::try_from(rows.per_layer).ok(),
                    },
                },
                wgpu::Extent3d {
                    width: desc.size[0].next_multiple_of(block_w),
                    height: desc.size[1].next_multiple_of(block_h),
                    depth_or_array_layers: desc.size[2],
                },
            );
        }
        _ => {}
    }
}

/// A buffer on its way into the CPU's memory.
#[derive(Debug)]
pub(super) struct Mapped {
    buffer: wgpu::Buffer,
    result: Arc<OnceLock<Result<(), wgpu::BufferAsyncError>>>,
}

impl Mapped {
    /// Asks for the buffer's contents as of what was submitted so far.
    pub(super) fn begin(buffer: wgpu::Buffer) -> Self {
        let result = Arc::new(OnceLock::new());
        let answer = Arc::clone(&result);
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            let _ = answer.set(result);
        });
        Self { buffer, result }
    }

    /// Whether the contents have arrived.
    pub(super) fn is_done(&self) -> bool {
        self.result.get().is_some()
    }

    /// The contents, waiting for them if need be.
    pub(super) fn bytes(self, gate: &Gate) -> Result<Vec<u8>, GraphError> {
        if !self.is_done() {
            gate.wait(None)?;
        }
        let refuse = |message: String| GraphError::Gpu { during: "a readback".to_owned(), message };
        match self.result.get() {
            Some(Ok(())) => {}
            Some(Err(error)) => return Err(refuse(error.to_string())),
            None => return Err(refuse("the buffer was never mapped".to_owned())),
        }
        let bytes = self.buffer.get_mapped_range(..).map_err(|error| refuse(error.to_string()))?.to_vec();
        self.buffer.unmap();
        Ok(bytes)
    }
}

/// A readback on its way.
#[derive(Debug)]
pub(super) struct Mapping {
    index: u32,
    mapped: Mapped,
    rows: Option<Rows>,
    size: u64,
}

impl Mapping {
    /// Call when the copy has been submitted.
    pub(super) fn begin(staged: Staged) -> Self {
        let Staged { index, buffer, rows, size } = staged;
        Self { index, mapped: Mapped::begin(buffer), rows, size }
    }

    pub(super) fn is_done(&self) -> bool {
        self.mapped.is_done()
    }

    /// Which readback it is, and its bytes with rows tightly packed.
    pub(super) fn bytes(self, gate: &Gate) -> Result<(u32, Vec<u8>), GraphError> {
        let mut bytes = self.mapped.bytes(gate)?;
        if let Some(rows) = self.rows
            && rows.tight != rows.pitch
        {
            for row in 1..(rows.per_layer * rows.layers) as usize {
                let from = row * rows.pitch as usize;
                bytes.copy_within(from..from + rows.tight as usize, row * rows.tight as usize);
            }
        }
        bytes.truncate(self.size as usize);
        Ok((self.index, bytes))
    }
}

/// Bytes of a texture's first mip level, all layers, tightly packed; `None` if its format has no one layout.
pub(crate) fn texture_bytes(desc: &TextureDesc) -> Option<u64> {
    desc.format.block_copy_size(None)?;
    let rows = Rows::of(desc);
    Some(rows.tight.saturating_mul(rows.per_layer).saturating_mul(rows.layers))
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
