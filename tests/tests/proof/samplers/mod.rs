//! Samplers: directions are drawn with the density that the shader itself returns, and weights are f·cos/pdf.
//!
//! Each case draws directions on the GPU into the cells of the sphere, and integrates the shader's density over each cell, on the GPU
//! as well. Pearson's χ² compares both; what a density does not cover (draws that end the path) is one more cell. The values of f are
//! compared with f64 code that follows the papers. The mean of the weights, a furnace's albedo, is compared with the integral of
//! f·cos, which closes the ring: density right, f right, weight right.

mod blinn_phong;
mod brdf;
mod dielectric;
mod emission;

use glam::{DVec3, Vec3};
use lightloom_graph::{BufferDesc, ComputeShader, Graph, shader_struct};
use lightloom_passes::scene::{GpuScene, builtin};
use lightloom_tests::{Cells, ChiSquare, Lab, Mean};

/// χ² tests of this module, at most; of all of them together the threshold speaks.
const TESTS: u32 = 200;
/// Directions a case draws.
const COUNT: u32 = 200_000;
const RINGS: u32 = 24;
const SECTORS: u32 = 24;
/// Points along each side of a cell, each at random in its own square: unbiased. Where the horizon cuts a cell in two, some 48 of its
/// 2304 squares are in doubt, and the integral by √(48/4)/2304 = 0.15 % of the cell; the counts are by 5 %, 1/√(200,000/576).
const FINE: u32 = 48;

const TEXT: &str = r"
struct SamplerParams {
    // Unit, away from the surface.
    wo: vec3f,
    roughness: f32,
    normal: vec3f,
    metallic: f32,
    base_color: vec3f,
    f0: f32,
    axis_x: vec3f,
    // Of the cells, see `Cells`.
    width: f32,
    axis_y: vec3f,
    span: f32,
    pole: vec3f,
    // Which side of the surface is looked at: 1, −1, 0 for both.
    side: f32,
    count: u32,
    seed: u32,
    rings: u32,
    sectors: u32,
    fine: u32,
    ior: f32,
    thickness: f32,
    transmission: f32,
    front: u32,
    radiance: u32,
    pad0: u32,
    pad1: u32,
}
@group(0) @binding(0) var<uniform> params: SamplerParams;
@group(0) @binding(1) var<storage, read_write> out: array<vec4f>;

struct Drawn { direction: vec3f, pdf: f32, weight: vec3f, glossy: bool }

@compute @workgroup_size(64)
fn sampler(@builtin(global_invocation_id) thread: vec3u) {
    let i = thread.x;
    if i >= params.count { return; }
";
const DRAW: &str = r"
    var rng = rng_new(params.seed, 0u, i);
    let it = drawn(rng_next4(&rng));
    out[2u * i] = vec4f(it.direction, it.pdf);
    out[2u * i + 1u] = vec4f(it.weight, select(0.0, 1.0, it.glossy));
}
";
const INTEGRATE: &str = r"
    let sector = i % params.sectors;
    let ring = i / params.sectors;
    let c2 = params.width * params.width;
    let area = 4.0 * PI * params.span / (f32(params.rings * params.sectors) * f32(params.fine * params.fine));
    var rng = rng_new(params.seed, 1u, i);
    var sum = 0.0;
    for (var a = 0u; a < params.fine; a += 1u) {
        for (var b = 0u; b < params.fine; b += 1u) {
            let inside = (vec2f(f32(a), f32(b)) + rng_next4(&rng).xy) / f32(params.fine);
            let m = min(c2 * (exp((f32(ring) + inside.x) / f32(params.rings) * params.span) - 1.0), 1.0);
            let sin_theta = 2.0 * sqrt(m * (1.0 - m));
            let phi = 2.0 * PI * (f32(sector) + inside.y) / f32(params.sectors);
            let w = params.axis_x * (sin_theta * cos(phi)) + params.axis_y * (sin_theta * sin(phi)) + params.pole * (1.0 - 2.0 * m);
            if params.side * dot(w, params.normal) >= 0.0 {
                sum += density(w) * area * (m + c2);
            }
        }
    }
    out[i] = vec4f(sum);
}
";

shader_struct! {
    struct SamplerParams {
        wo: [f32; 3],
        roughness: f32,
        normal: [f32; 3],
        metallic: f32,
        base_color: [f32; 3],
        f0: f32,
        axis_x: [f32; 3],
        width: f32,
        axis_y: [f32; 3],
        span: f32,
        pole: [f32; 3],
        side: f32,
        count: u32,
        seed: u32,
        rings: u32,
        sectors: u32,
        fine: u32,
        ior: f32,
        thickness: f32,
        transmission: f32,
        front: u32,
        radiance: u32,
        pad0: u32,
        pad1: u32,
    }
}

/// One direction that was drawn.
struct Drawn {
    direction: DVec3,
    pdf: f64,
    weight: DVec3,
    glossy: bool,
}

/// A sampler and its density: WGSL functions `drawn(u: vec4f) -> Drawn` and `density(w: vec3f) -> f32` of `params`.
struct Sampler {
    draw: ComputeShader,
    integrate: ComputeShader,
    scene: GpuScene,
}

impl Sampler {
    fn new(lab: &Lab, body: &str) -> Self {
        Self::with_constants(lab, body, &[])
    }

    /// With values of WGSL `override`s.
    fn with_constants(lab: &Lab, body: &str, constants: &[(&str, f64)]) -> Self {
        let kernel = |tail: &str| {
            let text = format!("#import \"shared/rng.wgsl\"\n#import \"shared/surface.wgsl\"\n{TEXT}{tail}{body}");
            let shader = ComputeShader::new(&lab.sources.with(&[("sampler.wgsl", &text)]), "sampler.wgsl");
            let set = |shader: ComputeShader, &(name, value): &(&str, f64)| shader.with_constant(name, value);
            shader.and_then(|shader| constants.iter().try_fold(shader, set)).expect("the kernel is valid")
        };
        // Whatever scene: the kernels only call functions beside which its bindings are declared.
        let scene = lab.upload(&builtin::plane(1.0));
        Self { draw: kernel(DRAW), integrate: kernel(INTEGRATE), scene }
    }

    fn run(&self, lab: &mut Lab, shader: &ComputeShader, params: &SamplerParams, words: u32) -> Vec<[f32; 4]> {
        let mut graph = Graph::new("sampler");
        let handles = self.scene.declare(&mut graph);
        let mut out = graph.buffer("out", BufferDesc::words(4 * u64::from(words)));
        handles.bind(graph.compute(shader).params(params)).write("out", &mut out).dispatch_1d(params.count);
        let read = graph.readback_buffer(&out);
        lab.run(graph).cast(read)
    }

    fn draw(&self, lab: &mut Lab, params: &SamplerParams) -> Vec<Drawn> {
        let params = SamplerParams { count: COUNT, seed: 1, ..*params };
        let words = self.run(lab, &self.draw, &params, 2 * COUNT);
        let vector = |v: &[f32; 4]| Vec3::from_slice(&v[..3]).as_dvec3();
        let pairs = words.chunks_exact(2);
        pairs
            .map(|pair| Drawn {
                direction: vector(&pair[0]),
                pdf: f64::from(pair[0][3]),
                weight: vector(&pair[1]),
                glossy: pair[1][3] != 0.0,
            })
            .collect()
    }

    /// The shader's density integrated over each cell, on `side` of the surface.
    fn expected(&self, lab: &mut Lab, params: &SamplerParams, cells: &Cells, side: f32) -> Vec<f64> {
        let [x, y, pole] = cells.axes.map(|axis| axis.as_vec3().to_array());
        let params = SamplerParams {
            axis_x: x,
            axis_y: y,
            pole,
            width: cells.width as f32,
            span: cells.span() as f32,
            side,
            count: cells.count() as u32,
            rings: cells.rings,
            sectors: cells.sectors,
            fine: FINE,
            ..*params
        };
        let sums = self.run(lab, &self.integrate, &params, params.count);
        sums.iter().map(|sum| f64::from(sum[0])).collect()
    }

    /// χ² of the draws on `side` of the surface, about a pole; of draws that count: their density is not zero.
    #[track_caller]
    fn assert_follows(&self, lab: &mut Lab, params: &SamplerParams, drawn: &[Drawn], cells: &Cells, side: f32, what: &str) {
        let share = self.expected(lab, params, cells, side);
        let normal = Vec3::from(params.normal).as_dvec3();
        let mut counts = vec![0.0; cells.count()];
        for draw in drawn {
            if draw.pdf > 0.0 && f64::from(side) * draw.direction.dot(normal) >= 0.0 {
                counts[cells.index(draw.direction)] += 1.0;
            }
        }
        let (n, inside) = (drawn.len() as f64, share.iter().sum::<f64>());
        assert!(inside <= 1.0 + 1e-3, "{what}: the density integrates to {inside}");
        let elsewhere = (n - counts.iter().sum::<f64>(), n * (1.0 - inside).max(0.0));
        let cells = counts.into_iter().zip(share.iter().map(|share| n * share));
        ChiSquare::of(cells.chain([elsewhere])).assert_probable(TESTS, what);
    }
}

/// Mean of one channel of the weights.
fn mean_weight(drawn: &[Drawn], channel: usize) -> Mean {
    Mean::of(&drawn.iter().map(|draw| draw.weight[channel]).collect::<Vec<_>>())
}

/// A unit vector `cos` above the plane of `normal`.
fn above(normal: DVec3, cos: f64) -> DVec3 {
    let across = normal.any_orthonormal_vector();
    // Along no axis of any frame.
    let across = (across + 0.7 * normal.cross(across)).normalize();
    normal * cos + across * (1.0 - cos * cos).sqrt()
}

/// A normal along no axis.
fn tilted() -> DVec3 {
    DVec3::new(0.3, -0.5, 0.8).normalize()
}

/// `w` in a frame whose z is the normal.
fn local(normal: DVec3, w: DVec3) -> DVec3 {
    let x = normal.any_orthonormal_vector();
    DVec3::new(w.dot(x), w.dot(normal.cross(x)), w.dot(normal))
}
