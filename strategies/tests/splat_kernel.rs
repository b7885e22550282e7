//! The splatting kernel's WGSL against its closed forms, and the counts of photons per tile against the CPU's.

mod common;

use common::{Bench, Random, camera, import_photons, photon};
use glam::{Mat4, Vec3};
use lightloom_graph::{BufferDesc, ComputeShader, Executor, Graph, shader_struct};
use lightloom_passes::scene::SceneInfo;
use lightloom_passes::{CameraUniform, Photon};
use lightloom_strategies::{DensityTiles, SplatKernel, SplatKernelUniform};

shader_struct! {
    struct Params {
        kernel: SplatKernelUniform,
        depth: f32,
        photons_in_tile: u32,
        pad0: u32,
        pad1: u32,
    }
}

/// Writes, per photon: red flux through the kernel plane over the photon's; the same half way up in the slab, and just outside it; half
/// axes u, t, n (m); the largest product of two axes; u · light.
const PROBE: &str = r#"
#import "shared/splat_kernel.wgsl"
struct Params { kernel: SplatKernel, depth: f32, photons_in_tile: u32, pad0: u32, pad1: u32 }
@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> photons: array<Photon>;
@group(0) @binding(2) var<storage, read_write> results: array<f32>;
const STEPS: u32 = 200u;
fn flux_through(e: Ellipsoid, height: f32) -> f32 {
    let kernel = kernel_test(e, splat_irradiance(e));
    let edge = 2.5 * e.radii.x / f32(STEPS);
    var inside = 0u;
    for (var y = 0u; y < STEPS; y++) {
        for (var x = 0u; x < STEPS; x++) {
            let at = (vec2f(vec2u(x, y)) + 0.5 - 0.5 * f32(STEPS)) * edge;
            // Axes of the plane that are not the ellipse's.
            let frame = tangent_frame(e.n);
            inside += u32(kernel_holds(kernel, e.center + frame * vec3f(at, height)));
        }
    }
    return f32(inside) * edge * edge * kernel.irradiance.x / e.flux.x;
}
// Three invocations per photon, one per plane: llvmpipe ends the loops of an invocation after 65,535 turns.
@compute @workgroup_size(1)
fn probe(@builtin(global_invocation_id) id: vec3u) {
    let e = splat_ellipsoid(photons[id.x], vec3f(0.0, 0.0, -params.depth), params.photons_in_tile, params.kernel);
    let at = 8u * id.x;
    results[at + id.y] = flux_through(e, vec3f(0.0, 0.5, 1.01)[id.y] * e.radii.z);
    if id.y == 0u {
        results[at + 3u] = e.radii.x;
        results[at + 4u] = e.radii.y;
        results[at + 5u] = e.radii.z;
        results[at + 6u] = max(abs(dot(e.u, e.t)), max(abs(dot(e.u, e.n)), abs(dot(e.t, e.n))));
        results[at + 7u] = dot(e.u, e.incident);
    }
}
"#;

fn probe(executor: &mut Executor, photons: &[Photon], kernel: SplatKernelUniform, depth: f32, count: u32) -> Vec<[f32; 8]> {
    let sources = lightloom_passes::shaders().with(&[("probe.wgsl", PROBE)]);
    let shader = ComputeShader::new(&sources, "probe.wgsl").expect("the probe is sound");
    let device = executor.device().clone();
    let mut graph = Graph::new("probe");
    let records = import_photons(&mut graph, &device, photons, photons.len() as u32).records;
    let mut results = graph.buffer("results", BufferDesc::words(8 * photons.len() as u64));
    graph
        .compute(&shader)
        .params(&Params { kernel, depth, photons_in_tile: count, ..Params::default() })
        .read("photons", &records)
        .write("results", &mut results)
        .dispatch([photons.len() as u32, 3, 1]);
    let read = graph.readback_buffer(&results);
    executor.execute(graph).expect("the probe runs").cast(read)
}

/// A photon whose light makes `degrees` with its normal and came `length_half` (a half) metres.
fn tilted(degrees: f32, length_half: u32) -> Photon {
    let normal = Vec3::new(0.3, 0.8, -0.4).normalize();
    let across = normal.any_orthonormal_vector();
    let from = normal * degrees.to_radians().cos() + across * degrees.to_radians().sin();
    let mut tilted = photon(Vec3::new(1.0, 2.0, 3.0), normal, from, Vec3::splat(0.5), 0, false);
    tilted.length_probability |= length_half;
    tilted
}

fn uniform(kernel: SplatKernel, size: [u32; 2]) -> SplatKernelUniform {
    let info = SceneInfo { bounds_radius: 10.0, ..SceneInfo::default() };
    let camera = camera(Vec3::Z, Vec3::ZERO, size, [0.5, 0.5]);
    kernel.resolve(&info, 1000, &camera).expect("the kernel is sound")
}

#[test]
fn the_kernel_integrates_to_one_over_its_plane_and_has_the_papers_axes() {
    let Some(mut bench) = Bench::new() else { return };
    let stated = SplatKernel {
        disc_min_m: Some(0.01),
        disc_max_m: Some(0.5),
        n_tile: Some(2.0),
        l_max_m: Some(4.0),
        s_n: Some(0.2),
        s_max: Some(3.0),
        tile: Some(16),
    };
    let kernel = uniform(stated, [64, 48]);
    // Halves of 0, 2 and 8 m.
    let lengths = [(0, 0.1), (0x4000, 0.5), (0x4800, 1.0)];
    let angles = [0.0_f32, 30.0, 60.0, 85.0];
    let photons: Vec<_> = angles.iter().flat_map(|&angle| lengths.map(|(half, _)| tilted(angle, half))).collect();
    // A disc clamped from below, within the bounds, and clamped from above.
    for (depth, count, clamp) in [(1.0, 1_000_000, "min"), (2.0, 5, ""), (100.0, 0, "max")] {
        let disc = depth * (kernel.c_tile / (std::f32::consts::PI * count.max(1) as f32)).sqrt();
        match clamp {
            "min" => assert!(disc < 0.01, "{disc}"),
            "max" => assert!(disc > 0.5, "{disc}"),
            _ => assert!((0.01..0.5).contains(&disc), "{disc}"),
        }
        let results = probe(&mut bench.executor, &photons, kernel, depth, count);
        for (i, &[flux, above, outside, u, t, n, product, toward_light]) in results.iter().enumerate() {
            let (angle, s_l) = (angles[i / 3], lengths[i % 3].1);
            let r = disc.clamp(0.01, 0.5) * 2.0 * s_l;
            let stretch = (1.0 / angle.to_radians().cos()).min(3.0);
            // Directions are codes of 16 bits, off by 4e-5 rad at most; 1 / cos stays below 3, its slope below 9.
            for (axis, expected) in [(u, r * stretch), (t, r), (n, 0.2 * r)] {
                assert!((axis / expected - 1.0).abs() < 5e-4, "{angle}°, {clamp}: {axis} m instead of {expected} m");
            }
            // Cells of 1/80 of the longer axis: of those on the rim, some 500 of 6,000 or more for each 3 : 1 ellipse, half are wrong
            // at random: ½ √500 / 6000 is 0.2 %, and a percent is five times that.
            assert!((flux - 1.0).abs() < 0.01, "{angle}°, {clamp}: {flux} of the flux falls on the plane");
            assert!(
                (above - 1.0).abs() < 0.01 && outside == 0.0,
                "{angle}°, {clamp}: {above} within the slab, {outside} outside"
            );
            assert!(product < 1e-4, "{angle}°: the axes are {product} from square");
            assert!(
                (toward_light - angle.to_radians().sin()).abs() < 2e-4,
                "{angle}°: u points {toward_light} towards the light"
            );
        }
    }
}

/// The tile of a photon in 64-bit floats, or why it counts nowhere; `None` too where rounding may decide.
fn tile_of(camera: &CameraUniform, kernel: &SplatKernelUniform, photon: &Photon) -> Result<Option<usize>, ()> {
    let view = Mat4::from_cols_array_2d(&camera.view_from_world).as_dmat4();
    let p = view.transform_point3(Vec3::from(photon.position).as_dvec3());
    let eye = Mat4::from_cols_array_2d(&camera.world_from_view).w_axis.truncate().as_dvec3();
    let facing = lightloom_passes::decode_octahedral(photon.normal).dot((eye - Vec3::from(photon.position).as_dvec3()).as_vec3());
    let ndc = [0, 1].map(|i: usize| [p.x, -p.y][i] / (-p.z * f64::from(camera.tan_half[i])));
    if p.z.abs() < 1e-3 || facing.abs() < 1e-3 || ndc.iter().any(|x| (x.abs() - 1.0).abs() < 1e-4) {
        return Err(());
    }
    if p.z > 0.0 || facing < 0.0 || ndc.iter().any(|x| x.abs() > 1.0) {
        return Ok(None);
    }
    let place = [0, 1].map(|i: usize| (ndc[i] * 0.5 + 0.5) * f64::from(camera.size[i]) / f64::from(kernel.tile_size));
    if place.iter().any(|x| (x - x.round()).abs() < 1e-3) {
        return Err(());
    }
    Ok(Some(place[1] as usize * kernel.tiles[0] as usize + place[0] as usize))
}

#[test]
fn tiles_count_the_photons_that_the_cpu_counts() {
    let Some(mut bench) = Bench::new() else { return };
    let camera = camera(Vec3::new(0.3, 1.0, 2.0), Vec3::new(0.0, 0.2, -1.0), [75, 50], [0.5, 0.5]);
    let kernel = uniform(SplatKernel { tile: Some(8), ..SplatKernel::default() }, camera.size);
    assert_eq!(kernel.tiles, [10, 7]);
    let mut random = Random(5);
    let mut photons = Vec::new();
    let mut expected = vec![0_u32; 70];
    while photons.len() < 3000 {
        let normal = random.cube().normalize_or(Vec3::Y);
        let photon = photon(random.cube() * 3.0, normal, normal, Vec3::ONE, 0, false);
        // Photons that 32-bit floats may put elsewhere than 64-bit ones do prove nothing.
        let Ok(tile) = tile_of(&camera, &kernel, &photon) else { continue };
        if let (Some(tile), true) = (tile, photons.len() < 2900) {
            expected[tile] += 1;
        }
        photons.push(photon);
    }
    assert!(expected.iter().sum::<u32>() > 300 && expected.iter().filter(|&&n| n > 0).count() > 50, "{expected:?}");

    let device = bench.executor.device().clone();
    let mut graph = Graph::new("tiles");
    let stored = import_photons(&mut graph, &device, &photons, 2900);
    let tiles = DensityTiles::new(&lightloom_passes::shaders()).unwrap().add(&mut graph, &stored, &camera, &kernel);
    let read = graph.readback_buffer(&tiles);
    let output = bench.executor.execute(graph).unwrap();
    assert_eq!(output.cast::<u32>(read), expected);
}
