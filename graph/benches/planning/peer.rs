//! zenfg, given one of our frames.

use lightloom_graph::{Declaration, Origin, PassKind, ResourceKind, Write, wgpu};
use std::time::Instant;
use zenfg::{
    BufferDesc, BufferRange, CompileOptions, FrameGraph, ImportBufferOptions, ImportTextureOptions, InitialContents, PassBuilder,
    RootReason, TextureDesc, TextureViewDesc, UsagePolicy, WriteContents,
};

/// What one compilation took.
pub(crate) struct Compiled {
    /// Declaring resources and passes (µs).
    pub(crate) record_us: f64,
    /// Compiling (µs).
    pub(crate) compile_us: f64,
    /// Bytes of its pool.
    pub(crate) bytes: u64,
}

enum Handle<'f> {
    /// The texture, and what its accesses go through.
    Texture(zenfg::Texture<'f>, zenfg::TextureTarget<'f>),
    Buffer(zenfg::Buffer<'f>),
}

/// Records and compiles `frame`. Every access is declared as a sampled or storage access, all usages are inferred, and what
/// outlives the frame is a root, as is what is kept. A storage access covers one mip, and a frame file does not say which, so
/// accesses to textures with several go through a view of the first: as many accesses as ours.
pub(crate) fn compile(frame: &Declaration) -> Compiled {
    let mut graph = FrameGraph::new();
    let started = Instant::now();
    let mut recording = graph.begin_frame();
    let handles: Vec<Handle<'_>> = frame
        .resources
        .iter()
        .map(|resource| {
            let imported = resource.origin != Origin::Transient;
            match &resource.kind {
                ResourceKind::Texture(desc) => {
                    let [width, height, depth_or_array_layers] = desc.size;
                    let desc = TextureDesc {
                        label: resource.name.to_string(),
                        size: wgpu::Extent3d { width, height, depth_or_array_layers },
                        mip_level_count: desc.mip_level_count,
                        sample_count: desc.sample_count,
                        dimension: desc.dimension,
                        format: desc.format,
                        view_formats: desc.view_formats.clone(),
                        usage: UsagePolicy::Infer,
                    };
                    let mips = desc.mip_level_count;
                    let texture = if imported {
                        let options = ImportTextureOptions::new(InitialContents::Defined);
                        recording.import_texture(desc, options).expect("a sound texture")
                    } else {
                        recording.create_texture(desc).expect("a sound texture")
                    };
                    if mips == 1 {
                        return Handle::Texture(texture, texture.into());
                    }
                    let first = TextureViewDesc { mip_level_count: Some(1), ..TextureViewDesc::default() };
                    let view = recording.create_texture_view(texture, first).expect("a sound view");
                    Handle::Texture(texture, view.into())
                }
                // The peer knows no acceleration structures: a small imported buffer stands for one.
                ResourceKind::Buffer(_) | ResourceKind::Tlas => {
                    let desc =
                        BufferDesc { label: resource.name.to_string(), size: resource.bytes.max(4), usage: UsagePolicy::Infer };
                    Handle::Buffer(if imported {
                        let options = ImportBufferOptions::new(InitialContents::Defined);
                        recording.import_buffer(desc, options).expect("a sound buffer")
                    } else {
                        recording.create_buffer(desc).expect("a sound buffer")
                    })
                }
            }
        })
        .collect();
    let mut written = vec![false; frame.resources.len()];
    for pass in &frame.passes {
        let mut builder = match pass.kind {
            PassKind::Compute | PassKind::Raytrace => recording.compute_pass(&*pass.name),
            _ => recording.command_pass(&*pass.name),
        };
        builder.set_side_effect(pass.side_effect);
        for access in &pass.accesses {
            declare(&mut builder, &handles[access.resource], access.read, access.write);
            written[access.resource] |= access.writes();
        }
        builder.finish().expect("a sound pass");
    }
    for ((resource, handle), written) in frame.resources.iter().zip(&handles).zip(written) {
        if written && (resource.origin != Origin::Transient || resource.keep) {
            match handle {
                Handle::Texture(texture, _) => recording.mark_texture_root(*texture, RootReason::Output),
                Handle::Buffer(buffer) => recording.mark_buffer_root(*buffer, BufferRange::whole(), RootReason::Output),
            }
            .expect("a sound root");
        }
    }
    let record_us = started.elapsed().as_secs_f64() * 1e6;
    let started = Instant::now();
    let compiled = recording.compile(CompileOptions::default()).expect("a sound frame");
    let compile_us = started.elapsed().as_secs_f64() * 1e6;
    let bytes = compiled.allocations().iter().map(|allocation| allocation.estimated_byte_size).sum();
    Compiled { record_us, compile_us, bytes }
}

fn declare<'f>(builder: &mut PassBuilder<'_, 'f>, handle: &Handle<'f>, read: bool, write: Write) {
    let contents = if read || write == Write::Keep { WriteContents::Preserve } else { WriteContents::Overwrite };
    match (handle, write == Write::No) {
        (Handle::Texture(_, target), true) => drop(builder.sampled_texture(*target).expect("a sound read")),
        (Handle::Texture(_, target), false) => drop(builder.storage_texture_write(*target, contents).expect("a sound write")),
        (Handle::Buffer(buffer), true) => {
            let _ = builder.storage_buffer_read(*buffer, BufferRange::whole()).expect("a sound read");
        }
        (Handle::Buffer(buffer), false) => {
            let _ = builder.storage_buffer_write(*buffer, BufferRange::whole(), contents).expect("a sound write");
        }
    }
}
