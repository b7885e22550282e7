//! Attachments of a raster pass, compared with the fragment stage's outputs.

use crate::{
    Graph, Handle, Load, RasterShader, Subresources, TextureDesc,
    declaration::{Access, Attachment, Declaration, ResourceKind, Write},
    error::{GraphError, PassRef, names},
    graph::Cleared,
    handle::Texture,
    plan::validate,
    reflect::Output,
};
use wgpu::TextureSampleType as S;

/// One `.color` or `.depth` call.
#[derive(Debug)]
pub(crate) struct Attach {
    name: String,
    resource: usize,
    graph: u64,
    texture: String,
    part: Subresources,
    load: Load,
}

impl Attach {
    pub(crate) fn new(name: &str, texture: &Handle<Texture>, part: Subresources, load: Load) -> Self {
        let (resource, graph, texture) = (texture.index, texture.graph, texture.name.to_string());
        Self { name: name.to_owned(), resource, graph, texture, part, load }
    }
}

/// What a raster pass draws into.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Targets {
    /// By location; a gap is a location the shader does not write.
    pub(crate) colors: Vec<Option<Target<wgpu::Color>>>,
    pub(crate) depth: Option<Target<f32>>,
    pub(crate) samples: u32,
}

/// One mip and layer of a texture as an attachment, with what it holds when the pass begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Target<V> {
    pub(crate) resource: usize,
    pub(crate) part: Subresources,
    pub(crate) load: wgpu::LoadOp<V>,
}

/// Checks the attachments; adds their accesses and any errors.
pub(crate) fn targets(
    graph: &Graph<'_>,
    shader: &RasterShader,
    colors: &[Attach],
    depth: Option<&Attach>,
    at: PassRef<'_>,
    accesses: &mut Vec<Access>,
    errors: &mut Vec<GraphError>,
) -> Targets {
    let locations = shader.outputs.iter().map(|output| output.location as usize + 1).max().unwrap_or(0);
    let mut targets = Targets { colors: vec![None; locations], depth: None, samples: 1 };
    let mut sized: Option<(&str, &TextureDesc, [u32; 2])> = None;
    for attach in colors.iter().chain(depth) {
        if attach.graph != graph.id {
            errors.push(GraphError::ForeignHandle { at: at.place(), resource: attach.texture.clone() });
            continue;
        }
        let ResourceKind::Texture(desc) = &graph.declaration.resources[attach.resource].kind else { continue };
        let is_depth = depth.is_some_and(|depth| std::ptr::eq(depth, attach));
        let refuse = |message: String| GraphError::Attachment {
            at: at.place(),
            attachment: attach.name.clone(),
            resource: attach.texture.clone(),
            format: crate::format::name(desc.format),
            message,
        };
        if let Some(error) = validate::part_error(&graph.declaration, attach.resource, attach.part, at) {
            errors.push(error);
            continue;
        }
        let mips = attach.part.mips_of(desc.mip_level_count);
        if attach.part.layers_of(desc.size[2]).len() != 1 || mips.len() != 1 {
            errors.push(refuse("it has several layers or mips; attach one of each (`color_at`, `depth_at`)".to_owned()));
        }
        let size = [0, 1].map(|axis: usize| (desc.size[axis] >> mips.start.min(31)).max(1));
        match sized {
            Some((first, other, other_size)) if (other_size, other.sample_count) != (size, desc.sample_count) => {
                let (first, second) = (first.to_owned(), attach.texture.clone());
                let (first_size, second_size) = (size_in_words(other, other_size), size_in_words(desc, size));
                errors.push(GraphError::AttachmentSize { at: at.place(), first, first_size, second, second_size });
            }
            Some(_) => {}
            None => {
                sized = Some((&attach.texture, desc, size));
                targets.samples = desc.sample_count;
            }
        }
        let (resource, part) = (attach.resource, attach.part);
        let keeps = matches!(attach.load, Load::Keep);
        if is_depth {
            match depth_load(desc, attach.load) {
                Ok(load) => targets.depth = Some(Target { resource, part, load }),
                Err(message) => errors.push(refuse(message)),
            }
        } else {
            let Some(output) = shader.outputs.iter().find(|output| output.name == attach.name) else {
                errors.push(GraphError::UnknownAttachment {
                    at: at.place(),
                    attachment: attach.name.clone(),
                    shader: shader.core.source.flat.root(),
                    known: names(shader.outputs.iter().map(|output| output.name.as_str())),
                });
                continue;
            };
            match color_load(desc, attach.load, output, shader.blend.is_some()) {
                Err(message) => errors.push(refuse(message)),
                Ok(_) if targets.colors[output.location as usize].is_some() => {
                    errors.push(refuse("this output already has a texture; remove one".to_owned()));
                }
                Ok(load) => targets.colors[output.location as usize] = Some(Target { resource, part, load }),
            }
        }
        let location = || shader.outputs.iter().find(|output| output.name == attach.name).map_or(0, |output| output.location);
        accesses.push(Access {
            part,
            attachment: Some(if is_depth { Attachment::Depth } else { Attachment::Color(location()) }),
            ..Access::new(
                attach.resource,
                attach.name.as_str(),
                keeps,
                if keeps { Write::Keep } else { Write::Overwrite },
                wgpu::TextureUsages::RENDER_ATTACHMENT.bits(),
            )
        });
    }
    missing(shader, colors, depth, at, errors);
    targets
}

fn size_in_words(desc: &TextureDesc, [w, h]: [u32; 2]) -> String {
    if desc.mip_level_count == 1 { desc.to_string() } else { format!("{desc}: {w}×{h} at this mip") }
}

/// Outputs that have nothing to go to.
fn missing(shader: &RasterShader, colors: &[Attach], depth: Option<&Attach>, at: PassRef<'_>, errors: &mut Vec<GraphError>) {
    for output in shader.outputs.iter() {
        if !colors.iter().any(|attach| attach.name == output.name) {
            errors.push(GraphError::MissingAttachment {
                at: at.place(),
                attachment: output.name.clone(),
                shader: shader.core.source.flat.root(),
            });
        }
    }
    if colors.is_empty() && depth.is_none() && shader.outputs.is_empty() {
        errors.push(GraphError::NoAttachment { at: at.place() });
    }
    if shader.writes_depth && depth.is_none() {
        errors.push(GraphError::MissingAttachment {
            at: at.place(),
            attachment: "depth".to_owned(),
            shader: shader.core.source.flat.root(),
        });
    }
}

/// The target of a clear outside any pass.
pub(crate) fn clear(
    declaration: &Declaration,
    texture: &Handle<Texture>,
    part: Subresources,
    load: Load,
    at: PassRef<'_>,
) -> Result<Cleared, GraphError> {
    if let Some(error) = validate::part_error(declaration, texture.index, part, at) {
        return Err(error);
    }
    let desc = &texture.desc;
    let refuse = |message: &str| GraphError::Attachment {
        at: at.place(),
        attachment: "clear".to_owned(),
        resource: texture.name.to_string(),
        format: crate::format::name(desc.format),
        message: message.to_owned(),
    };
    if part.layers_of(desc.size[2]).len() != 1 || part.mips_of(desc.mip_level_count).len() != 1 {
        return Err(refuse("it has several layers or mips; clear one of each (`clear_texture_at`)"));
    }
    let resource = texture.index;
    if desc.format.has_depth_aspect() {
        let load = depth_load(desc, load).map_err(|message| refuse(&message))?;
        return match load {
            wgpu::LoadOp::Clear(_) => Ok(Cleared::Depth(Target { resource, part, load })),
            _ => Err(refuse("a clear needs a value; use `Load::ClearDepth`")),
        };
    }
    match load {
        Load::Clear([r, g, b, a]) if desc.format.has_color_aspect() => {
            Ok(Cleared::Color(Target { resource, part, load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }) }))
        }
        Load::Clear(_) => Err(refuse("its format is neither colour nor depth")),
        _ => Err(refuse("a clear of colour needs `Load::Clear([r, g, b, a])`")),
    }
}

fn depth_load(desc: &TextureDesc, load: Load) -> Result<wgpu::LoadOp<f32>, String> {
    if !desc.format.has_depth_aspect() {
        return Err("it is no depth format; use depth32float".to_owned());
    }
    match load {
        Load::ClearDepth(depth) if (0.0..=1.0).contains(&depth) => Ok(wgpu::LoadOp::Clear(depth)),
        Load::ClearDepth(depth) => Err(format!("clear depth {depth} is outside 0…1")),
        Load::Keep => Ok(wgpu::LoadOp::Load),
        Load::Clear(_) => Err("a depth attachment clears with `Load::ClearDepth(1.0)`".to_owned()),
    }
}

fn color_load(desc: &TextureDesc, load: Load, output: &Output, blends: bool) -> Result<wgpu::LoadOp<wgpu::Color>, String> {
    if !desc.format.has_color_aspect() {
        return Err("it is a depth format; attach it with `.depth(…)`".to_owned());
    }
    let given = desc.format.sample_type(None, None);
    let fits = matches!(
        (output.sample, given),
        (S::Float { .. }, Some(S::Float { .. })) | (S::Uint, Some(S::Uint)) | (S::Sint, Some(S::Sint))
    );
    if !fits {
        return Err(
            "the fragment stage writes another kind of value (f32, u32 or i32); make format and WGSL type agree".to_owned()
        );
    }
    if output.components < desc.format.components() {
        return Err(format!(
            "the fragment stage writes {} components and the format has {}; write them all",
            output.components,
            desc.format.components()
        ));
    }
    // Whether the device blends 32-bit floats, the executor knows.
    if blends && !matches!(given, Some(S::Float { .. })) {
        return Err("the shader blends, which formats of integers do not; use a float or unorm format".to_owned());
    }
    match load {
        Load::Clear([r, g, b, a]) => Ok(wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a })),
        Load::Keep => Ok(wgpu::LoadOp::Load),
        Load::ClearDepth(_) => Err("a colour attachment clears with `Load::Clear([r, g, b, a])`".to_owned()),
    }
}
