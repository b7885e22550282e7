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
    if let Ok(sets) = std::env::var("P_SETS") { for kv in sets.split(',') { let (k, v) = kv.split_once('=').unwrap(); pipeline.strategy_mut().set(k, v).unwrap(); } }
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
    let mut ours = total.mean.clone(); let mut ours_e = total.standard_error.clone();
    let mut them = reference.radiance.clone(); let mut them_e = reference.standard_error.clone();
    let mut smooth = Image { size: reference.size, pixels: reference.smooth.iter().map(|s| [f64::from(u8::from(*s)); 3]).collect() };
    if std::env::var_os("P_WITHOUT").is_some() { them = reference.part("_without_caustics"); println!("without: ratio {:.5}", reference.smooth_mean(&total.mean) / reference.smooth_mean(&them)); }
    for level in 0..3 {
        let pool = |e: &Image, r: i32| -> Image {
            let [w, h] = e.size.map(|s| s as i32);
            let mut out = e.clone();
            for y in 0..h { for x in 0..w {
                let mut s = [0.0; 3]; let mut n = 0.0;
                for v in (y-r).max(0)..=(y+r).min(h-1) { for u in (x-r).max(0)..=(x+r).min(w-1) {
                    let i = (v*w+u) as usize;
                    if smooth.pixels[i][0] > 0.5 { n += 1.0; for c in 0..3 { s[c] += e.pixels[i][c].powi(2); } }
                }}
                if n > 0.0 { out.pixels[(y*w+x) as usize] = s.map(|s: f64| (s/n).sqrt()); }
            }}
            out
        };
        for r in 0..3 {
            let (oe, te) = (pool(&ours_e, r), pool(&them_e, r));
            let mut line = format!("level {level} pool {r}:");
            for c in [1, 3] {
                let (mut out, mut pos, mut n) = (0, 0, 0);
                let mut z2 = 0.0;
                for i in 0..ours.pixels.len() {
                    if smooth.pixels[i][0] < 0.5 { continue; }
                    n += 1;
                    let g = |p: &[f64;3]| if c == 3 { (p[0]+p[1]+p[2])/3.0 } else { p[c] };
                    let d = g(&ours.pixels[i]) - g(&them.pixels[i]);
                    let s = g(&oe.pixels[i]).hypot(g(&te.pixels[i]));
                    if s > 0.0 { z2 += d*d/s/s; }
                    if d.abs() > 3.0*s { out += 1; if d > 0.0 { pos += 1; } }
                }
                line += &format!("  ch {c}: {out}/{n} ({:.3} %) {pos} above, rms {:.3}", 100.0*f64::from(out)/f64::from(n), (z2/f64::from(n)).sqrt());
            }
            println!("{line}");
        }
        ours = ours.halved(|f| f.iter().sum::<f64>() / 4.0); them = them.halved(|f| f.iter().sum::<f64>() / 4.0);
        ours_e = ours_e.halved(|f| f.iter().map(|x| x*x).sum::<f64>().sqrt() / 4.0); them_e = them_e.halved(|f| f.iter().map(|x| x*x).sum::<f64>().sqrt() / 4.0);
        smooth = smooth.halved(|f| f.into_iter().fold(1.0, f64::min));
    }
}

#[test]
fn probe_flux() {
    let Some(mut lab) = Lab::open() else { return };
    for sphere in [false, true] {
        let scene = if sphere { lightloom_passes::scene::builtin::closed_sphere(3) } else { lightloom_passes::scene::builtin::closed_box(0.5) };
        let g = lab.upload(&scene);
        let mut sums = Vec::new();
        for seed in 0..8 {
            let s = lightloom_passes::PhotonSettings { emitted: 1_000_000, capacity: 1_100_000, max_bounces: 24, seed, caustics_only: false };
            let t = lab.photons(&g, &s);
            let flux: f64 = t.records.iter().map(|p| f64::from(lightloom_passes::decode_flux(p.flux).y)).sum();
            let power = f64::from(g.info().total_power.y);
            println!("{seed}: stored {} dropped {} flux ratio {:.6}", t.state.stored, t.state.dropped, flux / power);
            sums.push(flux / power);
        }
        println!("{sphere} {:?} theory se {:.6}", lightloom_tests::Mean::of(&sums), (1.0f64 / 8e6 / 0.5).sqrt());
    }
}
