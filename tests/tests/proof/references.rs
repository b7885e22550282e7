//! `path` and the strategies against pictures by an independent renderer (see the README of the shared scenes).

use lightloom_strategies::{Layer, LayerImage, Pipeline, Rendered, Settings, by_name};
use lightloom_tests::reference::Reference;
use lightloom_tests::{Image, Lab, Pixels};
use std::ops::ControlFlow;

/// Layers of a rendering of the reference's first camera at its size.
fn render(lab: &mut Lab, reference: &Reference, strategy: &str, settings: &Settings) -> Rendered {
    let gpu_scene = lab.upload(&reference.scene);
    let camera = reference.scene.camera(None).expect("the scene has a camera");
    let strategy = by_name(strategy).expect("the strategy exists");
    let mut pipeline = Pipeline::new(strategy).expect("the shaders are valid");
    let settings = Settings { size: reference.size, ..settings.clone() };
    pipeline
        .render(&mut lab.executor, &gpu_scene, &camera, &settings, &mut |_| ControlFlow::Continue(()))
        .unwrap_or_else(|error| panic!("{error}"))
}

fn image(rendered: &Rendered, layer: Layer) -> Pixels {
    let LayerImage { pixels, standard_error, .. } = rendered.layer(layer).expect("the layer was asked for");
    let error = standard_error.as_ref().expect("several frames have a standard error");
    Pixels { mean: Image::from_rgb(rendered.size, pixels), standard_error: Image::from_rgb(rendered.size, error) }
}

#[test]
fn probe() {
    let Some(mut lab) = Lab::open() else { return };
    let var = |k: &str, d: &str| std::env::var(k).unwrap_or_else(|_| d.into());
    let name = var("P_SCENE", "cornell_point");
    let Some(mut reference) = Reference::load(&name) else { return };
    if name == "sponza" { reference.scene.make_lambert(); }
    let strategy = var("P_STRAT", "path");
    let settings = Settings {
        photons: var("P_PHOTONS", "200000").parse().unwrap(),
        bounces: var("P_BOUNCES", "16").parse().unwrap(),
        frames: var("P_FRAMES", "64").parse().unwrap(),
        seed: var("P_SEED", "1").parse().unwrap(),
        layers: vec![Layer::Final, Layer::Direct, Layer::Indirect, Layer::Caustic],
        ..Settings::default()
    };
    let t = std::time::Instant::now();
    let rendered = render(&mut lab, &reference, &strategy, &settings);
    println!("{name} {strategy} {} frames: {:.2} s {:?}", settings.frames, t.elapsed().as_secs_f32(), rendered.warnings);
    let total = image(&rendered, Layer::Final);
    let indirect = image(&rendered, Layer::Indirect);
    let direct = image(&rendered, Layer::Direct);
    let theirs = if name == "caustics_point" { reference.radiance.zip(&direct.mean, |x, d| x - d) } else { reference.part("_indirect") };
    let n = reference.smooth.iter().filter(|s| **s).count();
    println!("smooth {n}; indirect ratio {:.5}; final ratio {:.5}", reference.smooth_mean(&indirect.mean) / reference.smooth_mean(&theirs),
        reference.smooth_mean(&total.mean) / reference.smooth_mean(&reference.radiance));
    if name == "caustics_point" {
        let c = reference.radiance.zip(&reference.part("_without_caustics"), |a, b| a - b);
        println!("caustic ratio {:.5}", reference.smooth_mean(&image(&rendered, Layer::Caustic).mean) / reference.smooth_mean(&c));
    }
    for (what, ours, ours_e, them, them_e) in [("final", &total.mean, &total.standard_error, &reference.radiance, &reference.standard_error)] {
        for c in 0..4 {
            let (mut out, mut pos) = (0, 0);
            let mut z2 = 0.0; let (mut so, mut st) = (0.0, 0.0);
            for i in 0..ours.pixels.len() {
                if !reference.smooth[i] { continue; }
                let g = |p: &[f64;3]| if c == 3 { (p[0]+p[1]+p[2])/3.0 } else { p[c] };
                let d = g(&ours.pixels[i]) - g(&them.pixels[i]);
                let (a, b) = (g(&ours_e.pixels[i]), g(&them_e.pixels[i]));
                let s = a.hypot(b);
                so += a / g(&them.pixels[i]); st += b / g(&them.pixels[i]);
                z2 += d*d/s/s;
                if d.abs() > 3.0*s { out += 1; if d > 0.0 { pos += 1; }
                  if std::env::var_os("P_LIST").is_some() { println!("  px {},{} ours {:.5}±{:.5} theirs {:.5}±{:.5}", i%160, i/160, g(&ours.pixels[i]), a, g(&them.pixels[i]), b); } }
            }
            println!("{what} channel {c}: {out} of {n} outside ({:.4} %), {pos} above; z rms {:.4}; ours {:.4} theirs {:.4}", 100.0*f64::from(out)/n as f64, (z2/n as f64).sqrt(), so/n as f64, st/n as f64);
        }
    }
}
