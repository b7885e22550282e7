//! Photons that follow reflective shadow maps: drawn as the maps say, and no different on average from uniform emission's.

use crate::determinism::settings;
use glam::{Vec2, Vec3};
use lightloom_graph::{BufferDesc, Graph};
use lightloom_passes::scene::{Alpha, GpuScene, Light, Material, Scene, TextureData, TextureUse, Triangle, builtin};
use lightloom_passes::{
    FirstHit, LivePaths, MapsBy, PathBuffers, PhotonBatch, PhotonPath, PhotonSource, Ray, Rsm, RsmSettings, decode_flux, shaders,
};
use lightloom_tests::Lab;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

const AT: Vec3 = Vec3::new(0.3, 1.6, 0.4);
const POINT: Light = Light::Point { position_world: AT, intensity: Vec3::ONE };
const SPOT: Light = Light::Spot {
    position_world: AT,
    direction_world: Vec3::new(-0.6, -0.8, 0.0),
    intensity: Vec3::ONE,
    cos_inner: 0.9,
    cos_outer: 0.6,
};
/// The material of the Cornell room's lamp.
const LAMP: u32 = 3;

/// The room, lit by `light` alone.
fn room(light: Light) -> Scene {
    Scene { lights: vec![light], ..builtin::caustics() }
}

/// The Cornell room with its lamp turned into something else.
fn lamp(of: impl FnOnce(&mut Scene)) -> Scene {
    let mut scene = builtin::cornell();
    of(&mut scene);
    scene
}

/// The lamp shines up, too.
fn two_sided(scene: &mut Scene) {
    scene.materials[LAMP as usize].double_sided = true;
}

/// A small sphere of twenty normals in the middle of the room.
fn sphere(scene: &mut Scene) {
    scene.triangles.retain(|triangle| triangle.material != LAMP);
    let outwards = |mut triangle: Triangle| {
        triangle.positions_world.swap(1, 2);
        triangle.positions_world = triangle.positions_world.map(|p| Vec3::new(0.3, 1.5, 0.3) + 0.15 * p);
        triangle.normals_world = [triangle.normal_world(); 3];
        Triangle { material: LAMP, ..triangle }
    };
    scene.triangles.extend(builtin::closed_sphere(1).triangles.into_iter().map(outwards));
}

/// The lamp shines from a half of it.
fn textured(scene: &mut Scene) {
    let rgba8 = vec![255, 255, 255, 255, 0, 0, 0, 255];
    scene.textures.push(TextureData { name: "half".into(), width: 2, height: 1, rgba8 });
    scene.materials[LAMP as usize].emissive_texture = Some(TextureUse::new(0));
    let least = Vec3::new(-0.25, 1.995, -0.2);
    for triangle in scene.triangles.iter_mut().filter(|triangle| triangle.material == LAMP) {
        triangle.uvs = triangle.positions_world.map(|p| Vec2::new((p - least).x / 0.5, (p - least).z / 0.4));
    }
}

/// Where in the unit square the photons of a point light have their directions.
fn of_sphere([x, y, z]: [f64; 3]) -> [f64; 2] {
    [(1.0 - z) / 2.0, (y.atan2(x) / TAU).rem_euclid(1.0)]
}

/// Likewise of a two-sided surface whose front looks down: cosine-distributed about it in the frame of shared/math.wgsl, which there is
/// (x, 0, 0), (0, 0, 1) for both sides.
fn of_two_sides([x, y, z]: [f64; 3]) -> [f64; 2] {
    let (back, turn) = if y > 0.0 { (0.5, (-z).atan2(x)) } else { (0.0, z.atan2(x)) };
    [back + 0.5 * (x * x + z * z), (turn / TAU).rem_euclid(1.0)]
}

#[test]
fn directions_follow_the_map_and_carry_its_flux() {
    let Some(mut lab) = Lab::open() else { return };
    follow_the_map(&mut lab, &room(POINT), of_sphere);
    follow_the_map(&mut lab, &lamp(two_sided), of_two_sides);
}

/// A half float of a positive, normal number.
fn half(bits: u32) -> f32 {
    f32::from_bits((bits << 13) + (112 << 23))
}

fn follow_the_map(lab: &mut Lab, scene: &Scene, place_of: fn([f64; 3]) -> [f64; 2]) {
    const SIZE: usize = 32;
    const COUNT: u32 = 131_072;
    let scene = lab.upload(scene);
    let Emitted { importance: map, rays, paths } = emit(lab, &scene, RsmSettings::new(SIZE as u32), COUNT);
    let map = &map[..SIZE * SIZE];
    let total: f64 = map.iter().map(|&w| f64::from(w)).sum();
    let mut drawn = vec![0.0; SIZE * SIZE];
    let mut strays = 0;
    let mut kept = Vec::new();
    for (ray, path) in rays.iter().zip(paths) {
        let u = place_of(ray.direction.map(f64::from)).map(|u| ((u * SIZE as f64) as usize).min(SIZE - 1));
        let texel = u[1] * SIZE + u[0];
        drawn[texel] += 1.0;
        let density = f64::from(map[texel]) / total * (SIZE * SIZE) as f64;
        let expected = f64::from(scene.info().total_power.y) / f64::from(COUNT) / density;
        kept.push(half(path.bounce_flags >> 16));
        strays += u32::from((f64::from(path.flux[1]) / expected - 1.0).abs() > 1e-4);
    }
    // A direction in floats may come back on the other side of a texel's edge: 10⁻⁶ of a side, of 32, for each of two axes.
    assert!(strays < COUNT / 1000, "{strays} photons carry another flux than the map's");
    // The first surface is expected to keep its albedo and the floor of 0.05, of a photon that stands for all of a lamp's triangles:
    // from nothing to white, 0.73, or glass, 1. Halves have 11 bits.
    let [least, most] = [f32::min, f32::max].map(|of| kept.iter().copied().reduce(of).expect("photons"));
    assert!((0.0499..0.2).contains(&least) && (0.7796..=1.0).contains(&most), "{least} to {most} are kept");
    let chi2: f64 = map
        .iter()
        .zip(&drawn)
        .map(|(&w, n)| (f64::from(COUNT) * f64::from(w) / total, n))
        .map(|(e, n)| (n - e).powi(2) / e)
        .sum();
    let freedom = (SIZE * SIZE - 1) as f64;
    println!("χ² = {chi2:.1} of {freedom} degrees of freedom, {strays} strays");
    // Four standard deviations of χ²: p > 3·10⁻⁵ where points are independent; low discrepancy only lowers it.
    assert!(chi2 < freedom + 4.0 * (2.0 * freedom).sqrt(), "χ² = {chi2}");
}

#[test]
fn maps_change_no_mean() {
    let Some(mut lab) = Lab::open() else { return };
    let directional = Light::Directional { direction_world: Vec3::new(0.0, -0.6, -0.8), irradiance: Vec3::ONE };
    for light in [POINT, SPOT, directional] {
        change_no_mean(&mut lab, &room(light), &[MapsBy::Rays, MapsBy::Raster]);
    }
}

#[test]
fn maps_of_surfaces_change_no_mean() {
    let Some(mut lab) = Lab::open() else { return };
    for of in [two_sided, sphere, textured] {
        change_no_mean(&mut lab, &lamp(of), &[MapsBy::Rays]);
    }
}

fn change_no_mean(lab: &mut Lab, scene: &Scene, all_by: &[MapsBy]) {
    const SEEDS: u32 = 8;
    let scene = lab.upload(scene);
    let mut sums = vec![[0.0; 2]; 1 + all_by.len()];
    for seed in 0..SEEDS {
        let settings = settings(20_000, 3, seed);
        let mut all = vec![lab.photons(&scene, &settings)];
        all.extend(
            all_by.iter().map(|&maps_by| lab.photons_by_maps(&scene, &settings, RsmSettings { maps_by, ..RsmSettings::new(64) })),
        );
        for (traced, sum) in all.iter().zip(&mut sums) {
            assert!(traced.state.flux_ledger().balances(), "{:?}", traced.state.flux_ledger());
            let flux: f64 = traced.records.iter().map(|photon| f64::from(decode_flux(photon.flux).y)).sum();
            *sum = [sum[0] + flux, sum[1] + flux * flux];
        }
    }
    let n = f64::from(SEEDS);
    let means: Vec<_> =
        sums.iter().map(|[sum, squares]| (sum / n, (squares / n - (sum / n).powi(2)).max(0.0) / (n - 1.0))).collect();
    for (maps_by, maps) in all_by.iter().zip(&means[1..]) {
        let error = (means[0].1 + maps.1).sqrt();
        println!("{maps_by:?}: {:.4} uniform, {:.4} by maps, ± {error:.4} W", means[0].0, maps.0);
        // Four standard errors of the difference; packed fluxes are rounded without bias.
        assert!((means[0].0 - maps.0).abs() < 4.0 * error, "{maps_by:?}: {:?} against {maps:?}", means[0]);
    }
}

/// What a frame of a source by maps holds.
struct Emitted {
    importance: Vec<f32>,
    rays: Vec<Ray>,
    paths: Vec<PhotonPath>,
}

fn emit(lab: &mut Lab, scene: &GpuScene, maps: RsmSettings, count: u32) -> Emitted {
    let rsm = Rsm::new(&shaders()).expect("valid");
    let mut graph = Graph::new("draw");
    let handles = scene.declare(&mut graph);
    let maps = rsm.add(&mut graph, &handles, &scene.info(), maps);
    assert_eq!(maps.count, 1, "a light, or a lamp of one piece");
    let places = u64::from(count);
    let mut out = PathBuffers {
        rays: graph.buffer("rays", BufferDesc::array_of::<Ray>(places)),
        paths: graph.buffer("paths", BufferDesc::array_of::<PhotonPath>(places)),
        live: graph.buffer("live", BufferDesc::array_of::<LivePaths>(1)),
    };
    let batch = PhotonBatch { emitted: count, first: 0, count, seed: 3 };
    rsm.source(&maps).add(&mut graph, &handles, &scene.info(), batch, &mut out);
    let reads = (graph.readback_texture(&maps.importance), graph.readback_buffer(&out.rays), graph.readback_buffer(&out.paths));
    let output = lab.run(graph);
    Emitted { importance: output.cast(reads.0), rays: output.cast(reads.1), paths: output.cast(reads.2) }
}

/// Views look up what rays would find: the importance is the same but in texels in which it changes.
#[test]
fn rasterised_maps_are_the_traced_ones() {
    let Some(mut lab) = Lab::open() else { return };
    let directional = Light::Directional { direction_world: Vec3::new(0.0, -0.6, -0.8), irradiance: Vec3::ONE };
    let Light::Spot { position_world, direction_world, intensity, cos_inner, .. } = SPOT else { return };
    let wide = Light::Spot { position_world, direction_world, intensity, cos_inner, cos_outer: 0.1 };
    for light in [POINT, SPOT, wide, directional] {
        let scene = lab.upload(&room(light));
        let [traced, rasterised] = [MapsBy::Rays, MapsBy::Raster]
            .map(|maps_by| emit(&mut lab, &scene, RsmSettings { maps_by, ..RsmSettings::new(64) }, 64).importance);
        let sum: f32 = traced.iter().sum();
        let apart: f32 = traced.iter().zip(&rasterised).map(|(a, b)| (a - b).abs()).sum();
        println!("{light:?}: {:.4} apart", apart / sum);
        // Of 64² texels the outlines of sphere, ring and walls cross some 300, half of which see one side and half the other.
        assert!(apart < 0.05 * sum, "{light:?}: {apart} of {sum}");
    }
}

/// Photons that start at what their texel holds go wrong only where outlines are, and there only past what stands before: about in
/// proportion to the side of a texel.
#[test]
fn first_hits_are_wrong_along_outlines_only() {
    const COUNT: u32 = 65_536;
    let Some(mut lab) = Lab::open() else { return };
    let mut scene = room(POINT);
    // Before a wall hangs a veil with holes.
    let rgba8 = vec![255, 255, 255, 255, 255, 255, 255, 0, 255, 255, 255, 0, 255, 255, 255, 255];
    scene.textures.push(TextureData { name: "veil".into(), width: 2, height: 2, rgba8 });
    let mut veil = Material::lambert("veil", Vec3::splat(0.5));
    veil.base_color_texture = Some(TextureUse::new(0));
    veil.alpha = Alpha::Mask(0.5);
    let hung = |mut triangle: Triangle| {
        triangle.positions_world = triangle.positions_world.map(|p| Vec3::new(-0.9, 0.2 + 0.2 * p.z, 0.1 * p.x));
        Triangle { material: scene.materials.len() as u32, ..triangle }
    };
    let veils: Vec<_> = builtin::plane(4.0).triangles.into_iter().map(hung).collect();
    scene.triangles.extend(veils);
    scene.materials.push(veil);
    let scene = lab.upload(&scene);
    let mut wrong_of = |maps_by, side| {
        let rays =
            emit(&mut lab, &scene, RsmSettings { maps_by, first_hit: FirstHit::Map, ..RsmSettings::new(side) }, COUNT).rays;
        let blind: Vec<_> = rays.iter().map(|ray| Ray { seen: 0, ..*ray }).collect();
        let known = rays.iter().filter(|ray| ray.seen > 0).count();
        let (held, traced) = (lab.rays(&scene, &rays), lab.rays(&scene, &blind));
        let apart: Vec<_> = held.iter().zip(&traced).filter(|(a, b)| a.triangle != b.triangle).collect();
        // Nothing is invented: where they differ, something stood before it. Rays through a common edge may choose either side.
        assert!(apart.iter().all(|(held, traced)| traced.t <= held.t * 1.000_01), "{side}: a hit that no ray finds");
        println!("{maps_by:?} {side}: {known} of {COUNT} know their triangle, {} go wrong", apart.len());
        assert!(known > rays.len() / 2, "{side}: {known}");
        apart.len() as f64 / f64::from(COUNT)
    };
    for maps_by in [MapsBy::Rays, MapsBy::Raster] {
        let wrong = [32, 512].map(|side| wrong_of(maps_by, side));
        // Measured: 0.0064 and 0.00063, of 41 photons with a standard deviation of 6; four of them are allowed for.
        assert!(wrong[0] < 0.01 && wrong[1] < wrong[0] / 6.0, "{wrong:?}");
    }
}

#[test]
fn maps_of_nothing_and_of_black_walls_are_uniform() {
    let Some(mut lab) = Lab::open() else { return };
    let away = Light::Spot {
        position_world: Vec3::Y * 9.0,
        direction_world: Vec3::Y,
        intensity: Vec3::ONE,
        cos_inner: 0.9,
        cos_outer: 0.8,
    };
    let mut black = room(POINT);
    black.materials.fill(Material::lambert("black", Vec3::ZERO));
    let mut black_lamp = builtin::cornell();
    for material in &mut black_lamp.materials {
        material.base_color = [0.0, 0.0, 0.0, 1.0];
    }
    for scene in [room(away), black, black_lamp] {
        let scene = lab.upload(&scene);
        let settings = settings(20_000, 3, 1);
        let [first, second] = [(); 2].map(|()| lab.photons_by_maps(&scene, &settings, RsmSettings::new(64)).state);
        assert_eq!(first, second, "deterministic");
        let ledger = first.flux_ledger();
        assert!(ledger.balances() && ledger.emitted[1] > 0 && first.stored == 0, "{ledger:?}");
    }
}

/// Of `SEEDS` frames of 20,000 photons by each source: the variance of the flux stored in cells of `cell` metres, summed over the cells,
/// as parts of uniform emission's, for each of the `maps`.
fn variance_by_maps<const N: usize>(lab: &mut Lab, scene: &GpuScene, cell: f32, maps: [RsmSettings; N]) -> [f64; N] {
    const SEEDS: u32 = 6;
    let mut cells = BTreeMap::<[i32; 3], Vec<[f64; 2]>>::new();
    for seed in 0..SEEDS {
        let settings = settings(20_000, 3, seed);
        let uniform = lab.photons(scene, &settings);
        let by_maps = maps.map(|maps| lab.photons_by_maps(scene, &settings, maps));
        for (kind, traced) in std::iter::once(uniform).chain(by_maps).enumerate() {
            let mut frame = BTreeMap::<[i32; 3], f64>::new();
            for photon in &traced.records {
                *frame.entry(photon.position.map(|x| (x / cell).floor() as i32)).or_default() +=
                    f64::from(decode_flux(photon.flux).y);
            }
            for (cell, flux) in frame {
                let sums = &mut cells.entry(cell).or_insert_with(|| vec![[0.0; 2]; N + 1])[kind];
                *sums = [sums[0] + flux, sums[1] + flux * flux];
            }
        }
    }
    let n = f64::from(SEEDS);
    let variance = |kind: usize| cells.values().map(|cell| cell[kind][1] / n - (cell[kind][0] / n).powi(2)).sum::<f64>();
    let ratios = std::array::from_fn(|i| variance(i + 1) / variance(0));
    println!("{maps:?}: variance {ratios:.3?} of uniform emission's over {} cells", cells.len());
    ratios
}

/// A spot's light falls off towards its edge and meets walls and an icosphere of other albedos. Photons that follow its map all bring the
/// same to their second hit, and none is lost to roulette before. With six seeds and some
/// hundred cells that matter a ratio is known to √(2/5/100) √2 = 9 %.
#[test]
fn maps_halve_the_variance() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = lab.upload(&room(SPOT));
    let rasterised = RsmSettings { maps_by: MapsBy::Raster, ..RsmSettings::new(64) };
    let ratios = variance_by_maps(&mut lab, &scene, 0.25, [RsmSettings::new(256), rasterised]);
    // Measured: 0.29 and 0.30; 0.37 and 0.40 where roulette takes at the first surface what the map has paid for.
    assert!(ratios.iter().all(|&ratio| ratio < 0.34), "{ratios:?}");
}

/// A lamp below the ceiling of a dark room with one bright wall.
fn bright_wall(scene: &mut Scene) {
    // The red wall is the left one.
    for (material, albedo) in scene.materials.iter_mut().zip([0.05, 0.9, 0.05]) {
        *material = Material::lambert(&material.name, Vec3::splat(albedo));
    }
}

/// Maps know directions only, so that a lamp whose every point sees another bright thing gains less than a punctual light.
#[test]
fn maps_of_surfaces_lessen_the_variance() {
    let Some(mut lab) = Lab::open() else { return };
    // Measured: 0.31 for 64 texels, 0.29 for 256. The bright wall takes half of the light of a ceiling lamp; the rest meets next to nothing.
    let scene = lab.upload(&lamp(bright_wall));
    let ratios = variance_by_maps(&mut lab, &scene, 0.25, [RsmSettings::new(64)]);
    assert!(ratios[0] < 0.36, "{ratios:?}");
}

#[test]
#[ignore = "a measurement; needs LIGHTLOOM_SPONZA, the path of the scene"]
fn variance_in_sponza() {
    let (Some(path), Some(mut lab)) = (std::env::var_os("LIGHTLOOM_SPONZA"), Lab::open()) else { return };
    let mut scene = Scene::load(path.as_ref()).expect("the scene loads");
    let eye = scene.cameras[0].clone();
    let [position_world, direction_world] = [eye.world_from_view.w_axis.truncate(), -eye.world_from_view.z_axis.truncate()];
    scene.lights = vec![Light::Spot { position_world, direction_world, intensity: Vec3::ONE, cos_inner: 0.9, cos_outer: 0.7 }];
    let scene = lab.upload(&scene);
    variance_by_maps(&mut lab, &scene, 1.0, [64, 256].map(RsmSettings::new));
}
