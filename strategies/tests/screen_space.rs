//! Photons into the pixels that see them: against a sum on the CPU, what is not stored and why, and that light is conserved, from wherever it
//! is seen and however it is denoised (PHYSICS check 12).

mod common;

use common::{
    Bench, Images, PROBABILITIES, Random, SPECULAR, View, camera, encode_octahedral, floor_and_wall, photon, photons, strategy,
    views,
};
use glam::{DMat4, DVec3, Vec3};
use lightloom_graph::{Executor, Gpu, wgpu};
use lightloom_passes::{CameraUniform, Photon, PhotonFlags, decode_flux, decode_octahedral};
use lightloom_strategies::Strategy;
use std::f64::consts::PI;

const SIZE: [u32; 2] = [75, 50];
const DENOISERS: [&[(&str, &str)]; 4] = [
    &[("denoiser", "none")],
    &[("denoiser", "guided"), ("distance_min", "6")],
    &[("denoiser", "bilateral"), ("near", "0")],
    &[("denoiser", "bilateral"), ("near", "1000"), ("width", "2")],
];

fn screen_space(settings: &[(&str, &str)]) -> Box<dyn Strategy> {
    strategy("screen-space", settings)
}

fn count(images: &Images, name: &str) -> u32 {
    images.stats.iter().find(|(found, _)| *found == name).unwrap_or_else(|| panic!("no `{name}` in {:?}", images.stats)).1
}

/// The camera in 64-bit floats.
struct Eye {
    world_from_view: DMat4,
    tan_half: [f64; 2],
    size: [f64; 2],
}

impl Eye {
    fn new(camera: &CameraUniform) -> Self {
        let columns = camera.world_from_view.map(|column| column.map(f64::from));
        Self {
            world_from_view: DMat4::from_cols_array_2d(&columns),
            tan_half: camera.tan_half.map(f64::from),
            size: camera.size.map(f64::from),
        }
    }

    fn position(&self) -> DVec3 {
        self.world_from_view.w_axis.truncate()
    }

    /// Point of the image (pixels), and depth (m).
    fn film(&self, world: DVec3) -> ([f64; 2], f64) {
        let view = self.world_from_view.inverse().transform_point3(world);
        let x = (view.x / (-view.z * self.tan_half[0]) * 0.5 + 0.5) * self.size[0];
        let y = (0.5 - view.y / (-view.z * self.tan_half[1]) * 0.5) * self.size[1];
        ([x, y], -view.z)
    }

    /// Area (m²) of the quadrilateral that the corners of a pixel cut from a plane; `None` where they do not all meet it.
    fn pixel_area(&self, [x, y]: [u32; 2], point: DVec3, normal: DVec3) -> Option<f64> {
        let corner = |dx: u32, dy: u32| {
            let ndc_x = f64::from(x + dx) / self.size[0] * 2.0 - 1.0;
            let ndc_y = 1.0 - f64::from(y + dy) / self.size[1] * 2.0;
            let ray = DVec3::new(ndc_x * self.tan_half[0], ndc_y * self.tan_half[1], -1.0);
            let ray = self.world_from_view.transform_vector3(ray);
            let t = normal.dot(point - self.position()) / normal.dot(ray);
            (t > 0.0).then(|| self.position() + ray * t)
        };
        let [a, b, c, d] = [corner(0, 0)?, corner(1, 0)?, corner(1, 1)?, corner(0, 1)?];
        Some(0.5 * (c - a).cross(d - b).length())
    }
}

fn point(texel: &[f32; 4]) -> DVec3 {
    Vec3::new(texel[0], texel[1], texel[2]).as_dvec3()
}

/// Flux (W) of an image of white Lambertians: `Σ L a_p / f`.
fn flux(view: &View, image: &[[f32; 4]]) -> DVec3 {
    let eye = Eye::new(&view.camera);
    let width = view.camera.size[0];
    let mut sum = DVec3::ZERO;
    for (index, pixel) in image.iter().enumerate() {
        if pixel[..3] != [0.0; 3] {
            let at = [index as u32 % width, index as u32 / width];
            let normal = decode_octahedral(view.surface[index][1]).as_dvec3();
            let area = eye.pixel_area(at, point(&view.position[index]), normal).expect("lit pixels are not on the horizon");
            sum += Vec3::new(pixel[0], pixel[1], pixel[2]).as_dvec3() * area * PI;
        }
    }
    sum
}

/// What becomes of a photon; `None` if rounding decides.
fn becomes(view: &View, eye: &Eye, photon: &Photon) -> Option<&'static str> {
    let ([x, y], depth) = eye.film(Vec3::from(photon.position).as_dvec3());
    let near = |value: f64, bound: f64| (value - bound).abs() < 1e-3 * bound.abs().max(1.0);
    if depth <= 0.0 {
        return Some("off screen");
    }
    if near(x, x.round()) || near(y, y.round()) {
        return None;
    }
    if x < 0.0 || y < 0.0 || x >= eye.size[0] || y >= eye.size[1] {
        return Some("off screen");
    }
    let index = (y as usize) * view.camera.size[0] as usize + x as usize;
    let surface = view.surface[index];
    if surface[3] == 0 || surface[3] & SPECULAR != 0 {
        return Some("hidden");
    }
    let normal = decode_octahedral(surface[1]).as_dvec3();
    let off = normal.dot(Vec3::from(photon.position).as_dvec3() - point(&view.position[index])).abs();
    let cosine = normal.dot(decode_octahedral(photon.normal).as_dvec3());
    let incident = -normal.dot(decode_octahedral(photon.direction).as_dvec3());
    let slack = (depth * 2.0 * eye.tan_half[1] / eye.size[1]).max(depth * 2.0 * eye.tan_half[0] / eye.size[0]).max(1e-4);
    if near(off / slack, 1.0) || near(cosine, 0.5) || incident.abs() < 1e-3 {
        return None;
    }
    Some(if off > slack || cosine < 0.5 || incident < 0.0 { "hidden" } else { "seen" })
}

#[test]
fn the_map_is_the_sum_over_photons_of_f_flux_over_area() {
    let Some(mut bench) = Bench::new() else { return };
    let mut photons = photons(4000);
    photons.truncate(4000);
    for (place, camera) in views(SIZE) {
        let view = View::new(camera, floor_and_wall);
        let eye = Eye::new(&view.camera);
        // Those about which rounding decides are left out.
        let kept: Vec<Photon> = photons.iter().copied().filter(|photon| becomes(&view, &eye, photon).is_some()).collect();
        let images = bench.run(&mut *screen_space(DENOISERS[0]), &view, &kept, kept.len() as u32, false);
        let mut expected = vec![DVec3::ZERO; view.position.len()];
        let mut counts = [0; 3];
        for photon in kept.iter().filter(|photon| photon.bounce_flags & PhotonFlags::CAUSTIC != 0) {
            match becomes(&view, &eye, photon).expect("kept") {
                "off screen" => counts[1] += 1,
                "hidden" => counts[2] += 1,
                _ => {
                    counts[0] += 1;
                    let ([x, y], _) = eye.film(Vec3::from(photon.position).as_dvec3());
                    let index = (y as usize) * SIZE[0] as usize + x as usize;
                    let normal = decode_octahedral(view.surface[index][1]).as_dvec3();
                    let area = eye.pixel_area([x as u32, y as u32], point(&view.position[index]), normal);
                    let area = area.expect("photons are not on the horizon");
                    expected[index] += decode_flux(photon.flux).as_dvec3() / (PI * area);
                }
            }
        }
        let found = ["photons_seen", "photons_off_screen", "photons_hidden"].map(|name| count(&images, name));
        assert_eq!(found, counts, "{place}");
        assert_eq!(counts[0] > 50, place != "turned away", "{place}: {counts:?}");
        assert!(images.caustic == images.indirect, "{place}: caustics are all of the indirect light");
        for (index, (found, expected)) in images.caustic.iter().zip(&expected).enumerate() {
            for channel in 0..3 {
                let (found, expected) = (f64::from(found[channel]), expected[channel]);
                // A dozen roundings; the cosines of the area's corners are off by 2⁻²⁴ over the least of them, above 0.02 here.
                assert!((found - expected).abs() <= 2e-5 * expected, "{place}, pixel {index}: {found} for {expected}");
            }
        }
    }
}

/// The chapter's four conditions, a photon each, and what the map adds to them.
#[test]
fn photons_are_left_out_for_their_reasons() {
    let Some(mut bench) = Bench::new() else { return };
    let view = View::new(camera(Vec3::new(0.5, 2.0, 5.0), Vec3::new(0.0, 0.5, -1.0), SIZE, [0.5, 0.5]), floor_and_wall);
    let eye = Eye::new(&view.camera);
    // A point of the floor whose pixel is not specular, and one whose pixel is.
    let on = |specular: bool| {
        let floor = |surface: &[u32; 4]| surface[1] == encode_octahedral(Vec3::Y) && surface[3] != 0;
        let mut found = view.surface.iter().zip(&view.position).filter(|(surface, _)| floor(surface)).skip(100);
        point(found.find(|(surface, _)| (surface[3] & SPECULAR != 0) == specular).expect("one is").1).as_vec3()
    };
    let (up, down, white) = (Vec3::Y, Vec3::NEG_Y, Vec3::ONE);
    let whole = PROBABILITIES[0];
    let seen = photon(on(false), up, up, white, whole, true);
    let behind = on(false) + (on(false) - eye.position().as_vec3()) * 0.3;
    let cases = [
        ("seen", seen, [1, 0, 0]),
        ("1: without flux", Photon { flux: 0, ..seen }, [1, 0, 0]),
        ("2: beside the screen", photon(Vec3::new(200.0, 0.0, 0.0), up, up, white, whole, true), [0, 1, 0]),
        ("2: behind the eye", photon(Vec3::new(0.5, 2.0, 9.0), up, up, white, whole, true), [0, 1, 0]),
        ("3: behind the surface", photon(behind, up, up, white, whole, true), [0, 0, 1]),
        ("3: before the surface", photon(on(false) + up, up, up, white, whole, true), [0, 0, 1]),
        ("3: on its other side", photon(on(false), down, down, white, whole, true), [0, 0, 1]),
        ("3: on a wall that meets it", photon(on(false), Vec3::X, Vec3::new(0.8, 0.6, 0.0), white, whole, true), [0, 0, 1]),
        ("3: lit from behind", photon(on(false), up, down, white, whole, true), [0, 0, 1]),
        ("on a mirror", photon(on(true), up, up, white, whole, true), [0, 0, 1]),
        ("4: no caustic", photon(on(false), up, up, white, whole, false), [0, 0, 0]),
    ];
    for (what, photon, expected) in cases {
        let images = bench.run(&mut *screen_space(DENOISERS[0]), &view, &[photon], 1, false);
        let found = ["photons_seen", "photons_off_screen", "photons_hidden"].map(|name| count(&images, name));
        assert_eq!(found, expected, "{what}");
        let lit = images.caustic.iter().filter(|pixel| pixel[0] > 0.0).count();
        assert_eq!(lit, usize::from(expected[0] == 1 && photon.flux != 0), "{what}");
    }
}

/// PHYSICS check 12: the same photons, from afar, from near, at a slant and by another lens; all denoisers keep them.
#[test]
fn flux_is_conserved_from_wherever_it_is_seen() {
    let Some(mut bench) = Bench::new() else { return };
    let mut random = Random(3);
    let mut stored = Vec::new();
    let mut total = DVec3::ZERO;
    for _ in 0..3000 {
        let position = Vec3::new(random.unit() - 0.5, 0.0, random.unit() - 0.5) * 0.6;
        let tinted = Vec3::new(1.0, 0.3 + 0.5 * random.unit(), 0.1) * (0.5 + random.unit());
        let from = Vec3::new(random.unit() - 0.5, 1.0, random.unit() - 0.5).normalize();
        // Rays of 2 m.
        let stored_here = photon(position, Vec3::Y, from, tinted, PROBABILITIES[0], true);
        total += decode_flux(stored_here.flux).as_dvec3();
        stored.push(Photon { length_probability: stored_here.length_probability | 0x4000, ..stored_here });
    }
    // Pixels of a floor without holes.
    let floor = |origin: Vec3, direction: Vec3| (direction.y < 0.0).then(|| (-origin.y / direction.y, Vec3::Y));
    let eyes =
        [("afar", Vec3::new(0.0, 12.0, 3.0)), ("near", Vec3::new(0.0, 1.2, 0.3)), ("at a slant", Vec3::new(1.0, 0.9, 1.0))];
    for (place, eye) in eyes {
        let mut view = View::new(camera(eye, Vec3::ZERO, SIZE, [0.3, 0.8]), floor);
        view.surface.iter_mut().for_each(|surface| surface[3] &= !SPECULAR);
        let mut plain = None;
        for settings in DENOISERS {
            let images = bench.run(&mut *screen_space(settings), &view, &stored, 3000, false);
            assert_eq!(count(&images, "photons_seen"), 3000, "{place}, {settings:?}: all are in view");
            let found = flux(&view, &images.caustic);
            for channel in 0..3 {
                let ratio = found[channel] / total[channel];
                // Rounding of 10⁻⁷ in each of area, sum and weights.
                assert!((ratio - 1.0).abs() < 1e-5, "{place}, {settings:?}: {ratio} of the flux");
            }
            // What was noise is spread.
            let squares: f64 = images.caustic.iter().map(|pixel| f64::from(pixel[0]).powi(2)).sum();
            let first = *plain.get_or_insert(squares);
            let spreads = settings != DENOISERS[0] && place != "afar";
            assert!(!spreads || squares < 0.95 * first, "{place}, {settings:?}: calmer, {squares} for {first}");
        }
    }
    let view = View::new(camera(Vec3::new(0.0, 1.2, 0.3), Vec3::ZERO, SIZE, [0.5, 0.5]), floor);
    let [once, thrice] = ["1", "3"].map(|gain| {
        let settings = [("denoiser", "none"), ("gain", gain)];
        flux(&view, &bench.run(&mut *screen_space(&settings), &view, &stored, 3000, false).caustic).x
    });
    assert!((thrice / once - 3.0).abs() < 1e-5, "gain multiplies: {thrice} for {once}");
}

/// Photons on the floor, up to the wall: a bilateral kernel keeps to the floor, one of distances turns the corner within its width, and
/// light from nearby is spread less than light from afar.
#[test]
fn denoisers_keep_to_what_guides_them() {
    let Some(mut bench) = Bench::new() else { return };
    let mut random = Random(5);
    let on_floor = |random: &mut Random, length: u32| {
        let position = Vec3::new(random.unit() * 2.0 - 1.0, 0.0, -3.0 + 0.3 * random.unit());
        let stored = photon(position, Vec3::Y, Vec3::Y, Vec3::ONE, PROBABILITIES[0], true);
        Photon { length_probability: stored.length_probability | length, ..stored }
    };
    let stored: Vec<Photon> = (0..2000).map(|_| on_floor(&mut random, 0x4000)).collect();
    let mut view = View::new(camera(Vec3::new(0.0, 1.5, 0.5), Vec3::new(0.0, 0.2, -3.0), SIZE, [0.5, 0.5]), floor_and_wall);
    view.surface.iter_mut().for_each(|surface| surface[3] &= !SPECULAR);
    let up = encode_octahedral(Vec3::Y);
    let mut shares = Vec::new();
    for settings in DENOISERS {
        let images = bench.run(&mut *screen_space(settings), &view, &stored, 2000, false);
        let mut wall = images.caustic.clone();
        for (pixel, surface) in wall.iter_mut().zip(&view.surface) {
            if surface[1] == up {
                *pixel = [0.0; 4];
            }
        }
        shares.push(flux(&view, &wall).x / flux(&view, &images.caustic).x);
    }
    let [none, guided, bilateral, coarse] = shares[..] else { panic!("{shares:?}") };
    assert!(none == 0.0 && bilateral == 0.0 && coarse == 0.0, "the wall is dark: {shares:?}");
    assert!(guided > 0.0 && guided < 0.2, "a corner is turned: {shares:?}");

    // One photon, 1 m and 8 m from its last hit.
    let lit = [0x3c00, 0x4800].map(|length| {
        let one = [on_floor(&mut Random(7), length)];
        let settings =
            [("denoiser", "guided"), ("distance_min", "0.1"), ("distance_max", "100"), ("roughness", "0.12"), ("reach", "16")];
        let images = bench.run(&mut *screen_space(&settings), &view, &one, 1, false);
        images.caustic.iter().filter(|pixel| pixel[0] > 0.0).count()
    });
    assert!(lit[0] < 5 && lit[1] > 4 * lit[0], "pixels that one photon lights: {lit:?}");
}

/// In any order, and whatever is asked for where frames are deterministic; floats are the same but for rounding.
#[test]
fn fixed_point_knows_no_order() {
    let mut shuffled = photons(2500);
    let view = View::new(views(SIZE)[0].1, floor_and_wall);
    let Some(mut bench) = Bench::new() else { return };
    let first = bench.run(&mut *screen_space(&[]), &view, &shuffled, 2500, false);
    let mut random = Random(9);
    for last in (1..2500).rev() {
        shuffled.swap(last, (random.word() % (last as u64 + 1)) as usize);
    }
    let again = bench.run(&mut *screen_space(&[]), &view, &shuffled, 2500, false);
    assert!(first == again, "sums depend on the order");
    let Some(gpu) = Gpu::for_tests_with(wgpu::Features::SHADER_FLOAT32_ATOMIC) else { return };
    let mut bench = Bench { executor: Executor::new(&gpu), seed: 0 };
    let again = bench.run(&mut *screen_space(&[("sums", "float")]), &view, &shuffled, 2500, true);
    assert!(first == again, "deterministic frames are summed in fixed point");
    let floats = bench.run(&mut *screen_space(&[("sums", "float")]), &view, &shuffled, 2500, false);
    for (a, b) in first.caustic.iter().zip(&floats.caustic) {
        assert!((a[0] - b[0]).abs() <= 1e-5 * a[0] + 1e-9, "{} {}", a[0], b[0]);
    }
}

/// 2³⁶ times the flux: what sums cannot hold is cut at 2²⁹ and counted.
#[test]
fn overflow_is_counted() {
    let Some(mut bench) = Bench::new() else { return };
    let mut photons = photons(1000);
    let view = View::new(views(SIZE)[0].1, floor_and_wall);
    let plain = bench.run(&mut *screen_space(DENOISERS[0]), &view, &photons, 1000, false);
    assert_eq!(count(&plain, "pixels_overflowed"), 0);
    for photon in &mut photons {
        photon.flux += 30 << 24;
    }
    let bright = bench.run(&mut *screen_space(DENOISERS[0]), &view, &photons, 1000, false);
    let beyond =
        |bound: f32| plain.caustic.iter().filter(|pixel| pixel[..3].iter().any(|x| x * 2.0_f32.powi(30) > bound)).count();
    let counted = count(&bright, "pixels_overflowed") as usize;
    // Sums are flagged beyond 2²⁹, and addends from 2²⁸ on.
    let (sure, possible) = (beyond(2.0_f32.powi(29)), beyond(2.0_f32.powi(28) * 0.99));
    assert!(sure > 10 && (sure..=possible).contains(&counted), "{counted} of {sure} to {possible}");
    assert!(bright.caustic.iter().flatten().all(|x| x.is_finite()), "cut, not lost");
}
