//! The filter over frames: what each frame weighs, what is left of light that went, an engine's motion vectors, and irradiance with its direction.

mod common;

use common::filter_rig::{Rig, SIZE, corner, largest_difference, noise, only, still, view, wall};
use common::{Random, View};
use glam::Vec3;
use lightloom_passes::FilterSettings;

const PIXELS: usize = (SIZE[0] * SIZE[1]) as usize;

/// An image of one value.
fn even<T: Clone>(value: T) -> Vec<T> {
    vec![value; PIXELS]
}

/// Weight of the history of `frames` frames, and the frames that the new mean is worth: 1/n′ = (1 − α)² + α²/n.
fn history(frames: f64) -> (f64, f64) {
    let alpha = (frames / (frames + 1.0)).min(0.95);
    (alpha, 1.0 / ((1.0 - alpha).powi(2) + alpha * alpha / frames.max(1.0)))
}

/// Every frame is of one value. Sums of weights that are right for all values are right for all means and variances: the weights add to one,
/// so that nothing is brightened, and are those of a plain mean for 19 frames and of an exponential one after.
#[test]
fn frames_weigh_what_an_exponential_mean_says() {
    let Some(mut rig) = Rig::new() else { return };
    let (view, mut random) = (still(wall), Random(9));
    let (mut mean, mut frames, mut weights) = (0.0_f64, 0.0, Vec::new());
    for frame in 0..60 {
        let value = random.unit();
        let filtered = rig.frame(&view, only(0.95), &even(Vec3::splat(value)), false);
        let alpha;
        (alpha, frames) = history(frames);
        mean = alpha * mean + (1.0 - alpha) * f64::from(value);
        for weight in &mut weights {
            *weight *= alpha;
        }
        weights.push(1.0 - alpha);
        for found in filtered {
            // 60 frames, each rounding a few times by 2⁻²⁴.
            assert!((f64::from(found.x) - mean).abs() < 1e-5, "frame {frame}: {} instead of {mean}", found.x);
        }
    }
    // What the recursion above is worth.
    let squares: f64 = weights.iter().map(|weight| weight * weight).sum();
    assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12, "weights add to one");
    assert!((squares * frames - 1.0).abs() < 1e-9, "the frames it is worth are those of its variance: {frames}");
    assert!((35.0..39.0).contains(&frames), "{frames} of at most 39 frames");
}

/// A corner under an eye that moves and turns: history is resampled everywhere and rejected along the edge and the rim. Of light that went there is
/// at most 0.95ⁿ left after n frames, and none where the frame before saw nothing.
#[test]
fn moving_eyes_leave_no_more_than_still_ones() {
    let Some(mut rig) = Rig::new() else { return };
    // Half a pixel to a frame, and seven to one side or back every five.
    let at = |frame: i32| {
        let (t, turned) = (frame as f32, 1.2 * (frame.div_euclid(5) % 2) as f32);
        view(corner, Vec3::new(0.3 - 0.05 * t, 0.2, 5.0), Vec3::new(0.3 - 0.07 * t + turned, 0.01 * t, 0.0), [0.5; 2])
    };
    for frame in -20..0 {
        rig.frame(&at(frame), only(0.95), &even(Vec3::ONE), false);
    }
    let mut new = 0;
    for n in 1..=30 {
        let (before, now) = (at(n - 2), at(n - 1));
        let ghost = rig.frame(&now, only(0.95), &even(Vec3::ZERO), false);
        let bound = 0.95_f32.powi(n);
        let mean = ghost.iter().map(|value| value.x).sum::<f32>() / PIXELS as f32;
        for (index, value) in ghost.iter().enumerate() {
            // Rounding of a share of one, at each frame.
            assert!((0.0..=bound * (1.0 + 1e-6 * n as f32)).contains(&value.x), "{n} frames after: {} for {bound}", value.x);
            if unseen(&before, &now, index) {
                new += 1;
                assert_eq!(*value, Vec3::ZERO, "{n} frames after, pixel {index} comes to sight");
            }
        }
        // The rim that came to sight and the edge have less: of 48 pixels' width 15 by the slow motion and 7 by the jumps.
        assert!(mean > 0.5 * bound && mean < bound, "{n} frames after {mean} is left on average, at most {bound}");
    }
    assert!(new > 300, "{new} pixels came to sight");
}

/// Whether a pixel shows what lay more than a pixel outside the image before.
fn unseen(before: &View, now: &View, index: usize) -> bool {
    let [x, y, z, _] = now.position[index];
    let p = glam::Mat4::from_cols_array_2d(&before.camera.view_from_world).transform_point3(Vec3::new(x, y, z));
    let outside = |i: usize| {
        let ndc = [p.x, -p.y][i] / (-p.z * before.camera.tan_half[i]);
        (ndc.abs() - 1.0) * 0.5 * SIZE[i] as f32 > 1.5
    };
    outside(0) || outside(1)
}

/// Pixels that an engine says moved by two to the right and one up, though nothing that the filter could see did.
#[test]
fn an_engines_motion_is_followed() {
    let Some(mut rig) = Rig::new() else { return };
    // Straight on: all is 5 m along the view.
    let wall = view(wall, Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, [0.5; 2]);
    let mut random = Random(4);
    let [width, height] = SIZE.map(|side| side as i32);
    // A pattern without any likeness between neighbours, larger than the image.
    let pattern: Vec<Vec3> = (0..4 * width * height).map(|_| Vec3::new(random.unit(), random.unit(), random.unit())).collect();
    let shifted = |frame: i32| -> Vec<Vec3> {
        let texel = |i: i32| {
            let (x, y) = (i % width - 2 * frame, i / width + frame);
            pattern[(y.rem_euclid(2 * height) * 2 * width + x.rem_euclid(2 * width)) as usize]
        };
        (0..width * height).map(texel).collect()
    };
    let motion = even([-2.0, 1.0, 5.0, 1.0]);
    let mut filtered = Vec::new();
    for frame in 0..16 {
        let noisy: Vec<Vec3> =
            shifted(frame).iter().zip(&noise(&mut random)).map(|(light, noise)| *light + *noise - 0.5).collect();
        filtered = rig.moved(&wall, only(0.95), &noisy, &motion);
    }
    // Where all 16 frames were in the image: 32 pixels of the left and 16 of the lower rim were not. Uniform numbers scatter by 1/√12, their
    // mean over 16 by a quarter of that. The pattern's own scatter is as large as one frame's: any blur of it would show.
    let apart = |image: &[Vec3], light: &[Vec3]| {
        let inside = |i: &i32| i % width >= 31 && i / width < height - 15;
        let squares = (0..width * height).filter(inside).map(|i| (image[i as usize] - light[i as usize]).length_squared() / 3.0);
        let count = (0..width * height).filter(inside).count() as f32;
        (squares.sum::<f32>() / count).sqrt()
    };
    let error = apart(&filtered, &shifted(15)) / (1.0 / 12.0_f32).sqrt();
    // 816 numbers: √(1/1,632) is 2.5 %, of which four.
    assert!((error / 0.25 - 1.0).abs() < 0.1, "noise of 16 frames is {error} of one frame's");

    // Depth says whether what was there is what is here: at 8 m something else was. And w says whether it lay before the camera.
    for unlike in [[-2.0, 1.0, 8.0, 1.0], [-2.0, 1.0, 5.0, 0.0]] {
        let fresh = noise(&mut random);
        let filtered = rig.moved(&wall, only(0.95), &fresh, &even(unlike));
        // e^−(3 m / a footprint of 0.17 m) of the history.
        assert!(largest_difference(&filtered, &fresh) < 1e-6, "{unlike:?}: {}", largest_difference(&filtered, &fresh));
    }
}

/// Irradiance and direction are filtered alike, each with its own history; directions are below 0 too.
#[test]
fn irradiance_and_its_direction_are_filtered_side_by_side() {
    let Some(mut rig) = Rig::new() else { return };
    let view = still(corner);
    let (mut random, mut frames, mut means) = (Random(6), 0.0, [Vec3::ZERO; 2]);
    for frame in 0..6 {
        let light = [Vec3::new(1.0, 2.0, 3.0) * random.unit(), random.cube() - Vec3::new(0.5, 0.0, 2.0)];
        let filtered = rig.irradiance(&view, FilterSettings::default(), [&even(light[0]), &even(light[1])]);
        let alpha;
        (alpha, frames) = history(frames);
        for i in 0..2 {
            means[i] = means[i] * alpha as f32 + light[i] * (1.0 - alpha as f32);
            let off = largest_difference(&filtered[i], &even(means[i]));
            // Equal pixels are neither blurred nor clipped; means over frames and five levels round.
            assert!(off < 2e-5, "frame {frame}, image {i}: off by {off} from {}", means[i]);
        }
    }
    assert!(means[1].z < -1.0, "directions below 0 are kept: {}", means[1]);

    // Noise is calmed and keeps its mean, also about 0.
    rig.previous = None;
    let view = still(wall);
    let centred: Vec<Vec3> = noise(&mut random).iter().map(|value| *value - 0.5).collect();
    let settings = FilterSettings { clip: 0.0, ..FilterSettings::default() };
    let filtered = rig.irradiance(&view, settings, [&noise(&mut random), &centred]);
    let mean = |image: &[Vec3]| image.iter().sum::<Vec3>() / PIXELS as f32;
    let scatter = |image: &[Vec3]| {
        let mean = mean(image);
        (image.iter().map(|value| (*value - mean).length_squared() / 3.0).sum::<f32>() / PIXELS as f32).sqrt()
    };
    assert!(scatter(&filtered[1]) < 0.15 * scatter(&centred), "{} of {}", scatter(&filtered[1]), scatter(&centred));
    // Weights of pixels near the rim, which are taken by fewer, differ by a factor of up to two for some fifth of the image: a hundredth of
    // the scatter, 1/√12, at 1,536 pixels' own error of 1/40 of it.
    let off = (mean(&filtered[1]) - mean(&centred)).abs().max_element();
    assert!(off < 0.02, "the mean of directions moves by {off}");
}
