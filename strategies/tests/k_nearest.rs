//! Radii by neighbours are those that trying all pairs of photons finds, in both stores.

mod common;

use common::{Bench, Random, photon, photons};
use glam::Vec3;
use lightloom_graph::wgpu::{self, util::DeviceExt};
use lightloom_graph::{BufferDesc, Graph, ShaderStruct, bytemuck};
use lightloom_passes::scene::SceneInfo;
use lightloom_passes::{CompactPhoton, Photon, PhotonGrid, PhotonState, PhotonStore, Photons, decode_octahedral};
use lightloom_strategies::{KNearest, KernelRadius};
use std::num::NonZeroU32;

/// Of what the tests' photons lie in.
fn info() -> SceneInfo {
    SceneInfo { bounds_center: Vec3::ZERO, bounds_radius: 10.0, ..SceneInfo::default() }
}

/// Neighbours, and between which radii (m) to look for them.
#[derive(Clone, Copy, Debug)]
struct Wanted {
    nearest: u32,
    r_min: f32,
    r_max: f32,
}

impl From<Wanted> for KernelRadius {
    fn from(Wanted { nearest, r_min, r_max }: Wanted) -> Self {
        Self { r_min_m: Some(r_min), r_max_m: Some(r_max), nearest: NonZeroU32::new(nearest) }
    }
}

fn wanted(nearest: u32, r_min: f32, r_max: f32) -> Wanted {
    Wanted { nearest, r_min, r_max }
}

/// The records as the passes leave them; `stored` of `records`, the rest is rubbish.
fn search<Record: ShaderStruct>(
    bench: &mut Bench,
    store: PhotonStore,
    records: &[Record],
    stored: u32,
    wanted: Wanted,
) -> Vec<Record> {
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    let state = PhotonState { stored, grid: PhotonGrid::of(&info()), ..PhotonState::default() };
    let mut graph = Graph::new("k-nearest");
    let mut import = |name: &str, desc, contents: &[u8]| {
        let descriptor = wgpu::util::BufferInitDescriptor { label: Some(name), contents, usage };
        graph.import_buffer(name, desc, bench.executor.device().create_buffer_init(&descriptor))
    };
    let capacity = records.len() as u32;
    let given = Photons {
        records: import("photons", store.desc(capacity), bytemuck::cast_slice(records)),
        state: import("photon_state", BufferDesc::array_of::<PhotonState>(1), bytemuck::bytes_of(&state)),
        capacity,
        emitted: capacity,
    };
    let mut passes = KNearest::new(&store.shaders());
    let found = passes.add(&mut graph, &info(), &given, &wanted.into()).expect("the radii are sound").expect("there is a choice");
    let reads = [&found.records, &found.state, &given.records].map(|buffer| graph.readback_buffer(buffer));
    let output = bench.executor.execute(graph).expect("the frame runs");
    assert_eq!(output.cast::<PhotonState>(reads[1]), [state], "the state is the same");
    assert!(output.cast::<u8>(reads[2]) == bytemuck::cast_slice::<_, u8>(records), "what others read is as it was");
    let mut found = output.cast::<Record>(reads[0]);
    found.truncate(stored as usize);
    found
}

/// Levels of radius that the photon `i` may have, the least and the most: distances are rounded to a few 2⁻²⁴ of the coordinates, up to 10 m
/// here, and normals, decoded to some 10⁻⁶, may be found on either side of 60°.
fn levels(points: &[(Vec3, Vec3)], i: usize, wanted: Wanted) -> [u32; 2] {
    let [r_min, r_max] = [wanted.r_min, wanted.r_max].map(f64::from);
    let level = |cosine: f32, rounding: f64| {
        let near = |(j, (position, normal)): (usize, &(Vec3, Vec3))| {
            let distance = position.as_dvec3().distance(points[i].0.as_dvec3()) + rounding;
            (j != i && normal.dot(points[i].1) >= cosine && distance <= r_max).then_some(distance)
        };
        let mut distances: Vec<f64> = points.iter().enumerate().filter_map(near).collect();
        distances.sort_by(f64::total_cmp);
        let farthest = distances.get(wanted.nearest as usize - 1).copied().unwrap_or(r_max);
        ((farthest - r_min) / (r_max - r_min) * 63.0).ceil().clamp(0.0, 63.0) as u32
    };
    [level(0.5 - 1e-5, -4e-6), level(0.5 + 1e-5, 4e-6)]
}

fn points(photons: &[Photon]) -> Vec<(Vec3, Vec3)> {
    photons.iter().map(|photon| (photon.position.into(), decode_octahedral(photon.normal))).collect()
}

/// Runs the whole store; returns how many photons are at the ends and how many between. Half floats of ρ, at most 1, are off by up to 2⁻¹¹, however they
/// are rounded.
fn check(bench: &mut Bench, what: &str, records: &[Photon], stored: u32, wanted: Wanted) -> [u32; 3] {
    let found = search(bench, PhotonStore::Whole, records, stored, wanted);
    assert!(search(bench, PhotonStore::Whole, records, stored, wanted) == found, "{what}: two runs differ");
    let points = points(&records[..stored as usize]);
    let mut kinds = [0; 3];
    for (i, (given, found)) in records.iter().zip(&found).enumerate() {
        let share2 = 1.0 - found.length_and_probability()[1];
        let [least, most] = levels(&points, i, wanted);
        let near = |level: u32| (share2 - (level as f32 / 63.0).powi(2)).abs() <= 2.0_f32.powi(-11);
        assert!((least..=most).any(near), "{what}, photon {i}: {} in place of {least} to {most}", 63.0 * share2.sqrt());
        kinds[[0, 63].iter().position(|&end| end == most).unwrap_or(2)] += 1;
        let kept = |photon: &Photon| Photon { length_probability: photon.length_probability & 0xffff, ..*photon };
        assert!(kept(given) == kept(found), "{what}, photon {i}: nothing else changes");
    }
    kinds
}

#[test]
fn radii_are_those_of_all_pairs() {
    let Some(mut bench) = Bench::new() else { return };
    let mut all = photons(2500);
    for (i, photon) in all.iter_mut().enumerate() {
        photon.length_probability |= i as u32 & 0xffff;
    }
    let [dense, sparse, between] = check(&mut bench, "20 of 2500", &all, 2500, wanted(20, 0.05, 0.4));
    assert!(dense > 100 && sparse > 100 && between > 500, "{dense} {sparse} {between}: every kind is there");
    check(&mut bench, "the next", &all, 2500, wanted(1, 0.001, 0.4));
    check(&mut bench, "wider than the scene", &all, 2500, wanted(300, 0.01, 100.0));
    let [_, sparse, _] = check(&mut bench, "more than there are", &all, 2500, wanted(u32::MAX, 0.05, 0.4));
    assert_eq!(sparse, 2500);
    check(&mut bench, "one", &all, 1, wanted(1, 0.05, 0.4));
    check(&mut bench, "none", &all, 0, wanted(1, 0.05, 0.4));
}

#[test]
fn neighbours_lie_on_the_same_surface() {
    let Some(mut bench) = Bench::new() else { return };
    let mut random = Random(7);
    // A thin wall: one photon on this side, 200 on the other.
    let side = |random: &mut Random, side: f32| {
        let position = random.cube() * Vec3::new(0.2, 0.0, 0.2) + Vec3::Y * 0.001 * side;
        photon(position, Vec3::Y * side, Vec3::Y * side, Vec3::ONE, 0, false)
    };
    let mut all: Vec<_> = (0..200).map(|_| side(&mut random, -1.0)).collect();
    all.push(side(&mut random, 1.0));
    let [_, sparse, _] = check(&mut bench, "a thin wall", &all, 201, wanted(5, 0.01, 0.5));
    assert_eq!(sparse, 1, "the photon on this side is alone");
}

#[test]
fn photons_in_one_place_are_neighbours() {
    let Some(mut bench) = Bench::new() else { return };
    let all = vec![photon(Vec3::new(1.0, 2.0, 3.0), Vec3::Y, Vec3::Y, Vec3::ONE, 0, false); 300];
    assert_eq!(check(&mut bench, "all", &all, 300, wanted(299, 0.1, 0.5)), [300, 0, 0]);
    assert_eq!(check(&mut bench, "one more than there are", &all, 300, wanted(300, 0.1, 0.5)), [0, 300, 0]);
}

/// So many photons in the reach of each that a driver which counts turns would end a loop over all of them: the search ends when nothing nearer can come.
#[test]
fn the_search_ends_early_where_photons_are_dense() {
    let Some(mut bench) = Bench::new() else { return };
    let all = vec![photon(Vec3::ONE, Vec3::Y, Vec3::Y, Vec3::ONE, 0x3c00, false); 600_000];
    let found = search(&mut bench, PhotonStore::Whole, &all, 600_000, wanted(2, 0.1, 5.0));
    assert!(found == all, "all have ρ = 1");
}

/// A compact photon on the grid of the scene, with a normal up or down.
fn compact(random: &mut Random, grid: &PhotonGrid) -> CompactPhoton {
    let position = random.cube() * Vec3::new(1.0, 0.0, 1.0);
    let [x, y, z] = ((position - Vec3::from_array(grid.origin)) / grid.step).round().to_array().map(|cell| cell as u32);
    let up = random.word() & 3 > 0;
    let rubbish = random.word();
    CompactPhoton {
        position_low: x | (y << 21),
        position_high: (y >> 11) | (z << 10) | (rubbish as u32 & 0x8000_0000),
        flux: random.word() as u32,
        direction: random.word() as u32,
        // (0, ±127) in 8 + 8 bits.
        normal: (if up { 127 } else { 129 } << 8) | ((rubbish >> 32) as u32 & 0xffff_0000),
    }
}

/// Six bits of √(1 − ρ) hold the 64 levels exactly.
#[test]
fn the_compact_store_holds_the_levels() {
    let Some(mut bench) = Bench::new() else { return };
    let grid = PhotonGrid::of(&info());
    let mut random = Random(11);
    let all: Vec<_> = (0..1500).map(|_| compact(&mut random, &grid)).collect();
    let points: Vec<_> = all.iter().map(|photon| (photon.position(&grid), photon.normal())).collect();
    assert!(points.iter().all(|(_, normal)| normal.y.abs() > 0.999), "the test's own codes are sound");
    let wanted = wanted(12, 0.02, 0.25);
    let found = search(&mut bench, PhotonStore::Compact, &all, 1500, wanted);
    let mut seen = [0_u32; 64];
    for (i, (given, found)) in all.iter().zip(&found).enumerate() {
        let level = (found.direction >> 24) & 63;
        let [least, most] = levels(&points, i, wanted);
        assert!((least..=most).contains(&level), "photon {i}: {level} in place of {least} to {most}");
        let kept = |photon: &CompactPhoton| CompactPhoton { direction: photon.direction & 0xc0ff_ffff, ..*photon };
        assert!(kept(given) == kept(found), "photon {i}: nothing else changes");
        seen[level as usize] += 1;
    }
    assert!(seen.iter().filter(|&&photons| photons > 0).count() > 30, "{seen:?}");
}

#[test]
fn nothing_is_done_where_there_is_no_choice() {
    let Some(mut bench) = Bench::new() else { return };
    let mut graph = Graph::new("k-nearest");
    let device = bench.executor.device().clone();
    let given = common::import_photons(&mut graph, &device, &photons(5), 5);
    let mut passes = KNearest::new(&lightloom_passes::shaders());
    for radius in [KernelRadius::default(), wanted(9, 0.1, 0.1).into()] {
        assert!(passes.add(&mut graph, &info(), &given, &radius).expect("the radii are sound").is_none(), "{radius:?}");
    }
    assert!(passes.add(&mut graph, &info(), &given, &wanted(9, 0.2, 0.1).into()).is_err(), "radii are checked");
    bench.executor.execute(graph).expect("nothing runs");
}
