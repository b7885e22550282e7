//! Reads accessors with bounds: plain, strided, normalised and sparse.

use super::{SceneError, Source, label};
use gltf::accessor::{Accessor, DataType, Dimensions};

/// Elements of an accessor without data of its own (sparse over zeros) beyond which it is refused.
const MOST_ZEROS: usize = 1 << 26;

/// Reads an accessor of vectors as floats, of scalars where N is 1, of 4 × 4 matrices where N is 16; integers are normalised where the accessor says so.
/// `what` names the user, such as ``mesh 3 `Roof`, primitive 0, POSITION``.
pub(super) fn read_vectors<const N: usize>(
    source: &Source<'_>,
    accessor: &Accessor<'_>,
    what: &str,
) -> Result<Vec<[f32; N]>, SceneError> {
    let place = || format!("{what}, {}", label("accessor", accessor.index(), accessor.name()));
    let expected = match N {
        1 => Dimensions::Scalar,
        2 => Dimensions::Vec2,
        3 => Dimensions::Vec3,
        16 => Dimensions::Mat4,
        _ => Dimensions::Vec4,
    };
    if accessor.dimensions() != expected {
        let problem = format!("it is {:?}, expected {expected:?}", accessor.dimensions());
        return Err(source.malformed(place(), problem));
    }
    let kind = accessor.data_type();
    let decode = |bytes: &[u8]| {
        let mut vector = [0.0; N];
        for (value, component) in vector.iter_mut().zip(bytes.chunks_exact(kind.size())) {
            *value = decode_float(kind, accessor.normalized(), component);
        }
        vector
    };
    read(source, accessor, kind.size() * N, decode).map_err(|problem| source.malformed(place(), problem))
}

/// Reads an accessor of unsigned scalars.
pub(super) fn read_indices(source: &Source<'_>, accessor: &Accessor<'_>, what: &str) -> Result<Vec<u32>, SceneError> {
    let place = || format!("{what}, {}", label("accessor", accessor.index(), accessor.name()));
    let kind = accessor.data_type();
    let unsigned = matches!(kind, DataType::U8 | DataType::U16 | DataType::U32);
    if accessor.dimensions() != Dimensions::Scalar || !unsigned {
        let problem = format!("it is {:?} of {kind:?}, expected unsigned scalars", accessor.dimensions());
        return Err(source.malformed(place(), problem));
    }
    read(source, accessor, kind.size(), decode_unsigned).map_err(|problem| source.malformed(place(), problem))
}

/// Reads all elements, each `size` bytes long, and applies the sparse substitutions.
fn read<T: Clone>(
    source: &Source<'_>,
    accessor: &Accessor<'_>,
    size: usize,
    decode: impl Fn(&[u8]) -> T,
) -> Result<Vec<T>, String> {
    let count = accessor.count();
    let json = &source.document.as_json().accessors[accessor.index()];
    let mut values = match json.buffer_view {
        Some(view) => {
            let stride = source.document.as_json().buffer_views.get(view.value());
            let stride = stride.and_then(|view| view.byte_stride.map(|s| s.0)).unwrap_or(size);
            elements(source, view.value(), accessor.offset(), count, size, stride)?.map(&decode).collect()
        }
        None if count > MOST_ZEROS => return Err(format!("{count} elements without data")),
        None => vec![decode(&vec![0; size]); count],
    };
    if let Some(sparse) = &json.sparse {
        let places = sparse.count.0 as usize;
        let kind = match sparse.indices.component_type {
            gltf::json::validation::Checked::Valid(kind) => kind.0,
            gltf::json::validation::Checked::Invalid => return Err("sparse index type".into()),
        };
        let view = sparse.indices.buffer_view.value();
        let offset = sparse.indices.byte_offset.0 as usize;
        let at = elements(source, view, offset, places, kind.size(), kind.size())?;
        let view = sparse.values.buffer_view.value();
        let offset = sparse.values.byte_offset.0 as usize;
        let new = elements(source, view, offset, places, size, size)?;
        for (index, bytes) in at.map(decode_unsigned).zip(new) {
            let slot = values.get_mut(index as usize);
            *slot.ok_or_else(|| format!("sparse index {index} of {count} elements"))? = decode(bytes);
        }
    }
    Ok(values)
}

/// The byte slices of `count` elements in a buffer view, or why they do not lie within it.
fn elements<'a>(
    source: &Source<'a>,
    view: usize,
    offset: usize,
    count: usize,
    size: usize,
    stride: usize,
) -> Result<impl Iterator<Item = &'a [u8]> + use<'a>, String> {
    let bytes = source.buffers.view(source.document, view)?;
    if stride < size {
        return Err(format!("stride {stride} of buffer view {view} is below the element's {size}"));
    }
    let end = match count {
        0 => Some(offset),
        _ => (count - 1)
            .checked_mul(stride)
            .and_then(|before| before.checked_add(size))
            .and_then(|length| length.checked_add(offset)),
    };
    if end.is_none_or(|end| end > bytes.len()) {
        return Err(format!(
            "{count} elements of {size} bytes, {stride} apart from byte {offset}, do not fit \
             buffer view {view} of {} bytes",
            bytes.len()
        ));
    }
    Ok((0..count).map(move |i| &bytes[offset + i * stride..][..size]))
}

fn decode_unsigned(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
}

/// One component as a float; glTF 2.0, 3.11 for the normalised integers.
fn decode_float(kind: DataType, normalized: bool, bytes: &[u8]) -> f32 {
    let bits = decode_unsigned(bytes);
    let (value, most) = match kind {
        DataType::F32 => return f32::from_bits(bits),
        DataType::U8 => (bits as f32, 255.0),
        DataType::U16 => (bits as f32, 65535.0),
        DataType::U32 => (bits as f32, u32::MAX as f32),
        DataType::I8 => (f32::from(bits as u8 as i8), 127.0),
        DataType::I16 => (f32::from(bits as u16 as i16), 32767.0),
    };
    if normalized { (value / most).max(-1.0) } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_decode_as_the_format_says() {
        assert!((decode_float(DataType::U8, true, &[255]) - 1.0).abs() < 1e-7, "255 is one");
        assert!((decode_float(DataType::I8, true, &[0x80]) + 1.0).abs() < 1e-7, "-128 is -1");
        assert!((decode_float(DataType::I16, false, &[0xff, 0xff]) + 1.0).abs() < 1e-7, "-1");
        assert_eq!(decode_unsigned(&[1, 2]), 513);
        assert!((decode_float(DataType::F32, false, &1.5_f32.to_le_bytes()) - 1.5).abs() < 1e-7, "1.5");
    }
}
