//! PHYSICS check 6: two unit discs two apart, one emitting L = 1: the other receives π·½(6 − √32) = 0.5390 W·m⁻² on average.
//!
//! The film is parallel to the receiver, so every pixel is the same area of it and nothing else in view is bright. The sum over
//! *all* pixels of L times that area is the integral over the receiver, whatever pixels its rim cuts. The discs are polygons of
//! 256 sides and exact area, within (π/256)²/3 = 5·10⁻⁵ m of the circle; E is of order ½ and changes sign of that deviation along
//! each side, so the error is far below 10⁻⁴.

use lightloom_passes::scene::builtin;
use lightloom_tests::{Lab, Mean, View};
use std::f64::consts::PI;

const SIZE: u32 = 64;
const RIM: f64 = 1e-4;

fn expected() -> f64 {
    PI * 0.5 * (6.0 - 32.0_f64.sqrt())
}

#[test]
fn path_and_direct_light_agree_with_the_form_factor() {
    let Some(mut lab) = Lab::open() else { return };
    let scene = builtin::two_discs();
    let gpu_scene = lab.upload(&scene);
    let mut view = View::new(scene.cameras[0].clone(), [SIZE, SIZE]);
    let albedo = f64::from(scene.materials[0].base_color[1]);
    let height = f64::from(view.camera.position_world().y);
    let across = 2.0 * (0.5 * f64::from(view.camera.yfov)).tan() * height;
    // From the mean radiance over the picture to the mean irradiance on the disc.
    let scale = PI / albedo * across * across / PI;

    let images = lab.path(&gpu_scene, &view, 64, 2, 1);
    let direct = images.direct.grey();
    let path = Mean { value: direct.value * scale, standard_error: direct.standard_error * scale };
    path.assert_near(expected(), RIM, "irradiance by `path`");
    assert!(path.standard_error < 2e-3, "precise enough to mean something: {path:?}");
    assert!(images.indirect.grey().value.abs() < 1e-12, "the emitter reflects nothing");

    // The G-buffer has one point per pixel. Shifted over the pixel on a 4 × 4 grid, the points cover the disc on a grid of
    // 256 × 256; the number of them inside a disc of n points' radius differs from its area by less than 2 n^(2/3) of π n², 10⁻³,
    // and it is light of the rim, less than E = ½, that this error miscounts.
    let points = 4.0 * f64::from(SIZE) / across;
    let count_error = 2.0 * points.powf(2.0 / 3.0) / (PI * points * points);
    let mut means = Vec::new();
    for shift in 0..16_u32 {
        view.jitter = [(shift % 4) as f32 / 4.0 + 0.125, (shift / 4) as f32 / 4.0 + 0.125];
        let (radiance, positions) = lab.direct(&gpu_scene, &view, shift, 16);
        let seen = positions.iter().filter(|p| p[3] > 0.0).count();
        assert!(seen > 2000, "the disc is seen: {seen} pixels");
        means.push(radiance.mean()[1] * scale);
    }
    let mean = Mean::of(&means);
    mean.assert_near(expected(), RIM + count_error, "irradiance by `direct`");
}
