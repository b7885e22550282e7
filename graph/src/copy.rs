//! Clears, copies and readbacks: passes without a shader.

use crate::{
    Graph, Handle, Load, Subresources, TextureDesc,
    declaration::{Access, Attachment, PassDecl, PassKind, Place, Write},
    error::{GraphError, PassRef},
    graph::{Readback, Recorded, Work},
    handle::{Buffer, Texture},
};
use std::{panic::Location, sync::Arc};

impl<'f> Graph<'f> {
    /// Fills the whole buffer with zero bytes.
    #[track_caller]
    pub fn clear_buffer(&mut self, buffer: &mut Handle<Buffer>) {
        let name = format!("clear {}", buffer.name);
        let usage = wgpu::BufferUsages::COPY_DST.bits();
        let access = Access::new(buffer.index, "clear", false, Write::Overwrite, usage);
        self.copy_pass(&name, vec![access], false, &[(buffer.graph, &buffer.name)], Work::ClearBuffer { buffer: buffer.index });
    }

    /// Fills one mip and layer of a colour texture with `color` (r, g, b, a), or of a depth texture with `Load::ClearDepth`.
    ///
    /// If the next use is a draw into it that keeps its contents, the clear becomes that render pass's load operation.
    #[track_caller]
    pub fn clear_texture(&mut self, texture: &mut Handle<Texture>, load: Load) {
        self.clear_texture_at(texture, Subresources::ALL, load);
    }

    /// As [`Graph::clear_texture`], of one mip and layer of several.
    #[track_caller]
    pub fn clear_texture_at(&mut self, texture: &mut Handle<Texture>, part: Subresources, load: Load) {
        let name = format!("clear {}", texture.name);
        let location = Location::caller();
        let at = PassRef::new(&name, location);
        if texture.graph == self.id {
            match crate::raster::clear(&self.declaration, texture, part, load, at) {
                Ok(target) => {
                    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT.bits();
                    let access = Access {
                        part,
                        attachment: Some(Attachment::Clear),
                        ..Access::new(texture.index, "clear", false, Write::Overwrite, usage)
                    };
                    let decl = PassDecl {
                        name: Arc::from(name),
                        kind: PassKind::Raster,
                        heavy: false,
                        side_effect: false,
                        pinned: false,
                        accesses: vec![access],
                        place: Place(Some(location)),
                    };
                    self.record(Recorded { decl, work: Work::ClearTexture { target } });
                }
                Err(error) => self.errors.push(error),
            }
        } else {
            self.errors.push(GraphError::ForeignHandle { at: at.place(), resource: texture.name.to_string() });
        }
    }

    /// Copies a whole buffer to one of the same size.
    #[track_caller]
    pub fn copy_buffer(&mut self, from: &Handle<Buffer>, to: &mut Handle<Buffer>) {
        let name = format!("copy {} to {}", from.name, to.name);
        if from.desc.size != to.desc.size {
            self.mismatch(&name, (&from.name, from.desc.to_string()), (&to.name, to.desc.to_string()));
            return;
        }
        let usages = (wgpu::BufferUsages::COPY_SRC.bits(), wgpu::BufferUsages::COPY_DST.bits());
        let accesses = copy_accesses(from.index, to.index, usages);
        let work = Work::CopyBuffer { from: from.index, to: to.index };
        self.copy_pass(&name, accesses, false, &[(from.graph, &from.name), (to.graph, &to.name)], work);
    }

    /// Copies a whole texture, all mips and layers, to one of the same size and format (sRGB or not).
    #[track_caller]
    pub fn copy_texture(&mut self, from: &Handle<Texture>, to: &mut Handle<Texture>) {
        let name = format!("copy {} to {}", from.name, to.name);
        let key = |desc: &TextureDesc| {
            (desc.size, desc.format.remove_srgb_suffix(), desc.mip_level_count, desc.sample_count, desc.dimension)
        };
        if key(&from.desc) != key(&to.desc) {
            self.mismatch(&name, (&from.name, from.desc.to_string()), (&to.name, to.desc.to_string()));
            return;
        }
        let usages = (wgpu::TextureUsages::COPY_SRC.bits(), wgpu::TextureUsages::COPY_DST.bits());
        let accesses = copy_accesses(from.index, to.index, usages);
        let work = Work::CopyTexture { from: from.index, to: to.index };
        self.copy_pass(&name, accesses, false, &[(from.graph, &from.name), (to.graph, &to.name)], work);
    }

    /// Brings the buffer's bytes back to the CPU with the frame's output.
    #[track_caller]
    pub fn readback_buffer(&mut self, buffer: &Handle<Buffer>) -> Readback {
        let part = Subresources::ALL;
        self.readback(&buffer.name, buffer.graph, buffer.index, part, wgpu::BufferUsages::COPY_SRC.bits())
    }

    /// Brings the texture's first mip level, all layers, back to the CPU: rows tightly packed, row 0 on top. Only that level need
    /// have been written.
    #[track_caller]
    pub fn readback_texture(&mut self, texture: &Handle<Texture>) -> Readback {
        let desc = &texture.desc;
        let refusal = unreadable(desc);
        if let Some(message) = refusal {
            let at = PassRef::new(&format!("readback {}", texture.name), Location::caller()).place();
            let (resource, desc) = (texture.name.to_string(), desc.to_string());
            self.errors.push(GraphError::Readback { at, resource, desc, message: message.to_owned() });
        }
        let part = if desc.mip_level_count > 1 { Subresources::mip(0) } else { Subresources::ALL };
        self.readback(&texture.name, texture.graph, texture.index, part, wgpu::TextureUsages::COPY_SRC.bits())
    }

    #[track_caller]
    fn readback(&mut self, name: &str, graph: u64, resource: usize, part: Subresources, usage: u32) -> Readback {
        let readback = Readback { graph: self.id, index: self.readbacks };
        self.readbacks += 1;
        let access = Access { part, ..Access::new(resource, "readback", true, Write::No, usage) };
        let work = Work::Readback { resource, index: readback.index };
        self.copy_pass(&format!("readback {name}"), vec![access], true, &[(graph, name)], work);
        readback
    }

    #[track_caller]
    fn mismatch(&mut self, name: &str, from: (&str, String), to: (&str, String)) {
        let at = PassRef::new(name, Location::caller()).place();
        let (from_desc, to_desc) = (from.1, to.1);
        self.errors.push(GraphError::CopyMismatch { at, from: from.0.to_owned(), from_desc, to: to.0.to_owned(), to_desc });
    }

    #[track_caller]
    fn copy_pass(&mut self, name: &str, accesses: Vec<Access>, side_effect: bool, handles: &[(u64, &str)], work: Work<'f>) {
        let location = Location::caller();
        let at = PassRef::new(name, location);
        let mut errors: Vec<GraphError> = handles
            .iter()
            .filter(|(graph, _)| *graph != self.id)
            .map(|(_, resource)| GraphError::ForeignHandle { at: at.place(), resource: (*resource).to_owned() })
            .collect();
        if errors.is_empty() {
            crate::verify::conflicts(self, &accesses, at, &mut errors);
        }
        if !errors.is_empty() {
            self.refuse(errors);
            return;
        }
        let decl = PassDecl {
            name: Arc::from(name),
            kind: PassKind::Copy,
            heavy: false,
            side_effect,
            pinned: false,
            accesses,
            place: Place(Some(location)),
        };
        self.record(Recorded { decl, work });
    }
}

fn copy_accesses(from: usize, to: usize, usages: (u32, u32)) -> Vec<Access> {
    vec![
        Access::new(from, "copy source", true, Write::No, usages.0),
        Access::new(to, "copy target", false, Write::Overwrite, usages.1),
    ]
}

/// Why a texture cannot be read back, with the mend.
pub(crate) fn unreadable(desc: &TextureDesc) -> Option<&'static str> {
    let format = desc.format;
    let copyable =
        matches!(format, wgpu::TextureFormat::Depth32Float | wgpu::TextureFormat::Depth16Unorm | wgpu::TextureFormat::Stencil8);
    if desc.sample_count != 1 {
        Some("it has several samples per texel; resolve it first by a pass that reads them")
    } else if format.is_depth_stencil_format() && !copyable || format.is_multi_planar_format() {
        Some("its format has no single copyable layout; use depth32float or a colour format")
    } else {
        None
    }
}
