//! The steps as calls of the graph.

use super::{
    case::{Bind, Step},
    kernels::{Kernels, Source, Target},
    model,
    node::{Kind, Node, Owner, Part},
};
use lightloom_graph::{
    Buffer, Graph, Handle, Initial, Load, Readback, Texture, shader_struct,
    wgpu::{self, util::DeviceExt},
};

shader_struct! {
    /// As `StepParams` in `kernels.rs`.
    pub struct StepParams { pub seed: u32, pub count: u32, pub width: u32, pub depth: u32 }
}

/// A node's handle in one graph.
enum Named {
    Buffer(Handle<Buffer>),
    Texture(Handle<Texture>),
}

/// A node's wgpu object, if the caller owns it.
pub(super) enum Import {
    None,
    Buffer(wgpu::Buffer),
    Texture(wgpu::Texture),
}

fn bytes(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_ne_bytes()).collect()
}

/// The objects behind the imported nodes, with their first contents.
pub(super) fn imports(device: &wgpu::Device, queue: &wgpu::Queue, nodes: &[Node]) -> Vec<Import> {
    let import = |(index, node): (usize, &Node)| {
        let words: Vec<u8> = bytes(&model::first(index, node.kind));
        match node.kind {
            _ if node.owner != Owner::Imported => Import::None,
            Kind::Buffer { .. } => Import::Buffer(device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("import"),
                contents: &words,
                usage: wgpu::BufferUsages::STORAGE
                    | wgpu::BufferUsages::UNIFORM
                    | wgpu::BufferUsages::INDIRECT
                    | wgpu::BufferUsages::COPY_SRC
                    | wgpu::BufferUsages::COPY_DST,
            })),
            Kind::Texture { .. } | Kind::Depth { .. } => {
                let [width, height] = node.kind.size(0);
                let [mip_level_count, depth_or_array_layers] = node.kind.counts();
                let descriptor = wgpu::TextureDescriptor {
                    label: Some("import"),
                    size: wgpu::Extent3d { width, height, depth_or_array_layers },
                    mip_level_count,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format: node.kind.texture().format,
                    usage: wgpu::TextureUsages::TEXTURE_BINDING
                        | wgpu::TextureUsages::STORAGE_BINDING
                        | wgpu::TextureUsages::RENDER_ATTACHMENT
                        | wgpu::TextureUsages::COPY_SRC
                        | wgpu::TextureUsages::COPY_DST,
                    view_formats: &[],
                };
                let order = wgpu::util::TextureDataOrder::MipMajor;
                Import::Texture(device.create_texture_with_data(queue, &descriptor, order, &words))
            }
        }
    };
    nodes.iter().enumerate().map(import).collect()
}

/// Declares the nodes.
fn handles(graph: &mut Graph<'_>, nodes: &[Node], imports: &[Import]) -> Vec<Named> {
    let mut handles = Vec::new();
    for (index, node) in nodes.iter().enumerate() {
        let name = format!("n{index}");
        let import = imports.get(index);
        let initial = if node.filled {
            Initial::Bytes(bytes(&model::first(index, node.kind)[..node.kind.first_mip()]).into())
        } else {
            Initial::Zero
        };
        match (node.owner, node.kind.is_buffer()) {
            (Owner::Transient, true) => handles.push(Named::Buffer(graph.buffer(&name, node.kind.buffer()))),
            (Owner::Transient, false) => handles.push(Named::Texture(graph.texture(&name, node.kind.texture()))),
            (Owner::Imported, true) => {
                let object =
                    import.and_then(|import| if let Import::Buffer(object) = import { Some(object.clone()) } else { None });
                handles.push(Named::Buffer(graph.import_buffer(&name, node.kind.buffer(), object)));
            }
            (Owner::Imported, false) => {
                let object =
                    import.and_then(|import| if let Import::Texture(object) = import { Some(object.clone()) } else { None });
                handles.push(Named::Texture(graph.import_texture(&name, node.kind.texture(), object)));
            }
            (Owner::Persistent, true) => {
                handles.push(Named::Buffer(graph.persistent_buffer(&name, node.kind.buffer(), initial)));
            }
            (Owner::Persistent, false) => {
                handles.push(Named::Texture(graph.persistent_texture(&name, node.kind.texture(), initial)));
            }
            (Owner::Previous, true) => {
                let pair = graph.history_buffer_from(&name, node.kind.buffer(), initial);
                handles.extend([Named::Buffer(pair.previous), Named::Buffer(pair.current)]);
            }
            (Owner::Previous, false) => {
                let pair = graph.history_texture_from(&name, node.kind.texture(), initial);
                handles.extend([Named::Texture(pair.previous), Named::Texture(pair.current)]);
            }
            // Came with the previous half.
            (Owner::Current, _) => {}
        }
        if node.keep && node.owner == Owner::Transient {
            match &handles[index] {
                Named::Buffer(handle) => graph.keep(handle),
                Named::Texture(handle) => graph.keep(handle),
            }
        }
    }
    handles
}

/// Declares a frame; its reads, in order.
pub(super) fn frame(
    graph: &mut Graph<'_>,
    kernels: &mut Kernels,
    nodes: &[Node],
    imports: &[Import],
    steps: &[Step],
) -> Vec<Readback> {
    let mut handles = handles(graph, nodes, imports);
    steps.iter().filter_map(|&step| declare(graph, kernels, nodes, &mut handles, step)).collect()
}

/// Binds a source to a pass of either kind.
macro_rules! read {
    ($handles:expr, $pass:expr, $binding:literal, $from:expr, $bind:expr) => {
        match $from.map(|part: Part| (part, &$handles[part.node])) {
            None if $bind == Bind::Optional => $pass.read_optional($binding, None::<&Handle<Buffer>>),
            None => $pass,
            Some((part, Named::Buffer(handle))) if $bind == Bind::Optional && part.is_whole() => {
                $pass.read_optional($binding, Some(handle))
            }
            Some((part, Named::Texture(handle))) if $bind == Bind::Optional && part.is_whole() => {
                $pass.read_optional($binding, Some(handle))
            }
            Some((_, Named::Buffer(handle))) => $pass.read($binding, handle),
            Some((part, Named::Texture(handle))) if part.is_whole() => $pass.read($binding, handle),
            Some((part, Named::Texture(handle))) => $pass.read_at($binding, handle, part.subresources()),
        }
    };
}

/// What a source is to the shader.
fn source(nodes: &[Node], from: Option<Part>, bind: Bind) -> Source {
    match from.map(|part| (part, nodes[part.node].kind)) {
        None if bind == Bind::Optional => Source::Buffer,
        None => Source::None,
        Some((_, Kind::Buffer { .. })) => match bind {
            Bind::Uniform => Source::Uniform,
            Bind::Exclusive => Source::Exclusive,
            Bind::Plain | Bind::Optional => Source::Buffer,
        },
        Some((part, kind)) if part.is_array(kind) => Source::Array,
        Some(_) => Source::Texture,
    }
}

fn declare(graph: &mut Graph<'_>, kernels: &mut Kernels, nodes: &[Node], handles: &mut [Named], step: Step) -> Option<Readback> {
    let kind = |node: usize| nodes[node].kind;
    let width = |part: Part| part.size(kind(part.node))[0];
    match step {
        Step::Compute { to, from, bind, groups, count, pinned, seed } => {
            let target = if kind(to.node).is_buffer() { Target::Buffer } else { Target::Texture(kind(to.node).channels()) };
            let shader = kernels.compute([source(nodes, from[0], bind), source(nodes, from[1], Bind::Plain)], target);
            let pass = graph.compute(shader).params(&StepParams { seed, count, width: width(to), depth: 0 });
            let pass = if pinned { pass.pinned() } else { pass };
            let pass = read!(handles, read!(handles, pass, "a", from[0], bind), "b", from[1], Bind::Plain);
            let pass = match &mut handles[to.node] {
                Named::Buffer(goal) => pass.write("goal", goal),
                Named::Texture(goal) if to.is_whole() => pass.write("goal", goal),
                Named::Texture(goal) => pass.write_at("goal", goal, to.subresources()),
            };
            match groups.map(|node| &handles[node]) {
                Some(Named::Buffer(arguments)) => pass.dispatch_indirect(arguments, 4),
                _ => pass.dispatch_1d(count),
            }
        }
        Step::Update { to, from, count, seed } => {
            let shader = kernels.compute([source(nodes, from, Bind::Plain), Source::None], Target::Update);
            let pass = graph.compute(shader).params(&StepParams { seed, count, width: 1, depth: 0 });
            let pass = read!(handles, pass, "a", from, Bind::Plain);
            if let Named::Buffer(goal) = &mut handles[to.node] {
                pass.write("goal", goal).dispatch_1d(count);
            }
        }
        Step::Arguments { to, groups, vertices, seed } => {
            let shader = kernels.compute([Source::None; 2], Target::Arguments);
            let params = StepParams { seed, count: vertices, width: groups, depth: 0 };
            if let Named::Buffer(goal) = &mut handles[to] {
                graph.compute(shader).params(&params).write("goal", goal).dispatch_1d(kind(to).words() as u32);
            }
        }
        Step::Draw { .. } => draw(graph, kernels, nodes, handles, step),
        Step::Clear { to, value } => match &mut handles[to.node] {
            Named::Buffer(goal) => graph.clear_buffer(goal),
            Named::Texture(goal) if kind(to.node).is_depth() => graph.clear_texture(goal, Load::ClearDepth(value as f32 / 8.0)),
            Named::Texture(goal) if to.is_whole() => graph.clear_texture(goal, Load::Clear([value.into(); 4])),
            Named::Texture(goal) => graph.clear_texture_at(goal, to.subresources(), Load::Clear([value.into(); 4])),
        },
        Step::Copy { to, from } => match handles.get_disjoint_mut([from, to]).ok()? {
            [Named::Buffer(from), Named::Buffer(goal)] => graph.copy_buffer(from, goal),
            [Named::Texture(from), Named::Texture(goal)] => graph.copy_texture(from, goal),
            _ => {}
        },
        Step::Closure { to, from, words } => {
            let [source, goal] = handles.get_disjoint_mut([from, to]).ok()?;
            closure(graph, source, goal, kind(from), words);
        }
        Step::Read { from } => {
            return Some(match &handles[from.node] {
                Named::Buffer(handle) => graph.readback_buffer(handle),
                Named::Texture(handle) => graph.readback_texture(handle),
            });
        }
    }
    None
}

fn draw(graph: &mut Graph<'_>, kernels: &mut Kernels, nodes: &[Node], handles: &mut [Named], step: Step) {
    let Step::Draw { to, depth, from, bind, beside, vertices, clear, columns, pinned, seed } = step else { return };
    let targets: Vec<Part> = to.into_iter().flatten().collect();
    let channels: Vec<u32> = targets.iter().map(|part| nodes[part.node].kind.channels()).collect();
    let shader = kernels.raster(source(nodes, from, bind), &channels, beside.is_some());
    let width = targets[0].size(nodes[targets[0].node].kind)[0];
    let params = StepParams { seed, count: columns, width, depth: model::depth(seed) };
    let pass = graph.raster(shader).params(&params);
    let pass = if pinned { pass.pinned() } else { pass };
    let mut pass = read!(handles, pass, "a", from, bind);
    if let Some(Named::Buffer(beside)) = beside.map(|node| &mut handles[node]) {
        pass = pass.write("beside", beside);
    }
    let load = clear.map_or(Load::Keep, |value| Load::Clear([value.into(); 4]));
    for (n, part) in targets.into_iter().enumerate() {
        if let Named::Texture(goal) = &mut handles[part.node] {
            pass = if part.is_whole() {
                pass.color(&format!("at{n}"), goal, load)
            } else {
                pass.color_at(&format!("at{n}"), goal, part.subresources(), load)
            };
        }
    }
    if let Some(Named::Texture(depth)) = depth.map(|node| &mut handles[node]) {
        pass = pass.depth(depth, if clear.is_some() { Load::ClearDepth(1.0) } else { Load::Keep });
    }
    match vertices.map(|node| &handles[node]) {
        Some(Named::Buffer(arguments)) => pass.draw_indirect(arguments, 16),
        _ => pass.draw(3, 1),
    }
}

/// Copies by commands of the caller's.
fn closure(graph: &mut Graph<'_>, from: &Named, goal: &mut Named, kind: Kind, words: u32) {
    match (from, goal) {
        (Named::Buffer(from), Named::Buffer(goal)) => {
            let names = [from.name().to_owned(), goal.name().to_owned()];
            graph.closure("closure").read(from).write(goal).record(move |context| {
                let [from, goal] = [context.buffer(&names[0])?, context.buffer(&names[1])?];
                context.encoder().copy_buffer_to_buffer(&from, 0, &goal, 0, u64::from(words) * 4);
                Ok(())
            });
        }
        (Named::Texture(from), Named::Texture(goal)) => {
            let names = [from.name().to_owned(), goal.name().to_owned()];
            graph.closure("closure").read(from).write(goal).record(move |context| {
                let [from, goal] = [context.texture(&names[0])?, context.texture(&names[1])?];
                // The objects may have more mips and layers than asked for.
                for [mip_level, z] in kind.cells() {
                    let origin = wgpu::Origin3d { x: 0, y: 0, z };
                    let at = |texture| wgpu::TexelCopyTextureInfo { mip_level, origin, ..wgpu::Texture::as_image_copy(texture) };
                    let [width, height] = kind.size(mip_level);
                    let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
                    context.encoder().copy_texture_to_texture(at(&from), at(&goal), size);
                }
                Ok(())
            });
        }
        _ => {}
    }
}
