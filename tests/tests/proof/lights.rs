//! What lights emit: the budget of photons, the environment, guided emission; each against its closed form.

use crate::determinism::settings;
use glam::Vec3;
use lightloom_graph::{BufferDesc, ComputeShader, Graph, shader_struct};
use lightloom_passes::scene::{Emission, Environment, GpuScene, Light, Material, Scene, SceneInfo, builtin};
use lightloom_passes::{LightInfo, PhotonFlags, PhotonSettings, decode_flux};
use lightloom_tests::{Lab, Traced, View};
use std::f64::consts::PI;

/// Lets a shader draw `count` things and bring back two vectors of each.
const HEAD: &str = r"
struct DrawParams { lights: LightInfo, count: u32, seed: u32, pad0: u32, pad1: u32 }
@group(0) @binding(0) var<uniform> params: DrawParams;
@group(0) @binding(1) var<storage, read_write> drawn: array<vec4f>;
@compute @workgroup_size(64)
fn draw(@builtin(global_invocation_id) thread: vec3u) {
    let i = thread.x;
    if i >= params.count { return; }
";
const EMIT: &str = r"
    let emitted = emit_photon(i, params.count, params.seed, params.lights);
    drawn[2u * i] = vec4f(emitted.origin, 0.0);
    drawn[2u * i + 1u] = vec4f(emitted.flux, dot(emitted.direction, emitted.direction));
}";
const SKY: &str = r"
    var rng = rng_new(params.seed, 0u, i);
    let sky = sample_environment(rng_next4(&rng).xy);
    drawn[2u * i] = vec4f(sky.direction, sky.pdf);
    drawn[2u * i + 1u] = vec4f(sky.radiance, environment_pdf(sky.direction));
}";

shader_struct! {
    struct DrawParams {
        lights: LightInfo,
        count: u32,
        seed: u32,
        pad0: u32,
        pad1: u32,
    }
}

/// Runs `body` for each of `count` threads, which writes two vectors.
pub(crate) fn draw(lab: &mut Lab, scene: &GpuScene, info: &SceneInfo, body: &str, count: u32, seed: u32) -> Vec<[[f32; 4]; 2]> {
    let text = format!("#import \"shared/emission.wgsl\"\n{HEAD}{body}");
    let shader = ComputeShader::new(&lab.sources.with(&[("draw.wgsl", &text)]), "draw.wgsl").expect("the kernel is valid");
    let mut graph = Graph::new("draw");
    let handles = scene.declare(&mut graph);
    let mut drawn = graph.buffer("drawn", BufferDesc::words(u64::from(count) * 8));
    let params = DrawParams { lights: info.into(), count, seed, pad0: 0, pad1: 0 };
    handles.bind(graph.compute(&shader).params(&params)).write("drawn", &mut drawn).dispatch_1d(count);
    let read = graph.readback_buffer(&drawn);
    lab.run(graph).cast(read)
}

/// Fifty lamps of 1 W·sr⁻¹ over a sunlit plane.
fn fifty_lamps() -> Scene {
    let mut scene = builtin::plane(4.0);
    scene.lights[0] = Light::Directional { direction_world: Vec3::NEG_Y, irradiance: Vec3::splat(1000.0) };
    scene.light_names = vec!["sun".into()];
    for i in 0..50_u8 {
        scene.lights.push(Light::Point { position_world: Vec3::new(f32::from(i), 1.0, 0.0), intensity: Vec3::ONE });
        scene.light_names.push(format!("lamp {i}"));
    }
    scene.set_photon_weight("lamp 7", 4.0).expect("it is a lamp");
    scene
}

#[test]
fn fifty_lamps_beside_a_sun_get_their_photons_and_emit_their_power() {
    const COUNT: u32 = 40_000;
    let Some(mut lab) = Lab::open() else { return };
    let scene = lab.upload(&fifty_lamps());
    let budget = scene.budget();
    let planned = budget.photons(COUNT, 3);
    let drawn = draw(&mut lab, &scene, &scene.info(), EMIT, COUNT, 3);
    let mut counts = vec![0_u32; 51];
    let mut fluxes = vec![0.0_f64; 51];
    for [origin, flux] in drawn {
        // The sun's photons start above the plane's bounding sphere, the lamps' at the lamps.
        let lamp = if origin[1] > 2.0 { 0 } else { origin[0] as usize + 1 };
        counts[lamp] += 1;
        fluxes[lamp] += f64::from(flux[0]);
    }
    assert_eq!(counts, planned, "what the CPU tells is what shaders do");
    assert_eq!(counts.iter().sum::<u32>(), COUNT, "all photons");
    // The floor F / ((1 + F) n) with F = ¼; weight 4 on one of 51 lamps lengthens the normalisation by 3 F / n more.
    let floor = f64::from(COUNT) * 0.25 / (51.0 * (1.25 + 0.75 / 51.0));
    for (lamp, (&count, flux)) in counts.iter().zip(&fluxes).enumerate() {
        assert!(f64::from(count) + 1.0 >= floor, "lamp {lamp} has {count} photons of at least {floor}");
        // A count is within one of N p.
        let power = f64::from(budget.lamps()[lamp].power.x);
        let error = (flux / power - 1.0).abs();
        assert!(error <= 1.0 / f64::from(count - 1), "lamp {lamp} emits {flux} W of {power}");
    }
    let ratio = f64::from(counts[8]) / f64::from(counts[9]);
    assert!((ratio / 4.0 - 1.0).abs() < 0.02, "four times its neighbour's, but for rounding to whole photons: {ratio}");
}

/// A sky with a bright spot, a black half and coarse texels, turned by a radian.
pub(crate) fn sky() -> Environment {
    let texel = |i: u32| {
        let (x, y) = (i % 16, i / 16);
        let base = if x < 8 { 0.2 + 0.1 * (y as f32) } else { 0.0 };
        if (x, y) == (5, 2) { [40.0, 30.0, 20.0] } else { [base, base, 2.0 * base] }
    };
    Environment::from_map("sky", [16, 8], (0..128).map(texel).collect()).expect("sound").with_rotation(1.0)
}

#[test]
fn directions_of_the_environment_follow_their_density() {
    const COUNT: u32 = 200_000;
    let Some(mut lab) = Lab::open() else { return };
    let mut scene = builtin::plane(4.0);
    let environment = sky();
    scene.set_environment(environment.clone());
    let scene = lab.upload(&scene);
    let mut sum = glam::DVec3::ZERO;
    // Finer than the texels: 64 × 32 cells of equal steps in angle, so that the inside of a texel is tested too.
    let mut cells = vec![0_u32; 64 * 32];
    for [direction, radiance] in draw(&mut lab, &scene, &scene.info(), SKY, COUNT, 1) {
        let d = Vec3::from_slice(&direction[..3]);
        assert!((d.length() - 1.0).abs() < 1e-5, "unit: {d}");
        // Rounding may carry a direction at a texel's edge over it.
        let seen = environment.radiance(d);
        let drawn = Vec3::from_slice(&radiance[..3]);
        let pdf = (radiance[3] / direction[3] - 1.0).abs();
        let inner = environment.radiance((d + 1e-4 * Vec3::ONE).normalize()) == seen
            && environment.radiance((d - 1e-4 * Vec3::ONE).normalize()) == seen;
        assert!(!inner || (pdf < 1e-4 && drawn == seen), "{d}: pdf {direction:?} and {radiance:?}, radiance {seen}");
        sum += (drawn / direction[3]).as_dvec3();
        let map = glam::Quat::from_rotation_y(-1.0) * d;
        let (u, v) = (0.5 + map.x.atan2(-map.z) / (2.0 * PI as f32), map.y.clamp(-1.0, 1.0).acos() / PI as f32);
        cells[((v * 32.0) as usize).min(31) * 64 + ((u * 64.0) as usize).min(63)] += 1;
    }
    let total = environment.irradiance_all_round();
    // Luminance over density is constant; channels differ from it by at most a factor 2 in the blue: σ below 1 of the mean, 4σ of N.
    let error = (sum.as_vec3() / COUNT as f32 / total - 1.0).abs().max_element();
    assert!(error < 4.0 / (COUNT as f32).sqrt(), "∫ L dω is {sum} / N, exactly {total}");
    // χ² of the cells against luminance times solid angle.
    let luminance = |c: Vec3| f64::from(c.dot(Vec3::new(0.2126, 0.7152, 0.0722)));
    let all = luminance(total);
    let (mut chi2, mut degrees) = (0.0_f64, -1.0_f64);
    for (cell, &count) in cells.iter().enumerate() {
        let (x, y) = (cell % 64, cell / 64);
        let edge = |row: usize| (PI * row as f64 / 32.0).cos();
        let solid_angle = 2.0 * PI / 64.0 * (edge(y) - edge(y + 1));
        let (phi, theta) = (2.0 * PI * ((x as f64 + 0.5) / 64.0 - 0.5), PI * (y as f64 + 0.5) / 32.0);
        let local = Vec3::new((theta.sin() * phi.sin()) as f32, theta.cos() as f32, -(theta.sin() * phi.cos()) as f32);
        let expected =
            f64::from(COUNT) * luminance(environment.radiance(glam::Quat::from_rotation_y(1.0) * local)) * solid_angle / all;
        if expected > 5.0 {
            chi2 += (f64::from(count) - expected).powi(2) / expected;
            degrees += 1.0;
        } else {
            assert!(f64::from(count) < expected + 15.0, "cell {x}, {y}: {count} where {expected} are expected");
        }
    }
    // χ² has mean k and variance 2k: four standard deviations.
    let bound = degrees + 4.0 * (2.0 * degrees).sqrt();
    assert!(chi2 < bound, "χ² {chi2} for {degrees} degrees of freedom, at most {bound}");
}

/// A white ball in a furnace of radiance 1.
#[test]
fn a_white_convex_body_in_a_furnace_is_invisible() {
    let Some(mut lab) = Lab::open() else { return };
    let mut scene = builtin::two_discs();
    // One disc, looked at from above, seen against the sky: plane, so that nothing is lost to shading normals.
    scene.triangles.retain(|triangle| triangle.material == 0);
    scene.materials[0] = Material::lambert("white", Vec3::ONE);
    scene.set_environment(Environment::constant(Vec3::ONE).expect("sound"));
    let gpu_scene = lab.upload(&scene);
    let view = View::new(scene.cameras[0].clone(), [24, 24]);
    let path = lab.path(&gpu_scene, &view, 64, 1, 4);
    let (direct, positions) = lab.direct(&gpu_scene, &view, 1, 64);
    let mut on_disc = (0.0, 0.0, 0.0);
    for (pixel, position) in positions.iter().enumerate() {
        let (seen, reference) = (direct.pixels[pixel][1], path.direct.mean.pixels[pixel][1]);
        if position[3] == 0.0 {
            assert!((seen - 1.0).abs() < 1e-6, "the direct layer shows the sky");
        } else {
            on_disc = (on_disc.0 + seen, on_disc.1 + reference, on_disc.2 + 1.0);
        }
    }
    let (seen, reference) = (on_disc.0 / on_disc.2, on_disc.1 / on_disc.2);
    assert!(on_disc.2 > 200.0, "{} pixels show the disc", on_disc.2);
    // A light sample is 4 cos θ on half the sphere: variance 5/3; the heuristic's are less. Four standard errors of 64 samples a pixel.
    let bound = 4.0 * (5.0 / 3.0 / 64.0 / on_disc.2).sqrt();
    assert!((seen - 1.0).abs() < bound, "direct layer: {seen}, E = π within {bound}");
    assert!((reference - 1.0).abs() < bound, "path: {reference} within {bound}");
    assert!(path.indirect.mean.mean()[1] < 1e-6, "nothing comes from elsewhere");
}

#[test]
fn photons_of_the_environment_carry_its_flux_and_the_ledger_balances() {
    const COUNT: u32 = 60_000;
    let Some(mut lab) = Lab::open() else { return };
    let mut scene = builtin::plane(4.0);
    scene.lights.clear();
    scene.materials[0] = Material::lambert("black", Vec3::ZERO);
    scene.set_environment(Environment::constant(Vec3::new(1.0, 2.0, 0.5)).expect("sound"));
    let gpu_scene = lab.upload(&scene);
    let info = gpu_scene.info();
    let expected = 4.0 * PI * PI * f64::from(info.bounds_radius).powi(2);
    assert!((f64::from(info.total_power.x) / expected - 1.0).abs() < 1e-5, "4π²R²L: {} of {expected}", info.total_power);
    let settings = settings(COUNT, 3, 5);
    let ledger = lab.photons(&gpu_scene, &settings).state.flux_ledger();
    assert!(ledger.balances(), "{ledger:?}");
    let scale = f64::from(settings.ledger_scale(&info));
    let emitted = ledger.emitted[0] as f64 / scale;
    assert!((emitted / expected - 1.0).abs() < 1e-4, "{emitted} W of {expected}");
    // A flat body of two sides of 16 m² takes πL of each: that is the share of the photons that do not escape.
    let landed = emitted - ledger.escaped[0] as f64 / scale;
    let exact = 2.0 * 16.0 * PI;
    let share = exact / expected;
    let bound = 4.0 * ((1.0 - share) / (share * f64::from(COUNT))).sqrt();
    assert!((landed / exact - 1.0).abs() < bound, "{landed} W land of {exact}, within {bound}");
}

/// Flux of the photons that only specular surfaces scattered (W).
fn caustic_flux(traced: &Traced) -> f64 {
    let caustic = traced.records.iter().filter(|photon| photon.bounce_flags & PhotonFlags::CAUSTIC != 0);
    caustic.map(|photon| f64::from(decode_flux(photon.flux).y)).sum()
}

#[test]
fn guided_emission_stores_the_same_caustics_with_less_noise() {
    const SEEDS: u32 = 12;
    let Some(mut lab) = Lab::open() else { return };
    let point = builtin::caustics();
    let mut sun = builtin::caustics();
    // Into the open front, onto both objects.
    let direction_world = Vec3::new(0.1, -0.6, -1.0).normalize();
    sun.lights = vec![Light::Directional { direction_world, irradiance: Vec3::splat(5.0) }];
    let mut spot = builtin::caustics();
    spot.lights = vec![Light::Spot {
        position_world: Vec3::new(0.0, 1.9, 0.0),
        direction_world: Vec3::NEG_Y,
        intensity: Vec3::splat(5.0),
        cos_inner: 0.95,
        cos_outer: 0.6,
    }];
    for (name, scene) in [("point", point), ("sun", sun), ("spot", spot)] {
        let gpu_scene = lab.upload(&scene);
        let mut measure = |emission| {
            let fluxes: Vec<f64> = (0..SEEDS)
                .map(|seed| {
                    let settings = PhotonSettings { caustics_only: true, ..settings(4_000, 6, 100 + seed) };
                    caustic_flux(&lab.photons_by(emission, &gpu_scene, &settings))
                })
                .collect();
            let mean = fluxes.iter().sum::<f64>() / f64::from(SEEDS);
            let variance = fluxes.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / f64::from(SEEDS - 1);
            (mean, variance)
        };
        let (uniform, guided) = (measure(Emission::Uniform), measure(Emission::Guided));
        println!("{name}: uniform {uniform:?}, guided {guided:?}");
        let error = ((uniform.1 + guided.1) / f64::from(SEEDS)).sqrt();
        assert!(guided.0 > 0.0, "{name}: there are caustics");
        assert!((uniform.0 - guided.0).abs() < 4.0 * error, "{name}: {} W guided, {} W uniform, ± {error}", guided.0, uniform.0);
        assert!(guided.1 < uniform.1, "{name}: variance {} guided, {} uniform", guided.1, uniform.1);
    }
}
