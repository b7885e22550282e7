//! `exact` is what its formula says; `tiled`, `hash-grid`, `sorted-grid` and `view-grid` are `exact`, but for the order of summation. On
//! photons and a G-buffer made on the CPU, with constant and with varying radii. Spherical splats are `exact` but for that and the rounding of their targets.

mod common;

use common::{Bench, Images, Random, SPECULAR, View, camera, density_estimate, floor_and_wall, photon, photons, strategy, views};
use glam::Vec3;
use lightloom_graph::{Executor, Gpu, wgpu};
use lightloom_passes::Photon;

const SIZE: [u32; 2] = [75, 50];

/// What looks for photons where `exact` tries them all.
const SEARCHES: [&str; 4] = ["tiled", "hash-grid", "sorted-grid", "view-grid"];

/// The radii of the tests: constant; varying with the path probability; wider than the room between eye and floor.
const RADII: [[(&str, &str); 2]; 3] =
    [[("r_min", "0.3"), ("r_max", "0.3")], [("r_min", "0.05"), ("r_max", "0.4")], [("r_min", "1.5"), ("r_max", "2.5")]];

/// Rounding: each of up to n summands, all positive, brings half an ulp of the sum, however they are ordered; each summand is
/// the same number in every strategy. n < 3000 gives 3000 · 2⁻²⁴ = 1.8e-4 at the very worst; errors of random sign,
/// √n · 2⁻²⁴ · a few, stay below 2e-5.
const ROUNDING: f32 = 2e-5;

fn assert_equal(a: &Images, b: &Images, what: &str) {
    for (layer, a, b) in [("indirect", &a.indirect, &b.indirect), ("caustic", &a.caustic, &b.caustic)] {
        assert_eq!(a.len(), b.len(), "{what}: {layer}");
        for (index, (a, b)) in a.iter().zip(b).enumerate() {
            for channel in 0..3 {
                let (a, b) = (a[channel], b[channel]);
                assert!(
                    a.is_finite() && (a - b).abs() <= ROUNDING * a.abs(),
                    "{what}: {layer}, pixel {index}, channel {channel}: {a} {b}"
                );
            }
        }
    }
}

#[test]
fn exact_is_its_formula() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(600);
    let view = View::new(views(SIZE)[0].1, floor_and_wall);
    let images = bench.run(&mut *strategy("exact", &RADII[1]), &view, &photons, 600, false);
    let mut lit = 0;
    for (index, (position, surface)) in view.position.iter().zip(&view.surface).enumerate() {
        let gathers = surface[3] != 0 && surface[3] & SPECULAR == 0;
        let sum = if gathers { density_estimate(position, surface, &photons[..600], 0.05, 0.4).sum } else { [0.0; 3] };
        for (&gpu, sum) in images.indirect[index].iter().zip(sum) {
            let gpu = f64::from(gpu);
            // Directions are 16-bit codes decoded in 32-bit floats on one side and the other: 1e-4 near the cut of normals and at
            // grazing directions is their rounding, not an error of the sum.
            assert!((gpu - sum).abs() <= 1e-4 * sum + 1e-6, "pixel {index}: {gpu} {sum}");
        }
        lit += u32::from(sum[0] > 0.0);
    }
    assert!(lit > 500, "only {lit} pixels are lit: the test shows nothing");
}

#[test]
fn all_strategies_equal_exact() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(2500);
    for (place, camera) in views(SIZE) {
        let view = View::new(camera, floor_and_wall);
        for radii in &RADII {
            let exact = bench.run(&mut *strategy("exact", radii), &view, &photons, 2500, false);
            let light: f32 = exact.indirect.iter().map(|pixel| pixel[0]).sum();
            assert_eq!(light > 0.0, place != "turned away", "{place}: {light}");
            for name in SEARCHES {
                let images = bench.run(&mut *strategy(name, radii), &view, &photons, 2500, false);
                assert_equal(&exact, &images, &format!("{name}, {place}, {radii:?}"));
                let dropped = images.stats.iter().find(|(name, _)| *name == "entries_dropped");
                assert_eq!(dropped, Some(&("entries_dropped", 0)));
            }
        }
    }
}

/// Radii by neighbours are found once, before whatever gathers. Splats in 32 bits, where there are such.
#[test]
fn all_strategies_equal_exact_with_radii_by_neighbours() {
    let Some(mut bench) = Bench::new() else { return };
    let gpu = Gpu::for_tests_with(wgpu::Features::FLOAT32_BLENDABLE);
    let mut blending = gpu.map(|gpu| Bench { executor: Executor::new(&gpu), seed: 0 });
    let photons = photons(2500);
    let nearest = [RADII[1][0], RADII[1][1], ("nearest", "12")];
    let view = View::new(views(SIZE)[0].1, floor_and_wall);
    let exact = bench.run(&mut *strategy("exact", &nearest), &view, &photons, 2500, false);
    let by_path = bench.run(&mut *strategy("exact", &RADII[1]), &view, &photons, 2500, false);
    let differ = exact.indirect.iter().zip(&by_path.indirect).filter(|(a, b)| (a[0] - b[0]).abs() > 0.01 * b[0]).count();
    assert!(differ > 500, "{differ} pixels have changed");
    for name in SEARCHES {
        let images = bench.run(&mut *strategy(name, &nearest), &view, &photons, 2500, false);
        assert_equal(&exact, &images, name);
    }
    if let Some(bench) = &mut blending {
        for (name, shape) in SPLATS {
            let settings = splat_settings(shape, &nearest, "float");
            assert_equal(&exact, &bench.run(&mut *strategy(name, &settings), &view, &photons, 2500, false), name);
        }
    }
    // Deterministic: the search finds the same whatever the order of a cell's photons.
    let mut sorted = strategy("sorted-grid", &nearest);
    let first = bench.run(&mut *sorted, &view, &photons, 2500, true);
    assert!(first == bench.run(&mut *sorted, &view, &photons, 2500, true), "two runs differ");
}

/// Rows of every width over tables from one so small that every bucket holds photons of many cells.
#[test]
fn sorted_grids_of_any_shape_equal_exact() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(2500);
    let view = View::new(views(SIZE)[1].1, floor_and_wall);
    for radii in &RADII[..2] {
        let exact = bench.run(&mut *strategy("exact", radii), &view, &photons, 2500, false);
        for (rows, bits) in [("1", "14"), ("2", "12"), ("3", "13"), ("4", "12")] {
            let settings = [radii[0], radii[1], ("rows", rows), ("bucket_bits", bits)];
            let images = bench.run(&mut *strategy("sorted-grid", &settings), &view, &photons, 2500, false);
            assert_equal(&exact, &images, &format!("{rows} rows, {bits} bits, {radii:?}"));
        }
    }
}

#[test]
fn view_grids_of_any_cells_equal_exact() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(2500);
    let view = View::new(views(SIZE)[1].1, floor_and_wall);
    for radii in &RADII {
        let exact = bench.run(&mut *strategy("exact", radii), &view, &photons, 2500, false);
        for cells in ["1", "2", "3", "4"] {
            let settings = [radii[0], radii[1], ("cells", cells)];
            let images = bench.run(&mut *strategy("view-grid", &settings), &view, &photons, 2500, false);
            assert_equal(&exact, &images, &format!("{cells} cells, {radii:?}"));
        }
    }
}

/// Images of an executor's first frame are black where nothing is written; later ones may show an earlier frame there.
#[test]
fn every_pixel_is_written() {
    let photons = photons(2500);
    let view = View::new(views(SIZE)[1].1, floor_and_wall);
    for name in SEARCHES {
        let Some(mut bench) = Bench::new() else { return };
        let first = bench.run(&mut *strategy(name, &RADII[1]), &view, &photons, 2500, false);
        let exact = bench.run(&mut *strategy("exact", &RADII[1]), &view, &photons, 2500, false);
        assert_equal(&exact, &first, name);
    }
}

/// Radii of some cells, of a hundred thousand cells to the scene, of five times the scene: fewer photons than 3000 in all.
#[test]
fn kernels_from_tiny_to_wider_than_the_scene_equal_exact() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(2500);
    let view = View::new(views(SIZE)[1].1, floor_and_wall);
    for (radius, lit) in [("0.02", true), ("1e-6", false), ("100", true)] {
        let exact = bench.run(&mut *strategy("exact", &[("radius", radius)]), &view, &photons, 2500, false);
        assert_eq!(exact.indirect.iter().any(|pixel| pixel[0] > 0.0), lit, "{radius} m");
        for name in SEARCHES {
            let images = bench.run(&mut *strategy(name, &[("radius", radius)]), &view, &photons, 2500, false);
            assert_equal(&exact, &images, &format!("{name}, {radius} m"));
        }
    }
    for name in ["sorted-grid", "view-grid"] {
        let images = bench.run(&mut *strategy(name, &[("radius", "3e38")]), &view, &photons, 2500, false);
        assert!(images.indirect.iter().all(|pixel| pixel[..3] == [0.0; 3]), "{name}: light over an infinite area is none");
        assert!(images.stats.contains(&("pixels_cut", 0)), "{name}: {:?}", images.stats);
    }
}

#[test]
fn one_photon_is_one_term() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(1);
    let view = View::new(views(SIZE)[0].1, floor_and_wall);
    let exact = bench.run(&mut *strategy("exact", &RADII[2]), &view, &photons, 1, false);
    assert!(exact.indirect.iter().any(|pixel| pixel[0] > 0.0), "the photon is seen");
    for name in SEARCHES {
        assert_equal(&exact, &bench.run(&mut *strategy(name, &RADII[2]), &view, &photons, 1, false), name);
    }
}

#[test]
fn no_photons_no_light() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(0);
    let view = View::new(views(SIZE)[0].1, floor_and_wall);
    for name in ["exact"].into_iter().chain(SEARCHES) {
        let images = bench.run(&mut *strategy(name, &RADII[0]), &view, &photons, 0, true);
        assert!(images.indirect.iter().all(|pixel| pixel[..3] == [0.0; 3]), "{name} finds light in rubbish");
    }
}

#[test]
fn deterministic_runs_give_equal_bits() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(2500);
    let view = View::new(views(SIZE)[1].1, floor_and_wall);
    for name in ["exact"].into_iter().chain(SEARCHES) {
        let mut strategy = strategy(name, &RADII[1]);
        let first = bench.run(&mut *strategy, &view, &photons, 2500, true);
        for _ in 0..2 {
            let again = bench.run(&mut *strategy, &view, &photons, 2500, true);
            assert!(first == again, "{name} differs from run to run");
        }
    }
    // Sorted, the photons of a tile are summed in the order of the store, as `exact` does within a chunk.
    let exact = bench.run(&mut *strategy("exact", &RADII[1]), &view, &photons, 2500, true);
    let tiled = bench.run(&mut *strategy("tiled", &RADII[1]), &view, &photons, 2500, true);
    assert_eq!(exact.indirect, tiled.indirect, "one order, one sum");
}

/// So many photons in one bucket that the threads which count them race.
#[test]
fn deterministic_buckets_are_summed_in_one_order() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(16_000);
    let view = View::new(camera(Vec3::new(0.5, 2.0, 5.0), Vec3::new(0.0, 0.5, -1.0), [16, 8], [0.5, 0.5]), floor_and_wall);
    let mut strategy = strategy("sorted-grid", &[("radius", "100"), ("rows", "1")]);
    let runs: Vec<_> = (0..4).map(|_| bench.run(&mut *strategy, &view, &photons, 16_000, true)).collect();
    assert!(runs[0].stats.contains(&("longest_list", 16_000)), "{:?}", runs[0].stats);
    assert!(runs.iter().all(|run| *run == runs[0]), "the order of a bucket differs from run to run");
}

/// The same in lists of chunks, which are then summed as `exact` sums.
#[test]
fn deterministic_lists_are_summed_in_the_order_of_the_store() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(16_000);
    let view = View::new(camera(Vec3::new(0.5, 2.0, 5.0), Vec3::new(0.0, 0.5, -1.0), [16, 8], [0.5, 0.5]), floor_and_wall);
    let exact = bench.run(&mut *strategy("exact", &RADII[2]), &view, &photons, 16_000, true);
    for name in ["tiled", "view-grid"] {
        let mut strategy = strategy(name, &RADII[2]);
        for _ in 0..3 {
            let images = bench.run(&mut *strategy, &view, &photons, 16_000, true);
            let longest = images.stats.iter().find(|(name, _)| *name == "longest_list").expect("it is counted").1;
            assert!(longest > 1000, "{name}: {:?}", images.stats);
            assert_eq!(exact.indirect, images.indirect, "{name}: one order, one sum");
        }
    }
}

/// Bounds of normals keep photons of other surfaces out of the lists, not only out of the sums: below the floor, and on it with light that came from
/// below.
#[test]
fn photons_that_face_away_enter_no_list() {
    let Some(mut bench) = Bench::new() else { return };
    let view = View::new(views(SIZE)[1].1, floor);
    let mut random = Random(2);
    let mut scattered = |normal: Vec3, from: Vec3| -> Vec<Photon> {
        let mut at = || random.cube() * Vec3::new(3.0, 0.0, 3.0);
        (0..500).map(|_| photon(at(), normal, from, Vec3::ONE, 0, false)).collect()
    };
    let facing = scattered(Vec3::Y, Vec3::Y);
    let away = [scattered(Vec3::NEG_Y, Vec3::NEG_Y), scattered(Vec3::Y, Vec3::NEG_Y), scattered(Vec3::X, Vec3::Y)];
    for name in ["tiled", "view-grid"] {
        let mut entries = |photons: &[Photon]| {
            let images = bench.run(&mut *strategy(name, &RADII[0]), &view, photons, 500, false);
            images.stats.iter().find(|(name, _)| *name == "entries").expect("they are counted").1
        };
        assert!(entries(&facing) > 100, "{name}: photons of the floor are listed");
        for photons in &away {
            assert_eq!(entries(photons), 0, "{name}: photons of another side are listed");
        }
    }
}

/// The floor alone.
fn floor(origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
    floor_and_wall(origin, direction).filter(|(_, normal)| *normal == Vec3::Y)
}

#[test]
fn full_lists_are_reported() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(500);
    let view = View::new(views(SIZE)[0].1, floor_and_wall);
    for name in ["tiled", "view-grid"] {
        // Which points share a chunk, and so the number of entries, is the same in deterministic runs only.
        let roomy = bench.run(&mut *strategy(name, &RADII[0]), &view, &photons, 500, true);
        let entries = roomy.stats.iter().find(|(name, _)| *name == "entries").unwrap().1;
        assert!(entries > 100, "{name}: {entries}");
        let mut settings = RADII[0].to_vec();
        settings.push(("entry_capacity", "100"));
        let tight = bench.run(&mut *strategy(name, &settings), &view, &photons, 500, true);
        assert!(tight.stats.contains(&("entries", entries)), "{name}: {:?}", tight.stats);
        assert!(tight.stats.contains(&("entries_dropped", entries - 100)), "{name}: {:?}", tight.stats);
        let sum = |images: &Images| images.indirect.iter().map(|pixel| pixel[0]).sum::<f32>();
        assert!(sum(&tight) < sum(&roomy), "{name}: what was dropped is missing");
    }
}

/// What draws photons, with spheres.
const SPLATS: [(&str, &[(&str, &str)]); 3] = [
    ("splat-3d", &[("shape", "sphere")]),
    ("splat-2.5d", &[("shape", "sphere")]),
    ("splat-2.5d", &[("shape", "sphere"), ("corners", "4")]),
];

/// The settings of a splat, of 16 or of 32 bits.
fn splat_settings<'a>(shape: &[(&'a str, &'a str)], radii: &[(&'a str, &'a str)], precision: &'a str) -> Vec<(&'a str, &'a str)> {
    [shape, radii, &[("precision", precision)]].concat()
}

/// With 32 bits, splats differ from `exact` by the order of summation alone.
#[test]
fn spherical_splats_in_32_bits_equal_exact() {
    let Some(gpu) = Gpu::for_tests_with(wgpu::Features::FLOAT32_BLENDABLE) else { return };
    let mut bench = Bench { executor: Executor::new(&gpu), seed: 0 };
    let photons = photons(2500);
    for (place, camera) in views(SIZE) {
        let view = View::new(camera, floor_and_wall);
        for radii in RADII.iter().chain(&[[("r_min", "0.01"), ("r_max", "0.03")], [("r_min", "0.001"), ("r_max", "100")]]) {
            let exact = bench.run(&mut *strategy("exact", radii), &view, &photons, 2500, false);
            for (name, shape) in SPLATS {
                let settings = splat_settings(shape, radii, "float");
                let images = bench.run(&mut *strategy(name, &settings), &view, &photons, 2500, false);
                assert_equal(&exact, &images, &format!("{name}, {place}, {settings:?}"));
                assert_eq!(images.stats, [("pixels_overflowed", 0)]);
            }
        }
    }
}

/// n summands, all positive: each is rounded to 11 bits, by 2⁻¹¹ of itself and so of their sum in all, and so is each of n partial sums, by
/// 2⁻¹¹ of the whole sum at the most, or by half the smallest 16-bit float, 2⁻²⁵, where it is tiny. So n + 1 times 2⁻¹¹, and 2 n times 2⁻²⁵.
#[test]
fn spherical_splats_in_16_bits_equal_exact_but_for_their_rounding() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(300);
    let (mut lit, mut loosest) = (0, 0.0_f32);
    for (place, camera) in views(SIZE) {
        let view = View::new(camera, floor_and_wall);
        for (radii, r_max) in [(&RADII[0], 0.3), (&RADII[1], 0.4)] {
            let exact = bench.run(&mut *strategy("exact", radii), &view, &photons, 300, false);
            for (name, shape) in SPLATS {
                let settings = splat_settings(shape, radii, "half");
                let images = bench.run(&mut *strategy(name, &settings), &view, &photons, 300, false);
                assert_eq!(images.stats, [("pixels_overflowed", 0)]);
                for (index, position) in view.position.iter().enumerate() {
                    let point = Vec3::new(position[0], position[1], position[2]);
                    let near = |photon: &&Photon| Vec3::from(photon.position).distance(point) < r_max;
                    let n = photons[..300].iter().filter(near).count() as f32;
                    for (exact, half) in [(&exact.indirect, &images.indirect), (&exact.caustic, &images.caustic)] {
                        for channel in 0..3 {
                            let (exact, half) = (exact[index][channel], half[index][channel]);
                            let bound = (n + 1.0) * 2.0_f32.powi(-11) * exact + 2.0 * n * 2.0_f32.powi(-25);
                            let what = || format!("{name}, {place}, {settings:?}, pixel {index}: {exact} {half}, {n} photons");
                            assert!((exact - half).abs() <= bound, "{}", what());
                            lit += u32::from(exact > 0.0);
                            loosest = loosest.max(if exact > 0.0 { bound / exact } else { 0.0 });
                        }
                    }
                }
            }
        }
    }
    assert!(lit > 10_000 && loosest < 0.1, "{lit} values are lit, and the loosest bound is {loosest}");
}

#[test]
fn splats_are_blended_in_one_order() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(2500);
    let view = View::new(views(SIZE)[1].1, floor_and_wall);
    for (name, shape) in SPLATS {
        let mut strategy = strategy(name, &splat_settings(shape, &RADII[1], "half"));
        let first = bench.run(&mut *strategy, &view, &photons, 2500, true);
        for _ in 0..2 {
            assert!(first == bench.run(&mut *strategy, &view, &photons, 2500, true), "{name} differs from run to run");
        }
        let none = bench.run(&mut *strategy, &view, &photons, 0, true);
        assert!(none.indirect.iter().all(|pixel| pixel[..3] == [0.0; 3]), "{name} finds light in rubbish");
    }
}

/// 4 million times the flux: sums beyond 65,504 are cut there and counted.
#[test]
fn what_16_bits_cannot_hold_is_cut_and_counted() {
    let Some(mut bench) = Bench::new() else { return };
    let mut photons = photons(500);
    for photon in &mut photons {
        photon.flux += 22 << 24;
    }
    let view = View::new(views(SIZE)[0].1, floor_and_wall);
    let exact = bench.run(&mut *strategy("exact", &RADII[0]), &view, &photons, 500, false);
    for (name, shape) in SPLATS {
        let images = bench.run(&mut *strategy(name, &splat_settings(shape, &RADII[0], "half")), &view, &photons, 500, false);
        let over = exact.indirect.iter().filter(|pixel| pixel[0] > 65_504.0).count();
        let (_, counted) = images.stats[0];
        assert!(over > 100 && (counted as usize).abs_diff(over) <= over / 100, "{name}: {counted} counted, {over} are over");
        assert!(images.indirect.iter().all(|pixel| pixel[0] <= 65_504.0), "{name}: cut");
    }
}
