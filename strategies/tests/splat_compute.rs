//! Splats of compute shaders: spheres are `exact`, ellipsoids are what the rasteriser draws; sums, their order, and what they cannot hold.

mod common;

use common::{Bench, Images, Random, View, camera, floor_and_wall, photons, strategy, views};
use glam::Vec3;
use lightloom_graph::{Executor, Gpu, wgpu};
use lightloom_passes::Photon;
use lightloom_strategies::Strategy;

const SIZE: [u32; 2] = [75, 50];

/// What pixels are summed in, with a device for it.
fn benches() -> Vec<(&'static str, Bench)> {
    let float = Gpu::for_tests_with(wgpu::Features::SHADER_FLOAT32_ATOMIC);
    let float = float.map(|gpu| ("float", Bench { executor: Executor::new(&gpu), seed: 0 }));
    Bench::new().map(|bench| ("fixed", bench)).into_iter().chain(float).collect()
}

fn splats(sums: &str, settings: &[(&str, &str)]) -> Box<dyn Strategy> {
    strategy("splat-compute", &[&[("sums", sums)], settings].concat())
}

/// Each summand is the same number as in `exact`. Sums of n < 2600 floats, all positive, are off by some √n · 2⁻²⁴ on either side, as in
/// `equality.rs`: 2e-5 of them is far beyond. Fixed point rounds each summand by half its unit at most, of 2⁻³⁴ where the scene tells no flux:
/// 2600 · 2⁻³⁵ in all.
fn assert_equal(exact: &Images, found: &Images, what: &str) {
    for (layer, a, b) in [("indirect", &exact.indirect, &found.indirect), ("caustic", &exact.caustic, &found.caustic)] {
        assert_eq!(a.len(), b.len(), "{what}: {layer}");
        for (index, (a, b)) in a.iter().zip(b).enumerate() {
            for channel in 0..3 {
                let (a, b) = (a[channel], b[channel]);
                let bound = 2e-5 * a.abs() + 2600.0 * 2.0_f32.powi(-35);
                assert!((a - b).abs() <= bound, "{what}: {layer}, pixel {index}, channel {channel}: {a} {b}");
            }
        }
    }
}

fn count(images: &Images, name: &str) -> u32 {
    images.stats.iter().find(|(found, _)| *found == name).unwrap_or_else(|| panic!("no `{name}` in {:?}", images.stats)).1
}

/// Constant radii, varying ones, radii of pixels and less, and wider than the scene; from afar, from within, and turned away.
#[test]
fn spheres_equal_exact() {
    let photons = photons(2500);
    let radii = [("0.3", "0.3"), ("0.05", "0.4"), ("1.5", "2.5"), ("0.01", "0.03"), ("1e-6", "1e-6"), ("0.001", "100")];
    for (sums, mut bench) in benches() {
        for (place, camera) in views(SIZE) {
            let view = View::new(camera, floor_and_wall);
            for (r_min, r_max) in radii {
                let radii = [("r_min", r_min), ("r_max", r_max)];
                let exact = bench.run(&mut *strategy("exact", &radii), &view, &photons, 2500, false);
                let light: f32 = exact.indirect.iter().map(|pixel| pixel[0]).sum();
                assert_eq!(light > 0.0, place != "turned away" && r_max != "1e-6", "{place}, {radii:?}: {light}");
                let found = bench.run(&mut *splats(sums, &radii), &view, &photons, 2500, false);
                assert_equal(&exact, &found, &format!("{sums}, {place}, {radii:?}"));
                assert_eq!(count(&found, "pixels_overflowed"), 0, "{sums}, {place}, {radii:?}");
                // Boxes of kernels of at most 0.03 m, 5 m away, where a pixel is 0.1 m wide, have no blocks.
                let blocks = count(&found, "pixel_blocks");
                assert!((r_max == "2.5") <= (blocks > 100 || place == "turned away"), "{place}: {blocks} blocks");
                assert!(place != "from a distance" || r_max != "0.03" || blocks == 0, "{place}: {blocks} blocks");
            }
        }
        let view = View::new(views(SIZE)[0].1, floor_and_wall);
        let nearest = [("r_min", "0.05"), ("r_max", "0.4"), ("nearest", "12")];
        let exact = bench.run(&mut *strategy("exact", &nearest), &view, &photons, 2500, false);
        let found = bench.run(&mut *splats(sums, &nearest), &view, &photons, 2500, false);
        assert_equal(&exact, &found, &format!("{sums}, radii by neighbours"));
        let none = bench.run(&mut *splats(sums, &[]), &view, &photons, 0, false);
        assert!(none.indirect.iter().all(|pixel| pixel[..3] == [0.0; 3]), "{sums}: light in rubbish");
    }
}

/// Boxes of more pixels than 16 × 16 blocks of 16 × 16, so that blocks are wider; of odd sizes, so that the last are narrower.
#[test]
fn splats_as_wide_as_the_image_equal_exact() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(20);
    let view = View::new(camera(Vec3::new(0.5, 2.0, 5.0), Vec3::new(0.0, 0.5, -1.0), [401, 301], [0.5, 0.5]), floor_and_wall);
    for radius in ["0.5", "3", "100"] {
        let exact = bench.run(&mut *strategy("exact", &[("radius", radius)]), &view, &photons, 20, false);
        let found = bench.run(&mut *splats("fixed", &[("radius", radius)]), &view, &photons, 20, false);
        assert_equal(&exact, &found, radius);
        if radius == "100" {
            assert_eq!(count(&found, "pixel_blocks"), 20 * 16 * 16, "every splat covers the image");
        }
    }
}

/// 180,000 photons at each of a few pixels: far more than any loop of any thread turns.
#[test]
fn many_photons_on_a_pixel_are_all_summed() {
    let Some(mut bench) = Bench::new() else { return };
    let few = photons(500);
    let many: Vec<Photon> = (0..180_000).map(|index| few[index % 500]).collect();
    let view = View::new(camera(Vec3::new(0.5, 2.0, 5.0), Vec3::new(0.0, 0.5, -1.0), [6, 4], [0.5, 0.5]), floor_and_wall);
    let radius = [("radius", "20")];
    let once = bench.run(&mut *splats("fixed", &radius), &view, &few, 500, false);
    let all = bench.run(&mut *splats("fixed", &radius), &view, &many, 180_000, false);
    let mut lit = 0;
    for (once, all) in once.indirect.iter().zip(&all.indirect) {
        // Whole numbers: 360 times each, but for two roundings to a float.
        assert!((all[0] - 360.0 * once[0]).abs() <= 2.0_f32.powi(-22) * all[0], "{} is not 360 times {}", all[0], once[0]);
        lit += u32::from(once[0] > 0.0);
    }
    assert!(lit > 5, "{lit} pixels are lit");
}

/// In any order and on any run, to the bit; deterministic frames are summed so, whatever is asked for.
#[test]
fn fixed_point_knows_no_order() {
    let mut shuffled = photons(2500);
    let view = View::new(views(SIZE)[1].1, floor_and_wall);
    let settings = [("r_min", "0.05"), ("r_max", "0.9")];
    for (sums, mut bench) in benches() {
        let first = bench.run(&mut *splats("fixed", &settings), &view, &shuffled, 2500, false);
        let mut random = Random(9);
        for last in (1..2500).rev() {
            shuffled.swap(last, (random.word() % (last as u64 + 1)) as usize);
        }
        for deterministic in [false, true] {
            let sums = if deterministic { sums } else { "fixed" };
            let again = bench.run(&mut *splats(sums, &settings), &view, &shuffled, 2500, deterministic);
            assert!(first == again, "{sums}, deterministic: {deterministic}");
        }
    }
}

/// 2³⁵ times the flux: sums beyond 2²⁹ are cut there and counted, and so are those with a summand of 2²⁸ and more.
#[test]
fn what_fixed_point_cannot_hold_is_cut_and_counted() {
    let Some(mut bench) = Bench::new() else { return };
    let mut photons = photons(500);
    for photon in &mut photons {
        photon.flux += 35 << 24;
    }
    let view = View::new(views(SIZE)[0].1, floor_and_wall);
    for radius in ["0.3", "2"] {
        let exact = bench.run(&mut *strategy("exact", &[("radius", radius)]), &view, &photons, 500, false);
        let found = bench.run(&mut *splats("fixed", &[("radius", radius)]), &view, &photons, 500, false);
        let beyond = |bound: f32| exact.indirect.iter().filter(|pixel| pixel[..3].iter().any(|&x| x > bound)).count();
        let (largest, counted) = (2.0_f32.powi(29), count(&found, "pixels_overflowed") as usize);
        assert!(beyond(largest) > 100, "{radius} m: {} pixels are over", beyond(largest));
        assert!((beyond(largest)..=beyond(0.5 * largest)).contains(&counted), "{radius} m: {counted} pixels counted");
        for (exact, found) in exact.indirect.iter().zip(&found.indirect) {
            for channel in 0..3 {
                let (exact, found) = (exact[channel], found[channel]);
                assert!((exact.min(largest) - found).abs() <= 2e-5 * found || found >= largest, "{radius} m: {exact} {found}");
            }
        }
    }
}

/// What the drawing strategies blend into 32-bit floats, kernel by kernel: written, drawn, stretched and around the eye.
#[test]
fn ellipsoids_equal_drawn_ones() {
    let features = wgpu::Features::FLOAT32_BLENDABLE | wgpu::Features::SHADER_FLOAT32_ATOMIC;
    let Some(gpu) = Gpu::for_tests_with(features) else { return };
    let mut bench = Bench { executor: Executor::new(&gpu), seed: 0 };
    // Rays of ½, 2 and 8 m.
    let lengths = [0x3800, 0x4000, 0x4800].into_iter().cycle();
    let mut photons = photons(1500);
    for (photon, length) in photons.iter_mut().zip(lengths) {
        photon.length_probability |= length;
    }
    photons.truncate(1500);
    let mut lit = 0;
    for (place, camera) in views(SIZE) {
        let view = View::new(camera, floor_and_wall);
        for (disc_min, disc_max) in [("0.001", "0.02"), ("0.1", "0.4"), ("2", "3")] {
            let settings =
                [("shape", "ellipsoid"), ("disc_min", disc_min), ("disc_max", disc_max), ("n_tile", "1"), ("l_max", "4")];
            let mut drawn = strategy("splat-2.5d", &[&settings[..], &[("precision", "float")]].concat());
            let drawn = bench.run_irradiance(&mut *drawn, &view, &photons);
            for sums in ["fixed", "float"] {
                let found = bench.run_irradiance(&mut *splats(sums, &settings), &view, &photons);
                let what = format!("{sums}, {place}, discs of {disc_max} m");
                for (index, (a, b)) in drawn.irradiance.iter().zip(&found.irradiance).enumerate() {
                    let bound = 2e-5 * a[0] + 1500.0 * 2.0_f32.powi(-35);
                    assert!((a[0] - b[0]).abs() <= bound, "{what}, pixel {index}: irradiance {} {}", a[0], b[0]);
                    // Components cancel; none of the summands is larger than the irradiance.
                    let (a, b) = (drawn.direction[index], found.direction[index]);
                    let off = (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f32::max);
                    assert!(off <= bound, "{what}, pixel {index}: direction {a:?} {b:?}");
                    lit += u32::from(drawn.irradiance[index][0] > 0.0);
                }
                for (a, b) in drawn.indirect.iter().zip(&found.indirect) {
                    assert!((a[0] - b[0]).abs() <= 1e-4 * a[0] + 1e-6, "{what}: reflected {} {}", a[0], b[0]);
                }
            }
        }
    }
    assert!(lit > 5000, "{lit} pixels are lit");
}
