//! Compares Rust and WGSL structs.

use crate::{
    error::{GraphError, PassRef, did_you_mean},
    layout::StructLayout,
    reflect::{Binding, Element, StructShape},
};

/// The first difference between a Rust layout and a WGSL element.
pub(super) fn compare(layout: &StructLayout, element: &Element, binding: &Binding, at: PassRef<'_>) -> Result<(), GraphError> {
    let (wgsl_struct, difference) = match element {
        // No Rust struct can describe a runtime-sized tail; such a buffer is declared in bytes or words.
        Element::Tail(name) => {
            (name, "the WGSL struct ends in a runtime-sized array; describe the buffer with BufferDesc::bytes".to_owned())
        }
        Element::Plain(name) => {
            let mend = "describe the buffer with BufferDesc::words, or change the WGSL";
            (name, format!("the WGSL elements are `{name}`, no struct; {mend}"))
        }
        Element::Struct(shape) => match difference(layout, shape) {
            Some(difference) => (&shape.name, difference),
            None => return Ok(()),
        },
    };
    Err(GraphError::Layout {
        at: at.place(),
        binding: binding.name.to_string(),
        shader: binding.place.clone(),
        rust_struct: layout.name.to_owned(),
        wgsl_struct: wgsl_struct.clone(),
        difference,
    })
}

fn difference(layout: &StructLayout, shape: &StructShape) -> Option<String> {
    let padding = |name: &str| name.starts_with("pad") || name.starts_with("_pad");
    for field in layout.fields.iter().filter(|field| !padding(field.name)) {
        let Some(other) = shape.fields.iter().find(|other| other.name == field.name) else {
            let hint = did_you_mean(field.name, shape.fields.iter().map(|field| field.name.as_str()));
            return Some(format!("WGSL has no field `{}`{hint}; add it, or call the Rust field `pad…`", field.name));
        };
        if other.offset != field.offset {
            return Some(format!(
                "field `{}` lies at byte {} in Rust and {} in WGSL; put explicit padding before it (WGSL aligns vec3 and vec4 to 16)",
                field.name, field.offset, other.offset
            ));
        }
        if other.size != field.size {
            return Some(format!(
                "field `{}` takes {} bytes in Rust and {} in WGSL; make the types the same",
                field.name, field.size, other.size
            ));
        }
    }
    for other in shape.fields.iter().filter(|field| !padding(&field.name)) {
        if !layout.fields.iter().any(|field| field.name == other.name) {
            return Some(format!("Rust has no field `{}` (byte {}, {} bytes); add it", other.name, other.offset, other.size));
        }
    }
    (layout.size != shape.size).then(|| {
        format!(
            "the struct takes {} bytes in Rust and {} in WGSL; pad the shorter (WGSL rounds up to the alignment)",
            layout.size, shape.size
        )
    })
}
