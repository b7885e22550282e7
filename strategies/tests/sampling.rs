//! Gathering some of the photons, and at some of the pixels.

mod common;

use common::{Bench, POSITION, Random, SPECULAR, Terms, View, density_estimate, floor_and_wall, photons, strategy, views};
use lightloom_graph::Graph;
use lightloom_passes::{Photon, Subsample, Upsample, shaders};

const SIZE: [u32; 2] = [40, 30];

/// What gathers at pixels.
const GATHERS: [&str; 4] = ["tiled", "hash-grid", "sorted-grid", "view-grid"];

/// Terms of each pixel, on the CPU.
fn terms(view: &View, photons: &[Photon], radius: f64) -> Vec<Terms> {
    let pixels = view.position.iter().zip(&view.surface);
    let gathers = |surface: &[u32; 4]| surface[3] != 0 && surface[3] & SPECULAR == 0;
    pixels
        .map(
            |(position, surface)| {
                if gathers(surface) { density_estimate(position, surface, photons, radius, radius) } else { Terms::default() }
            },
        )
        .collect()
}

/// A photon taken with probability p and weighed 1/p has the mean c and the variance c² (1 − p)/p; photons and pixels are drawn
/// independently. Over n runs the squared error of a pixel's mean, in units of its variance, is 1 in expectation; over m
/// pixels the mean of that is 1 ± √(2/m) and a little more, for sums of few terms have heavy tails. And all the light together has no
/// bias beyond its standard error.
#[test]
fn selected_photons_have_the_mean_and_the_variance_of_independent_draws() {
    const RUNS: u32 = 48;
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(1500);
    let view = View::new(views(SIZE)[0].1, floor_and_wall);
    let terms = terms(&view, &photons[..1500], 0.4);
    for (name, p) in GATHERS.into_iter().zip([0.5, 0.25, 0.0625, 0.25]) {
        let mut strategy = strategy(name, &[("radius", "0.4"), ("selection", &p.to_string())]);
        let mut sums = vec![0.0_f64; terms.len()];
        for run in 0..RUNS {
            bench.seed = 1000 + run;
            let images = bench.run(&mut *strategy, &view, &photons, 1500, false);
            assert!(images.stats.contains(&("pixels_cut", 0)), "{name}: {:?}", images.stats);
            for (sum, pixel) in sums.iter_mut().zip(&images.indirect) {
                *sum += f64::from(pixel[0]) / f64::from(RUNS);
            }
        }
        let (mut pixels, mut chi, mut bias, mut variance) = (0.0, 0.0, 0.0, 0.0);
        for (mean, terms) in sums.iter().zip(&terms).filter(|(_, terms)| terms.sum[0] > 0.0) {
            let expected = terms.squares[0] * (1.0 - p) / p / f64::from(RUNS);
            let error = mean - terms.sum[0];
            pixels += 1.0;
            chi += error * error / expected;
            bias += error;
            variance += expected;
        }
        assert!(pixels > 500.0, "only {pixels} lit pixels");
        let (chi, bias) = (chi / pixels, bias / variance.sqrt());
        println!("{name}, p = {p}: χ²/m = {chi:.3} over {pixels} pixels, bias {bias:.2} standard errors");
        assert!((chi - 1.0).abs() < 4.0 * (2.0_f64 / pixels).sqrt() + 0.05, "{name}: χ²/m = {chi}");
        assert!(bias.abs() < 4.0, "{name}: all light is off by {bias} standard errors");
    }
}

#[test]
fn a_probability_of_one_takes_every_photon() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(1500);
    let view = View::new(views(SIZE)[1].1, floor_and_wall);
    for name in GATHERS {
        let all = bench.run(&mut *strategy(name, &[]), &view, &photons, 1500, true);
        let one = bench.run(&mut *strategy(name, &[("selection", "1"), ("subsampling", "1")]), &view, &photons, 1500, true);
        assert!(all == one, "{name}");
    }
}

/// A pixel draws from the photons of its list: which those are must not depend on which threads were first.
#[test]
fn deterministic_draws_are_the_same_in_every_run() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(2500);
    let view = View::new(views([160, 120])[1].1, floor_and_wall);
    for name in GATHERS {
        let mut strategy = strategy(name, &[("radius", "0.6"), ("selection", "0.25")]);
        let first = bench.run(&mut *strategy, &view, &photons, 2500, true);
        for _ in 0..3 {
            assert!(first == bench.run(&mut *strategy, &view, &photons, 2500, true), "{name} differs from run to run");
        }
    }
}

/// The pixels that gather are the same, and so must their sums be; up to rounding, as everywhere.
#[test]
fn subsampled_strategies_are_equal_and_lose_no_light() {
    let Some(mut bench) = Bench::new() else { return };
    let photons = photons(2500);
    for (place, camera) in &views(SIZE)[..2] {
        let view = View::new(*camera, floor_and_wall);
        let radius = ("radius", "0.6");
        let full = bench.run(&mut *strategy("exact", &[radius]), &view, &photons, 2500, false);
        let sum = |image: &[[f32; 4]]| image.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>();
        for k in ["2", "3", "8"] {
            let settings = [radius, ("subsampling", k)];
            let first = bench.run(&mut *strategy(GATHERS[0], &settings), &view, &photons, 2500, false);
            for name in &GATHERS[1..] {
                let other = bench.run(&mut *strategy(name, &settings), &view, &photons, 2500, false);
                for (a, b) in first.indirect.iter().zip(&other.indirect) {
                    assert!((a[0] - b[0]).abs() <= 2e-5 * a[0].abs(), "{name}, {place}, k = {k}: {} {}", a[0], b[0]);
                }
            }
            let dark = |(full, few): (&[f32; 4], &[f32; 4])| full[0] > 0.0 && few[0] == 0.0;
            let holes = full.indirect.iter().zip(&first.indirect).filter(|&pair| dark(pair)).count();
            let ratio = sum(&first.indirect) / sum(&full.indirect);
            println!("{place}, k = {k}: {ratio:.4} of the light, {holes} dark pixels");
            // Light that varies within k pixels is sampled, and so few samples of it are worth no more than this.
            assert!(k == "8" || (ratio - 1.0).abs() < 0.1, "{place}, k = {k}: {ratio} of the light");
        }
    }
}

/// Base colour of a pixel's surface.
fn base_color(surface: [u32; 4]) -> f32 {
    let root = (surface[2] & 2047) as f32 / 2047.0;
    root * root
}

/// Irradiance π on the floor and none on the wall: radiance is the base colour of whatever texture the floor has, and nothing of it
/// comes to the wall. A pixel whose surface no sample around it shows has nothing better to go by.
#[test]
fn light_is_carried_over_within_a_surface_and_before_its_texture() {
    let Some(mut bench) = Bench::new() else { return };
    let size = [61, 43];
    let mut view = View::new(views(size)[0].1, floor_and_wall);
    let mut random = Random(5);
    for surface in &mut view.surface {
        // A third of the texture is black.
        surface[2] = if random.unit() < 0.33 { 0 } else { (random.unit() * 2047.0) as u32 };
    }
    let sources = shaders();
    let (subsample, upsample) = (Subsample::new(&sources).unwrap(), Upsample::new(&sources).unwrap());
    let on_floor = |position: &[f32; 4]| position[1].abs() < 1e-3;
    for stride in [2_u32, 5] {
        let mut graph = Graph::new("choose");
        let gbuffer = bench.gbuffer(&mut graph, &view);
        let points = subsample.add(&mut graph, &gbuffer, size, stride);
        let reads = (graph.readback_texture(&points.position), graph.readback_texture(&points.surface));
        let output = bench.executor.execute(graph).unwrap();
        let (positions, surfaces) = (output.cast::<[f32; 4]>(reads.0), output.cast::<[u32; 4]>(reads.1));
        let samples = positions.iter().zip(&surfaces);
        let light: Vec<_> =
            samples.map(|(position, &surface)| [if on_floor(position) { base_color(surface) } else { 0.0 }; 4]).collect();

        let mut graph = Graph::new("carry over");
        let gbuffer = bench.gbuffer(&mut graph, &view);
        let points = subsample.add(&mut graph, &gbuffer, size, stride);
        let radiance = bench.image(&mut graph, "light", points.size, POSITION, &light);
        let all = upsample.add(&mut graph, "all", &view.camera, &gbuffer, &points, &radiance);
        let read = graph.readback_texture(&all);
        let all = bench.executor.execute(graph).unwrap().cast::<[f32; 4]>(read);

        let squares = points.size;
        let mut seen = [0_u32; 2];
        for (index, (position, &surface)) in view.position.iter().zip(&view.surface).enumerate() {
            let gathers = surface[3] != 0 && surface[3] & SPECULAR == 0;
            let floor = on_floor(position);
            let place = [index as u32 % size[0], index as u32 / size[0]].map(|x| (x as f32 + 0.5) / stride as f32 - 0.5);
            let knows = |[x, y]: [f32; 2]| {
                let at = x.clamp(0.0, squares[0] as f32 - 1.0) as usize
                    + y.clamp(0.0, squares[1] as f32 - 1.0) as usize * squares[0] as usize;
                let sample = surfaces[at];
                sample[3] != 0 && sample[3] & SPECULAR == 0 && on_floor(&positions[at]) == floor && base_color(sample) > 0.05
            };
            // The sample of the pixel's own square weighs a quarter at least.
            if !gathers || !knows(place.map(f32::round)) {
                continue;
            }
            seen[usize::from(floor)] += 1;
            let expected = if floor { base_color(surface) } else { 0.0 };
            // Samples of the other surface weigh 1e-4, and at most twenty times more by their base colour.
            assert!((all[index][0] - expected).abs() < 0.01, "stride {stride}, pixel {index}: {} {expected}", all[index][0]);
        }
        assert!(seen.iter().all(|&count| count > 100), "{seen:?}");
    }
}

/// A pixel that alone in its square gathers light is the one that gathers.
#[test]
fn no_square_goes_without() {
    let Some(mut bench) = Bench::new() else { return };
    let size = [16, 12];
    let mut view = View::new(views(size)[0].1, |_, _| Some((5.0, glam::Vec3::Y)));
    for (index, surface) in view.surface.iter_mut().enumerate() {
        let (x, y) = (index % 16, index / 16);
        surface[3] = if (x % 4, y % 4) == (3, 1) { surface[3] & !SPECULAR } else { 0 };
        surface[2] = index as u32;
    }
    let mut graph = Graph::new("choose");
    let gbuffer = bench.gbuffer(&mut graph, &view);
    let points = Subsample::new(&shaders()).unwrap().add(&mut graph, &gbuffer, size, 4);
    let read = graph.readback_texture(&points.surface);
    let chosen = bench.executor.execute(graph).unwrap().cast::<[u32; 4]>(read);
    let expected: Vec<_> = (0..12).map(|square| (square / 4 * 4 + 1) * 16 + square % 4 * 4 + 3).collect();
    assert_eq!(chosen.iter().map(|surface| surface[2]).collect::<Vec<_>>(), expected);
}
