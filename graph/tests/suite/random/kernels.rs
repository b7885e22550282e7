//! The shaders of the steps, written as they are asked for. All arithmetic is on u32, so results are exact.

use lightloom_graph::{ComputeShader, RasterShader};
use std::collections::HashMap;

/// What a source is bound as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Source {
    None,
    Buffer,
    Uniform,
    /// A buffer by a variable that could write it.
    Exclusive,
    Texture,
    Array,
}

/// What a kernel writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Target {
    Buffer,
    Update,
    /// Arguments of indirect calls, by `count` (vertices) and `width` (groups).
    Arguments,
    /// By its channels.
    Texture(u32),
}

/// Shaders made so far.
#[derive(Default)]
pub(super) struct Kernels {
    compute: HashMap<([Source; 2], Target), ComputeShader>,
    /// By source, channels of the attachments, and whether a buffer is updated beside them.
    raster: HashMap<(Source, Vec<u32>, bool), RasterShader>,
}

const HASH: &str = "
fn mix32(a: u32, b: u32) -> u32 {
    let h = (a ^ (b * 0x9e3779b1u)) * 0x85ebca6bu;
    return h ^ (h >> 15u);
}
struct StepParams { seed: u32, count: u32, width: u32, depth: u32 }
@group(0) @binding(0) var<uniform> params: StepParams;
";

/// The variable `name` and the function that reads its item `i`.
fn source(source: Source, name: &str, number: u32) -> String {
    let read = format!("fn item_{name}(i: u32) -> u32");
    let binding = format!("@group(0) @binding({number}) var");
    match source {
        Source::None => format!("{read} {{ return 0u; }}\n"),
        Source::Buffer | Source::Exclusive => {
            let access = if source == Source::Buffer { "read" } else { "read_write" };
            format!("{binding}<storage, {access}> {name}: array<u32>;\n{read} {{ return {name}[i % arrayLength(&{name})]; }}\n")
        }
        Source::Uniform => {
            format!("{binding}<uniform> {name}: array<vec4u, 4>;\n{read} {{ return {name}[(i / 4u) % 4u][i % 4u]; }}\n")
        }
        // Item after item from another mip and layer.
        Source::Texture | Source::Array => {
            let (kind, layers, layer) = match source {
                Source::Array => ("texture_2d_array", format!("textureNumLayers({name})"), "cell % layers, "),
                _ => ("texture_2d", "1u".to_owned(), ""),
            };
            format!(
                "{binding} {name}: {kind}<u32>;
                {read} {{
                    let layers = {layers};
                    let cells = textureNumLevels({name}) * layers;
                    let cell = i % cells;
                    // All lanes load all levels: not every driver loads from a level that differs between lanes.
                    var item = 0u;
                    for (var level = 0u; level < textureNumLevels({name}); level++) {{
                        let size = textureDimensions({name}, level);
                        let at = i / cells % (size.x * size.y);
                        let texel = textureLoad({name}, vec2u(at % size.x, at / size.x), {layer}level) * vec4u(1u, 3u, 5u, 7u);
                        item = select(item, texel.x + texel.y + texel.z + texel.w, level == cell / layers);
                    }}
                    return item;
                }}\n"
            )
        }
    }
}

/// All channels of a texel whose first is `value`.
fn texel(channels: u32) -> &'static str {
    if channels == 1 { "vec4u(value, 0u, 0u, 0u)" } else { "vec4u(value, mix32(value, 1u), mix32(value, 2u), mix32(value, 3u))" }
}

impl Kernels {
    /// Writes `target` from the sources `a` and `b`, one item an invocation.
    pub(super) fn compute(&mut self, from: [Source; 2], target: Target) -> &ComputeShader {
        self.compute.entry((from, target)).or_insert_with(|| {
            let sources = source(from[0], "a", 1) + &source(from[1], "b", 2);
            let binding = "@group(0) @binding(3) var";
            let (variable, store) = match target {
                Target::Buffer => (format!("{binding}<storage, read_write> goal: array<u32>;"), "goal[i] = value;".to_owned()),
                Target::Update => {
                    (format!("{binding}<storage, read_write> goal: array<u32>;"), "goal[i] = mix32(goal[i], value);".to_owned())
                }
                Target::Arguments => (
                    format!("{binding}<storage, read_write> goal: array<u32>;"),
                    "var words = array(value, params.width, 1u, 1u, params.count, 1u, 0u, 0u); goal[i] = select(value, words[i % 8u], i < 8u);"
                        .to_owned(),
                ),
                Target::Texture(channels) => (
                    format!(
                        "{binding} goal: texture_storage_2d<{}, write>;",
                        if channels == 1 { "r32uint" } else { "rgba32uint" }
                    ),
                    format!("textureStore(goal, vec2u(i % params.width, i / params.width), {});", texel(channels)),
                ),
            };
            let value = match target {
                Target::Update => "mix32(mix32(params.seed, i), item_a(i))",
                _ => "mix32(mix32(mix32(params.seed, i), item_a(i)), item_b(i))",
            };
            let bound = if target == Target::Arguments { "arrayLength(&goal)" } else { "params.count" };
            let wgsl = format!(
                "{HASH}{sources}{variable}
                @compute @workgroup_size(64) fn step(@builtin(global_invocation_id) id: vec3u) {{
                    let i = id.x;
                    if i < {bound} {{ let value = {value}; {store} }}
                }}"
            );
            ComputeShader::from_wgsl("step", &wgsl).unwrap_or_else(|error| panic!("{error}\n{wgsl}"))
        })
    }

    /// Draws a triangle over everything; output `at0` has `channels[0]` channels, and so on. Later columns are discarded.
    /// `beside`: each texel updates its word of the buffer of that name.
    pub(super) fn raster(&mut self, from: Source, channels: &[u32], beside: bool) -> &RasterShader {
        self.raster.entry((from, channels.to_vec(), beside)).or_insert_with(|| {
            let member =
                |(n, &channels): (usize, &u32)| format!("@location({n}) at{n}: {}", if channels == 1 { "u32" } else { "vec4u" });
            let members: Vec<String> = channels.iter().enumerate().map(member).collect();
            let store = |(n, &channels): (usize, &u32)| {
                let texel = if channels == 1 { "value" } else { texel(channels) };
                format!("{{ let value = mix32(mix32(params.seed + {n}u, i), item); out.at{n} = {texel}; }}")
            };
            let stores: Vec<String> = channels.iter().enumerate().map(store).collect();
            let (variable, update) = if beside {
                (
                    "@group(0) @binding(3) var<storage, read_write> beside: array<u32>;",
                    "if i < arrayLength(&beside) { beside[i] = mix32(beside[i], mix32(mix32(params.seed, i), item)); }",
                )
            } else {
                ("", "")
            };
            let wgsl = format!(
                "{HASH}{}{variable}
                struct Output {{ {} }}
                @vertex fn draw_vertex(@builtin(vertex_index) v: u32) -> @builtin(position) vec4f {{
                    return vec4f(vec2f(f32(v & 1u), f32(v >> 1u)) * 4.0 - 1.0, f32(params.depth) / 8.0, 1.0);
                }}
                @fragment fn draw_fragment(@builtin(position) position: vec4f) -> Output {{
                    let at = vec2u(position.xy);
                    if at.x >= params.count {{ discard; }}
                    let i = at.y * params.width + at.x;
                    let item = item_a(i);
                    {update}
                    var out: Output;
                    {}
                    return out;
                }}",
                source(from, "a", 1),
                members.join(", "),
                stores.join("\n"),
            );
            RasterShader::from_wgsl("draw", &wgsl).unwrap_or_else(|error| panic!("{error}\n{wgsl}"))
        })
    }
}
