//! The steps as calls of the graph.

use super::{
    case::{Kind, Node, Owner, Step},
    kernels::{Kernels, Source, Target},
    model,
};
use lightloom_graph::{
    Buffer, Graph, Handle, Load, Readback, Texture, shader_struct,
    wgpu::{self, util::DeviceExt},
};

shader_struct! {
    /// As `StepParams` in `kernels.rs`.
    pub struct StepParams { pub seed: u32, pub count: u32, pub width: u32, pub pad: u32 }
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

/// The objects behind the imported nodes, with their first contents.
pub(super) fn imports(device: &wgpu::Device, queue: &wgpu::Queue, nodes: &[Node]) -> Vec<Import> {
    let import = |(index, node): (usize, &Node)| {
        let words: Vec<u8> = model::imported(index, node.kind).into_iter().flat_map(u32::to_ne_bytes).collect();
        match node.kind {
            _ if node.owner != Owner::Imported => Import::None,
            Kind::Buffer { .. } => Import::Buffer(device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("import"),
                contents: &words,
                usage: wgpu::BufferUsages::STORAGE
                    | wgpu::BufferUsages::UNIFORM
                    | wgpu::BufferUsages::COPY_SRC
                    | wgpu::BufferUsages::COPY_DST,
            })),
            Kind::Texture { size, .. } => {
                let descriptor = wgpu::TextureDescriptor {
                    label: Some("import"),
                    size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                    mip_level_count: 1,
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
                let order = wgpu::util::TextureDataOrder::LayerMajor;
                Import::Texture(device.create_texture_with_data(queue, &descriptor, order, &words))
            }
        }
    };
    nodes.iter().enumerate().map(import).collect()
}

/// Declares the nodes.
fn handles(graph: &mut Graph<'_>, nodes: &[Node], imports: &[Import]) -> Vec<Option<Named>> {
    let mut handles = Vec::new();
    for (index, node) in nodes.iter().enumerate() {
        let name = format!("n{index}");
        let import = imports.get(index);
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
            (Owner::Previous, true) => {
                let pair = graph.history_buffer(&name, node.kind.buffer());
                handles.extend([Named::Buffer(pair.previous), Named::Buffer(pair.current)]);
            }
            (Owner::Previous, false) => {
                let pair = graph.history_texture(&name, node.kind.texture());
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
    handles.into_iter().map(Some).collect()
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

fn declare(
    graph: &mut Graph<'_>,
    kernels: &mut Kernels,
    nodes: &[Node],
    handles: &mut [Option<Named>],
    step: Step,
) -> Option<Readback> {
    let kind = |node: usize| nodes[node].kind;
    let width = |node: usize| if let Kind::Texture { size, .. } = kind(node) { size[0] } else { 1 };
    let source = |from: Option<usize>, uniform: bool| match from.map(kind) {
        None => Source::None,
        Some(Kind::Buffer { .. }) if uniform => Source::Uniform,
        Some(Kind::Buffer { .. }) => Source::Buffer,
        Some(Kind::Texture { .. }) => Source::Texture,
    };
    // Binds a source to a pass of either kind.
    macro_rules! read {
        ($pass:expr, $binding:literal, $from:expr) => {
            match $from.and_then(|node: usize| handles[node].as_ref()) {
                None => $pass,
                Some(Named::Buffer(handle)) => $pass.read($binding, handle),
                Some(Named::Texture(handle)) => $pass.read($binding, handle),
            }
        };
    }
    match step {
        Step::Compute { to, from, uniform, count, seed } => {
            let mut goal = handles[to].take();
            let target = if kind(to).is_buffer() { Target::Buffer } else { Target::Texture(kind(to).channels()) };
            let shader = kernels.compute([source(from[0], uniform), source(from[1], false)], target);
            let pass = graph.compute(shader).params(&StepParams { seed, count, width: width(to), pad: 0 });
            let pass = read!(read!(pass, "a", from[0]), "b", from[1]);
            match &mut goal {
                Some(Named::Buffer(goal)) => pass.write("goal", goal).dispatch_1d(count),
                Some(Named::Texture(goal)) => pass.write("goal", goal).dispatch_1d(count),
                None => {}
            }
            handles[to] = goal;
        }
        Step::Update { to, from, count, seed } => {
            let mut goal = handles[to].take();
            let shader = kernels.compute([source(from, false), Source::None], Target::Update);
            let pass = read!(graph.compute(shader).params(&StepParams { seed, count, width: 1, pad: 0 }), "a", from);
            if let Some(Named::Buffer(goal)) = &mut goal {
                pass.write("goal", goal).dispatch_1d(count);
            }
            handles[to] = goal;
        }
        Step::Draw { to, from, clear, columns, seed } => {
            let targets: Vec<usize> = to.into_iter().flatten().collect();
            let mut goals: Vec<Option<Named>> = targets.iter().map(|&node| handles[node].take()).collect();
            let channels: Vec<u32> = targets.iter().map(|&node| kind(node).channels()).collect();
            let shader = kernels.raster(source(from, false), &channels);
            let params = StepParams { seed, count: columns, width: width(targets[0]), pad: 0 };
            let mut pass = read!(graph.raster(shader).params(&params), "a", from);
            let load = clear.map_or(Load::Keep, |value| Load::Clear([value.into(); 4]));
            for (n, goal) in goals.iter_mut().enumerate() {
                if let Some(Named::Texture(goal)) = goal {
                    pass = pass.color(&format!("at{n}"), goal, load);
                }
            }
            pass.draw(3, 1);
            targets.into_iter().zip(goals).for_each(|(node, goal)| handles[node] = goal);
        }
        Step::Clear { to } => {
            if let Some(Named::Buffer(goal)) = &mut handles[to] {
                graph.clear_buffer(goal);
            }
        }
        Step::Copy { to, from } => {
            let mut goal = handles[to].take();
            match (&handles[from], &mut goal) {
                (Some(Named::Buffer(from)), Some(Named::Buffer(goal))) => graph.copy_buffer(from, goal),
                (Some(Named::Texture(from)), Some(Named::Texture(goal))) => graph.copy_texture(from, goal),
                _ => {}
            }
            handles[to] = goal;
        }
        Step::Closure { to, from, words } => {
            let mut goal = handles[to].take();
            if let (Some(from), Some(goal)) = (&handles[from], &mut goal) {
                closure(graph, from, goal, words);
            }
            handles[to] = goal;
        }
        Step::Read { from } => {
            return match &handles[from] {
                Some(Named::Buffer(handle)) => Some(graph.readback_buffer(handle)),
                Some(Named::Texture(handle)) => Some(graph.readback_texture(handle)),
                None => None,
            };
        }
    }
    None
}

/// Copies by commands of the caller's.
fn closure(graph: &mut Graph<'_>, from: &Named, goal: &mut Named, words: u32) {
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
                let (from, goal, size) = (from.as_image_copy(), goal.as_image_copy(), from.size());
                context.encoder().copy_texture_to_texture(from, goal, size);
                Ok(())
            });
        }
        _ => {}
    }
}
